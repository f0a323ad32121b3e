#include "tools/keratin-diff/compare.h"

#include "tests/tools/diff/full_asset.h"
#include "tools/keratin-diff/judge.h"
#include "tools/keratin-diff/report_text.h"

#include <catch2/catch.hpp>

#include <functional>
#include <map>
#include <random>

using namespace keratin;
using test::full_asset;
using test::FullAsset;
using test::OpenAsset;

namespace {

constexpr float kMillimetre = 1e-3f;
// Layout of full_asset().
constexpr std::uint32_t kPoints = 4;

struct Compared {
    diff::Report report;
    std::vector<std::string> names;  // what differs
    std::string text;
};

Compared compared(const FullAsset& a, const FullAsset& b) {
    const OpenAsset open_a(a), open_b(b);
    Compared result;
    result.report = diff::compare(open_a.view(), open_b.view());
    const auto findings = diff::judge(result.report, diff::Tolerances());
    for (const diff::Finding& finding : findings)
        if (finding.severity != diff::Severity::same) result.names.push_back(finding.name);
    result.text = diff::report_text(result.report, findings);
    return result;
}

const diff::FieldDifference& field(const Compared& result, std::string_view name) {
    for (const auto& difference : result.report.fields)
        if (difference.name == name) return difference;
    FAIL("no such field");
    return result.report.fields.front();
}

using Names = std::vector<std::string>;

// One value of a field changed a little, for fields that nothing else hangs on: of guide 0 at its
// root, or of the first item. False when the asset does not have the field.
bool change_first_value(FullAsset& asset, std::string_view wanted) {
    bool changed = false;
    std::size_t i = 0;
    const AssetInfo& info = asset.info;
    const auto change = [&]<class Element>(const FieldDescription& field,
                                           std::vector<Element>& values) {
        if (field.name != wanted || values.empty()) return;
        changed = true;
        if constexpr (std::is_same_v<Element, float>)
            values[0] += field.unit == "m" ? kMillimetre : 0.125f;
        else if (field.target != Domain::none)
            values[0] =
                (values[0] + 1) % static_cast<std::uint32_t>(domain_count(info, field.target));
        else
            ++values[0];
    };
#define X(name, element, domain, components, presence, target, unit, meaning) \
    change(kAssetFields[i++], asset.name);
    KERATIN_ASSET_FIELDS(X)
#undef X
    return changed;
}

// The smallest change of one field alone that the format allows, where it is more than a value.
const std::map<std::string, std::function<void(FullAsset&)>>& injections() {
    static const std::map<std::string, std::function<void(FullAsset&)>> all{
        {"tile_first_row",
         [](FullAsset& a) {
             lay_out_guides(a, {0, 1, 2, 3, 4}, kPoints + 1);
         }},
        {"guide_point_count",
         [](FullAsset& a) {
             a.guide_point_count[2] = kPoints - 1;
             a.guide_length[scalar_index(kPoints - 1, 2)] = 0;  // the format asks for it
         }},
        {"guide_strand", [](FullAsset& a) { a.guide_strand[2] = 5; }},
        {"guide_group", [](FullAsset& a) { a.guide_group.assign(a.guide_group.size(), 1); }},
        {"guide_position",
         [](FullAsset& a) { a.guide_position[vector_index(3, 3, 1, 4)] += kMillimetre; }},
        {"guide_length", [](FullAsset& a) { a.guide_length[scalar_index(2, 1)] *= 1.01f; }},
        {"guide_shape",
         [](FullAsset& a) { a.guide_shape[vector_index(2, 3, 0, 3)] += kMillimetre; }},
        {"guide_bone", [](FullAsset& a) { a.guide_bone[vector_index(0, 4, 1, 2)] = 2; }},
        {"guide_bone_weight",
         [](FullAsset& a) {
             a.guide_bone_weight[vector_index(0, 4, 0, 2)] = 0.5f;
             a.guide_bone_weight[vector_index(0, 4, 1, 2)] = 0.5f;
         }},
        {"guide_triangle", [](FullAsset& a) { a.guide_triangle[1] = 2; }},
        {"guide_barycentric",
         [](FullAsset& a) { a.guide_barycentric[vector_index(0, 2, 1, 3)] = 0.5f; }},
        {"strand_first_point", [](FullAsset& a) { a.strand_first_point[2] += 1; }},
        {"strand_position", [](FullAsset& a) { a.strand_position[3 * 9 + 2] += kMillimetre; }},
        {"strand_fraction", [](FullAsset& a) { a.strand_fraction[6] = 0.5f; }},
        {"strand_guide", [](FullAsset& a) { a.strand_guide[3 * 3] = 4; }},
        {"strand_weight",
         [](FullAsset& a) {
             a.strand_weight[3 * 3] = 0.75f;
             a.strand_weight[3 * 3 + 1] = 0;
         }},
        {"strand_id", [](FullAsset& a) { a.strand_id[3] = 99; }},
        {"strand_group", [](FullAsset& a) { a.strand_group[6] = 1; }},
        {"strand_bone", [](FullAsset& a) { a.strand_bone[4 * 2 + 1] = 2; }},
        {"strand_bone_weight",
         [](FullAsset& a) {
             a.strand_bone_weight[4 * 2] = 0.5f;
             a.strand_bone_weight[4 * 2 + 1] = 0.5f;
         }},
        {"strand_triangle", [](FullAsset& a) { a.strand_triangle[6] = 3; }},
        {"mesh_position", [](FullAsset& a) { a.mesh_position[4] += kMillimetre; }},
        {"mesh_vertex_source", [](FullAsset& a) { a.mesh_vertex_source[4] = 5; }},
        {"mesh_triangle", [](FullAsset& a) { a.mesh_triangle[8] = 3; }},
        {"mesh_triangle_source", [](FullAsset& a) { a.mesh_triangle_source[2] = 4; }},
        {"grid_brick", [](FullAsset& a) { a.grid_brick[1] = kNoBrick; }},
        {"grid_distance", [](FullAsset& a) { a.grid_distance[kBrickNodes + 7] += kMillimetre; }},
    };
    return all;
}

std::vector<std::uint32_t> strand_order(std::initializer_list<std::uint32_t> order) {
    return order;
}

}  // namespace

