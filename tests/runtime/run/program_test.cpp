// Runs the program keratin-run itself.
#include "bake/write.h"
#include "schema/asset.h"
#include "schema/cache.h"
#include "schema/files/write_file.h"
#include "tests/json_schema.h"
#include "tests/schema/small_asset.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

using namespace keratin;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

std::string content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

struct Outcome {
    int code = -1;
    std::string out, err;
};

// A folder of its own with an asset, head.kera, that goes away with the test.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("keratin_run_program_" + std::to_string(getpid()));

    Folder() {
        fs::create_directories(path);
        const auto small = test::small_asset();
        auto bytes = serialise_asset(small.info, small.fields(), "head.kera");
        REQUIRE(bytes);
        REQUIRE(write_file(file("head.kera"), *bytes));
    }
    ~Folder() { fs::remove_all(path); }
    std::string file(const std::string& name) const { return (path / name).string(); }
    void write(const std::string& name, const std::string& text) const {
        REQUIRE(write_file(file(name), text));
    }
    // A scene of the asset that is moved sideways, with more fields.
    void scene(const std::string& fields) const {
        write("scene.json",
              "{ \"assets\": [{ \"file\": \"head.kera\", \"motion\": [{ \"time\": 0 }, { \"time\": "
              "0.2, \"translation\": [0.1, 0, 0] }] }]" +
                  (fields.empty() ? "" : ", " + fields) + " }");
    }
    // Runs the program in the folder.
    Outcome run(const std::string& arguments) const {
        const std::string command = "cd '" + path.string() + "' && '" KERATIN_RUN_PROGRAM "' " +
                                    arguments + " >out.txt 2>err.txt";
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content(file("out.txt")),
                content(file("err.txt"))};
    }
    json stats(const std::string& arguments) const {
        const Outcome outcome = run(arguments + " --stats stats.json");
        INFO(outcome.err);
        REQUIRE(outcome.code == 0);
        return json::parse(content(file("stats.json")));
    }
};

json schema() { return json::parse(content(KERATIN_SCHEMA_DIR "/report/keratin-run.schema.json")); }

}  // namespace

TEST_CASE("keratin-run runs a baked asset as it is") {
    const Folder folder;
    const Outcome outcome = folder.run("head.kera --frames 3");
    CHECK(outcome.code == 0);
    CHECK(outcome.err.empty());
    CHECK(outcome.out.find("strand: 5 simulated strands, 20 points, 7 render strands\n3 steps of "
                           "0.0166667 s") == 0);
    CHECK(folder.run("head.kera --frames 3 --quiet").out.empty());
}

TEST_CASE("the figures of a run follow their schema and say what happened") {
    const Folder folder;
    folder.scene(R"("duration": 0.25, "step": 0.005, "frame": 0.02,
        "colliders": [{ "sphere": { "center": [0.2, 0, 0], "radius": 0.05 } }])");
    const json stats = folder.stats("scene.json --final --explain");
    CHECK(test::schema_misfit(schema(), stats) == "");
    CHECK(stats["solver"] == "strand");
    CHECK(stats["steps"] == 50);
    CHECK(stats["frames"] == 12);
    CHECK(stats["strands"] == 5);
    CHECK(stats["points"] == 20);
    CHECK(stats["finite"] == true);
    CHECK(stats["max_stretch"].get<double>() < 0.05);
    CHECK(stats["max_tip_lag"].get<double>() > 1e-4);
    CHECK(stats["penetration"]["mesh"].is_number());
    CHECK(stats["penetration"]["colliders"] == 0);
    // The initial state, 12 frames, and the end half-way through the next.
    CHECK(stats["series"]["time"].size() == 14);
    CHECK(stats["series"]["time"][13] == 0.25);
    CHECK(stats["energy"].size() == 14);
    CHECK(stats["energy"][0]["kinetic"] == 0);
    CHECK(stats["bytes"]["total"].get<int>() > 0);
    CHECK(stats["final"].size() == 5);
    CHECK(stats["final"][0].size() == 4);
    CHECK(stats["final"][0][0][0].get<double>() == Approx(0.1));
    CHECK(stats["final_velocity"][4].size() == 4);
    CHECK(stats["plan"][0]["passes"].size() > 3);
}

