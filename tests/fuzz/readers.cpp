#include "tests/fuzz/readers.h"

#include "bake/nurbs.h"
#include "bake/read/formats.h"
#include "tests/fuzz/demand.h"

namespace keratin::fuzz {
namespace {

template <class T>
bool one_a_curve(const std::vector<T>& channel, const RawGroom& groom) {
    return channel.empty() || channel.size() == groom.curves.size();
}

void check(const Result<RawGroom>& result) {
    if (!result) {
        demand(!result.error().message.empty(), "an error says something");
        return;
    }
    const RawGroom& groom = *result;
    for (const RawCurve& curve : groom.curves) {
        demand(curve.points.size() >= 2, "a curve has two points or more");
        for (const Vec3& point : curve.points) demand(is_usable(point), "positions are usable");
        if (curve.degree == 0) continue;
        const auto nurbs = NurbsCurve::make(curve.points, curve.weights, curve.knots, curve.degree);
        demand(static_cast<bool>(nurbs), "a NURBS curve is sound");
        demand(curve.u_begin < curve.u_end, "a NURBS curve has a range");
        demand(curve.u_begin >= nurbs->u_min() && curve.u_end <= nurbs->u_max(),
               "the range lies inside the knots");
        demand(nurbs->position(0.5 * (curve.u_begin + curve.u_end)).allFinite(),
               "a NURBS curve has points");
    }
    demand(one_a_curve(groom.root_uv, groom) && one_a_curve(groom.radius, groom) &&
               one_a_curve(groom.point_radius, groom) && one_a_curve(groom.id, groom) &&
               one_a_curve(groom.group, groom) && one_a_curve(groom.is_guide, groom) &&
               one_a_curve(groom.closest_guides, groom) &&
               one_a_curve(groom.guide_weights, groom) && one_a_curve(groom.fixed_points, groom),
           "a channel has one entry a curve");
    for (std::uint32_t group : groom.group)
        demand(group < groom.group_names.size(), "a group has a name");
    for (std::size_t s = 0; s < groom.point_radius.size(); ++s)
        demand(groom.point_radius[s].size() == groom.curves[s].points.size(),
               "there is one radius a point");
    for (std::size_t s = 0; s < groom.fixed_points.size(); ++s)
        demand(groom.fixed_points[s] <= groom.curves[s].points.size(),
               "points are fixed by number");
}

}  // namespace

void run_alembic(std::string_view bytes) { check(read_alembic(bytes, "fuzz", 0.5)); }

void run_gltf(std::string_view bytes) {
    check(read_gltf_curves(bytes, "fuzz", [](const std::string&) -> Result<std::string> {
        return std::string(256, '?');
    }));
    (void)find_gltf_mesh_fault(bytes, "fuzz");
}

void run_hair(std::string_view bytes) { check(read_hair(bytes, "fuzz")); }

void run_obj_curves(std::string_view bytes) { check(read_obj_curves(bytes, "fuzz")); }

void run_obj_mesh(std::string_view bytes) {
    const auto mesh = read_obj_mesh(bytes, "fuzz");
    if (!mesh) return;
    demand(!mesh->triangle.empty(), "a mesh has triangles");
    demand(mesh->uv.empty() || mesh->uv.size() == mesh->position.size(), "one uv a vertex");
    std::size_t next = 0;
    for (const RawMeshPart& part : mesh->parts) {
        demand(part.first_triangle == next, "parts follow each other");
        next += part.triangle_count;
    }
    demand(next == mesh->triangle.size(), "parts cover the mesh");
    for (const auto& triangle : mesh->triangle)
        for (std::uint32_t vertex : triangle)
            demand(vertex < mesh->position.size(), "triangles name vertices");
}

void run_tfx(std::string_view bytes) { check(read_tfx(bytes, "fuzz")); }

void run_tfxbone(std::string_view bytes) {
    const auto skin = read_tfxbone(bytes, "fuzz");
    if (!skin) return;
    for (const auto& bones : skin->bone)
        for (std::uint32_t bone : bones) demand(bone < skin->bones.size(), "bones have names");
}

void run_tfxskin(std::string_view bytes) {
    const auto binding = read_tfxskin(bytes, "fuzz");
    if (!binding) return;
    for (std::uint32_t triangle : binding->triangle)
        demand(triangle < binding->mesh_triangle_count, "triangles are in range");
}

void run_usc_data(std::string_view bytes) { check(read_usc_data(bytes, "fuzz")); }

}  // namespace keratin::fuzz
