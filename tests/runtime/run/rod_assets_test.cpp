// Assets under the rod solver: which rods their guides become, what moves them, what follows them.
#include "bake/write.h"
#include "runtime/run/asset_body.h"
#include "runtime/run/motion.h"
#include "runtime/run/solver_run.h"
#include "schema/file_hash.h"
#include "schema/files/write_file.h"
#include "tests/schema/small_asset.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>

using namespace keratin;
using measure::Point;

namespace {

// Hair so soft that it moves within the time that a test has.
test::SmallAsset soft_asset() {
    test::SmallAsset a = test::small_asset();
    Material& m = a.info.groups[0].material;
    m = {3e-5f, 5e-5f, 1200, 1e7f, 0.3f, 0};
    return a;
}

void write_asset(const test::TemporaryFolder& folder, const std::string& name,
                 const AssetInfo& info, const AssetFields& fields) {
    const auto bytes = serialise_asset(info, fields, name);
    REQUIRE(bytes);
    REQUIRE(write_file(folder.file(name), *bytes));
}

void write_asset(const test::TemporaryFolder& folder, const test::SmallAsset& a,
                 const std::string& name = "head.kera") {
    write_asset(folder, name, a.info, a.fields());
}

Scene scene_of(const test::TemporaryFolder& folder, const std::string& fields) {
    auto scene =
        parse_scene("{ \"solver\": \"rod\", " + fields + " }", "s.json", folder.path().string());
    if (!scene) FAIL(to_string(scene.error()));
    return *scene;
}

std::unique_ptr<SolverRun> run_of(const Scene& scene, int threads = 1) {
    auto run = scene.solver == SolverKind::rod ? make_rod_run(scene, {"test", threads, false})
                                               : make_strand_run(scene, {"test", threads, false});
    if (!run) FAIL(to_string(run.error()));
    return std::move(*run);
}

void advance(SolverRun& run, int from, int to, double h = 0.002) {
    for (int k = from; k < to; ++k) REQUIRE(run.step(k * h, (k + 1) * h));
}

RunState look(const SolverRun& run) {
    RunState state;
    run.look(state);
    return state;
}

std::string refusal(const Scene& scene) {
    const auto run = make_rod_run(scene, {"test", 1, false});
    return run ? "" : to_string(run.error());
}

std::string number(double v) {
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", v);
    return text;
}

const char* const kNoContact = "\"settings\": { \"contact\": \"none\" }";
const char* const kMotion =
    R"("motion": [{ "time": 0, "rotation": [0,0,0.3,1] },
                  { "time": 0.05, "translation": [0.02,0,0.01], "rotation": [0.3,0,0.1,1] }])";

}  // namespace

TEST_CASE("guides of an asset run as the explicit strands that they are, bit by bit") {
    const test::TemporaryFolder folder;
    const test::SmallAsset a = soft_asset();
    write_asset(folder, a);
    const auto guides = run_of(scene_of(
        folder, std::string("\"assets\": [{ \"file\": \"head.kera\", ") + kMotion + " }]"));
    std::string strands;
    const Material& m = a.info.groups[0].material;
    for (std::uint32_t g = 0; g < a.info.guide_count; ++g) {
        std::string points;
        for (std::uint32_t p = 0; p < 4; ++p) {
            const Point x = guide_point(a.guide_position, a.fields(), g, p);
            points += (p ? ",[" : "[") + number(x.x) + "," + number(x.y) + "," + number(x.z) + "]";
        }
        strands += (g ? ", " : "") + std::string("{ \"points\": [") + points + "], \"radii\": [" +
                   number(m.radius) + "," + number(m.radius2) +
                   "], \"density\": " + number(m.density) +
                   ", \"youngs_modulus\": " + number(m.youngs_modulus) +
                   ", \"poisson_ratio\": " + number(m.poisson_ratio) +
                   ", \"root_normal\": [1,0,0], " + kMotion + " }";
    }
    const auto explicit_strands = run_of(scene_of(
        folder, "\"strands\": [" + strands +
                    "], \"colliders\": [{ \"sphere\": { \"center\": [0,-1,0], \"radius\": 0.5 }, " +
                    kMotion + " }]"));
    advance(*guides, 0, 50);
    advance(*explicit_strands, 0, 50);
    const RunState state = look(*guides);
    CHECK(measure::distance(state.position[3], state.rigid[3]) > 1e-3);
    CHECK(guides->hash() == explicit_strands->hash());
    CHECK(guides->layout().degrees_of_freedom == explicit_strands->layout().degrees_of_freedom);
    for (std::size_t i = 0; i < state.position.size(); ++i) {
        CHECK(guides->layout().mass[i] == Approx(explicit_strands->layout().mass[i]));
        CHECK(guides->layout().rest[i].x == explicit_strands->layout().rest[i].x);
    }
}