TEST_CASE("the elastic energy of a run is that of the bend from the rest edges, not from the groom") {
    const Folder folder;
    auto asset = test::small_asset();
    const double segment = double(asset.guide_length[scalar_index(1, 0)]), angle = 0.3;
    for (std::uint32_t lane = 0; lane < kTileLanes; ++lane)
        for (std::uint32_t p = 1; p < asset.guide_point_count[0]; ++p) {
            const double turn = p > 1 ? angle : 0;
            const double edge[] = {segment * std::cos(turn), segment * std::sin(turn), 0};
            for (std::size_t k = 0; k < 3; ++k)
                asset.guide_shape[vector_index(p, 3, k, lane)] = static_cast<float>(edge[k]);
        }
    const auto bytes = serialise_asset(asset.info, asset.fields(), "bent.kera");
    REQUIRE(bytes);
    REQUIRE(write_file(folder.file("bent.kera"), *bytes));
    const json stats = folder.stats("bent.kera --frames 1");
    const Material& m = asset.info.groups[0].material;
    const double stiffness =
        double(m.youngs_modulus) * std::numbers::pi * std::pow(double(m.radius), 4) / 4;
    // Five guides of two joints.
    CHECK(stats["energy"][0]["elastic"].get<double>() ==
          Approx(5 * 2 * stiffness * (1 - std::cos(angle)) / segment).epsilon(1e-5));
}

TEST_CASE("with --json there is one document on stdout and nothing else") {
    const Folder folder;
    const Outcome figures = folder.run("head.kera --frames 2 --json");
    CHECK(figures.code == 0);
    CHECK(test::schema_misfit(schema(), json::parse(figures.out)) == "");
    CHECK_FALSE(json::parse(figures.out).contains("final"));
    const Outcome plan = folder.run("head.kera --explain --json");
    CHECK(plan.code == 0);
    CHECK(test::schema_misfit(schema(), json::parse(plan.out)) == "");
    CHECK_FALSE(json::parse(plan.out).contains("steps"));
    const Outcome dash = folder.run("head.kera --frames 2 --stats -");
    CHECK(test::schema_misfit(schema(), json::parse(dash.out)) == "");
}

TEST_CASE("the schema of the figures refuses what is missing, unknown or of another type") {
    const Folder folder;
    const json good = folder.stats("head.kera --frames 2");
    json bad = good;
    bad.erase("hash");
    CHECK(test::schema_misfit(schema(), bad) == "document lacks hash");
    bad = good;
    bad["more"] = 1;
    CHECK(test::schema_misfit(schema(), bad) == "document.more is not listed");
    bad = good;
    bad["series"]["stretch"][1] = "much";
    CHECK(test::schema_misfit(schema(), bad) == "document.series.stretch[1] has the wrong type");
}

TEST_CASE("one and two threads give the same hash, another scene another") {
    const Folder folder;
    folder.scene("");
    const std::string one = folder.stats("scene.json --frames 20 --threads 1")["hash"];
    CHECK(folder.stats("scene.json --frames 20 --threads 2")["hash"] == one);
    CHECK(folder.stats("scene.json --frames 21 --threads 2")["hash"] != one);
}

TEST_CASE("a run that was saved and resumed ends as the unbroken one") {
    const Folder folder;
    folder.scene("\"step\": 0.005");
    const std::string whole = folder.stats("scene.json --frames 12")["hash"];
    REQUIRE(folder.run("scene.json --frames 5 --save half.state").code == 0);
    const json rest = folder.stats("scene.json --frames 12 --resume half.state");
    CHECK(rest["hash"] == whole);
    CHECK(rest["steps"] == 7 * 4);
    const Outcome again = folder.run("scene.json --frames 5 --resume half.state");
    CHECK(again.code == 2);
    CHECK(again.err.find("half.state: the saved run is at step 20 already") != std::string::npos);
    CHECK(folder.run("scene.json --frames 9 --step 0.001 --resume half.state").code == 2);
    CHECK(folder.run("scene.json --frames 9 --resume head.kera").err.find("not a saved run") !=
          std::string::npos);
}

