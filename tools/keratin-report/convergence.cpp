#include "tools/keratin-report/convergence.h"

#include "schema/files/write_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace keratin::report {
namespace {

using Json = nlohmann::json;

constexpr const char* kHowToMake = "keratin-run SCENE --convergence --stats FILE writes it";

// "line:column" of the byte that a parser stumbled over, counted from 1.
std::string place_of(std::span<const std::byte> text, std::size_t byte) {
    const auto end = text.begin() + std::ptrdiff_t(std::min(text.size(), byte > 0 ? byte - 1 : 0));
    const auto line = std::count(text.begin(), end, std::byte('\n'));
    auto start = end;
    while (start != text.begin() && *(start - 1) != std::byte('\n')) --start;
    return std::to_string(line + 1) + ":" + std::to_string(end - start + 1);
}

}  // namespace

Result<Convergence> read_convergence(const std::string& path) {
    const auto text = read_file(path);
    if (!text) return text.error();
    Json document;
    try {
        const auto* bytes = reinterpret_cast<const char*>(text->data());
        document = Json::parse(bytes, bytes + text->size());
    } catch (const Json::parse_error& error) {
        return Error{ErrorCode::input, path + ":" + place_of(*text, error.byte),
                     std::string("is not JSON here; ") + kHowToMake};
    }
    if (!document.is_object() || !document.contains("convergence"))
        return Error{ErrorCode::input, path,
                     std::string("holds no \"convergence\"; ") + kHowToMake};
    const Json& list = document["convergence"];
    if (!list.is_array())
        return Error{ErrorCode::input, path + ": convergence",
                     std::string("must be a list of iterations; ") + kHowToMake};
    if (list.empty())
        return Error{ErrorCode::input, path + ": convergence",
                     "holds no iteration: there is nothing to draw"};
    Convergence convergence;
    for (std::size_t i = 0; i < list.size(); ++i) {
        const std::string where = path + ": convergence[" + std::to_string(i) + "]";
        if (!list[i].is_object())
            return Error{ErrorCode::input, where, "must be an object {\"dv\", \"dr\", \"f_fb\"}"};
        // Absent only where nothing is wrong with that.
        const auto value = [&](const char* name, bool required) -> Result<std::optional<double>> {
            const auto found = list[i].find(name);
            if (!required && (found == list[i].end() || found->is_null()))
                return std::optional<double>();
            const bool number = found != list[i].end() && found->is_number();
            const double v = number ? found->get<double>() : -1;
            if (!(v >= 0 && v <= chart::kLargestValue))
                return Error{ErrorCode::input, where + "." + name,
                             found == list[i].end()
                                 ? "is missing; it must be a number >= 0"
                                 : "is " + found->dump() + "; it must be a number >= 0"};
            return std::optional<double>(v);
        };
        const auto dv = value("dv", true), dr = value("dr", true), f_fb = value("f_fb", false);
        for (const auto* v : {&dv, &dr, &f_fb})
            if (!*v) return v->error();
        convergence.dv.push_back(**dv);
        convergence.dr.push_back(**dr);
        convergence.f_fb.push_back(*f_fb);
    }
    return convergence;
}

chart::Chart convergence_chart(const Convergence& convergence, const std::string& title) {
    chart::Chart chart;
    chart.title = title;
    chart.x = {"iteration", chart::Scale::linear};
    chart.y = {"mean of the absolute values", chart::Scale::logarithmic};
    chart::Line dv{"change of velocity, m/s", {}, {}}, dr{"change of impulse, N s", {}, {}},
        f_fb{"Coulomb residual |f_FB|", {}, {}};
    for (std::size_t i = 0; i < convergence.dv.size(); ++i) {
        const double iteration = double(i + 1);
        dv.x.push_back(iteration);
        dv.y.push_back(convergence.dv[i]);
        dr.x.push_back(iteration);
        dr.y.push_back(convergence.dr[i]);
        if (!convergence.f_fb[i]) continue;
        f_fb.x.push_back(iteration);
        f_fb.y.push_back(*convergence.f_fb[i]);
    }
    for (const chart::Line& line : {dv, dr, f_fb})
        if (!line.x.empty()) chart.lines.push_back(line);
    return chart;
}

}  // namespace keratin::report
