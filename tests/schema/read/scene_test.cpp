#include "schema/read/scene.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <unistd.h>

using namespace keratin;

namespace {

std::string failure(const std::string& fields) {
    auto scene = parse_scene("{ \"assets\": [{ \"file\": \"a.kera\" }],\n" + fields + " }",
                             "scene.json", "");
    return scene ? "accepted" : to_string(scene.error());
}

std::string strand_failure(const std::string& fields) {
    auto scene = parse_scene(
        "{ \"solver\": \"rod\", \"strands\": [{ \"points\": [[0,0,0],[1,0,0],[2,0,0]],\n" + fields +
            " }] }",
        "scene.json", "");
    return scene ? "accepted" : to_string(scene.error());
}

}  // namespace

TEST_CASE("every field of a scene is read") {
    const auto folder = std::filesystem::temp_directory_path() /
                        ("keratin_scene_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "poses.json")
        << R"({"bones": {"head": [{"time": 0}, {"time": 1, "translation": [1,2,3], "rotation": [0,2,0,0]}]}})";
    std::ofstream(folder / "scene.json") << R"({
      "solver": "rod", "frame": 0.02, "step": 0.001, "duration": 2.5, "gravity": [0,-1,0.5],
      "seed": 7, "wind": { "velocity": [1,0,0], "gust": 0.5, "turbulence": 0.25 },
      "settings": { "iterations": 50, "tolerance": 1e-8, "newton": "full",
                    "contact": "gauss_seidel", "stretch_scale": 0.01, "bend_scale": 2,
                    "twist_scale": 3, "local_inertia": "rigid" },
      "assets": [ { "file": "head.kera", "lod": 0.5, "motion": [ { "time": 0.5 } ],
                    "bones": "poses.json",
                    "mesh_frames": [ { "time": 0, "file": "n.obj" }, { "time": 1, "file": "s.obj" } ],
                    "mesh_scale": 0.01, "mesh_up_axis": "z" } ],
      "strands": [ { "points": [[0,0,0],[0.01,0,0]], "velocities": [[0,0,0],[0,1,0]],
                     "natural_curvature": [3, 4], "natural_twist": 5, "radii": [1e-5, 2e-5],
                     "density": 1000, "youngs_modulus": 1e9, "poisson_ratio": 0.3, "viscosity": 6,
                     "air_drag": 7, "root": "pinned", "tip": "clamped",
                     "tip_direction": [1,0,0], "tip_normal": [0,1,0],
                     "motion": [{ "time": 0 }], "tip_motion": [{ "time": 1 }] },
                   { "points": [[0,0,0],[1,0,0]], "rest_points": [[0,0,0],[0,1,0]],
                     "root": "clamped_two_points" } ],
      "colliders": [ { "plane": { "point": [0,1,0], "normal": [0,1,0] } },
                     { "sphere": { "center": [1,2,3], "radius": 0.5 }, "friction": 0.1,
                       "contact_distance": 1e-4, "motion": [{ "time": 0 }] },
                     { "capsule": { "a": [0,0,0], "b": [1,0,0], "radius": 2 } },
                     { "box": { "center": [0,0,0], "half_size": [1,2,3] } },
                     { "mesh": { "file": "m.obj" } }, { "distance_grid": { "file": "m.grid" } } ],
      "friction": 0.6, "contact_distance": 1e-4 })";
    auto scene = read_scene((folder / "scene.json").string());
    INFO((scene ? "" : to_string(scene.error())));
    REQUIRE(scene);
    CHECK(scene->solver == SolverKind::rod);
    CHECK(scene->frame == 0.02);
    CHECK(scene->step == 0.001);
    CHECK(scene->duration == 2.5);
    CHECK(scene->gravity == Double3{0, -1, 0.5});
    CHECK(scene->seed == 7);
    CHECK(scene->wind.velocity == Double3{1, 0, 0});
    CHECK(scene->wind.gust == 0.5);
    CHECK(scene->wind.turbulence == 0.25);
    CHECK(scene->settings.iterations == 50);
    CHECK(scene->settings.tolerance == 1e-8);
    CHECK(scene->settings.newton == "full");
    CHECK(scene->settings.contact == "gauss_seidel");
    CHECK(scene->settings.stretch_scale == 0.01);
    CHECK(scene->settings.bend_scale == 2.0);
    CHECK(scene->settings.twist_scale == 3.0);
    CHECK(scene->settings.local_inertia == "rigid");
    REQUIRE(scene->assets.size() == 1);
    const SceneAsset& asset = scene->assets[0];
    CHECK(asset.file == (folder / "head.kera").string());
    CHECK(asset.lod == 0.5);
    CHECK(asset.motion.size() == 1);
    REQUIRE(asset.bones.size() == 1);
    CHECK(asset.bones[0].bone == "head");
    REQUIRE(asset.bones[0].motion.size() == 2);
    CHECK(asset.bones[0].motion[1].translation == Double3{1, 2, 3});
    CHECK(asset.bones[0].motion[1].rotation == Double4{0, 1, 0, 0});
    REQUIRE(asset.mesh_frames.size() == 2);
    CHECK(asset.mesh_frames[1].file == (folder / "s.obj").string());
    CHECK(asset.mesh_scale == 0.01);
    CHECK(asset.mesh_up_axis == UpAxis::z);
    REQUIRE(scene->strands.size() == 2);
    const SceneStrand& strand = scene->strands[0];
    CHECK(strand.points[1] == Double3{0.01, 0, 0});
    CHECK(strand.velocities[1] == Double3{0, 1, 0});
    CHECK(strand.natural_curvature == std::array<double, 2>{3, 4});
    CHECK(strand.natural_twist == 5);
    CHECK(strand.radii == std::array<double, 2>{1e-5, 2e-5});
    CHECK(strand.density == 1000);
    CHECK(strand.youngs_modulus == 1e9);
    CHECK(strand.poisson_ratio == 0.3);
    CHECK(strand.viscosity == 6);
    CHECK(strand.air_drag == 7);
    CHECK(strand.root == EndKind::pinned);
    CHECK(strand.tip == EndKind::clamped);
    CHECK(strand.tip_direction == Double3{1, 0, 0});
    CHECK(strand.tip_normal == Double3{0, 1, 0});
    CHECK(strand.motion.size() == 1);
    CHECK(strand.tip_motion[0].time == 1);
    CHECK(scene->strands[1].rest_points[1] == Double3{0, 1, 0});
    CHECK(scene->strands[1].root == EndKind::clamped_two_points);
    REQUIRE(scene->colliders.size() == 6);
    CHECK(std::get<PlaneShape>(scene->colliders[0].shape).point == Double3{0, 1, 0});
    CHECK(scene->colliders[0].friction == 0.3);
    CHECK(std::get<SphereShape>(scene->colliders[1].shape).radius == 0.5);
    CHECK(scene->colliders[1].friction == 0.1);
    CHECK(scene->colliders[1].contact_distance == 1e-4);
    CHECK(scene->colliders[1].motion.size() == 1);
    CHECK(std::get<CapsuleShape>(scene->colliders[2].shape).b == Double3{1, 0, 0});
    CHECK(std::get<BoxShape>(scene->colliders[3].shape).half_size == Double3{1, 2, 3});
    CHECK(std::get<MeshShape>(scene->colliders[4].shape).file == (folder / "m.obj").string());
    CHECK(std::get<DistanceGridShape>(scene->colliders[5].shape).file ==
          (folder / "m.grid").string());
    CHECK(scene->friction == 0.6);
    CHECK(scene->contact_distance == 1e-4);
    std::filesystem::remove_all(folder);
}

