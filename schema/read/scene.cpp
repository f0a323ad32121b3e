#include "schema/read/scene.h"

#include "kSceneSchema.h"
#include "scene_generated.h"
#include "schema/read/typed_json.h"

#include <cmath>

namespace keratin {

namespace {

namespace fb = scene_fb;

static_assert(int(SolverKind::superhelix) == int(fb::Solver::superhelix) &&
              int(SolverKind::rod) == int(fb::Solver::rod));
static_assert(int(UpAxis::z) == int(fb::UpAxis::z) && int(UpAxis::x) == int(fb::UpAxis::x));
static_assert(int(EndKind::pinned) == int(fb::End::pinned) &&
              int(EndKind::clamped_two_points) == int(fb::End::clamped_two_points));

using Keyframes = flatbuffers::Vector<flatbuffers::Offset<fb::Keyframe>>;
using Points = flatbuffers::Vector<const fb::Vec3*>;

Double3 to_double3(const fb::Vec3& v) { return {v.x(), v.y(), v.z()}; }

double norm(const Double3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

Double3 cross(const Double3& a, const Double3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

std::string indexed(const std::string& path, std::size_t i) {
    return path + "[" + std::to_string(i) + "]";
}

bool normalise(Double4& q) {
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 1e-6 && length < 1e6)) return false;
    for (double& c : q) c /= length;
    return true;
}

const char* const kTimesRise = "is not later than the entry before; times must rise";
const char* const kNoRotation =
    "is not a rotation; write a quaternion [x, y, z, w], for none [0, 0, 0, 1]";

Result<void> read_motion(const TypedJson& json, const std::string& path, const Keyframes* in,
                         Motion& out) {
    if (!in) return {};
    for (flatbuffers::uoffset_t i = 0; i < in->size(); ++i) {
        const fb::Keyframe& key = *in->Get(i);
        Keyframe frame;
        frame.time = *key.time();
        if (key.translation()) frame.translation = to_double3(*key.translation());
        if (const auto* q = key.rotation()) frame.rotation = {q->x(), q->y(), q->z(), q->w()};
        if (!normalise(frame.rotation))
            return json.wrong(indexed(path, i) + ".rotation", kNoRotation);
        if (!out.empty() && frame.time <= out.back().time)
            return json.wrong(indexed(path, i) + ".time", kTimesRise);
        out.push_back(frame);
    }
    return {};
}

Result<void> read_asset(const TypedJson& json, const std::string& path, const fb::Asset& in,
                        const std::string& folder, SceneAsset& out) {
    out.file = resolve_path(folder, in.file()->str());
    if (in.lod()) out.lod = *in.lod();
    if (auto ok = read_motion(json, path + ".motion", in.motion(), out.motion); !ok) return ok;
    if (in.bones()) {
        auto poses = read_poses(resolve_path(folder, in.bones()->str()));
        if (!poses) return poses.error();
        out.bones = std::move(*poses);
    }
    if (!in.mesh_frames() && (in.mesh_scale() || in.mesh_up_axis()))
        return json.wrong(path + (in.mesh_scale() ? ".mesh_scale" : ".mesh_up_axis"),
                          "says how to read `mesh_frames`, but there are none");
    if (in.mesh_scale()) out.mesh_scale = *in.mesh_scale();
    if (in.mesh_up_axis()) out.mesh_up_axis = static_cast<UpAxis>(*in.mesh_up_axis());
    if (!in.mesh_frames()) return {};
    for (flatbuffers::uoffset_t i = 0; i < in.mesh_frames()->size(); ++i) {
        const fb::MeshFrame& frame = *in.mesh_frames()->Get(i);
        if (!out.mesh_frames.empty() && *frame.time() <= out.mesh_frames.back().time)
            return json.wrong(indexed(path + ".mesh_frames", i) + ".time", kTimesRise);
        out.mesh_frames.push_back({*frame.time(), resolve_path(folder, frame.file()->str())});
    }
    return {};
}

std::vector<Double3> to_points(const Points* in) {
    std::vector<Double3> out;
    if (in)
        for (const fb::Vec3* p : *in) out.push_back(to_double3(*p));
    return out;
}

// Consecutive points must be apart: a segment without length has no direction.
Result<void> check_segments(const TypedJson& json, const std::string& path,
                            const std::vector<Double3>& points) {
    for (std::size_t i = 1; i < points.size(); ++i)
        if (points[i] == points[i - 1])
            return json.wrong(indexed(path, i),
                              "is the same point as the one before; every segment needs a length");
    return {};
}

Result<void> check_count(const TypedJson& json, const std::string& path,
                         const std::vector<Double3>& values, const SceneStrand& strand) {
    if (values.empty() || values.size() == strand.points.size()) return {};
    return json.wrong(path, "has " + std::to_string(values.size()) +
                                " entries; write one a point, that is " +
                                std::to_string(strand.points.size()));
}

// The direction and the normal of one end of a strand.
Result<void> read_end_frame(const TypedJson& json, const std::string& path, const char* end,
                            EndKind kind, const fb::Vec3* direction, const fb::Vec3* normal,
                            std::optional<Double3>& out_direction,
                            std::optional<Double3>& out_normal) {
    const std::string at = path + "." + end;
    const auto read = [&](const char* what, const fb::Vec3* in,
                          std::optional<Double3>& out) -> Result<void> {
        if (!in) return {};
        if (kind != EndKind::clamped)
            return json.wrong(at + what, std::string("belongs to a clamped end; write \"") + end +
                                             "\": \"clamped\" or leave it out");
        out = to_double3(*in);
        if (norm(*out) < 1e-12) return json.wrong(at + what, "has no length; it must not be zero");
        return {};
    };
    if (auto ok = read("_direction", direction, out_direction); !ok) return ok;
    if (auto ok = read("_normal", normal, out_normal); !ok) return ok;
    if (out_direction && out_normal &&
        norm(cross(*out_direction, *out_normal)) < 1e-6 * norm(*out_direction) * norm(*out_normal))
        return json.wrong(at + "_normal", std::string("is parallel to ") + end + "_direction");
    return {};
}

Result<void> read_rest(const TypedJson& json, const std::string& path, const fb::Strand& in,
                       SceneStrand& out) {
    const std::string at = path + ".";
    out.rest_points = to_points(in.rest_points());
    if (auto ok = check_count(json, at + "rest_points", out.rest_points, out); !ok) return ok;
    if (auto ok = check_segments(json, at + "rest_points", out.rest_points); !ok) return ok;
    if (!out.rest_points.empty() && (in.natural_curvature() || in.natural_twist()))
        return json.wrong(at + "rest_points",
                          "the rest shape is given twice; write either `rest_points` or "
                          "`natural_curvature` and `natural_twist`");
    if (in.natural_curvature())
        out.natural_curvature = {in.natural_curvature()->a(), in.natural_curvature()->b()};
    if (in.natural_twist()) {
        out.natural_twist = *in.natural_twist();
        // The twist alone is a straight rest shape, twisted.
        if (!out.natural_curvature) out.natural_curvature = {0, 0};
    }
    return {};
}

Result<void> read_strand(const TypedJson& json, const std::string& path, const fb::Strand& in,
                         SceneStrand& out) {
    const std::string at = path + ".";
    out.points = to_points(in.points());
    if (auto ok = check_segments(json, at + "points", out.points); !ok) return ok;
    out.velocities = to_points(in.velocities());
    if (auto ok = check_count(json, at + "velocities", out.velocities, out); !ok) return ok;
    if (auto ok = read_rest(json, path, in, out); !ok) return ok;
    if (in.radius() && in.radii())
        return json.wrong(at + "radii", "`radius` is written too; write only one of them");
    if (in.radius()) out.radii = {*in.radius(), *in.radius()};
    if (in.radii()) out.radii = {in.radii()->a(), in.radii()->b()};
    if (in.density()) out.density = *in.density();
    if (in.youngs_modulus()) out.youngs_modulus = *in.youngs_modulus();
    if (in.poisson_ratio()) out.poisson_ratio = *in.poisson_ratio();
    if (in.viscosity()) out.viscosity = *in.viscosity();
    if (in.air_drag()) out.air_drag = *in.air_drag();
    if (in.root()) out.root = static_cast<EndKind>(*in.root());
    if (in.tip()) out.tip = static_cast<EndKind>(*in.tip());
    if (out.tip == EndKind::clamped_two_points)
        return json.wrong(at + "tip",
                          "only a root can be clamped_two_points; write free, pinned or clamped");
    if (auto ok = read_end_frame(json, path, "root", out.root, in.root_direction(),
                                 in.root_normal(), out.root_direction, out.root_normal);
        !ok)
        return ok;
    if (auto ok = read_end_frame(json, path, "tip", out.tip, in.tip_direction(), in.tip_normal(),
                                 out.tip_direction, out.tip_normal);
        !ok)
        return ok;
    if (auto ok = read_motion(json, at + "motion", in.motion(), out.motion); !ok) return ok;
    if (auto ok = read_motion(json, at + "tip_motion", in.tip_motion(), out.tip_motion); !ok)
        return ok;
    if (!out.motion.empty() && out.root == EndKind::free)
        return json.wrong(at + "motion", "moves the root but the root is free");
    if (!out.tip_motion.empty() && out.tip == EndKind::free)
        return json.wrong(at + "tip_motion", "moves the tip but the tip is free");
    return {};
}

Result<void> read_shape(const TypedJson& json, const std::string& path, const fb::Collider& in,
                        const std::string& folder, SceneShape& out) {
    std::vector<std::string> shapes;
    if (const auto* plane = in.plane()) {
        shapes.push_back("plane");
        out = PlaneShape{to_double3(*plane->point()), to_double3(*plane->normal())};
        if (norm(to_double3(*plane->normal())) < 1e-12)
            return json.wrong(path + ".plane.normal", "has no length; it must not be zero");
    }
    if (const auto* sphere = in.sphere()) {
        shapes.push_back("sphere");
        out = SphereShape{to_double3(*sphere->center()), *sphere->radius()};
    }
    if (const auto* capsule = in.capsule()) {
        shapes.push_back("capsule");
        out =
            CapsuleShape{to_double3(*capsule->a()), to_double3(*capsule->b()), *capsule->radius()};
    }
    if (const auto* box = in.box()) {
        shapes.push_back("box");
        out = BoxShape{to_double3(*box->center()), to_double3(*box->half_size())};
    }
    if (const auto* mesh = in.mesh()) {
        shapes.push_back("mesh");
        out = MeshShape{resolve_path(folder, mesh->file()->str())};
    }
    if (const auto* grid = in.distance_grid()) {
        shapes.push_back("distance_grid");
        out = DistanceGridShape{resolve_path(folder, grid->file()->str())};
    }
    const char* const one =
        "write exactly one of plane, sphere, capsule, box, mesh and distance_grid";
    if (shapes.empty()) return json.wrong(path, std::string("has no shape; ") + one);
    if (shapes.size() > 1)
        return json.wrong(path + "." + shapes[1],
                          "is a second shape beside `" + shapes[0] + "`; " + one);
    return {};
}

Result<void> read_collider(const TypedJson& json, const std::string& path, const fb::Collider& in,
                           const std::string& folder, SceneCollider& out) {
    if (auto ok = read_shape(json, path, in, folder, out.shape); !ok) return ok;
    if (in.friction()) out.friction = *in.friction();
    if (in.contact_distance()) out.contact_distance = *in.contact_distance();
    return read_motion(json, path + ".motion", in.motion(), out.motion);
}

// Refuses a setting that the solver does not know; which knows which stands in scene.fbs.
Result<void> check_settings(const TypedJson& json, SolverKind solver) {
    const JsonValue* settings = json.root.find("settings");
    if (!settings) return {};
    const auto* def = json.parser.LookupStruct("keratin.scene_fb.Settings");
    const std::string word(solver_word(solver));
    const auto knows = [&](const std::string& owners) {
        return (" " + owners + " ").find(" " + word + " ") != std::string::npos;
    };
    std::vector<std::string> known;
    for (const auto* field : def->fields.vec)
        if (knows(field->attributes.Lookup("solvers")->constant)) known.push_back(field->name);
    for (const std::string& key : settings->keys) {
        const std::string owner = def->fields.Lookup(key)->attributes.Lookup("solvers")->constant;
        if (knows(owner)) continue;
        std::string message =
            "is a setting of the " + owner + " solver, but this scene runs " + word;
        if (known.empty()) message += ", which has no settings";
        for (std::size_t i = 0; i < known.size(); ++i)
            message += (i ? ", " : ", which knows ") + known[i];
        return json.wrong("settings." + key, message);
    }
    return {};
}

void read_settings(const fb::Settings* in, SceneSettings& out) {
    if (!in) return;
    const auto copy = [](auto from, auto& to) {
        if (from) to = *from;
    };
    copy(in->iterations(), out.iterations);
    copy(in->tolerance(), out.tolerance);
    copy(in->stretch_scale(), out.stretch_scale);
    copy(in->bend_scale(), out.bend_scale);
    copy(in->twist_scale(), out.twist_scale);
    copy(in->substeps(), out.substeps);
    copy(in->grid_friction(), out.grid_friction);
    copy(in->grid_volume(), out.grid_volume);
    copy(in->stretch(), out.stretch);
    copy(in->local_shape(), out.local_shape);
    copy(in->global_length(), out.global_length);
    copy(in->collision(), out.collision);
    copy(in->interpolation(), out.interpolation);
    if (in->newton()) out.newton = fb::EnumNameNewton(*in->newton());
    if (in->contact()) out.contact = fb::EnumNameContact(*in->contact());
    if (in->local_inertia()) out.local_inertia = fb::EnumNameLocalInertia(*in->local_inertia());
}

// Calls read(path, entry, result) for each entry of a list of the scene.
template <class List, class Out, class Read>
Result<void> read_list(const char* name, const List* in, std::vector<Out>& out, Read&& read) {
    if (!in) return {};
    for (flatbuffers::uoffset_t i = 0; i < in->size(); ++i) {
        out.emplace_back();
        if (auto ok = read(indexed(name, i), *in->Get(i), out.back()); !ok) return ok;
    }
    return {};
}

Result<void> read_lists(const TypedJson& json, const fb::Scene& in, const std::string& folder,
                        Scene& out) {
    if (auto ok = read_list("assets", in.assets(), out.assets,
                            [&](const std::string& path, const fb::Asset& from, SceneAsset& to) {
                                return read_asset(json, path, from, folder, to);
                            });
        !ok)
        return ok;
    if (auto ok = read_list("strands", in.strands(), out.strands,
                            [&](const std::string& path, const fb::Strand& from, SceneStrand& to) {
                                return read_strand(json, path, from, to);
                            });
        !ok)
        return ok;
    return read_list("colliders", in.colliders(), out.colliders,
                     [&](const std::string& path, const fb::Collider& from, SceneCollider& to) {
                         return read_collider(json, path, from, folder, to);
                     });
}

}  // namespace

std::string_view solver_word(SolverKind solver) {
    return fb::EnumNameSolver(static_cast<fb::Solver>(solver));
}

std::optional<SolverKind> solver_of_word(std::string_view word) {
    for (const fb::Solver solver : fb::EnumValuesSolver())
        if (word == fb::EnumNameSolver(solver)) return static_cast<SolverKind>(solver);
    return {};
}

Result<Scene> parse_scene(const std::string& text, const std::string& name,
                          const std::string& folder, std::optional<SolverKind> solver) {
    TypedJson json;
    if (auto ok = read_typed_json(text, name, kSceneSchema, json); !ok) return ok.error();
    const auto& in = json.table<fb::Scene>();

    Scene out;
    out.file = name;
    if (in.solver()) out.solver = static_cast<SolverKind>(*in.solver());
    if (solver) out.solver = *solver;
    if (in.frame()) out.frame = *in.frame();
    if (in.step()) out.step = *in.step();
    if (in.duration()) out.duration = *in.duration();
    if (in.gravity()) out.gravity = to_double3(*in.gravity());
    if (in.seed()) out.seed = *in.seed();
    if (const fb::Wind* wind = in.wind()) {
        if (wind->velocity()) out.wind.velocity = to_double3(*wind->velocity());
        if (wind->gust()) out.wind.gust = *wind->gust();
        if (wind->turbulence()) out.wind.turbulence = *wind->turbulence();
    }
    if (auto ok = check_settings(json, out.solver); !ok) return ok.error();
    read_settings(in.settings(), out.settings);
    if (auto ok = read_lists(json, in, folder, out); !ok) return ok.error();
    if (in.friction()) out.friction = *in.friction();
    if (in.contact_distance()) out.contact_distance = *in.contact_distance();
    if (out.assets.empty() && out.strands.empty())
        return Error{
            ErrorCode::input, name,
            "there is nothing to simulate; write \"assets\": [{ \"file\": \"head.kera\" }] "
            "or \"strands\": [ ... ]"};
    return out;
}

Result<Scene> read_scene(const std::string& path, std::optional<SolverKind> solver) {
    auto text = read_text_file(path);
    if (!text) return text.error();
    return parse_scene(*text, path, folder_of(path), solver);
}

Result<std::vector<BoneMotion>> parse_poses(const std::string& text, const std::string& name) {
    // The bones' names are free, which a schema cannot say; each keyframe is checked against it.
    flatbuffers::Parser schema;
    if (!schema.Parse(kSceneSchema))
        return Error{ErrorCode::internal, name, "the schema does not parse: " + schema.error_};
    auto root = parse_json(text, name);
    if (!root) return root.error();
    const auto fail = [&](const JsonValue& at, const std::string& path,
                          const std::string& message) {
        return Error{ErrorCode::input, json_place(name, at.line, at.column) + ": " + path, message};
    };
    const JsonValue* bones = root->find("bones");
    if (!bones || bones->kind != JsonKind::object || root->items.size() != 1)
        return Error{ErrorCode::input, json_place(name, root->line, root->column),
                     "a pose file is { \"bones\": { \"head\": [ { \"time\": 0, \"translation\": "
                     "[0,0,0], \"rotation\": [0,0,0,1] } ] } }"};
    std::vector<BoneMotion> out;
    for (std::size_t b = 0; b < bones->items.size(); ++b) {
        const JsonValue& list = bones->items[b];
        const std::string path = "bones." + bones->keys[b];
        if (list.kind != JsonKind::array)
            return fail(list, path,
                        "expected a list of keyframes but found " +
                            std::string(json_kind_words(list.kind)));
        BoneMotion motion{bones->keys[b], {}};
        for (std::size_t i = 0; i < list.items.size(); ++i) {
            const JsonValue& key = list.items[i];
            const std::string at = indexed(path, i);
            if (auto ok = check_table(schema, "keratin.scene_fb.Keyframe", key, name, at); !ok)
                return ok.error();
            Keyframe frame;
            frame.time = key.find("time")->number;
            if (const JsonValue* t = key.find("translation"))
                for (std::size_t c = 0; c < 3; ++c) frame.translation[c] = t->items[c].number;
            if (const JsonValue* q = key.find("rotation"))
                for (std::size_t c = 0; c < 4; ++c) frame.rotation[c] = q->items[c].number;
            if (!normalise(frame.rotation))
                return fail(*key.find("rotation"), at + ".rotation", kNoRotation);
            if (!motion.motion.empty() && frame.time <= motion.motion.back().time)
                return fail(*key.find("time"), at + ".time", kTimesRise);
            motion.motion.push_back(frame);
        }
        out.push_back(std::move(motion));
    }
    return out;
}

Result<std::vector<BoneMotion>> read_poses(const std::string& path) {
    auto text = read_text_file(path);
    if (!text) return text.error();
    return parse_poses(*text, path);
}

}  // namespace keratin