TEST_CASE("an asset does not differ from itself") {
    const Compared result = compared(full_asset(), full_asset());
    CHECK(result.names.empty());
    CHECK(result.report.same_bytes);
    CHECK(result.text == "the assets are equal, byte for byte\n");
}

TEST_CASE("an error in one field is named, and nothing else") {
    for (const FieldDescription& description : kAssetFields) {
        const std::string name(description.name);
        INFO(name);
        const auto injection = injections().find(name);
        FullAsset wrong = full_asset();
        if (injection != injections().end())
            injection->second(wrong);
        else
            REQUIRE(change_first_value(wrong, name));
        for (const Compared& result :
             {compared(full_asset(), wrong), compared(wrong, full_asset())}) {
            INFO(result.text);
            CHECK(result.names == Names{name});
            CHECK(field(result, name).worst);
        }
    }
}

TEST_CASE("a field that only one asset has is named, and what it stands for is compared") {
    FullAsset without = full_asset();
    without.guide_density.clear();
    CHECK(compared(full_asset(), without).names == Names{"guide_density"});
    CHECK(std::isinf(field(compared(full_asset(), without), "guide_density").value()));
    // An absent radius is the group's, absent sources are the same numbers.
    without = full_asset();
    without.strand_radius.clear();
    for (GroupInfo& group : without.info.groups) group.material.radius = 3e-5f;
    FullAsset with = full_asset();
    for (GroupInfo& group : with.info.groups) group.material.radius = 3e-5f;
    CHECK(compared(with, without).names.empty());
    with.strand_radius[4] = 5e-5f;
    CHECK(compared(with, without).names == Names{"strand_radius"});
}

TEST_CASE("an edited strand: only its points are named, with strand, point and both values") {
    FullAsset edited = full_asset();
    const std::size_t first = edited.strand_first_point[5];
    edited.strand_position[3 * (first + 2)] += kMillimetre;
    edited.strand_position[3 * (first + 3)] += 2 * kMillimetre;
    const Compared result = compared(full_asset(), edited);
    CHECK(result.names == Names{"strand_position"});
    const auto& difference = field(result, "strand_position");
    CHECK(difference.compared == 28);
    CHECK(difference.differing == 2);
    CHECK(difference.spread.max == Approx(2e-3).epsilon(1e-4));
    CHECK(difference.spread.p99 == Approx(2e-3).epsilon(1e-4));
    CHECK(difference.spread.rms == Approx(std::sqrt((1e-6 + 4e-6) / 28)).epsilon(1e-4));
    CHECK(difference.worst->item == "strand 5");
    CHECK(difference.worst->point == 3u);
    CHECK(difference.worst->a.at(0) == Approx(0.025));
    CHECK(difference.worst->b.at(0) == Approx(0.027));
    CHECK_FALSE(difference.shift);
    CHECK(result.text.find("strand 5 point 3: (0.025, 0.03, 0) -> (0.027, 0.03, 0)") !=
          std::string::npos);
}

