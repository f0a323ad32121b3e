#include "bake/report.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace keratin {
namespace {

using Json = nlohmann::ordered_json;

const char* word(Severity severity) {
    switch (severity) {
        case Severity::note:
            return "note";
        case Severity::warning:
            return "warning";
        case Severity::error:
            break;
    }
    return "error";
}

// Findings name at most this many ranges in a line of text; JSON lists all.
constexpr std::size_t kRangesInText = 8;

template <class... Args>
std::string format(const char* pattern, Args... args) {
    char text[256];
    std::snprintf(text, sizeof text, pattern, args...);
    return text;
}

std::string metres(const std::array<double, 3>& size) {
    return format("%.3f x %.3f x %.3f m", size[0], size[1], size[2]);
}

std::string millimetres(const Spread& s) {
    return format("mean %.3f, p95 %.3f, max %.3f mm", 1e3 * s.mean, 1e3 * s.p95, 1e3 * s.max);
}

Json to_json(const Spread& s) { return Json{{"mean", s.mean}, {"p95", s.p95}, {"max", s.max}}; }

Json to_json(const BakeReport::SagFree& sag) {
    Json out{{"guides", sag.guides},
             {"too_soft", sag.too_soft},
             {"residual", to_json(sag.residual)},
             {"settles", to_json(sag.settles)}};
    Json& each = out["each"] = Json::array();
    for (const BakeReport::SagFree::Guide& guide : sag.each) {
        each.push_back({{"strand", guide.strand},
                        {"held", guide.held},
                        {"residual", guide.residual},
                        {"settles", guide.settles}});
    }
    return out;
}

Json to_json(const Finding& finding) {
    const RuleDescription& rule = describe(finding.rule);
    Json out{{"code", rule.code},
             {"name", rule.name},
             {"severity", word(rule.severity)},
             {"where", finding.where},
             {"message", finding.message},
             {"strand_count", strand_total(finding.strands)}};
    Json& strands = out["strands"] = Json::array();
    for (const StrandRange& range : finding.strands) strands.push_back({range.first, range.last});
    return out;
}

}  // namespace

std::uint64_t strand_total(std::span<const StrandRange> ranges) {
    std::uint64_t total = 0;
    for (const StrandRange& range : ranges) total += std::uint64_t{range.last} - range.first + 1;
    return total;
}

std::vector<StrandRange> to_ranges(std::span<const std::uint32_t> ascending) {
    std::vector<StrandRange> out;
    for (std::uint32_t s : ascending) {
        if (!out.empty() && out.back().last + 1 == s) {
            out.back().last = s;
        } else {
            out.push_back({s, s});
        }
    }
    return out;
}

std::string to_text(std::span<const StrandRange> ranges, std::size_t limit) {
    std::string out;
    const std::size_t shown = std::min(limit, ranges.size());
    for (std::size_t i = 0; i < shown; ++i) {
        if (i > 0) out += ", ";
        out += std::to_string(ranges[i].first);
        if (ranges[i].last > ranges[i].first) out += "-" + std::to_string(ranges[i].last);
    }
    if (shown < ranges.size()) {
        out += " and " + std::to_string(strand_total(ranges.subspan(shown))) + " more";
    }
    return out;
}

Spread spread_of(std::vector<double> values) {
    Spread out;
    if (values.empty()) return out;
    for (double v : values) out.mean += v;
    out.mean /= static_cast<double>(values.size());
    const auto p95 = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 95 / 100);
    std::nth_element(values.begin(), p95, values.end());
    out.p95 = *p95;
    out.max = *std::max_element(p95, values.end());
    return out;
}

std::string finding_text(const Finding& finding) {
    const RuleDescription& rule = describe(finding.rule);
    std::string out = finding.where;
    if (!finding.strands.empty()) {
        out += (out.empty() ? "" : ": ");
        out += "strands " + to_text(finding.strands, kRangesInText);
    }
    if (!out.empty()) out += ": ";
    out += word(rule.severity);
    out += " ";
    out += rule.code;
    out += " ";
    out += rule.name;
    out += ": " + finding.message;
    return out;
}

