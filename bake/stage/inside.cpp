#include "bake/stage/inside.h"

#include <algorithm>

namespace keratin {
namespace {

// A pushed point ends this far outside, so that rounding to float leaves it outside.
constexpr double kClearance = 1e-5;  // m

std::string millimetres(double metres) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f mm", 1000 * metres);
    return text;
}

}  // namespace

BakeReport::Inside find_inside(const GrowthSurfaces& surfaces, const Recipe& recipe, Groom& groom,
                               Findings& findings) {
    BakeReport::Inside out;
    out.depth = kInsideDepth;
    if (surfaces.trees.empty()) return out;
    const std::size_t n = groom.strand_count();
    const double margin = recipe.distance_grid_margin;
    std::vector<double> deepest(n, 0);
    std::vector<std::uint32_t> points(n, 0), pushed(n, 0);
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t s = 0; s < n; ++s) {
        const MeshTree& tree = *surfaces.of_source[groom.source[s]];
        const auto strand = groom.points(s);
        for (std::size_t p = 0; p < strand.size(); ++p) {
            const bool inside = tree.inside(strand[p]);
            if (!inside && !(recipe.push_out && p > 0 && margin > 0)) continue;
            const NearestTriangle near = tree.nearest(strand[p]);
            if (inside) {
                deepest[s] = std::max(deepest[s], near.at.distance);
                points[s] += near.at.distance > kInsideDepth;
            }
            if (!recipe.push_out || p == 0) continue;
            if (!inside && near.at.distance >= margin) continue;
            const Vec3 away = strand[p] - near.at.point;
            const bool on_surface = near.at.distance < kClearance;
            const Vec3 normal = inside || on_surface ? triangle_normal(tree.mesh(), near.triangle)
                                                     : Vec3(away / near.at.distance);
            strand[p] = near.at.point + std::max(kClearance, margin) * normal;
            ++pushed[s];
        }
    }
    std::vector<std::vector<std::uint32_t>> strands(recipe.curves.size());
    std::vector<double> depth(recipe.curves.size(), 0);
    std::vector<std::uint64_t> moved(recipe.curves.size(), 0);
    for (std::size_t s = 0; s < n; ++s) {
        const std::uint32_t f = groom.source[s];
        out.deepest = std::max(out.deepest, deepest[s]);
        out.points += points[s];
        out.pushed += pushed[s];
        moved[f] += pushed[s];
        if (points[s] == 0) continue;
        ++out.strands;
        strands[f].push_back(groom.curve[s]);
        depth[f] = std::max(depth[f], deepest[s]);
    }
    for (std::size_t f = 0; f < strands.size(); ++f) {
        const std::string& file = recipe.curves[f].file;
        if (!strands[f].empty()) {
            findings.push_back({Rule::starts_inside, file,
                                std::to_string(strands[f].size()) +
                                    " strands start inside the mesh, deeper than " +
                                    millimetres(kInsideDepth) + ", up to " + millimetres(depth[f]) +
                                    (recipe.push_out ? "" : "; `push_out` moves them out"),
                                to_ranges(strands[f])});
        }
        if (moved[f] > 0) {
            findings.push_back(
                {Rule::pushed_out,
                 file,
                 std::to_string(moved[f]) + " points were moved out to the surface of the mesh",
                 {}});
        }
    }
    return out;
}

}  // namespace keratin