TEST_CASE("the strand solver's switches are read, and a setting of another solver is refused") {
    auto scene = parse_scene(R"({ "assets": [{ "file": "a.kera" }], "settings": {
        "grid_friction": false, "grid_volume": false, "stretch": false, "local_shape": false,
        "global_length": false, "collision": false, "interpolation": false } })",
                             "scene.json", "");
    REQUIRE(scene);
    CHECK(scene->settings.grid_friction == false);
    CHECK(scene->settings.interpolation == false);
    CHECK(failure(R"("settings": { "newton": "full" })") ==
          "scene.json:2:25: settings.newton: is a setting of the rod solver, but this scene runs "
          "strand, which knows iterations, grid_friction, grid_volume, stretch, local_shape, "
          "global_length, "
          "collision, interpolation");
    CHECK(failure(R"("solver": "rod", "settings": { "substeps": 4 })")
              .find("settings.substeps: is a setting of the cosserat solver") != std::string::npos);
    CHECK(failure(R"("solver": "superhelix", "settings": { "contact": "none" })") ==
          "scene.json:2:50: settings.contact: is a setting of the rod solver, but this scene runs "
          "superhelix, which has no settings");
    const std::string rod =
        R"({ "assets": [{ "file": "a.kera" }], "settings": { "newton": "full" } })";
    CHECK_FALSE(parse_scene(rod, "s", ""));
    CHECK(parse_scene(rod, "s", "", SolverKind::rod));
}

