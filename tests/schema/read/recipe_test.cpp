#include "schema/read/recipe.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <unistd.h>

using namespace keratin;

namespace {

std::string failure(const std::string& fields) {
    auto recipe = parse_recipe(
        "{ \"curves\": [{ \"file\": \"a.tfx\" }]" + (fields.empty() ? "" : ",\n" + fields) + " }",
        "groom.json", "");
    return recipe ? "accepted" : to_string(recipe.error());
}

}  // namespace

TEST_CASE("a recipe with nothing but curves takes every default and says so") {
    auto recipe =
        parse_recipe(R"({ "curves": [{ "file": "hair/a.tfx" }] })", "groom.json", "grooms");
    REQUIRE(recipe);
    REQUIRE(recipe->curves.size() == 1);
    CHECK(recipe->curves[0].file == "grooms/hair/a.tfx");
    CHECK(recipe->mesh.empty());
    CHECK(recipe->scale == 1);
    CHECK(recipe->attach == Attach::bone);
    CHECK(recipe->guide_fraction == 0.1);
    CHECK(recipe->guide_method == GuideMethod::kmeans);
    CHECK(recipe->strand == StrandParameters{});
    CHECK(recipe->material == Material{});
    CHECK(std::count(recipe->defaulted.begin(), recipe->defaulted.end(), "guides.fraction") == 1);
    CHECK(recipe->defaulted.size() == 27);
}

TEST_CASE("every field of a recipe is read") {
    const std::string text = R"({
      // a head of hair
      "curves": [
        { "file": "a.tfx", "mesh_nodes": ["Mesh_head", "Mesh_hair*"], "group": "top", "scale": 2,
          "root_end": "last", "bones": "a.tfxbone", "time": 1.5 },
        { "file": "/abs/b.obj", "root_end": "auto" } ],
      "mesh": { "file": "../head.obj", "keep": "all" },
      "scale": 0.0027, "up_axis": "z", "points_per_strand": 24,
      "guides": { "fraction": 0.25, "method": "random", "seed": 18446744073709551615,
                  "measure": true },
      "quantise": { "max_error": 2e-5 }, "handedness": "left",
      "attach": "triangle", "bones": "all.tfxbone",
      "material": { "radii": [3e-5, 5e-5], "density": 1320, "youngs_modulus": 3e9,
                    "poisson_ratio": 0.36, "viscosity": 7 },
      "strand": { "damping_ramp": [0, 0.5, 1], "friction": 0.2, "volume": 3, "iterations": 6,
                  "global_length": 0.2, "length_damping": 0.8, "wind_response": 2,
                  "sag_free": true },
      "groups": [ { "name": "top", "strand": { "damping": 0.7 }, "material": { "radius": 1e-4 } },
                  { "name": "tail", "strand": { "sag_free": false },
                    "rod": { "sag_free": false } } ],
      "rod": { "sag_free": true },
      "colliders": "fit", "push_out": true })";
    auto recipe = parse_recipe(text, "grooms/x/groom.json", "grooms/x");
    INFO((recipe ? "" : to_string(recipe.error())));
    REQUIRE(recipe);
    CHECK(recipe->text == text);
    CHECK(recipe->curves[0].mesh_nodes == std::vector<std::string>{"Mesh_head", "Mesh_hair*"});
    CHECK(recipe->curves[0].group == "top");
    CHECK(recipe->curves[0].scale == 2);
    CHECK(recipe->curves[0].root_end == RootEnd::last);
    CHECK(recipe->curves[0].time == 1.5);
    CHECK(recipe->curves[1].time == 0);
    CHECK(recipe->curves[0].bones == "grooms/x/a.tfxbone");
    CHECK(recipe->curves[1].file == "/abs/b.obj");
    CHECK(recipe->curves[1].root_end == RootEnd::automatic);
    CHECK(recipe->curves[1].bones == "grooms/x/all.tfxbone");
    CHECK(recipe->mesh == "grooms/head.obj");
    CHECK(recipe->mesh_keep == MeshKeep::all);
    CHECK(recipe->scale == 0.0027);
    CHECK(recipe->up_axis == UpAxis::z);
    CHECK(recipe->points_per_strand == 24u);
    CHECK(recipe->guide_fraction == 0.25);
    CHECK(recipe->guide_method == GuideMethod::random);
    CHECK(recipe->guide_measure == true);
    CHECK(recipe->quantise);
    CHECK(recipe->quantise_max_error == 2e-5);
    CHECK(recipe->handedness == Handedness::left);
    CHECK(recipe->guide_seed == 18446744073709551615ull);
    CHECK(recipe->attach == Attach::triangle);
    CHECK(recipe->material == Material{3e-5f, 5e-5f, 1320, 3e9f, 0.36f, 7});
    StrandParameters strand{{0, 0.5f, 1}, {0.2f}, {3}, 6, 0.2f, 0.8f, {2}};
    CHECK(recipe->strand == strand);
    CHECK(recipe->sag_free);
    REQUIRE(recipe->groups.size() == 2);
    strand.damping = {0.7f};
    CHECK(recipe->groups[0].strand == strand);
    CHECK(recipe->groups[0].material.radius == 1e-4f);
    CHECK(recipe->groups[0].material.density == 1320);
    CHECK(recipe->groups[0].sag_free);
    CHECK_FALSE(recipe->groups[1].sag_free);
    CHECK(recipe->rod_sag_free);
    CHECK(recipe->groups[0].rod_sag_free);
    CHECK_FALSE(recipe->groups[1].rod_sag_free);
    CHECK(recipe->colliders == ColliderMethod::fit);
    CHECK(recipe->push_out);
    CHECK(recipe->defaulted.empty());
}