TEST_CASE("strands in another order: only the order is named, with the fewest moves") {
    FullAsset reordered = full_asset();
    lay_out_strands(reordered, {0, 1, 6, 2, 3, 4, 5});
    const Compared result = compared(full_asset(), reordered);
    CHECK(result.names == Names{"strand_order"});
    CHECK(result.report.strands.reordered_count == 1);
    CHECK(result.report.strands.reordered_example->id == 6);
    lay_out_strands(reordered, {6, 5, 4, 3, 2, 1, 0});
    CHECK(compared(full_asset(), reordered).report.strands.matched == 7);
    CHECK(compared(full_asset(), reordered).names == Names{"strand_order"});
}

TEST_CASE("guides in other lanes and tiles: only their order is named") {
    FullAsset reordered = full_asset();
    lay_out_guides(reordered, {3, 1, 0, 4, 2}, kPoints);
    const Compared result = compared(full_asset(), reordered);
    INFO(result.text);
    CHECK(result.names == Names{"guide_order"});
    CHECK(result.report.guides.matched == 5);
}

TEST_CASE("a moved mesh: only the mesh is named, with its shift") {
    FullAsset moved = full_asset();
    for (std::size_t i = 0; i < moved.mesh_position.size(); i += 3) moved.mesh_position[i] += 0.5f;
    const Compared result = compared(full_asset(), moved);
    CHECK(result.names == Names{"mesh_position"});
    REQUIRE(field(result, "mesh_position").shift);
    CHECK(field(result, "mesh_position").shift->at(0) == Approx(0.5));
    CHECK(result.text.find("all by the same shift (0.5 m, 0 mm, 0 mm)") != std::string::npos);
}

TEST_CASE("a moved groom is matched by id and its shift found") {
    FullAsset moved = full_asset();
    for (std::size_t i = 0; i < moved.strand_position.size(); i += 3)
        moved.strand_position[i] += 0.2f;
    const Compared result = compared(full_asset(), moved);
    CHECK(result.names == Names{"strand_position"});
    REQUIRE(field(result, "strand_position").shift);
    CHECK(field(result, "strand_position").shift->at(0) == Approx(0.2));
}

TEST_CASE("a changed recipe: settings and recipe are named, no data") {
    FullAsset changed = full_asset();
    changed.info.groups[1].strand.damping = {0.1f, 0.2f};
    changed.info.groups[0].material.radius = 5e-5f;
    changed.info.recipe_hash = {7, 8};
    const Compared result = compared(full_asset(), changed);
    CHECK(result.names == Names{"settings", "recipe"});
    REQUIRE(result.report.settings.size() == 2);
    CHECK(result.report.settings[0].path == "groups[default].material.radius");
    CHECK(result.report.settings[1].path == "groups[fringe].strand.damping");
    CHECK(result.report.settings[1].a == "0.05");
    CHECK(result.report.settings[1].b == "(0.1, 0.2)");
}

