#include "bake/stage/roots.h"

#include <algorithm>

namespace keratin {
namespace {

// A root farther from its mesh than this share of its strand's length is worth a warning.
constexpr double kFarShare = 0.25;

std::string part_names(const RawMesh& mesh) {
    std::string out;
    for (const RawMeshPart& part : mesh.parts) out += (out.empty() ? "" : ", ") + part.name;
    return out;
}

std::string joined(const std::vector<std::string>& names) {
    std::string out;
    for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
    return out;
}

}  // namespace

Result<GrowthSurfaces> find_growth_surfaces(const Recipe& recipe, const RawMesh* mesh,
                                            Findings& findings) {
    GrowthSurfaces out;
    out.of_source.assign(recipe.curves.size(), nullptr);
    if (mesh == nullptr) {
        for (std::size_t f = 0; f < recipe.curves.size(); ++f) {
            if (recipe.curves[f].mesh_nodes.empty()) continue;
            return Error{ErrorCode::input,
                         recipe.file + ": curves[" + std::to_string(f) + "].mesh_nodes",
                         "names parts of a mesh, but the recipe gives no `mesh`"};
        }
        findings.push_back({Rule::no_mesh, "", "no mesh: roots are not bound to triangles", {}});
        return out;
    }
    std::map<std::vector<std::string>, std::size_t> tree_of;
    std::size_t without_area = 0;
    std::vector<std::size_t> index(recipe.curves.size());
    for (std::size_t f = 0; f < recipe.curves.size(); ++f) {
        const auto& nodes = recipe.curves[f].mesh_nodes;
        const std::string place = recipe.file + ": curves[" + std::to_string(f) + "].mesh_nodes";
        for (const std::string& node : nodes) {
            const bool known =
                std::any_of(mesh->parts.begin(), mesh->parts.end(),
                            [&](const RawMeshPart& part) { return matches(part.name, node); });
            if (!known) {
                return Error{ErrorCode::input, place,
                             "\"" + node + "\" matches no part of " + mesh->file +
                                 "; its parts are: " + part_names(*mesh)};
            }
        }
        const auto [entry, is_new] = tree_of.try_emplace(nodes, out.trees.size());
        index[f] = entry->second;
        if (!is_new) continue;
        std::vector<std::uint32_t> triangles = triangles_of_parts(*mesh, nodes);
        const std::size_t all = triangles.size();
        std::erase_if(triangles,
                      [&](std::uint32_t t) { return triangle_normal(*mesh, t).isZero(); });
        without_area += all - triangles.size();
        if (triangles.empty()) {
            return Error{ErrorCode::input, nodes.empty() ? mesh->file : place,
                         nodes.empty() ? "the mesh has no triangles with area"
                                       : "the parts " + joined(nodes) + " of " + mesh->file +
                                             " have no triangles with area"};
        }
        out.trees.emplace_back(*mesh, triangles);
        out.triangles.insert(out.triangles.end(), triangles.begin(), triangles.end());
    }
    for (std::size_t f = 0; f < recipe.curves.size(); ++f) out.of_source[f] = &out.trees[index[f]];
    std::sort(out.triangles.begin(), out.triangles.end());
    out.triangles.erase(std::unique(out.triangles.begin(), out.triangles.end()),
                        out.triangles.end());
    if (without_area > 0) {
        findings.push_back(
            {Rule::unused_triangles,
             mesh->file,
             std::to_string(without_area) + " triangles without area cannot carry roots",
             {}});
    }
    return out;
}

Roots bind_roots(const Groom& groom, const GrowthSurfaces& surfaces, const Recipe& recipe,
                 Findings& findings) {
    const std::size_t n = groom.strand_count();
    Roots out;
    const bool has_mesh = !surfaces.trees.empty();
    const bool mesh_uv = has_mesh && !surfaces.trees.front().mesh().uv.empty();
    if (mesh_uv || !groom.root_uv.empty()) out.uv.assign(n, Vec2::Zero());
    if (has_mesh) {
        out.triangle.resize(n);
        out.barycentric.resize(n);
        out.distance.resize(n);
        out.normal.resize(n);
#pragma omp parallel for schedule(dynamic, 256)
        for (std::size_t s = 0; s < n; ++s) {
            const MeshTree& tree = *surfaces.of_source[groom.source[s]];
            const RawMesh& mesh = tree.mesh();
            const NearestTriangle near = tree.nearest(groom.points(s).front());
            const auto& weight = near.at.barycentric;
            out.triangle[s] = near.triangle;
            out.barycentric[s] = {weight[1], weight[2]};
            out.distance[s] = near.at.distance;
            out.normal[s] = triangle_normal(mesh, near.triangle);
            if (mesh_uv) {
                const auto& corner = mesh.triangle[near.triangle];
                out.uv[s] = weight[0] * mesh.uv[corner[0]] + weight[1] * mesh.uv[corner[1]] +
                            weight[2] * mesh.uv[corner[2]];
            }
        }
    }
    if (!groom.root_uv.empty()) {
        for (std::size_t s = 0; s < n; ++s) {
            if (groom.has_root_uv[s]) out.uv[s] = groom.root_uv[s];
        }
    }
    if (!has_mesh) return out;

    std::vector<std::vector<std::uint32_t>> far(recipe.curves.size());
    std::vector<double> farthest(recipe.curves.size(), 0);
    const std::vector<double> length = strand_lengths(groom);
    for (std::size_t s = 0; s < n; ++s) {
        if (out.distance[s] <= kFarShare * length[s]) continue;
        far[groom.source[s]].push_back(groom.curve[s]);
        farthest[groom.source[s]] = std::max(farthest[groom.source[s]], out.distance[s]);
    }
    for (std::size_t f = 0; f < far.size(); ++f) {
        if (far[f].empty()) continue;
        findings.push_back({Rule::root_far, recipe.curves[f].file,
                            std::to_string(far[f].size()) +
                                " roots are farther from the mesh than a quarter of their "
                                "strand's length, up to " +
                                std::to_string(1000 * farthest[f]) + " mm",
                            to_ranges(far[f])});
    }
    return out;
}

}  // namespace keratin
