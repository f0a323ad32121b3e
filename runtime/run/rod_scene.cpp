#include "runtime/run/rod_scene.h"

#include "runtime/root_transform.h"
#include "runtime/run/mesh_frames.h"
#include "runtime/run/motion.h"

#include <cmath>
#include <optional>
#include <utility>
#include <variant>

namespace keratin {
namespace {

using measure::Point;

Vector3 to_vector3(const Double3& v) { return {v[0], v[1], v[2]}; }

RodEnd to_rod(EndKind kind) {
    switch (kind) {
        case EndKind::free:
            return RodEnd::free;
        case EndKind::pinned:
            return RodEnd::pinned;
        case EndKind::clamped:
            return RodEnd::clamped;
        case EndKind::clamped_two_points:
            return RodEnd::clamped_two_points;
    }
    return RodEnd::free;
}

}  // namespace

Double3 turn_between(const std::array<double, 4>& a, const std::array<double, 4>& b) {
    // b * conjugate(a)
    const Point av{-a[0], -a[1], -a[2]}, bv{b[0], b[1], b[2]};
    Point v = av * b[3] + bv * a[3] + measure::cross(bv, av);
    double w = b[3] * a[3] - measure::dot(bv, av);
    if (w < 0) {
        v = v * -1;
        w = -w;
    }
    const double sine = measure::length(v);
    // Near no turn at all the angle is twice the sine.
    const double factor = sine > 1e-12 ? 2 * std::atan2(sine, w) / sine : 2;
    return to_double3(v * factor);
}

RodStrand to_rod(const SceneStrand& in) {
    const measure::Rigid start = to_rigid(pose_at(in.motion, 0));
    RodStrand out;
    for (const Double3& p : in.points) out.points.push_back(to_double3(apply(start, to_point(p))));
    for (const Double3& v : in.velocities)
        out.velocities.push_back(to_double3(turn(start, to_point(v))));
    for (const Double3& p : in.rest_points)
        out.rest_points.push_back(to_double3(apply(start, to_point(p))));
    out.natural_curvature = in.natural_curvature;
    out.natural_twist = in.natural_twist;
    out.material = {in.radii,         in.density,   in.youngs_modulus,
                    in.poisson_ratio, in.viscosity, in.air_drag};
    out.root = to_rod(in.root);
    out.tip = to_rod(in.tip);
    const auto unit = [&](const std::optional<Double3>& d, const Motion& motion) {
        if (!d) return d;
        const Point turned = turn(to_rigid(pose_at(motion, 0)), to_point(*d));
        return std::optional(to_double3(turned * (1 / measure::length(turned))));
    };
    out.root_frame = {unit(in.root_direction, in.motion), unit(in.root_normal, in.motion)};
    out.tip_frame = {unit(in.tip_direction, in.tip_motion), unit(in.tip_normal, in.tip_motion)};
    return out;
}

RodStrand to_rod(const AssetBody& body, std::uint32_t lane, const RigidTransform& root) {
    const AssetFields& fields = body.asset.fields();
    const measure::Rigid carry = to_rigid(root);
    RodStrand out;
    for (std::uint32_t p = 0; p < fields.guide_point_count[lane]; ++p)
        out.points.push_back(
            to_double3(apply(carry, guide_point(fields.guide_position, fields, lane, p))));
    const Material& m = body.asset.info().groups[fields.guide_group[lane]].material;
    out.material = {{m.radius, m.radius2}, m.density,   m.youngs_modulus,
                    m.poisson_ratio,       m.viscosity, 0};
    if (!fields.guide_rod_strain.empty())
        for (std::uint32_t p = 1; p < fields.guide_point_count[lane]; ++p) {
            const auto at = [&](std::size_t c) {
                const std::size_t row = fields.tile_first_row[lane / kTileLanes] + p;
                return double(fields.guide_rod_strain[vector_index(row, 4, c, lane % kTileLanes)]);
            };
            out.rest_strain.push_back({at(0), {at(1), at(2)}, at(3)});
        }
    out.root = RodEnd::clamped;
    out.root_frame.normal =
        to_double3(turn(carry, guide_point(fields.guide_shape, fields, lane, 0)));
    return out;
}

RodSettings to_settings(const Scene& scene, const RunOptions& options) {
    RodSettings out;
    out.gravity = scene.gravity;
    out.air_velocity = scene.wind.velocity;
    const SceneSettings& in = scene.settings;
    out.stretch_scale = in.stretch_scale.value_or(out.stretch_scale);
    out.bend_scale = in.bend_scale.value_or(out.bend_scale);
    out.twist_scale = in.twist_scale.value_or(out.twist_scale);
    if (in.newton) out.newton = *in.newton == "full" ? RodNewton::full : RodNewton::quasi;
    if (in.iterations) out.iterations = static_cast<std::uint32_t>(*in.iterations);
    out.tolerance = in.tolerance.value_or(out.tolerance);
    // Most steps of the local pass end at the cap, and most halves of them too.
    if (in.contact == "impulse") out.contact_halvings = out.overlap_halvings = 1;
    out.threads = options.threads;
    return out;
}

ContactSettings to_contact(const Scene& scene, const RunOptions& options) {
    ContactSettings out;
    if (scene.settings.contact == "impulse") out.method = ContactMethod::impulse;
    if (scene.settings.contact == "gauss_seidel") out.method = ContactMethod::gauss_seidel;
    if (scene.settings.local_inertia == "rigid") out.local_inertia = LocalInertia::rigid;
    out.friction = scene.friction;
    out.contact_distance = scene.contact_distance;
    out.threads = options.threads;
    return out;
}

Result<void> add_colliders(const Scene& scene, std::vector<std::unique_ptr<TriangleTree>>& meshes,
                           std::vector<ContactCollider>& out) {
    for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
        const SceneCollider& in = scene.colliders[i];
        RigidShape shape;
        if (const auto* plane = std::get_if<PlaneShape>(&in.shape)) {
            const Vector3 normal = to_vector3(plane->normal);
            shape = {ShapeKind::plane, to_vector3(plane->point),
                     (1 / std::sqrt(dot(normal, normal))) * normal, 0, nullptr};
        } else if (const auto* sphere = std::get_if<SphereShape>(&in.shape)) {
            shape = {
                ShapeKind::sphere, to_vector3(sphere->center), {0, 0, 0}, sphere->radius, nullptr};
        } else if (const auto* capsule = std::get_if<CapsuleShape>(&in.shape)) {
            shape = {ShapeKind::capsule, to_vector3(capsule->a), to_vector3(capsule->b),
                     capsule->radius, nullptr};
        } else if (const auto* box = std::get_if<BoxShape>(&in.shape)) {
            shape = {ShapeKind::box, to_vector3(box->center), to_vector3(box->half_size), 0,
                     nullptr};
        } else if (const auto* mesh = std::get_if<MeshShape>(&in.shape)) {
            auto read = read_obj_triangles(mesh->file);
            if (!read) return read.error();
            std::vector<Vector3> points;
            for (const Double3& p : read->position) points.push_back(to_vector3(p));
            std::vector<std::uint32_t> corners;
            for (const auto& t : read->triangle) corners.insert(corners.end(), t.begin(), t.end());
            meshes.push_back(std::make_unique<TriangleTree>(points, corners));
            shape.kind = ShapeKind::mesh;
            shape.mesh = meshes.back().get();
        } else {
            return Error{ErrorCode::unsupported,
                         scene.file + ": colliders[" + std::to_string(i) + "]",
                         "the rod solver does not take a distance_grid; use the mesh itself"};
        }
        ContactCollider collider{shape, in.friction, in.contact_distance, {}};
        if (!in.motion.empty())
            collider.pose = [&in](double time) {
                const RigidTransform m = pose_at(in.motion, time);
                return make_pose(m.rotation[0], m.rotation[1], m.rotation[2], m.rotation[3],
                                 to_vector3(m.translation));
            };
        out.push_back(std::move(collider));
    }
    return {};
}