TEST_CASE("each setting is named on its own") {
    const auto path = [](auto&& change) {
        FullAsset changed = full_asset();
        change(changed);
        const Compared result = compared(full_asset(), changed);
        REQUIRE(result.names == Names{"settings"});
        REQUIRE(result.report.settings.size() == 1);
        return result.report.settings[0].path;
    };
    using A = FullAsset&;
    CHECK(path([](A a) { a.info.attach = Attach::all; }) == "attach");
    CHECK(path([](A a) { a.info.groups[1].name = "tail"; }) == "groups[fringe].name");
    CHECK(path([](A a) { a.info.groups.push_back({"new", {}, {}}); }) == "groups[new]");
    CHECK(path([](A a) { a.info.groups[0].material.radius2 *= 2; }) ==
          "groups[default].material.radius2");
    CHECK(path([](A a) { a.info.groups[0].material.density *= 2; }) ==
          "groups[default].material.density");
    CHECK(path([](A a) { a.info.groups[0].material.youngs_modulus *= 2; }) ==
          "groups[default].material.youngs_modulus");
    CHECK(path([](A a) { a.info.groups[0].material.poisson_ratio = 0.25f; }) ==
          "groups[default].material.poisson_ratio");
    CHECK(path([](A a) { a.info.groups[0].material.viscosity = 1; }) ==
          "groups[default].material.viscosity");
    CHECK(path([](A a) { a.info.groups[0].strand.friction = {0.5f}; }) ==
          "groups[default].strand.friction");
    CHECK(path([](A a) { a.info.groups[0].strand.volume = {0.5f}; }) ==
          "groups[default].strand.volume");
    CHECK(path([](A a) { a.info.groups[0].strand.iterations = 9; }) ==
          "groups[default].strand.iterations");
    CHECK(path([](A a) { a.info.groups[0].strand.global_length = 1; }) ==
          "groups[default].strand.global_length");
    CHECK(path([](A a) { a.info.groups[0].strand.length_damping = 1; }) ==
          "groups[default].strand.length_damping");
    CHECK(path([](A a) { a.info.groups[0].strand.wind_response = {2}; }) ==
          "groups[default].strand.wind_response");
    CHECK(path([](A a) { a.info.bones[2] = "chin"; }) == "bones[jaw]");
    CHECK(path([](A a) { a.info.colliders[0].a[0] = 1; }) == "colliders[0].a");
    CHECK(path([](A a) { a.info.colliders[0].b[0] = 1; }) == "colliders[0].b");
    CHECK(path([](A a) { a.info.colliders[0].radius = 1; }) == "colliders[0].radius");
    CHECK(path([](A a) { a.info.colliders[0].bone = 1; }) == "colliders[0].bone");
    CHECK(path([](A a) { a.info.colliders.clear(); }) == "colliders[0]");
}

TEST_CASE("tool, inputs, mesh and bounds have names of their own") {
    const auto names = [](auto&& change) {
        FullAsset changed = full_asset();
        change(changed);
        return compared(full_asset(), changed).names;
    };
    using A = FullAsset&;
    CHECK(names([](A a) { a.info.tool_version = "newer"; }) == Names{"tool_version"});
    CHECK(names([](A a) { a.info.inputs[0].hash = {9, 9}; }) == Names{"inputs"});
    CHECK(names([](A a) { a.info.inputs[0].name = "other.tfx"; }) == Names{"inputs"});
    CHECK(names([](A a) { a.info.inputs.push_back({"mesh", "head.obj", {}}); }) == Names{"inputs"});
    CHECK(names([](A a) { a.info.mesh_vertex_count = 9; }) == Names{"mesh"});
    CHECK(names([](A a) { a.info.bounds_max[1] += 1; }) == Names{"bounds"});
    CHECK(names([](A a) {
              a.info.bounds_max[1] += 1;
              a.strand_position[4] += kMillimetre;
          }) == Names{"strand_position"});
}

TEST_CASE("removed and added strands are counted and named by id") {
    FullAsset fewer = full_asset();
    lay_out_strands(fewer, {0, 1, 2, 3, 4, 6});
    const Compared removed = compared(full_asset(), fewer);
    CHECK(removed.names == Names{"strands"});
    CHECK(removed.report.strands.removed == strand_order({5}));
    CHECK(removed.report.strands.added_count == 0);
    const Compared added = compared(fewer, full_asset());
    CHECK(added.names == Names{"strands"});
    CHECK(added.report.strands.added == strand_order({5}));
}

TEST_CASE("renumbered strands are matched by their shape") {
    FullAsset fewer = full_asset();
    lay_out_strands(fewer, {0, 1, 2, 3, 4, 6});
    fewer.strand_id[5] = 5;  // the last strand takes the id of the removed one
    const Compared result = compared(full_asset(), fewer);
    INFO(result.text);
    CHECK(result.names == Names{"strands", "strand_id"});
    CHECK(result.report.strands.removed == strand_order({5}));
    CHECK(field(result, "strand_id").worst->a.at(0) == 6);
}

TEST_CASE("strands with useless ids are matched by the nearest root and shape") {
    FullAsset a = full_asset(), b = full_asset();
    a.strand_id.assign(7, 0);
    b.strand_id.assign(7, 0);
    lay_out_strands(b, {6, 2, 4, 1, 3, 0, 5});
    std::mt19937 random(1);
    std::uniform_real_distribution<float> noise(-kMillimetre, kMillimetre);
    for (float& x : b.strand_position) x += noise(random);
    const Compared result = compared(a, b);
    INFO(result.text);
    CHECK(result.names == Names{"strand_order", "strand_position"});
    CHECK(result.report.strands.matched == 7);
    CHECK(field(result, "strand_position").spread.max < 2e-3);
}

