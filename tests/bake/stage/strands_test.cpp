#include "bake/stage/bones.h"
#include "bake/stage/degenerate.h"
#include "bake/stage/evaluate.h"
#include "bake/stage/inside.h"
#include "bake/stage/place.h"
#include "bake/stage/resample.h"
#include "bake/stage/root_end.h"
#include "bake/stage/roots.h"
#include "bake/stage/size.h"
#include "tests/bake/stage/shapes.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <limits>
#include <numbers>

using namespace keratin;
using test::groom_of;
using test::recipe_of;

namespace {

bool has(const Findings& findings, Rule rule) {
    return std::any_of(findings.begin(), findings.end(),
                       [&](const Finding& f) { return f.rule == rule; });
}

const Finding& the(const Findings& findings, Rule rule) {
    for (const Finding& f : findings) {
        if (f.rule == rule) return f;
    }
    FAIL("no finding " << describe(rule).code);
    throw;
}

std::vector<Vec3> helix(std::size_t points) {
    std::vector<Vec3> out;
    for (std::size_t p = 0; p < points; ++p) {
        const double t = 6 * double(p) / double(points - 1);
        out.push_back({0.01 * std::cos(t), 0.02 * t, 0.01 * std::sin(t)});
    }
    return out;
}

RawGroom raw_of(const std::vector<std::vector<Vec3>>& strands) {
    RawGroom raw;
    raw.file = "hair.tfx";
    for (const auto& points : strands) {
        RawCurve curve;
        curve.points = points;
        curve.index = raw.curves.size();
        raw.curves.push_back(curve);
    }
    return raw;
}

}  // namespace

TEST_CASE("up axes are turned to y without mirroring") {
    for (UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z}) {
        const Vec3 a = to_y_up({1, 0, 0}, up, Handedness::right), b = to_y_up({0, 1, 0}, up, Handedness::right);
        const Vec3 c = to_y_up({0, 0, 1}, up, Handedness::right);
        CHECK(a.cross(b).dot(c) == 1);
    }
    CHECK(to_y_up({0, 0, 1}, UpAxis::z, Handedness::right) == Vec3(0, 1, 0));
    CHECK(to_y_up({1, 0, 0}, UpAxis::x, Handedness::right) == Vec3(0, 1, 0));
}

TEST_CASE("left-handed files are mirrored, and their triangles still face out") {
    for (UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z}) {
        const Vec3 a = to_y_up({1, 0, 0}, up, Handedness::left);
        const Vec3 b = to_y_up({0, 1, 0}, up, Handedness::left);
        const Vec3 c = to_y_up({0, 0, 1}, up, Handedness::left);
        CHECK(a.cross(b).dot(c) == -1);
        const Vec3 upward = up == UpAxis::x ? a : up == UpAxis::y ? b : c;
        CHECK(upward == Vec3(0, 1, 0));
        // Left-handed programs wind front faces clockwise, which gives the same numbers.
        Recipe recipe = recipe_of();
        recipe.up_axis = up;
        recipe.handedness = Handedness::left;
        RawMesh mesh = test::sphere_mesh({0, 0, 0}, 1, 8);
        REQUIRE(place_mesh(recipe, mesh));
        double volume = 0;
        for (const auto& [i, j, k] : mesh.triangle)
            volume += mesh.position[i].cross(mesh.position[j]).dot(mesh.position[k]) / 6;
        CHECK(volume > 3);
    }
}

TEST_CASE("scales multiply, and a file's own unit counts when the recipe gives none") {
    Recipe recipe = recipe_of();
    recipe.scale = 0.01;
    recipe.curves[0].scale = 2;
    RawGroom raw = raw_of({{{0, 0, 0}, {0, 1, 0}}});
    raw.radius = {1};
    CHECK(metres_per_unit(raw, recipe, 0) == 0.02);
    raw.metres_per_unit = 0.001;
    CHECK(metres_per_unit(raw, recipe, 0) == 0.02);
    recipe.defaulted = {"scale"};
    recipe.scale = 1;
    CHECK(metres_per_unit(raw, recipe, 0) == 0.002);
    std::vector<RawGroom> grooms{raw};
    Findings findings;
    REQUIRE(place_curves(recipe, grooms, findings));
    CHECK(grooms[0].curves[0].points[1] == Vec3(0, 0.002, 0));
    CHECK(grooms[0].radius[0] == 0.002);
    CHECK(has(findings, Rule::file_unit));
}