TEST_CASE("a mistake in a scene is named with its place and what would be right") {
    struct Case {
        std::string fields, message;
    };
    const std::string one =
        "write exactly one of plane, sphere, capsule, box, mesh and distance_grid";
    const Case cases[] = {
        {R"("gravty": [0,0,0])", "scene.json:2:1: unknown field `gravty`; did you mean `gravity`?"},
        {R"("gravity": [0,-9.81])",
         "scene.json:2:12: gravity: expected 3 numbers [x, y, z] but found 2"},
        {R"("gravity": { "x": 0, "y": 1, "z": 2 })",
         "scene.json:2:12: gravity: expected the list [x, y, z] but found an object"},
        {R"("gravity": [0,"-9.81",0])",
         "scene.json:2:15: gravity[1]: expected a number but found the string \"-9.81\"; write it "
         "without the quotation marks"},
        {R"("gravity": [0,-1e999,0])",
         "scene.json:2:15: gravity[1]: -1e999 is too large for a number"},
        {R"("solver": "rods")",
         "scene.json:2:11: solver: expected strand, rod, cosserat or superhelix but found `rods`; "
         "did you mean `rod`?"},
        {R"("solver": "rod strand")",
         "scene.json:2:11: solver: expected strand, rod, cosserat or superhelix but found `rod "
         "strand`"},
        {R"("solver": 7)",
         "scene.json:2:11: solver: expected one of the words strand, rod, cosserat or superhelix "
         "but found the number 7"},
        {R"("step": 0)",
         "scene.json:2:9: step: 0 is out of range; it must be above 0 and at most 1e+06"},
        {R"("colliders": [{ "friction": 0.1 }])",
         "scene.json:2:15: colliders[0]: has no shape; " + one},
        {R"("colliders": [{ "sphere": { "center": [0,0,0], "radius": 1 }, "mesh": { "file": "m" } }])",
         "scene.json:2:71: colliders[0].mesh: is a second shape beside `sphere`; " + one},
        {R"("colliders": [{ "sphere": { "center": [0,0,0] } }])",
         "scene.json:2:27: colliders[0].sphere: the field `radius` is missing"},
        {R"("colliders": [{ "sphere": { "center": [0,0,0], "radius": 0 } }])",
         "scene.json:2:58: colliders[0].sphere.radius: 0 is out of range; it must be above 0 and "
         "at "
         "most 1e+06"},
        {R"("colliders": [{ "box": { "center": [0,0,0], "half_size": [1,0,1] } }])",
         "scene.json:2:61: colliders[0].box.half_size[1]: 0 is out of range; it must be above 0 "
         "and "
         "at most 1e+06"},
        {R"("colliders": [{ "plane": { "point": [0,0,0], "normal": [0,0,0] } }])",
         "scene.json:2:56: colliders[0].plane.normal: has no length; it must not be zero"},
        {R"("colliders": [{ "mesh": { "file": "m" }, "motion": [{ "time": 1 }, { "time": 1 }] }])",
         "scene.json:2:78: colliders[0].motion[1].time: is not later than the entry before; times "
         "must rise"},
        {R"("colliders": [{ "mesh": { "file": "m" }, "motion": [{ "time": 1, "rotation": [0,0,0,0] }] }])",
         "scene.json:2:78: colliders[0].motion[0].rotation: is not a rotation; write a quaternion "
         "[x, y, z, w], for none [0, 0, 0, 1]"},
        {R"("colliders": [{ "mesh": { "file": "m" }, "motion": [{}] }])",
         "scene.json:2:53: colliders[0].motion[0]: the field `time` is missing"},
    };
    for (const Case& c : cases) {
        INFO(c.fields);
        CHECK(failure(c.fields) == c.message);
    }
}