TEST_CASE("the cache and the table hold what the run ended with, frame by frame") {
    const Folder folder;
    folder.scene("\"step\": 0.008");
    const json stats =
        folder.stats("scene.json --frames 4 --final --cache run.kcache --points p.csv --every 2");
    auto reader = CacheReader::open(folder.file("run.kcache"));
    REQUIRE(reader);
    CHECK(reader->head().solver == "strand");
    CHECK(reader->head().assets[0].guide_count == 5);
    REQUIRE(reader->frame_count() == 5);
    auto last = reader->frame(4);
    REQUIRE(last);
    CHECK(last->time == Approx(4.0 / 60));
    CHECK(last->strand_position.size() == 7 * 4 * 3);
    CHECK(last->bodies[0].motion.translation[0] == Approx(0.1 / 3));
    REQUIRE(last->colliders.size() == 1);
    CHECK(last->colliders[0].a[0] == Approx(0.1 / 3));
    for (std::size_t s = 0; s < 5; ++s)
        for (std::size_t p = 0; p < 4; ++p)
            CHECK(last->guide_position[3 * (4 * s + p)] == stats["final"][s][p][0].get<float>());

    std::istringstream table(content(folder.file("p.csv")));
    std::string line;
    std::getline(table, line);
    CHECK(line == "frame,time,strand,point,x,y,z");
    std::size_t lines = 0;
    std::string first;
    while (std::getline(table, line)) first = lines++ ? first : line;
    CHECK(lines == 3 * 20);  // frames 0, 2 and 4
    CHECK(first == "0,0,0,0,0,0,0");
    CHECK(line.empty());
}

TEST_CASE("render strands are exported in each format") {
    const Folder folder;
    CHECK(folder.run("head.kera --frames 2 --export hair.abc").code == 0);
    CHECK(content(folder.file("hair.abc")).substr(0, 5) == "Ogawa");
    CHECK(folder.run("head.kera --frames 2 --export hair.obj").code == 0);
    CHECK(fs::exists(folder.file("hair.0002.obj")));
    const Outcome other = folder.run("head.kera --frames 2 --export hair.fbx");
    CHECK(other.code == 2);
    CHECK(other.err.find("fbx") != std::string::npos);
}

TEST_CASE("a pass that is switched off is left out, with the reason") {
    const Folder folder;
    folder.scene("\"settings\": { \"local_shape\": false, \"iterations\": 7 }");
    const Outcome plan = folder.run("scene.json --explain");
    CHECK(plan.code == 0);
    CHECK(plan.out.find("7 constraint iterations") != std::string::npos);
    const std::size_t left_out = plan.out.find("left out:");
    REQUIRE(left_out != std::string::npos);
    CHECK(plan.out.find("local_shape:", left_out) != std::string::npos);
    CHECK(plan.out.find("bytes") < left_out);
}

TEST_CASE("bad usage exits with 2 and one line that says what would be right") {
    const Folder folder;
    folder.scene("");
    struct Case {
        std::string arguments, message;
    };
    const Case cases[] = {
        {"", "input is required"},
        {"gone.json", "gone.json: "},
        {"gone.kera", "gone.kera: "},
        {"head.kera --fames 3", "--fames"},
        {"head.kera --frames 0", "--frames"},
        {"head.kera --frames three", "--frames"},
        {"head.kera --frames 3 --duration 1", "--frames"},
        {"head.kera --threads 0", "--threads"},
        {"head.kera --solver rods",
         "--solver: expected strand, rod, cosserat or superhelix but found rods"},
        {"head.kera --solver superhelix", "this build has no superhelix solver"},
        {"head.kera --backend vulkan", "--backend: this build has no Vulkan backend; use cpu"},
        {"head.kera --backend gpu", "--backend: expected cpu, vulkan or auto but found gpu"},
        {"head.kera --precision double", "--precision: the strand solver computes in float only"},
        {"head.kera --precision half", "--precision: expected float or double but found half"},
        {"head.kera --soften", "--soften: belongs to the cosserat solver"},
        {"head.kera --convergence --json", "--convergence: "},
        {"head.kera --final", "--final: adds to the figures; write --stats FILE or --json too"},
        {"head.kera --json --stats -", "--stats: writes to stdout as --json does"},
        {"head.kera --every 2", "--every"},
        {"head.kera --frames 1 --stats no/such/folder/s.json", "no/such/folder/s.json"},
        {"head.kera --frames 1 --cache no/such/folder/r.kcache", "no/such/folder/r.kcache"},
    };
    for (const Case& c : cases) {
        INFO(c.arguments);
        const Outcome outcome = folder.run(c.arguments);
        CHECK(outcome.code == 2);
        CHECK(outcome.out.empty());
        INFO(outcome.err);
        CHECK(outcome.err.find("keratin-run: ") == 0);
        CHECK(outcome.err.find(c.message) != std::string::npos);
        CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    }
}