TEST_CASE("roots of rods go where the strand solver's go: rigidly, with bones, with triangles") {
    const test::TemporaryFolder folder;
    test::SmallAsset a = test::small_asset();
    write_asset(folder, a, "motion.kera");
    a.info.attach = Attach::triangle;
    a.info.mesh_topology_hash = hash_bytes(std::as_bytes(std::span(a.mesh_triangle)));
    for (std::size_t lane = 0; lane < 64; ++lane) a.guide_barycentric[lane] = 0.25f;
    write_asset(folder, a, "triangle.kera");
    a = test::small_asset();
    a.info.bones = {"a", "b"};
    a.info.colliders.clear();
    AssetFields with_bones = a.fields();
    std::vector<std::uint32_t> bone(64 * 4, 0), strand_bone(7 * 4, 0);
    std::vector<float> weight(64 * 4, 0), strand_weight(7 * 4, 0);
    for (std::size_t lane = 0; lane < 64; ++lane)
        for (std::size_t k = 0; k < 2; ++k) {
            bone[vector_index(lane / 16, 4, k, lane % 16)] = static_cast<std::uint32_t>(k);
            weight[vector_index(lane / 16, 4, k, lane % 16)] = k == 0 ? 0.75f : 0.25f;
        }
    for (std::size_t s = 0; s < 7; ++s) strand_weight[4 * s] = 1;
    with_bones.guide_bone = bone, with_bones.guide_bone_weight = weight;
    with_bones.strand_bone = strand_bone, with_bones.strand_bone_weight = strand_weight;
    write_asset(folder, "bones.kera", a.info, with_bones);
    folder.write("rest.obj", "v -1 0 -1\nv 1 0 -1\nv 0 0 1\nf 1 2 3\n");
    folder.write("bent.obj", "v -1.01 0 -1\nv 1 0.2 -1\nv 0 0.1 1.02\nf 1 2 3\n");
    folder.write("poses.json", R"({ "bones": { "a": [{ "time": 0 },
        { "time": 0.04, "translation": [0.01,0,0], "rotation": [0,0.4,0.1,1] }],
        "b": [{ "time": 0, "translation": [0,0.02,0] }] } })");

    for (const std::string asset :
         {"\"file\": \"motion.kera\"", "\"file\": \"bones.kera\", \"bones\": \"poses.json\"",
          "\"file\": \"triangle.kera\", \"mesh_frames\": [{ \"time\": 0, \"file\": \"rest.obj\" }, "
          "{ \"time\": 0.04, \"file\": \"bent.obj\" }]"}) {
        INFO(asset);
        Scene scene = scene_of(folder, "\"gravity\": [0,0,0], \"assets\": [{ " + asset + ", " +
                                           kMotion + " }], " + kNoContact);
        const auto rods = run_of(scene);
        scene.solver = SolverKind::strand;
        scene.settings = {};
        const auto strands = run_of(scene);
        double farthest = 0;
        for (int k = 0; k < 30; ++k) {
            advance(*rods, k, k + 1);
            advance(*strands, k, k + 1);
            const RunState r = look(*rods), s = look(*strands);
            REQUIRE(r.position.size() == s.position.size());
            for (std::size_t i = 0; i < r.rigid.size(); ++i)
                farthest = std::max(farthest, measure::distance(r.rigid[i], s.rigid[i]));
            for (const std::size_t root : {0, 4, 16})
                farthest = std::max(farthest, measure::distance(r.position[root], r.rigid[root]));
        }
        CHECK(farthest < 1e-6);
        // Without weight a rod comes to rest along the direction that its root was turned to.
        for (int k = 1; k < 40; ++k) REQUIRE(rods->step(0.06 * k, 0.06 * (k + 1)));
        const RunState still = look(*rods);
        double off = 0;
        for (std::size_t i = 0; i < still.rigid.size(); ++i)
            off = std::max(off, measure::distance(still.position[i], still.rigid[i]));
        CHECK(off < 1e-5);
        CHECK(rods->layout().head.guide_lane == strands->layout().head.guide_lane);
        CHECK(rods->layout().head.guide_first_point == strands->layout().head.guide_first_point);
        CHECK(rods->layout().head.strand_first_point == strands->layout().head.strand_first_point);
        CHECK(rods->layout().id == strands->layout().id);
    }
}

