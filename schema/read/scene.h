// A scene: what keratin-run is asked to simulate. Read from JSON with comments, defined by
// schema/scene.fbs. Units SI, y up, quaternions (x, y, z, w).
#pragma once

#include "schema/read/up_axis.h"
#include "schema/result.h"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace keratin {

using Double3 = std::array<double, 3>;
using Double4 = std::array<double, 4>;

enum class SolverKind { strand, rod, cosserat, superhelix };

// Maps an initial point x to R x + T (about the world origin) and a direction d to R d.
// Interpolated linearly (rotation: spherically), held before the first and after the last.
struct Keyframe {
    double time = 0;               // s, strictly increasing within a motion
    Double3 translation{0, 0, 0};  // m
    Double4 rotation{0, 0, 0, 1};  // unit, normalised when read
};
using Motion = std::vector<Keyframe>;  // empty: at rest

struct BoneMotion {
    std::string bone;
    Motion motion;
};

struct MeshFrame {
    double time = 0;
    std::string file;  // resolved; same topology as the mesh the asset was bound to
};

struct SceneAsset {
    std::string file;  // resolved
    double lod = 1;    // (0, 1], share of the render strands
    Motion motion;
    std::vector<BoneMotion> bones;  // from the pose file `bones`
    std::vector<MeshFrame> mesh_frames;
    double mesh_scale = 1;  // m per unit of the mesh frames' files
    UpAxis mesh_up_axis = UpAxis::y;
};

enum class EndKind { free, pinned, clamped, clamped_two_points };

struct SceneStrand {
    std::vector<Double3> points, velocities, rest_points;
    std::optional<std::array<double, 2>> natural_curvature;  // 1/m
    double natural_twist = 0;                                // 1/m
    std::array<double, 2> radii{5e-5, 5e-5};                 // m
    double density = 1300, youngs_modulus = 2e9, poisson_ratio = 0.48, viscosity = 0, air_drag = 0;
    EndKind root = EndKind::clamped, tip = EndKind::free;
    std::optional<Double3> root_direction, root_normal, tip_direction, tip_normal;
    Motion motion, tip_motion;
};

struct PlaneShape {
    Double3 point{}, normal{0, 1, 0};
};
struct SphereShape {
    Double3 center{};
    double radius = 0;
};
struct CapsuleShape {
    Double3 a{}, b{};
    double radius = 0;
};
struct BoxShape {
    Double3 center{}, half_size{};
};
struct MeshShape {
    std::string file;
};
struct DistanceGridShape {
    std::string file;
};
using SceneShape =
    std::variant<PlaneShape, SphereShape, CapsuleShape, BoxShape, MeshShape, DistanceGridShape>;

struct SceneCollider {
    SceneShape shape;
    double friction = 0.3;
    double contact_distance = 0;  // m; 0: the strand's radius
    Motion motion;
};

struct SceneWind {
    Double3 velocity{};
    double gust = 0, turbulence = 0;
};

// What `settings` may hold; absent: the solver's default. Which solver knows which is checked when
// the scene is read.
struct SceneSettings {
    std::optional<int> iterations;
    std::optional<double> tolerance;     // m/s
    std::optional<std::string> newton;   // quasi | full
    std::optional<std::string> contact;  // none | impulse | gauss_seidel
    std::optional<double> stretch_scale, bend_scale, twist_scale;
    std::optional<std::string> local_inertia;  // lumped | rigid
    std::optional<int> substeps;               // cosserat
    // strand: passes switched off by hand, for comparisons
    std::optional<bool> grid_friction, grid_volume, stretch, local_shape, global_length, collision,
        interpolation;
};

struct Scene {
    std::string file;
    SolverKind solver = SolverKind::strand;
    double frame = 1.0 / 60;         // s
    std::optional<double> step;      // s; absent: for keratin-run to choose
    std::optional<double> duration;  // s
    Double3 gravity{0, -9.81, 0};
    std::uint64_t seed = 1;
    SceneWind wind;
    SceneSettings settings;
    std::vector<SceneAsset> assets;
    std::vector<SceneStrand> strands;
    std::vector<SceneCollider> colliders;
    double friction = 0.3;
    double contact_distance = 0;
};

// Reads and checks a scene and the pose files it names. `solver` replaces the scene's own choice,
// so that its settings are checked against the solver that will run. Errors (input): as
// read_recipe; exactly one shape a collider, settings of another solver, keyframes out of order,
// and so on, with the path ("strands[3].radius").
Result<Scene> read_scene(const std::string& path, std::optional<SolverKind> solver = {});
// The same from text; relative paths in it are resolved against `folder`.
Result<Scene> parse_scene(const std::string& text, const std::string& name,
                          const std::string& folder, std::optional<SolverKind> solver = {});

// Motion of bones by name, as a scene's `bones` names it:
//   { "bones": { "head": [ { "time": 0, "translation": [0,0,0], "rotation": [0,0,0,1] }, ... ] } }
// Each keyframe maps a point of the groom as it was bound to R x + T.
Result<std::vector<BoneMotion>> read_poses(const std::string& path);
Result<std::vector<BoneMotion>> parse_poses(const std::string& text, const std::string& name);

// "strand", "rod", ...
std::string_view solver_word(SolverKind solver);
std::optional<SolverKind> solver_of_word(std::string_view word);

}  // namespace keratin