std::string report_text(const BakeReport& report, std::span<const Finding> findings) {
    std::string out;
    const auto line = [&](const std::string& text) { out += text + "\n"; };
    for (const Finding& finding : findings) line(finding_text(finding));
    for (const BakeReport::Source& source : report.sources) {
        std::string text = source.file + ": " + std::to_string(source.curves) + " curves";
        if (source.left_out > 0) text += ", " + std::to_string(source.left_out) + " left out";
        text += ", root at the " + source.root_end + " point (" + source.root_end_from + ")";
        if (source.root_distance) {
            text += ", roots off the mesh: " + millimetres(*source.root_distance);
        }
        line(text);
    }
    line("hair: " + metres(report.hair_size) + ", strands " +
         format("%.3f m long on average, longest %.3f m", report.length.mean, report.length.max));
    if (report.body_size) line("body (the parts hair grows on): " + metres(*report.body_size));
    if (report.mesh_size) line("whole mesh: " + metres(*report.mesh_size));
    line(std::to_string(report.strands) + " strands of " +
         (report.points_min == report.points_max
              ? std::to_string(report.points_min)
              : std::to_string(report.points_min) + " to " + std::to_string(report.points_max)) +
         " points; " + std::to_string(report.guides) + " guides in " +
         std::to_string(report.tiles) + " tiles, " +
         format("%.1f %% of the guide rows are padding", 100 * report.padding));
    if (report.groups.size() > 1) {
        for (const BakeReport::Group& group : report.groups) {
            line("group " + group.name + ": " + std::to_string(group.strands) + " strands, " +
                 std::to_string(group.guides) + " guides");
        }
    }
    if (report.inside) {
        line(format("%llu strands start inside the mesh (%llu points deeper than %.1f mm, deepest "
                    "%.1f mm)",
                    static_cast<unsigned long long>(report.inside->strands),
                    static_cast<unsigned long long>(report.inside->points),
                    1e3 * report.inside->depth, 1e3 * report.inside->deepest) +
             (report.inside->pushed > 0
                  ? "; " + std::to_string(report.inside->pushed) + " points pushed out"
                  : ""));
    }
    if (report.colliders) {
        line(std::to_string(report.colliders->count) +
             " colliders fitted; outside the mesh: " + millimetres(report.colliders->outside) +
             "; mesh outside them, where hair comes: " + millimetres(report.colliders->gap));
    }
    if (const auto& grid = report.distance_grid) {
        line("distance grid: " + std::to_string(grid->stored_bricks) + " of " +
             std::to_string(grid->bricks) + " bricks stored, a node every " +
             format("%.3f mm", 1e3 * grid->spacing) + "; error " + millimetres(grid->error));
    }
    if (report.reconstruction) {
        line("guides by " + report.reconstruction->method +
             ", reconstruction error: " + millimetres(report.reconstruction->error));
    }
    const auto sag_line = [&](const char* name, const std::optional<BakeReport::SagFree>& sag) {
        if (!sag) return;
        line(name +
             format(": %llu guides, %llu too soft; force left over weight: p95 %.2g, max %.2g; "
                    "settle off the groom: ",
                    static_cast<unsigned long long>(sag->guides),
                    static_cast<unsigned long long>(sag->too_soft), sag->residual.p95,
                    sag->residual.max) +
             millimetres(sag->settles));
    };
    sag_line("sag-free", report.sag_free);
    sag_line("sag-free rods", report.rod_sag_free);
    if (const auto& quantised = report.quantised) {
        line("positions in 16 bits: " + std::to_string(quantised->bytes) + " bytes instead of " +
             std::to_string(quantised->bytes_before) + "; error " +
             format("mean %.5f, p95 %.5f, max %.5f mm", 1e3 * quantised->error.mean,
                    1e3 * quantised->error.p95, 1e3 * quantised->error.max));
    }
    line(report.output + ": " + std::to_string(report.output_bytes) + " bytes" +
         (report.output_changed ? "" : ", unchanged"));
    return out;
}