TEST_CASE("a coordinate that is not finite is refused with file, strand and point") {
    Recipe recipe = recipe_of();
    std::vector<RawGroom> grooms{raw_of({{{0, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 1, 0}}})};
    grooms[0].curves[1].points[1].y() = std::numeric_limits<double>::quiet_NaN();
    Findings findings;
    const auto placed = place_curves(recipe, grooms, findings);
    REQUIRE_FALSE(placed);
    CHECK(placed.error().code == ErrorCode::input);
    CHECK(placed.error().where == "hair.tfx: strand 1, point 1");
}

TEST_CASE("resampling puts points at equal arc length and keeps the ends exactly") {
    const auto fine = helix(2000);
    std::vector<Vec3> coarse(33);
    resample_polyline(fine, coarse);
    CHECK(coarse.front() == fine.front());
    CHECK(coarse.back() == fine.back());
    // A helix has equal chords between equal arcs.
    const double chord = (coarse[1] - coarse[0]).norm();
    for (std::size_t p = 1; p < coarse.size(); ++p) {
        CHECK((coarse[p] - coarse[p - 1]).norm() == Approx(chord).epsilon(1e-5));
    }
}

TEST_CASE("points that already stand evenly are left as they are") {
    Recipe recipe = recipe_of();
    recipe.points_per_strand = 5;
    std::vector<Vec3> line;
    for (int p = 0; p < 5; ++p) line.push_back({0.1, 0.07 * p, 1.0 / 3});
    Findings findings;
    const Groom out = resample(groom_of({line}), recipe, findings);
    for (std::size_t p = 0; p < 5; ++p) CHECK(out.position[p] == line[p]);
}

TEST_CASE("max_error gives each strand the fewest points that stay within it") {
    Recipe recipe = recipe_of();
    recipe.max_error = 2e-4;
    const std::vector<Vec3> straight{{0, 0, 0}, {0, 0.05, 0}, {0, 0.1, 0}};
    const Groom in = groom_of({helix(400), straight});
    Findings findings;
    const Groom out = resample(in, recipe, findings);
    CHECK(out.point_count(1) == 3);
    const std::size_t n = out.point_count(0);
    CHECK(resampling_error(in.points(0), out.points(0)) <= 2e-4);
    std::vector<Vec3> fewer(n - 1);
    resample_polyline(in.points(0), fewer);
    CHECK(resampling_error(in.points(0), fewer) > 2e-4);
    CHECK(findings.empty());
    recipe.max_error = 1e-15;
    const Groom most = resample(groom_of({helix(5000)}), recipe, findings);
    CHECK(most.point_count(0) == kBakeMaxPoints);
    CHECK(has(findings, Rule::error_bound));
}

TEST_CASE("degenerate strands are left out, counted and named; strict refuses them") {
    const std::vector<Vec3> good{{0, 0, 0}, {0, 0.1, 0}};
    const std::vector<Vec3> point{{1, 1, 1}, {1, 1, 1}};
    const std::vector<Vec3> tiny{{1, 1, 1}, {1, 1 + 5e-5, 1}};
    const Groom groom = groom_of({good, point, good, tiny, good});
    Findings findings;
    const auto kept = drop_degenerate(groom, recipe_of(), Strictness::lenient, findings);
    REQUIRE(kept);
    CHECK(kept->strand_count() == 3);
    CHECK(kept->curve == std::vector<std::uint32_t>{0, 2, 4});
    CHECK(kept->id == std::vector<std::uint32_t>{0, 2, 4});
    CHECK(the(findings, Rule::degenerate_strand).strands ==
          std::vector<StrandRange>{{1, 1}, {3, 3}});
    const auto refused = drop_degenerate(groom, recipe_of(), Strictness::strict, findings);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == "hair.tfx: strands 1, 3");
    CHECK_FALSE(drop_degenerate(groom_of({point}), recipe_of(), Strictness::lenient, findings));
}