Result<void> add_asset_colliders(const AssetBody& body, std::vector<ContactCollider>& out) {
    const Settings as_strands;
    const AssetInfo& info = body.asset.info();
    if (info.distance_grid.stored_bricks > 0)
        return Error{ErrorCode::unsupported, body.scene->file,
                     "the rod solver's contact does not take the distance grid of an asset; bake "
                     "it without \"distance_grid\" (fitted colliders, \"colliders\": \"fit\", are "
                     "taken) or write \"settings\": { \"contact\": \"none\" } in the scene"};
    for (const AssetCollider& in : info.colliders) {
        const Vector3 a{in.a[0], in.a[1], in.a[2]}, b{in.b[0], in.b[1], in.b[2]};
        const bool sphere = in.a == in.b;
        out.push_back({{sphere ? ShapeKind::sphere : ShapeKind::capsule, a,
                        sphere ? Vector3{0, 0, 0} : b, in.radius, nullptr},
                       as_strands.asset_collider_friction,
                       as_strands.asset_collider_distance,
                       [&body, bone = in.bone](double time) {
                           const RigidTransform motion = pose_at(body.scene->motion, time);
                           const Motion* own = body.bones.empty() ? nullptr : body.bones[bone];
                           const RigidTransform m =
                               own ? chained(motion, pose_at(*own, time)) : motion;
                           return make_pose(m.rotation[0], m.rotation[1], m.rotation[2],
                                            m.rotation[3], to_vector3(m.translation));
                       }});
    }
    return {};
}

}  // namespace keratin
