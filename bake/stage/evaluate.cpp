#include "bake/stage/evaluate.h"

#include "bake/nurbs.h"
#include "bake/stage/resample.h"
#include "schema/layout.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <map>

namespace keratin {
namespace {

// A straight NURBS curve fits two points; every solver takes three.
constexpr std::size_t kFewestPoints = 3;

Result<std::vector<Vec3>> points_of_nurbs(const RawCurve& curve, const Recipe& recipe) {
    const auto nurbs = NurbsCurve::make(curve.points, curve.weights, curve.knots, curve.degree);
    if (!nurbs) return nurbs.error();
    if (!recipe.max_error) {
        return points_by_arc_length(*nurbs, curve.u_begin, curve.u_end,
                                    recipe.points_per_strand.value_or(kDefaultPoints));
    }
    FittedPoints fitted =
        points_by_max_error(*nurbs, curve.u_begin, curve.u_end, *recipe.max_error, kBakeMaxPoints);
    if (fitted.points.size() >= kFewestPoints) return std::move(fitted.points);
    return points_by_arc_length(*nurbs, curve.u_begin, curve.u_end, kFewestPoints);
}

Result<void> report_problems(const RawGroom& groom, Strictness strictness, Findings& findings) {
    for (const std::string& remark : groom.remarks)
        findings.push_back({Rule::curve_file, groom.file, remark, {}});
    if (groom.problems.empty()) return {};
    const CurveProblem& first = groom.problems.front();
    const std::string place = groom.file +
                              (first.line > 0 ? ":" + std::to_string(first.line) : std::string()) +
                              ": strand " + std::to_string(first.curve);
    if (strictness == Strictness::strict) return Error{ErrorCode::input, place, first.what};
    std::vector<std::uint32_t> numbers;
    for (const CurveProblem& problem : groom.problems) {
        numbers.push_back(static_cast<std::uint32_t>(problem.curve));
    }
    std::sort(numbers.begin(), numbers.end());
    findings.push_back(
        {Rule::unusable_curve, groom.file,
         std::to_string(numbers.size()) + " unusable curves are left out; the first: " + first.what,
         to_ranges(numbers)});
    return {};
}

// Group of each curve of file f, numbered through all files.
std::vector<std::uint32_t> groups_of(const RawGroom& groom, const CurveSource& source,
                                     std::map<std::string, std::uint32_t>& numbers,
                                     std::vector<std::string>& names) {
    const auto number = [&](const std::string& name) {
        const auto [at, is_new] =
            numbers.try_emplace(name, static_cast<std::uint32_t>(names.size()));
        if (is_new) names.push_back(name);
        return at->second;
    };
    std::vector<std::uint32_t> out;
    if (source.group.empty() && !groom.group.empty()) {
        for (std::uint32_t g : groom.group) out.push_back(number(groom.group_names[g]));
    } else {
        out.assign(groom.curves.size(), number(source.group.empty() ? "default" : source.group));
    }
    return out;
}

}  // namespace

Result<Groom> evaluate_curves(std::span<const RawGroom> grooms, const Recipe& recipe,
                              Strictness strictness, Findings& findings) {
    Groom out;
    const auto any = [&](auto has) { return std::any_of(grooms.begin(), grooms.end(), has); };
    const bool radius =
        any([](const RawGroom& g) { return !g.radius.empty() || !g.point_radius.empty(); });
    const bool root_uv = any([](const RawGroom& g) { return !g.root_uv.empty(); });
    const bool is_guide = any([](const RawGroom& g) { return !g.is_guide.empty(); });
    const bool blends = any(
        [](const RawGroom& g) { return !g.closest_guides.empty() && !g.guide_weights.empty(); });

    bool authored_ids = true;
    std::map<std::string, std::uint32_t> group_numbers;
    std::vector<std::uint32_t> counted;
    std::uint32_t before = 0;
    for (std::size_t f = 0; f < grooms.size(); ++f) {
        const RawGroom& groom = grooms[f];
        if (auto ok = report_problems(groom, strictness, findings); !ok) return ok.error();
        const std::size_t n = groom.curves.size();
        std::vector<std::vector<Vec3>> evaluated(n);
        std::vector<std::optional<Error>> failed(n);
#pragma omp parallel for schedule(dynamic, 64)
        for (std::size_t c = 0; c < n; ++c) {
            if (groom.curves[c].degree == 0) continue;
            auto result = points_of_nurbs(groom.curves[c], recipe);
            if (result) {
                evaluated[c] = *std::move(result);
            } else {
                failed[c] = result.error();
            }
        }
        // Polylines stay where the reader put them until they are copied, by all threads.
        const auto points_of = [&](std::size_t c) -> const std::vector<Vec3>& {
            return groom.curves[c].degree == 0 ? groom.curves[c].points : evaluated[c];
        };
        const std::size_t first_strand = out.strand_count();
        std::size_t point_count = out.position.size();
        const auto groups = groups_of(groom, recipe.curves[f], group_numbers, out.group_names);
        authored_ids = authored_ids && !groom.id.empty();
        for (std::size_t c = 0; c < n; ++c) {
            const RawCurve& curve = groom.curves[c];
            if (failed[c]) {
                return Error{failed[c]->code,
                             groom.file + (curve.line > 0 ? ":" + std::to_string(curve.line) : "") +
                                 ": strand " + std::to_string(curve.index),
                             failed[c]->message};
            }
            point_count += points_of(c).size();
            if (point_count > std::numeric_limits<std::uint32_t>::max()) {
                return Error{ErrorCode::input, groom.file,
                             "the curves have more than 4 294 967 295 points together"};
            }
            out.first_point.push_back(static_cast<std::uint32_t>(point_count));
            out.source.push_back(static_cast<std::uint32_t>(f));
            out.curve.push_back(static_cast<std::uint32_t>(curve.index));
            out.group.push_back(groups[c]);
            out.even.push_back(curve.degree > 0);
            counted.push_back(before + static_cast<std::uint32_t>(curve.index));
            if (!groom.id.empty()) out.id.push_back(groom.id[c]);
            if (radius) {
                std::array<double, 2> ends{0, 0};
                if (!groom.point_radius.empty() && !groom.point_radius[c].empty()) {
                    ends = {groom.point_radius[c].front(), groom.point_radius[c].back()};
                } else if (!groom.radius.empty()) {
                    ends = {groom.radius[c], groom.radius[c]};
                }
                out.radius.push_back(ends);
            }
            if (root_uv) {
                out.root_uv.push_back(groom.root_uv.empty() ? Vec2(Vec2::Zero())
                                                            : groom.root_uv[c]);
                out.has_root_uv.push_back(!groom.root_uv.empty());
            }
            if (is_guide) out.is_guide.push_back(!groom.is_guide.empty() && groom.is_guide[c]);
            if (blends) {
                const bool own = !groom.closest_guides.empty() && !groom.guide_weights.empty();
                out.closest_guides.push_back(
                    own ? groom.closest_guides[c]
                        : std::array<std::uint32_t, 3>{kNoStrand, kNoStrand, kNoStrand});
                out.guide_weights.push_back(own ? groom.guide_weights[c]
                                                : std::array<double, 3>{0, 0, 0});
            }
        }
        out.position.resize(point_count);
#pragma omp parallel for schedule(static)
        for (std::size_t c = 0; c < n; ++c) {
            std::copy(points_of(c).begin(), points_of(c).end(),
                      out.position.begin() + out.first_point[first_strand + c]);
        }
        before += static_cast<std::uint32_t>(n + groom.problems.size());
    }
    if (authored_ids) {
        std::vector<std::uint32_t> sorted = out.id;
        std::sort(sorted.begin(), sorted.end());
        if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
            authored_ids = false;
            findings.push_back({Rule::ids_not_unique,
                                "",
                                "the authored ids are not unique; strands are numbered through "
                                "all files instead",
                                {}});
        }
    }
    if (!authored_ids) {
        if (blends) {
            findings.push_back({Rule::authored_dropped,
                                "",
                                "authored weights name guides by id, but there are no sound ids; "
                                "all weights were computed",
                                {}});
            out.closest_guides.clear();
            out.guide_weights.clear();
        }
        out.id = std::move(counted);
    }
    return out;
}

}  // namespace keratin