TEST_CASE("bad input exits with 2, names file and place, and leaves the old output alone") {
    const Folder folder;
    const std::string asset = content(folder.file("head.kera"));
    folder.write("short.kera", asset.substr(0, asset.size() / 2));
    std::string flipped = asset;
    flipped[flipped.size() / 2] ^= 16;
    folder.write("flipped.kera", flipped);
    folder.write("poses.json", R"({"bones": {"head": [{"time": 0}]}})");
    folder.write("other.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 1 3 4\n");
    struct Case {
        std::string scene, message;
    };
    const Case cases[] = {
        {R"({ "assets": [{ "file": "short.kera" }] })", "short.kera: the file is damaged"},
        {R"({ "assets": [{ "file": "flipped.kera" }] })", "flipped.kera: the file is damaged"},
        {R"({ "assets": [{ "file": "gone.kera" }] })", "gone.kera: "},
        {R"({ "assets": [{ "file": "poses.json" }] })", "poses.json: not a keratin asset"},
        {R"({ "assets": [{ "fil": "head.kera" }] })",
         "s.json:1:16: assets[0]: unknown field `fil`; did you mean `file`?"},
        {R"({ "assets": [{ "file": 3 }] })",
         "s.json:1:24: assets[0].file: expected a string but found the number 3"},
        {R"({ "assets": [{ "file": "head.kera" }], "gravity": [0, nan, 0] })",
         "s.json:1:55: expected a value but found `nan`"},
        {R"({ "assets": [{ "file": "head.kera", "bones": "poses.json" }] })",
         "head.kera: the pose file moves the bone `head`, which the asset has not; it has no "
         "bones"},
        {R"({ "assets": [{ "file": "head.kera", "mesh_frames": [{ "time": 0, "file": "other.obj" }] }] })",
         "other.obj: its 2 triangles are not those of the mesh"},
        {R"({ "assets": [{ "file": "head.kera" }], "colliders": [{ "mesh": { "file": "m.obj" } }] })",
         "s.json: colliders[0]: the strand solver does not take a mesh"},
        {R"({ "strands": [{ "points": [[0,0,0],[1,0,0]] }] })",
         "s.json: strands: the strand solver runs baked assets"},
        {R"({ "assets": [{ "file": "head.kera" }], "step": 0.5, "frame": 1 })", "s.json: "},
        {R"({ "assets": [{ "file": "head.kera" }], "settings": { "iterations": 100 } })",
         "iterations"},
    };
    for (const Case& c : cases) {
        INFO(c.scene);
        folder.write("s.json", c.scene);
        folder.write("stats.json", "old");
        const Outcome outcome = folder.run("s.json --frames 2 --stats stats.json --cache r.kcache");
        CHECK(outcome.code == 2);
        CHECK(outcome.out.empty());
        INFO(outcome.err);
        CHECK(outcome.err.find(c.message) != std::string::npos);
        CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
        CHECK(content(folder.file("stats.json")) == "old");
        CHECK_FALSE(fs::exists(folder.file("r.kcache")));
    }
    // Neither are there temporary files: 6 inputs, the scene, the old figures, out and err.
    CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 9);
}

#ifdef KERATIN_WITH_ROD
namespace {

// Two strands that lie across each other above a ball; the first is moved at its root.
const char* const kRods = R"({ "solver": "rod", "frame": 0.01, "step": 0.002, "duration": 0.06,
    "strands": [
        { "points": [[0,0,0],[0.01,0,0],[0.02,0,0],[0.03,0,0],[0.04,0,0]], "radius": 1e-4,
          "motion": [{ "time": 0 }, { "time": 0.06, "translation": [0, 0.01, 0], "rotation": [0, 0, 0.1, 1] }] },
        { "points": [[0.02,0.0005,-0.02],[0.02,0.0005,-0.01],[0.02,0.0005,0.005],[0.02,0.0005,0.015]],
          "radius": 1e-4, "root": "free" }],
    "colliders": [{ "sphere": { "center": [0.02, -0.03, 0], "radius": 0.025 } }] })";

}  // namespace