TEST_CASE("a whole file is turned round by the majority, and tips on the skin do not turn theirs") {
    const RawMesh mesh = test::plane_mesh(1, 8);
    const MeshTree tree(mesh, triangles_of_parts(mesh, {}));
    const std::vector<const MeshTree*> trees{&tree};
    std::vector<std::vector<Vec3>> strands;
    for (int s = 0; s < 20; ++s) {
        const double x = 0.05 * s - 0.5;
        // Every third lies down to the skin again: its ends are equally near.
        if (s % 3 == 0) {
            strands.push_back({{x + 0.1, 0, 0}, {x + 0.05, 0.05, 0}, {x, 0.001, 0}});
        } else {
            strands.push_back({{x, 0.1, 0}, {x, 0.05, 0}, {x, 0.002, 0}});
        }
    }
    Groom groom = groom_of(strands);
    Findings findings;
    const auto ends = orient_strands(recipe_of(), trees, groom, findings);
    CHECK(ends[0].end == "last");
    CHECK(ends[0].from == "mesh");
    CHECK(ends[0].reversed == 20);
    CHECK(groom.points(1).front() == strands[1].back());
    CHECK(groom.points(0).front() == strands[0].back());
    CHECK(has(findings, Rule::root_end));

    Recipe told = recipe_of();
    told.curves[0].root_end = RootEnd::first;
    Groom same = groom_of(strands);
    CHECK(orient_strands(told, trees, same, findings)[0].reversed == 0);
    const std::vector<const MeshTree*> none{nullptr};
    CHECK(orient_strands(recipe_of(), none, same, findings)[0].from == "default");
}

TEST_CASE("a file that runs both ways is turned strand by strand") {
    const RawMesh mesh = test::plane_mesh(1, 8);
    const MeshTree tree(mesh, triangles_of_parts(mesh, {}));
    const std::vector<const MeshTree*> trees{&tree};
    std::vector<std::vector<Vec3>> strands;
    for (int s = 0; s < 40; ++s) {
        const double x = 0.02 * s - 0.5;
        std::vector<Vec3> strand{{x, 0, 0}, {x, 0.1, 0}};
        if (s % 2) std::reverse(strand.begin(), strand.end());
        strands.push_back(strand);
    }
    Groom groom = groom_of(strands);
    Findings findings;
    const auto ends = orient_strands(recipe_of(), trees, groom, findings);
    CHECK(ends[0].end == "mixed");
    CHECK(ends[0].reversed == 20);
    CHECK(strand_total(the(findings, Rule::root_end_mixed).strands) == 20);
    for (std::size_t s = 0; s < groom.strand_count(); ++s) CHECK(groom.points(s)[0].y() == 0);
}

TEST_CASE("roots are bound to the parts their file grows on, with texture coordinates") {
    RawMesh mesh = test::plane_mesh(1, 2);
    const RawMesh far = test::plane_mesh(1, 2);
    const auto shift = static_cast<std::uint32_t>(mesh.position.size());
    const auto first = static_cast<std::uint32_t>(mesh.triangle.size());
    for (const Vec3& p : far.position) mesh.position.push_back(p - Vec3(0, 0.2, 0));
    mesh.uv.insert(mesh.uv.end(), far.uv.begin(), far.uv.end());
    for (auto t : far.triangle) {
        for (std::uint32_t& v : t) v += shift;
        mesh.triangle.push_back(t);
    }
    mesh.parts[0].name = "upper";
    mesh.parts.push_back({"lower", first, first});
    Recipe recipe = recipe_of({"a.tfx", "b.tfx"});
    recipe.curves[1].mesh_nodes = {"low*"};
    Findings findings;
    const auto surfaces = find_growth_surfaces(recipe, &mesh, findings);
    REQUIRE(surfaces);
    Groom groom = groom_of({{{0.3, 0, 0.5}, {0.3, 1, 0.5}}, {{0.3, 0, 0.5}, {0.3, 1, 0.5}}});
    groom.source = {0, 1};
    const Roots roots = bind_roots(groom, *surfaces, recipe, findings);
    CHECK(roots.distance[0] == 0);
    CHECK(roots.distance[1] == Approx(0.2));
    CHECK(roots.triangle[0] < first);
    CHECK(roots.triangle[1] == roots.triangle[0] + first);
    CHECK(roots.uv[0].x() == Approx(0.65));
    CHECK(roots.uv[0].y() == Approx(0.75));
    CHECK(roots.normal[0] == Vec3(0, 1, 0));

    recipe.curves[1].mesh_nodes = {"hat"};
    const auto unknown = find_growth_surfaces(recipe, &mesh, findings);
    REQUIRE_FALSE(unknown);
    CHECK(unknown.error().where == "groom.json: curves[1].mesh_nodes");
    CHECK(unknown.error().message.find("upper, lower") != std::string::npos);
    CHECK_FALSE(find_growth_surfaces(recipe, nullptr, findings));
}