TEST_CASE("render strands follow the rods as they follow the strand solver's guides") {
    const test::TemporaryFolder folder;
    const test::SmallAsset a = soft_asset();
    write_asset(folder, a);
    const auto run = run_of(scene_of(
        folder, std::string("\"assets\": [{ \"file\": \"head.kera\", ") + kMotion + " }]"));
    advance(*run, 0, 40);
    const RunState state = look(*run);
    REQUIRE(state.strand_position.size() == 7 * 4 * 3);
    double farthest = 0, moved = 0;
    for (std::size_t s = 0; s < 7; ++s)
        for (std::size_t p = 0; p < 4; ++p) {
            const float* rest = &a.strand_position[3 * (4 * s + p)];
            Point wanted = measure::apply(state.root[0], {rest[0], rest[1], rest[2]});
            const Point carried = wanted;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t at = 4 * a.strand_guide[3 * s + k] + p;
                wanted =
                    wanted + (state.position[at] - state.rigid[at]) * a.strand_weight[3 * s + k];
            }
            const float* x = &state.strand_position[3 * (4 * s + p)];
            farthest = std::max(farthest, measure::distance(wanted, {x[0], x[1], x[2]}));
            moved = std::max(moved, measure::distance(wanted, carried));
        }
    CHECK(farthest < 1e-6);
    CHECK(moved > 1e-3);
}

TEST_CASE(
    "rods of assets and explicit ones share a scene: threads, saved and resumed, the same bits") {
    const test::TemporaryFolder folder;
    write_asset(folder, soft_asset());
    const Scene scene = scene_of(
        folder, std::string("\"assets\": [{ \"file\": \"head.kera\", ") + kMotion +
                    " }], \"strands\": [{ \"points\": [[0.1,0,0],[0.11,0,0],[0.12,0,0]] }]");
    const auto one = run_of(scene), two = run_of(scene, 2), early = run_of(scene),
               late = run_of(scene);
    CHECK(one->layout().head.guide_lane.size() == 6);
    CHECK(one->layout().head.guide_lane.back() == kNoStrand);
    CHECK(one->layout().head.strand_first_point.size() == 9);
    CHECK(one->layout().uv.empty());
    advance(*one, 0, 30);
    advance(*two, 0, 30);
    advance(*early, 0, 11);
    const auto saved = early->save();
    REQUIRE(saved);
    REQUIRE(late->load(*saved, 11 * 0.002));
    advance(*late, 11, 30);
    CHECK(two->hash() == one->hash());
    CHECK(late->hash() == one->hash());
    CHECK(look(*late).strand_position == look(*one).strand_position);
}

TEST_CASE("rods stay out of the shapes fitted to their asset, which go with its motion") {
    const test::TemporaryFolder folder;
    test::SmallAsset a = soft_asset();
    // Beside the guides, which gravity pulls onto it.
    const float radius = 0.01f;
    a.info.colliders = {{{0.01f, 0.02f, 0.012f}, {0.01f, 0.02f, 0.012f}, radius, 0}};
    write_asset(folder, a);
    const std::string asset =
        "\"gravity\": [0,0,9.81], \"assets\": [{ \"file\": \"head.kera\", \"motion\": [{ \"time\": "
        "0 }, { \"time\": 0.1, \"translation\": [0.03,0,0] }] }], ";
    double deepest[2] = {};
    for (const bool contact : {false, true}) {
        const auto run = run_of(scene_of(folder, asset + "\"settings\": { \"contact\": \"" +
                                                     (contact ? "gauss_seidel" : "none") + "\" }"));
        for (int k = 0; k < 50; ++k) {
            advance(*run, k, k + 1);
            const RunState state = look(*run);
            REQUIRE(state.colliders.size() == (contact ? 1u : 0u));
            const double moved = 0.03 * (k + 1) / 50;
            if (contact) CHECK(double(state.colliders[0].a[0]) == Approx(0.01 + moved));
            for (const Point& x : state.position)
                deepest[contact] = std::max(
                    deepest[contact], radius - measure::distance(x, {0.01 + moved, 0.02, 0.012}));
        }
    }
    CHECK(deepest[false] > 1e-3);
    CHECK(deepest[true] == 0);
}