TEST_CASE("the rod solver runs explicit strands, and its figures follow the schema") {
    const Folder folder;
    folder.write("rods.json", kRods);
    const json stats = folder.stats("rods.json --threads 1 --final --convergence --explain");
    CHECK(test::schema_misfit(schema(), stats) == "");
    CHECK(stats["solver"] == "rod");
    CHECK(stats["steps"] == 30);
    CHECK(stats["frames"] == 6);
    CHECK(stats["strands"] == 2);
    CHECK(stats["points"] == 9);
    CHECK(stats["degrees_of_freedom"] == 4 * 5 - 1 - 3 + 4 * 4 - 1);
    for (const char* part : {"total", "prepare", "dynamics", "collision_detection",
                             "contact_bookkeeping", "impulse_solve"})
        CHECK(stats["seconds"][part].is_number());
    CHECK(stats["max_stretch"].get<double>() < 1e-3);
    CHECK(stats["max_penetration"].get<double>() < 1e-4);
    CHECK(stats["contacts_max"].get<int>() > 0);
    CHECK(stats["coulomb_residual"]["velocity_scale"].get<double>() == Approx(0.002 * 9.81));
    CHECK(stats["convergence"].size() > 0);
    CHECK(stats["energy"][3]["elastic"].get<double>() > 0);
    // The root is where the keyframe puts it.
    CHECK(stats["final"][0][0][1].get<double>() == Approx(0.01).epsilon(1e-12));
}

TEST_CASE("a free rod falls as a stone does, in implicit steps") {
    const Folder folder;
    folder.write("fall.json", R"({ "solver": "rod", "frame": 0.01, "duration": 0.1,
        "strands": [{ "points": [[0,0,0],[0.01,0,0],[0.02,0,0]], "root": "free" }] })");
    const json stats = folder.stats("fall.json --threads 1 --final");
    // n implicit Euler steps of h fall g h^2 n (n + 1) / 2.
    const double fallen = 9.81 * 0.01 * 0.01 * 10 * 11 / 2;
    for (const json& point : stats["final"][0])
        CHECK(point[1].get<double>() == Approx(-fallen).epsilon(1e-9));
    for (const json& velocity : stats["final_velocity"][0])
        CHECK(velocity[1].get<double>() == Approx(-0.981).epsilon(1e-9));
    // Potential energy became kinetic energy and, by the steps, a little was lost.
    const json &first = stats["energy"].front(), &last = stats["energy"].back();
    const double given = first["potential"].get<double>() - last["potential"].get<double>();
    CHECK(last["kinetic"].get<double>() == Approx(given * 10 / 11).epsilon(1e-6));
}

TEST_CASE("rods that can meet take steps of a millisecond unless the scene says another") {
    const Folder folder;
    const auto steps = [&](const std::string& fields, const std::string& options) {
        folder.write("meet.json",
                     R"({ "solver": "rod", "frame": 0.01, "duration": 0.02, )" + fields + R"(
            "strands": [{ "points": [[0,0,0],[0.01,0,0]] },
                        { "points": [[0,1,0],[0.01,1,0]] }] })");
        return folder.stats("meet.json " + options)["steps"].get<int>();
    };
    CHECK(steps("", "") == 20);
    CHECK(steps(R"("settings": { "contact": "none" },)", "") == 2);
    CHECK(steps(R"("step": 0.005,)", "") == 4);
    CHECK(steps("", "--step 0.01") == 2);
}

TEST_CASE("a strand whose motion begins turned begins without stress, rest points or none") {
    const Folder folder;
    for (const std::string rest : {"", R"("rest_points": [[0,0,0],[0.01,0,0],[0.02,0.002,0]],)"}) {
        folder.write("rod.json", R"({ "solver": "rod", "frame": 0.01, "duration": 0.05,
            "settings": { "contact": "none" }, "gravity": [0, 0, 0],
            "strands": [{ "points": [[0,0,0],[0.01,0,0],[0.02,0.002,0]], )" +
                                     rest + R"(
                          "motion": [{ "time": 0, "rotation": [0, 0, 0.6, 0.8] }] }] })");
        INFO(rest);
        const json stats = folder.stats("rod.json --threads 1");
        CHECK(stats["energy"][0]["elastic"].get<double>() < 1e-20);
        CHECK(stats["max_tip_lag"].get<double>() < 1e-12);
    }
}

TEST_CASE("how deep rods are in a collider counts from their surface, also in a mesh") {
    const Folder folder;
    // A cube of 2 m below y = 0, faces as quads; a rod of radius 1 cm lies 2 mm in it and stays.
    folder.write("cube.obj",
                 "v -1 -2 -1\nv 1 -2 -1\nv 1 0 -1\nv -1 0 -1\nv -1 -2 1\nv 1 -2 1\nv 1 0 1\nv -1 0 "
                 "1\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n");
    for (const std::string collider :
         {R"({ "mesh": { "file": "cube.obj" } })",
          R"({ "box": { "center": [0, -1, 0], "half_size": [1, 1, 1] } })",
          R"({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } })"}) {
        folder.write("rod.json", R"({ "solver": "rod", "frame": 0.001, "duration": 0.001,
            "settings": { "contact": "none" }, "gravity": [0, 0, 0],
            "strands": [{ "points": [[-0.2,0.008,0],[0,0.008,0],[0.2,0.008,0]], "radius": 0.01,
                          "root": "free" }],
            "colliders": [)" + collider +
                                     "] }");
        INFO(collider);
        const json stats = folder.stats("rod.json --threads 1");
        CHECK(stats["penetration"]["colliders"].get<double>() == Approx(0.002).epsilon(1e-6));
    }
}