TEST_CASE("points inside the mesh are counted, and pushed out on request") {
    const RawMesh mesh = test::sphere_mesh({0, 0, 0}, 0.1, 40);
    Recipe recipe = recipe_of();
    Findings findings;
    const auto surfaces = find_growth_surfaces(recipe, &mesh, findings);
    REQUIRE(surfaces);
    const std::vector<Vec3> through{{0, 0.1, 0}, {0.02, 0.08, 0}, {0, 0.16, 0}};
    const std::vector<Vec3> clear{{0, 0.1, 0}, {0, 0.12, 0}, {0, 0.14, 0}};
    Groom groom = groom_of({through, clear});
    const auto found = find_inside(*surfaces, recipe, groom, findings);
    CHECK(found.strands == 1);
    CHECK(found.points == 1);
    CHECK(found.deepest == Approx(0.1 - std::sqrt(0.0068)).margin(5e-4));
    CHECK(found.pushed == 0);
    CHECK(groom.points(0)[1] == through[1]);
    CHECK(the(findings, Rule::starts_inside).strands == std::vector<StrandRange>{{0, 0}});

    recipe.push_out = true;
    CHECK(find_inside(*surfaces, recipe, groom, findings).pushed >= 1);
    const MeshTree& tree = surfaces->trees[0];
    for (const Vec3& p : groom.points(0).subspan(1)) CHECK(tree.signed_distance(p) > 0);
    CHECK((groom.points(0)[1] - through[1]).norm() < 0.02);
}

TEST_CASE("bones of several files are merged by name, weights normalised, heaviest first") {
    Recipe recipe = recipe_of({"a.tfx", "b.tfx"});
    recipe.curves[0].bones = "a.tfxbone";
    recipe.curves[1].bones = "b.tfxbone";
    RawSkin a, b;
    a.bones = {"neck", "head"};
    a.bone = {{0, 1, 0, 0}};
    a.weight = {{0.2, 0.6, 0, 0}};
    b.bones = {"head", "tail"};
    b.bone = {{1, 0, 0, 0}};
    b.weight = {{0.5, 0.5, 0, 0}};
    Groom groom = groom_of({{{0, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 1, 0}}});
    groom.source = {0, 1};
    groom.curve = {0, 0};
    const std::vector<std::optional<RawSkin>> skins{a, b};
    const std::vector<std::size_t> counts{1, 1};
    Findings findings;
    const auto carried = carry_roots(groom, skins, nullptr, {}, recipe, counts, findings);
    REQUIRE(carried);
    CHECK(carried->bones == std::vector<std::string>{"neck", "head", "tail"});
    CHECK(carried->bone[0][0] == 1);
    CHECK(carried->weight[0][0] == Approx(0.75));
    CHECK(carried->bone[0][1] == 0);
    CHECK(carried->bone[1][0] == 1);
    CHECK(carried->bone[1][1] == 2);
    CHECK(strand_total(the(findings, Rule::bone_weights).strands) == 1);

    const std::vector<std::size_t> more{2, 1};
    CHECK_FALSE(carry_roots(groom, skins, nullptr, {}, recipe, more, findings));
}