TEST_CASE("a strand replaced by another far away was removed and added") {
    FullAsset a = full_asset(), b = full_asset();
    b.strand_id[6] = 77;
    for (std::uint32_t p = 0; p < kPoints; ++p)
        b.strand_position[3 * (b.strand_first_point[6] + p)] += 1;
    const Compared result = compared(a, b);
    CHECK(result.report.strands.removed == strand_order({6}));
    CHECK(result.report.strands.added == strand_order({77}));
    CHECK(result.names == Names{"strands"});
}

TEST_CASE("resampled strands are compared as curves") {
    FullAsset fine = full_asset();
    // Strand 6 gets a point in the middle of its first segment.
    const std::ptrdiff_t first = fine.strand_first_point[6];
    const auto x = fine.strand_position.begin() + 3 * first;
    const std::vector<float> middle{x[0], 0.5f * (x[1] + x[4]), x[2]};
    fine.strand_position.insert(x + 3, middle.begin(), middle.end());
    fine.strand_fraction.insert(fine.strand_fraction.begin() + first + 1, 0.1f);
    fine.strand_first_point[7] += 1;
    fine.info.point_count += 1;
    const Compared result = compared(full_asset(), fine);
    INFO(result.text);
    CHECK(result.names == Names{"strand_first_point"});
    CHECK(field(result, "strand_first_point").worst->item == "points of strand 6");
    CHECK(result.text.find("at most 0 mm apart") != std::string::npos);
    // 1 mm aside, where the longer curve also lags a little.
    fine.strand_position[3 * std::size_t(first + 1)] += kMillimetre;
    const std::string text = compared(full_asset(), fine).text;
    INFO(text);
    CHECK(text.find("at most 1.0") != std::string::npos);
}

TEST_CASE("a root on another triangle is named with both triangles and how far it moved") {
    FullAsset moved = full_asset();
    moved.strand_triangle[6] = 3;  // the same barycentrics on triangle (0, 2, 4)
    const Compared result = compared(full_asset(), moved);
    const auto& difference = field(result, "strand_triangle");
    REQUIRE(difference.moved);
    // (1 - u - v) A + u B + v C with u = 0.1, v = 0.2, by hand.
    const double dx = (-0.7 + 0.0 - 0.4) - (-0.7 + 0.1 + 0.0);
    const double dz = (-0.7 + 0.1 + 0.2) - (-0.7 - 0.1 + 0.2);
    CHECK(difference.moved->max == Approx(std::hypot(dx, dz)).epsilon(1e-5));
    CHECK(difference.worst->a.at(0) == 0);
    CHECK(difference.worst->b.at(0) == 3);
    CHECK(field(result, "strand_barycentric").not_compared == 1);
}

TEST_CASE("triangles of meshes with another topology are not compared by number") {
    FullAsset other = full_asset();
    other.info.mesh_topology_hash = {5, 5};
    other.strand_triangle[6] = 3;
    const Compared result = compared(full_asset(), other);
    INFO(result.text);
    CHECK(result.names == Names{"mesh"});
    CHECK(field(result, "strand_triangle").not_compared == 7);
}

TEST_CASE("a change of guides names the guides and what hangs on them") {
    FullAsset other = full_asset();
    // Strand 6 is carried by the guides 2, 0 and 1 instead of 4, 0 and 1.
    other.strand_guide[18] = 2;
    const Compared result = compared(full_asset(), other);
    CHECK(result.names == Names{"strand_guide"});
    CHECK(field(result, "strand_guide").worst->a == std::vector<double>{4, 0, 1});
    CHECK(field(result, "strand_guide").worst->b == std::vector<double>{2, 0, 1});
    // The same guides and weights in another order mean the same.
    FullAsset turned = full_asset();
    std::rotate(turned.strand_guide.begin() + 18, turned.strand_guide.begin() + 19,
                turned.strand_guide.end());
    std::rotate(turned.strand_weight.begin() + 18, turned.strand_weight.begin() + 19,
                turned.strand_weight.end());
    const Compared same = compared(full_asset(), turned);
    CHECK(same.names.empty());
    CHECK_FALSE(same.report.same_bytes);
}
