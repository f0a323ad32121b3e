// One strand with a width, a texture coordinate, a group and an id of its own, through every stage.
#include "bake/stage/bones.h"
#include "bake/stage/degenerate.h"
#include "bake/stage/evaluate.h"
#include "bake/stage/guides.h"
#include "bake/stage/inside.h"
#include "bake/stage/order.h"
#include "bake/stage/place.h"
#include "bake/stage/resample.h"
#include "bake/stage/rest.h"
#include "bake/stage/root_end.h"
#include "bake/stage/roots.h"
#include "bake/stage/weights.h"
#include "tests/bake/stage/shapes.h"

#include <catch2/catch.hpp>

using namespace keratin;

TEST_CASE("a tagged strand keeps its width, UV, group and id from file to asset") {
    // Millimetres, z up, tips first; strand 5 collapsed, strand 17 tagged.
    constexpr std::uint32_t kStrands = 40, kCollapsed = 5, kTagged = 17, kTaggedId = 9001;
    RawGroom raw;
    raw.file = "hair.abc";
    raw.group_names = {"default", "fringe"};
    for (std::uint32_t s = 0; s < kStrands; ++s) {
        RawCurve curve;
        const double x = 5.0 * (s % 8), y = 5.0 * (s / 8);
        for (int p = 5; p >= 0; --p)
            curve.points.push_back(s == kCollapsed ? Vec3(x, y, 0) : Vec3(x, y, 20.0 * p));
        curve.index = s;
        raw.curves.push_back(curve);
        raw.id.push_back(100 + s);
        raw.group.push_back(s % 2);
        raw.radius.push_back(0.05);
        raw.root_uv.push_back({0.01 * s, 0.5});
    }
    raw.id[kTagged] = kTaggedId;
    raw.group[kTagged] = 1;
    raw.radius[kTagged] = 0.125;
    raw.root_uv[kTagged] = {0.25, 0.75};

    Recipe recipe = test::recipe_of({"hair.abc"});
    recipe.scale = 0.001;
    recipe.up_axis = UpAxis::z;
    recipe.curves[0].root_end = RootEnd::last;
    recipe.points_per_strand = 9;
    GroupRecipe fringe{"fringe", recipe.material, recipe.strand};
    fringe.material.youngs_modulus = 5e9f;
    fringe.strand.damping = {0.1f, 0.9f};
    recipe.groups.push_back(fringe);

    RawMesh mesh = test::plane_mesh(1, 4);
    Findings findings;
    std::vector<RawGroom> raws{raw};
    REQUIRE(place_curves(recipe, raws, findings));
    const auto surfaces = find_growth_surfaces(recipe, &mesh, findings);
    REQUIRE(surfaces);
    const auto curves = evaluate_curves(raws, recipe, Strictness::lenient, findings);
    REQUIRE(curves);
    auto sound = drop_degenerate(*curves, recipe, Strictness::lenient, findings);
    REQUIRE(sound);
    orient_strands(recipe, surfaces->of_source, *sound, findings);
    Groom groom = resample(*sound, recipe, findings);
    const Roots roots = bind_roots(groom, *surfaces, recipe, findings);
    const std::vector<std::optional<RawSkin>> no_skins(1);
    const std::vector<std::size_t> counts{kStrands};
    const auto carriers = carry_roots(groom, no_skins, &mesh, roots, recipe, counts, findings);
    REQUIRE(carriers);
    const auto groups = group_settings(groom, recipe, findings);
    const auto features = strand_features(groom);
    const auto guides = choose_guides(groom, features, roots, nullptr, recipe, findings);
    REQUIRE(guides);
    const auto blends = blend_guides(groom, features, *guides, roots, recipe, findings);
    const AssetOrder order = order_asset(groom, *guides);
    AssetArrays arrays;
    store_strands(groom, roots, *carriers, order, blends, groups, arrays);

    REQUIRE(arrays.strand_id.size() == kStrands - 1);
    const auto found = std::find(arrays.strand_id.begin(), arrays.strand_id.end(), kTaggedId);
    REQUIRE(found != arrays.strand_id.end());
    const auto s = static_cast<std::size_t>(found - arrays.strand_id.begin());
    CHECK(arrays.strand_radius[s] == Approx(1.25e-4));
    CHECK(arrays.strand_uv[2 * s] == 0.25f);
    CHECK(arrays.strand_uv[2 * s + 1] == 0.75f);
    const GroupInfo& group = groups[arrays.strand_group[s]];
    CHECK(group.name == "fringe");
    CHECK(group.material.youngs_modulus == 5e9f);
    CHECK(group.strand.damping == Ramp{0.1f, 0.9f});
    // x right, z up and y back become x right, y up: (5, 10, 0) mm is (0.005, 0, -0.01) m.
    const float* root = &arrays.strand_position[3 * arrays.strand_first_point[s]];
    CHECK(root[0] == Approx(0.005));
    CHECK(root[1] == Approx(0).margin(1e-9));
    CHECK(root[2] == Approx(-0.01));
    CHECK(arrays.strand_first_point[s + 1] - arrays.strand_first_point[s] == 9);
    // Its neighbours kept theirs.
    for (std::size_t i = 0; i < arrays.strand_id.size(); ++i) {
        if (i == s) continue;
        const std::uint32_t number = arrays.strand_id[i] - 100;
        CHECK(arrays.strand_radius[i] == Approx(5e-5));
        CHECK(arrays.strand_uv[2 * i] == Approx(0.01 * number));
        CHECK(groups[arrays.strand_group[i]].name == (number % 2 ? "fringe" : "default"));
        CHECK(arrays.strand_position[3 * arrays.strand_first_point[i]] ==
              Approx(0.005 * (number % 8)).margin(1e-9));
    }
}