TEST_CASE("how deep rods are in each other is measured whether or not contact is on") {
    const Folder folder;
    for (const std::string contact : {"none", "gauss_seidel"}) {
        // Two crossed rods of radius 1 mm, 2.5 mm apart; the upper one falls.
        folder.write("rods.json",
                     R"({ "solver": "rod", "frame": 0.01, "step": 0.001, "duration": 0.05,
            "settings": { "contact": ")" +
                         contact + R"(" },
            "strands": [{ "points": [[-0.02,0,0],[0.001,0,0],[0.02,0,0]], "radius": 0.001,
                          "root": "clamped", "tip": "clamped" },
                        { "points": [[0,0.0025,-0.02],[0,0.0025,0.001],[0,0.0025,0.02]],
                          "radius": 0.001, "root": "free" }] })");
        INFO(contact);
        const json stats = folder.stats("rods.json --threads 1 --convergence");
        const double depth = stats["penetration"]["strands"].get<double>();
        CHECK(stats["max_penetration"].get<double>() == depth);
        if (contact == "none") {
            CHECK(depth > 1e-4);
            continue;
        }
        CHECK(depth <= 2e-5);
        CHECK(stats["contacts_max"].get<int>() >= 1);
        REQUIRE(stats["convergence"].size() > 1);
        CHECK(stats["convergence"].back()["f_fb"].get<double>() < 1e-6);
    }
}

TEST_CASE("rods end in the same bits on two threads, and when saved and resumed") {
    const Folder folder;
    folder.write("rods.json", kRods);
    const std::string whole = folder.stats("rods.json --threads 1")["hash"];
    CHECK(folder.stats("rods.json --threads 2")["hash"] == whole);
    REQUIRE(folder.run("rods.json --threads 1 --frames 4 --save half.state").code == 0);
    CHECK(folder.stats("rods.json --threads 1 --resume half.state")["hash"] == whole);
}

TEST_CASE("what the rod solver does not do is refused with what to write instead") {
    const Folder folder;
    struct Case {
        std::string scene, message;
    };
    const Case cases[] = {
        {R"({ "solver": "rod", "assets": [{ "file": "gone.kera" }] })", "gone.kera: "},
        {R"({ "solver": "rod", "wind": { "gust": 0.5 }, "strands": [{ "points": [[0,0,0],[1,0,0]] }] })",
         "s.json: wind: the rod solver knows steady wind only"},
        {R"({ "solver": "rod", "strands": [{ "points": [[0,0,0],[1,0,0]] }],
              "colliders": [{ "distance_grid": { "file": "g" } }] })",
         "s.json: colliders[0]: the rod solver does not take a distance_grid"},
        {R"({ "solver": "rod", "strands": [{ "points": [[0,0,0],[1,0,0]] }],
              "colliders": [{ "mesh": { "file": "gone.obj" } }] })",
         "gone.obj: "},
    };
    for (const Case& c : cases) {
        INFO(c.scene);
        folder.write("s.json", c.scene);
        const Outcome outcome = folder.run("s.json --frames 2");
        CHECK(outcome.code == 2);
        INFO(outcome.err);
        CHECK(outcome.err.find(c.message) != std::string::npos);
    }
    CHECK(folder.run("head.kera --solver rod --precision float")
              .err.find("the rod solver computes in double only") != std::string::npos);
}
#endif

TEST_CASE("help and version exit with 0 and go to stdout") {
    const Folder folder;
    const Outcome help = folder.run("--help");
    CHECK(help.code == 0);
    CHECK(help.out.find("--resume FILE") != std::string::npos);
    const Outcome version = folder.run("--version");
    CHECK(version.code == 0);
    CHECK(version.out.find("asset revision " + std::to_string(kAssetMajor) + "." +
                           std::to_string(kAssetMinor) + ", cache revision 1.0") !=
          std::string::npos);
}