TEST_CASE("a mistake in a recipe is named with its place and what would be right") {
    struct Case {
        std::string fields, message;
    };
    const Case cases[] = {
        {R"("scal": 1)", "groom.json:2:1: unknown field `scal`; did you mean `scale`?"},
        {R"("strand": { "dampng": 0.1 })",
         "groom.json:2:13: strand: unknown field `dampng`; did you mean `damping`?"},
        {R"("mesh": { "file": "m.obj", "xyzzy": 1 })",
         "groom.json:2:28: mesh: unknown field `xyzzy`; known here: file or keep"},
        {R"("scale": "3")",
         "groom.json:2:10: scale: expected a number but found the string \"3\"; write it without "
         "the quotation marks"},
        {R"("scale": "three")",
         "groom.json:2:10: scale: expected a number but found the string \"three\""},
        {R"("scale": true)", "groom.json:2:10: scale: expected a number but found true"},
        {R"("scale": [1])", "groom.json:2:10: scale: expected a number but found a list"},
        {R"("scale": null)",
         "groom.json:2:10: scale: expected a number but found null; leave the field out for its "
         "default"},
        {R"("scale": 1e400)", "groom.json:2:10: scale: 1e400 is too large for a number"},
        {R"("scale": 0)",
         "groom.json:2:10: scale: 0 is out of range; it must be above 0 and at most 1e+09"},
        {R"("scale": -2)",
         "groom.json:2:10: scale: -2 is out of range; it must be above 0 and at most 1e+09"},
        {R"("scale": nan)",
         "groom.json:2:10: expected a value but found `nan`; a number is written in digits, a word "
         "between \" and \""},
        {R"("points_per_strand": 1)",
         "groom.json:2:22: points_per_strand: 1 is out of range; it must be at least 2 and at most "
         "1024"},
        {R"("points_per_strand": 16.5)",
         "groom.json:2:22: points_per_strand: expected a whole number but found 16.5"},
        {R"("guides": { "seed": -1 })",
         "groom.json:2:21: guides.seed: -1 does not fit; it must be at least 0"},
        {R"("guides": { "seed": 99999999999999999999 })",
         "groom.json:2:21: guides.seed: 99999999999999999999 does not fit"},
        {R"("guides": 3)",
         "groom.json:2:11: guides: expected an object { ... } but found the "
         "number 3"},
        {R"("attach": "bon")",
         "groom.json:2:11: attach: expected bone, all or triangle but found `bon`; did you mean "
         "`bone`?"},
        {R"("attach": "bone all")",
         "groom.json:2:11: attach: expected bone, all or triangle but found `bone all`"},
        {R"("attach": 1)",
         "groom.json:2:11: attach: expected one of the words bone, all or triangle but found the "
         "number 1"},
        {R"("attach": "triangle")",
         "groom.json:2:11: attach: roots are to follow triangles but the recipe has no `mesh`; "
         "write \"mesh\": { \"file\": ... } or \"attach\": \"bone\""},
        {R"("attach": "all", "rod": { "sag_free": true })",
         "groom.json:2:39: rod.sag_free: every point follows its root (\"attach\": \"all\"), so "
         "that nothing can sag; leave it out"},
        {R"("attach": "all", "groups": [{ "name": "brow", "strand": { "sag_free": true } }])",
         "groom.json:2:71: groups[0].strand.sag_free: every point follows its root (\"attach\": "
         "\"all\"), so that nothing can sag; leave it out"},
        {R"("push_out": 1)",
         "groom.json:2:13: push_out: expected true or false but found the number 1"},
        {R"("colliders": "fit")",
         "groom.json:2:14: colliders: there is no `mesh` to fit colliders to; write \"none\""},
        {R"("points_per_strand": 8, "max_error": 1e-4)",
         "groom.json:2:38: max_error: `points_per_strand` is written too; write only one of them"},
        {R"("strand": { "damping": 0.1, "damping_ramp": [0, 1] })",
         "groom.json:2:45: strand.damping_ramp: `strand.damping` is written too; write only one of "
         "them"},
        {R"("strand": { "damping_ramp": [0, 1.5] })",
         "groom.json:2:33: strand.damping_ramp[1]: 1.5 is out of range; it must be at least 0 and "
         "at most 1"},
        {R"("strand": { "damping_ramp": 0.5 })",
         "groom.json:2:29: strand.damping_ramp: expected a list [ ... ] but found the number 0.5"},
        {R"("strand": { "damping_ramp": [0.5] })",
         "groom.json:2:29: strand.damping_ramp: has 1 entry; it takes at least 2 and at most 64"},
        {R"("material": { "radius": 1e-4, "radii": [1e-4, 2e-4] })",
         "groom.json:2:40: material.radii: `radius` is written too; write only one of them"},
        {R"("material": { "radii": [1e-4] })",
         "groom.json:2:24: material.radii: expected 2 numbers [a, b] but found 1"},
        {R"("groups": [{ "strand": {} }])",
         "groom.json:2:12: groups[0]: the field `name` is missing"},
        {R"("groups": [{ "name": "a" }, { "name": "a" }])",
         "groom.json:2:39: groups[1].name: the group `a` is described twice"},
        {R"("mesh": { "file": "" })",
         "groom.json:2:19: mesh.file: is empty; leave the field out instead"},
        {R"("scale": 1,)", "groom.json:2:13: a comma before } is one too many"},
    };
    for (const Case& c : cases) {
        INFO(c.fields);
        CHECK(failure(c.fields) == c.message);
    }
}