std::string report_json(const BakeReport& report, std::span<const Finding> findings) {
    Json out;
    out["recipe"] = report.recipe;
    out["output"] = {{"file", report.output},
                     {"bytes", report.output_bytes},
                     {"changed", report.output_changed}};
    Json& sources = out["sources"] = Json::array();
    for (const BakeReport::Source& source : report.sources) {
        Json item{{"file", source.file},
                  {"curves", source.curves},
                  {"left_out", source.left_out},
                  {"root_end", source.root_end},
                  {"root_end_from", source.root_end_from},
                  {"reversed", source.reversed},
                  {"metres_per_unit", source.scale}};
        if (source.root_distance) item["root_distance"] = to_json(*source.root_distance);
        sources.push_back(std::move(item));
    }
    Json& groups = out["groups"] = Json::array();
    for (const BakeReport::Group& group : report.groups) {
        groups.push_back(
            {{"name", group.name}, {"strands", group.strands}, {"guides", group.guides}});
    }
    out["strands"] = report.strands;
    out["points"] = report.points;
    out["points_per_strand"] = {report.points_min, report.points_max};
    out["guides"] = report.guides;
    out["tiles"] = report.tiles;
    out["rows"] = report.rows;
    out["padding"] = report.padding;
    out["hair_size"] = report.hair_size;
    if (report.body_size) out["body_size"] = *report.body_size;
    if (report.mesh_size) out["mesh_size"] = *report.mesh_size;
    out["strand_length"] = to_json(report.length);
    if (report.inside) {
        out["inside"] = {{"strands", report.inside->strands},
                         {"points", report.inside->points},
                         {"deeper_than", report.inside->depth},
                         {"deepest", report.inside->deepest},
                         {"points_pushed_out", report.inside->pushed}};
    }
    if (const auto& grid = report.distance_grid) {
        out["distance_grid"] = {{"spacing", grid->spacing},
                                {"bricks", grid->bricks},
                                {"stored_bricks", grid->stored_bricks},
                                {"error", to_json(grid->error)}};
    }
    if (report.colliders) {
        out["colliders"] = {{"count", report.colliders->count},
                            {"outside_mesh", to_json(report.colliders->outside)},
                            {"mesh_outside", to_json(report.colliders->gap)}};
    }
    if (report.reconstruction) {
        out["reconstruction"] = {{"method", report.reconstruction->method},
                                 {"error", to_json(report.reconstruction->error)}};
    }
    if (report.sag_free) out["sag_free"] = to_json(*report.sag_free);
    if (report.rod_sag_free) out["rod_sag_free"] = to_json(*report.rod_sag_free);
    if (const auto& quantised = report.quantised) {
        out["quantised"] = {{"bytes", quantised->bytes},
                            {"bytes_before", quantised->bytes_before},
                            {"error", to_json(quantised->error)}};
    }
    Json& levels = out["levels"] = Json::array();
    for (const BakeReport::Width& level : report.levels) {
        levels.push_back({{"strands", level.strands}, {"width_scale", level.scale}});
    }
    out["defaults_used"] = report.defaulted;
    Json& times = out["cpu_seconds"] = Json::object();
    for (const BakeReport::StageTime& time : report.times) times[time.stage] = time.cpu_seconds;
    const BakeReport::Cost& cost = report.cost;
    out["cost"] = {{"threads", cost.threads},
                   {"cpu_seconds", cost.cpu_seconds},
                   {"busiest_cpu_seconds", cost.busiest_cpu_seconds},
                   {"peak_bytes", cost.peak_bytes}};
    Json& list = out["findings"] = Json::array();
    for (const Finding& finding : findings) list.push_back(to_json(finding));
    return out.dump(2) + "\n";
}

std::string report_sarif(const BakeReport& report, std::span<const Finding> findings,
                         std::string_view tool_version) {
    Json rules = Json::array();
    for (const RuleDescription& rule : kBakeRules) {
        rules.push_back({{"id", rule.code},
                         {"name", rule.name},
                         {"shortDescription", {{"text", rule.meaning}}},
                         {"defaultConfiguration", {{"level", word(rule.severity)}}}});
    }
    Json results = Json::array();
    for (const Finding& finding : findings) {
        const RuleDescription& rule = describe(finding.rule);
        Json location{{"physicalLocation",
                       {{"artifactLocation",
                         {{"uri", finding.where.empty() ? report.recipe : finding.where}}}}}};
        if (!finding.strands.empty()) {
            Json& places = location["logicalLocations"] = Json::array();
            for (const StrandRange& range : finding.strands) {
                places.push_back(
                    {{"name", to_text(std::span(&range, 1), 1)},
                     {"fullyQualifiedName", "strands[" + to_text(std::span(&range, 1), 1) + "]"},
                     {"kind", "element"}});
            }
        }
        results.push_back({{"ruleId", rule.code},
                           {"ruleIndex", static_cast<std::size_t>(finding.rule)},
                           {"level", word(rule.severity)},
                           {"message", {{"text", finding.message}}},
                           {"locations", Json::array({location})}});
    }
    const Json out{
        {"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
        {"version", "2.1.0"},
        {"runs",
         Json::array(
             {{{"tool",
                {{"driver",
                  {{"name", "keratin-bake"}, {"version", tool_version}, {"rules", rules}}}}},
               {"results", results}}})}};
    return out.dump(2) + "\n";
}

}  // namespace keratin