TEST_CASE("the plan of rods names what is left out of an asset, and why") {
    const test::TemporaryFolder folder;
    write_asset(folder, soft_asset());
    const auto run = run_of(scene_of(folder, "\"assets\": [{ \"file\": \"head.kera\" }]"));
    CHECK(run->explain().find("  interpolate\n") != std::string::npos);
    CHECK(run->explain().find("render_strands") != std::string::npos);
    CHECK(run->explain().find("they are the strand solver's") != std::string::npos);
    const auto guides_only =
        run_of(scene_of(folder,
                        "\"wind\": { \"velocity\": [1,0,0] }, \"assets\": [{ \"file\": "
                        "\"head.kera\" }], \"settings\": { \"interpolation\": false, \"contact\": "
                        "\"none\" }"));
    const std::string plan = guides_only->explain();
    CHECK(plan.find("head.kera: switched off in the settings") != std::string::npos);
    CHECK(plan.find("wind on the guides of assets: an asset knows no air_drag") !=
          std::string::npos);
    CHECK(guides_only->layout().head.strand_radius.empty());
    advance(*guides_only, 0, 2);
    CHECK(look(*guides_only).strand_position.empty());
}

TEST_CASE("the plan says when stiffness scales undo what makes an asset sag-free") {
    const test::TemporaryFolder folder;
    const test::SmallAsset asset = soft_asset();
    write_asset(folder, asset, "plain.kera");
    AssetFields fields = asset.fields();
    const std::vector<float> strain(4 * fields.guide_length.size(), 0.0f);
    fields.guide_rod_strain = strain;
    write_asset(folder, "held.kera", asset.info, fields);
    const auto plan = [&](const std::string& file, const std::string& settings) {
        return run_of(scene_of(folder, "\"assets\": [{ \"file\": \"" + file +
                                           "\" }], \"settings\": { " + settings + " }"))
            ->explain();
    };
    const std::string said =
        "held.kera: it is sag-free for stretch_scale, bend_scale and "
        "twist_scale 1";
    CHECK(plan("held.kera", "\"bend_scale\": 2").find(said) != std::string::npos);
    CHECK(plan("held.kera", "\"twist_scale\": 0.5").find(said) != std::string::npos);
    CHECK(plan("held.kera", "\"bend_scale\": 1").find("sag-free") == std::string::npos);
    CHECK(plan("plain.kera", "\"bend_scale\": 2").find("sag-free") == std::string::npos);
}

TEST_CASE("what rods do not take of an asset is refused with what to do instead") {
    const test::TemporaryFolder folder;
    test::SmallAsset a = soft_asset();
    a.info.attach = Attach::all;
    write_asset(folder, a, "all.kera");
    CHECK(refusal(scene_of(folder, "\"assets\": [{ \"file\": \"all.kera\" }]"))
              .find("all.kera: every point follows its root") != std::string::npos);

    a = soft_asset();
    a.info.distance_grid = {{0, 0, 0}, 0.01f, {1, 1, 1}, 1, 0, 0};
    const std::vector<std::uint32_t> brick{0};
    const std::vector<float> distance(125, 0.0f);
    AssetFields fields = a.fields();
    fields.grid_brick = brick, fields.grid_distance = distance;
    write_asset(folder, "grid.kera", a.info, fields);
    const std::string grid = "\"assets\": [{ \"file\": \"grid.kera\" }]";
    const std::string message = refusal(scene_of(folder, grid));
    CHECK(message.find("grid.kera: the rod solver's contact does not take the distance grid") !=
          std::string::npos);
    CHECK(message.find("\"colliders\": \"fit\"") != std::string::npos);
    CHECK(refusal(scene_of(folder, grid + ", " + kNoContact)) == "");

    // A guide that folds back onto its root's point.
    a = soft_asset();
    a.guide_position[vector_index(1, 3, 1, 2)] = 0;
    write_asset(folder, a, "folded.kera");
    CHECK(refusal(scene_of(folder, "\"assets\": [{ \"file\": \"folded.kera\" }]"))
              .find("folded.kera: guide 2.points[1]: is the same as the point before") !=
          std::string::npos);
}