TEST_CASE("the mesh's skin is blended at the root where a file has no bones of its own") {
    RawMesh mesh = test::plane_mesh(1, 1);
    RawSkin skin;
    skin.bones = {"left", "right"};
    for (const Vec3& p : mesh.position) {
        skin.bone.push_back({0, 1, 0, 0});
        skin.weight.push_back({p.x() < 0 ? 1.0 : 0.0, p.x() < 0 ? 0.0 : 1.0, 0, 0});
    }
    mesh.skin = skin;
    const Recipe recipe = recipe_of();
    Findings findings;
    const auto surfaces = find_growth_surfaces(recipe, &mesh, findings);
    const Groom groom = groom_of({{{0.5, 0, 0}, {0.5, 1, 0}}});
    const Roots roots = bind_roots(groom, *surfaces, recipe, findings);
    const std::vector<std::optional<RawSkin>> none(1);
    const std::vector<std::size_t> counts{1};
    const auto carried = carry_roots(groom, none, &mesh, roots, recipe, counts, findings);
    REQUIRE(carried);
    CHECK(carried->bones[carried->bone[0][0]] == "right");
    CHECK(carried->weight[0][0] == Approx(0.75));
    CHECK(carried->weight[0][1] == Approx(0.25));
}

TEST_CASE("a NURBS curve is evaluated to points at equal arc length on the curve") {
    // A quarter circle as a rational quadratic.
    RawGroom raw = raw_of({{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}}});
    RawCurve& curve = raw.curves[0];
    curve.degree = 2;
    curve.weights = {1, std::sqrt(0.5), 1};
    curve.knots = {0, 0, 0, 1, 1, 1};
    curve.u_end = 1;
    Recipe recipe = recipe_of();
    recipe.points_per_strand = 10;
    Findings findings;
    const std::vector<RawGroom> grooms{raw};
    const auto groom = evaluate_curves(grooms, recipe, Strictness::lenient, findings);
    REQUIRE(groom);
    const Groom out = resample(*groom, recipe, findings);
    REQUIRE(out.point_count(0) == 10);
    for (std::size_t p = 0; p < 10; ++p) {
        const double angle = std::numbers::pi / 2 * double(p) / 9;
        CHECK((out.position[p] - Vec3(std::cos(angle), std::sin(angle), 0)).norm() < 1e-9);
    }
}

TEST_CASE("files are joined with counted ids, groups by name and channels filled") {
    RawGroom a = raw_of({{{0, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 2, 0}}});
    RawGroom b = raw_of({{{1, 0, 0}, {1, 1, 0}}});
    a.problems.push_back({2, 0, "knots decrease"});
    b.radius = {5e-5};
    b.root_uv = {{0.25, 0.5}};
    Recipe recipe = recipe_of({"a.tfx", "b.tfx"});
    recipe.curves[1].group = "tail";
    Findings findings;
    const std::vector<RawGroom> grooms{a, b};
    const auto groom = evaluate_curves(grooms, recipe, Strictness::lenient, findings);
    REQUIRE(groom);
    CHECK(groom->id == std::vector<std::uint32_t>{0, 1, 3});
    CHECK(groom->group_names == std::vector<std::string>{"default", "tail"});
    CHECK(groom->radius[0][0] == 0);
    CHECK(groom->radius[2][0] == 5e-5);
    CHECK(groom->has_root_uv == std::vector<std::uint8_t>{0, 0, 1});
    CHECK(has(findings, Rule::unusable_curve));
    CHECK_FALSE(evaluate_curves(grooms, recipe, Strictness::strict, findings));

    std::vector<RawGroom> authored{a, b};
    authored[0].id = {7, 9};
    authored[1].id = {8};
    CHECK(evaluate_curves(authored, recipe, Strictness::lenient, findings)->id ==
          std::vector<std::uint32_t>{7, 9, 8});
    authored[1].id = {9};
    CHECK(evaluate_curves(authored, recipe, Strictness::lenient, findings)->id ==
          std::vector<std::uint32_t>{0, 1, 3});
    CHECK(has(findings, Rule::ids_not_unique));
}

TEST_CASE("sizes that no hair has are noticed") {
    const Groom metres = groom_of({{{0, 0, 0}, {0, 0.2, 0}}});
    const Groom centimetres = groom_of({{{0, 0, 0}, {0, 20, 0}}});
    Findings findings;
    BakeReport report;
    measure_sizes(metres, nullptr, {}, report, findings);
    CHECK(findings.empty());
    CHECK(report.hair_size[1] == Approx(0.2));
    measure_sizes(centimetres, nullptr, {}, report, findings);
    CHECK(has(findings, Rule::size));
}