TEST_CASE("a recipe without curves, and one that is no object, are refused") {
    const auto message = [](const std::string& text) {
        auto recipe = parse_recipe(text, "g.json", "");
        return recipe ? "accepted" : to_string(recipe.error());
    };
    CHECK(message("{}") == "g.json:1:1: the field `curves` is missing");
    CHECK(message("{\"curves\": []}") ==
          "g.json:1:12: curves: has 0 entries; it takes at least 1 and at most 65536");
    CHECK(message("[]") == "g.json:1:1: expected an object { ... } but found a list");
    CHECK(message("{\"curves\": [{\"file\": \"a\", \"mesh_nodes\": [\"*\"]}]}") ==
          "g.json:1:41: curves[0].mesh_nodes: names parts of a mesh but the recipe has no `mesh`");
}

TEST_CASE("a comment after a field is taken even with three strokes") {
    CHECK(failure("\"scale\": 2 /// metres a unit\n") == "accepted");
}

TEST_CASE("a recipe that is missing or a folder is an input-output error with its name") {
    auto missing = read_recipe("no/such/groom.json");
    REQUIRE_FALSE(missing);
    CHECK(missing.error().code == ErrorCode::io);
    CHECK(missing.error().where == "no/such/groom.json");
    CHECK(missing.error().message.find("No such file") != std::string::npos);
    CHECK_FALSE(read_recipe("."));
}

TEST_CASE("a recipe is read from its file with paths seen from its folder") {
    const auto folder = std::filesystem::temp_directory_path() /
                        ("keratin_recipe_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "g.json") << "\xef\xbb\xbf{ \"curves\": [{ \"file\": \"a.tfx\" }] }";
    auto recipe = read_recipe((folder / "g.json").string());
    REQUIRE(recipe);
    CHECK(recipe->curves[0].file == (folder / "a.tfx").string());
    std::filesystem::remove_all(folder);
}