TEST_CASE("a mistake in a strand of a scene is named with its place and what would be right") {
    struct Case {
        std::string fields, message;
    };
    const Case cases[] = {
        {R"("velocities": [[0,0,0]])",
         "scene.json:2:15: strands[0].velocities: has 1 entries; write one a point, that is 3"},
        {R"("rest_points": [[0,0,0],[1,0,0],[1,0,0]])",
         "scene.json:2:33: strands[0].rest_points[2]: is the same point as the one before; every "
         "segment needs a length"},
        {R"("rest_points": [[0,0,0],[1,0,0],[2,0,0]], "natural_twist": 1)",
         "scene.json:2:16: strands[0].rest_points: the rest shape is given twice; write either "
         "`rest_points` or `natural_curvature` and `natural_twist`"},
        {R"("radius": -1)",
         "scene.json:2:11: strands[0].radius: -1 is out of range; it must be above 0 and at most "
         "1000"},
        {R"("radius": 1e-4, "radii": [1e-4, 1e-4])",
         "scene.json:2:26: strands[0].radii: `radius` is written too; write only one of them"},
        {R"("poisson_ratio": 0.6)",
         "scene.json:2:18: strands[0].poisson_ratio: 0.6 is out of range; it must be above -1 and "
         "at most 0.5"},
        {R"("tip": "clamped_two_points")",
         "scene.json:2:8: strands[0].tip: only a root can be clamped_two_points; write free, "
         "pinned "
         "or clamped"},
        {R"("tip_direction": [1,0,0])",
         "scene.json:2:18: strands[0].tip_direction: belongs to a clamped end; write \"tip\": "
         "\"clamped\" or leave it out"},
        {R"("root_direction": [0,0,0])",
         "scene.json:2:19: strands[0].root_direction: has no length; it must not be zero"},
        {R"("root_direction": [1,0,0], "root_normal": [-2,0,0])",
         "scene.json:2:43: strands[0].root_normal: is parallel to root_direction"},
        {R"("root": "free", "motion": [{ "time": 0 }])",
         "scene.json:2:27: strands[0].motion: moves the root but the root is free"},
        {R"("tip_motion": [{ "time": 0 }])",
         "scene.json:2:15: strands[0].tip_motion: moves the tip but the tip is free"},
    };
    for (const Case& c : cases) {
        INFO(c.fields);
        CHECK(strand_failure(c.fields) == c.message);
    }
    const auto points = [](const std::string& list) {
        auto scene = parse_scene("{ \"strands\": [{ \"points\": " + list + " }] }", "s", "");
        return scene ? "accepted" : to_string(scene.error());
    };
    CHECK(points("[[0,0,0]]") ==
          "s:1:27: strands[0].points: has 1 entry; it takes at least 2 and at most 1e+06");
    CHECK(points("[[0,0,0],[0,0,0]]").find("strands[0].points[1]: is the same point") !=
          std::string::npos);
}

TEST_CASE("a scene with nothing in it is refused") {
    auto scene = parse_scene("{}", "scene.json", "");
    REQUIRE_FALSE(scene);
    CHECK(scene.error().message.find("there is nothing to simulate") == 0);
}

TEST_CASE("a mistake in a pose file is named with its place") {
    const auto failed = [](const std::string& text) {
        auto poses = parse_poses(text, "poses.json");
        return poses ? "accepted" : to_string(poses.error());
    };
    CHECK(failed(R"({"bones": {}})") == "accepted");
    CHECK(failed("{}").find("poses.json:1:1: a pose file is { \"bones\"") == 0);
    CHECK(failed(R"({"bones": {"head": 1}})") ==
          "poses.json:1:20: bones.head: expected a list of keyframes but found a number");
    CHECK(failed(R"({"bones": {"head": [{"tim": 1}]}})") ==
          "poses.json:1:22: bones.head[0]: unknown field `tim`; did you mean `time`?");
    CHECK(failed(R"({"bones": {"head": [{"time": 1}, {"time": 0}]}})") ==
          "poses.json:1:43: bones.head[1].time: is not later than the entry before; times must "
          "rise");
    CHECK(failed(R"({"bones": {"head": [{"time": 1, "translation": [0, 0]}]}})") ==
          "poses.json:1:48: bones.head[0].translation: expected 3 numbers [x, y, z] but found 2");
    auto missing = parse_scene(R"({"assets": [{"file": "a", "bones": "gone.json"}]})", "s", "");
    REQUIRE_FALSE(missing);
    CHECK(missing.error().where == "gone.json");
}

TEST_CASE("solvers are known by their words") {
    CHECK(solver_word(SolverKind::cosserat) == "cosserat");
    CHECK(solver_of_word("rod") == SolverKind::rod);
    CHECK_FALSE(solver_of_word("rods"));
}
