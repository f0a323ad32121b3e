#include "bake/stage/guides.h"

#include "bake/stage/density.h"
#include "bake/stage/levels.h"
#include "bake/stage/motion.h"
#include "bake/stage/motion_guides.h"
#include "bake/stage/order.h"
#include "bake/stage/random.h"
#include "bake/stage/rest.h"
#include "bake/stage/rest_frame.h"
#include "bake/stage/spatial_order.h"
#include "bake/stage/weights.h"
#include "tests/bake/stage/shapes.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <cstdio>
#include <numeric>
#include <set>

using namespace keratin;
using test::groom_of;
using test::hairy_sphere;
using test::recipe_of;

namespace {

std::vector<std::uint32_t> guides_of(const Groom& groom, const Recipe& recipe) {
    Findings findings;
    const auto features = strand_features(groom);
    auto guides = choose_guides(groom, features, {}, nullptr, recipe, findings);
    if (!guides) FAIL(to_string(guides.error()));
    return *guides;
}

double mean_distance_to_guide(const Groom& groom, const std::vector<std::uint32_t>& guides) {
    const auto features = strand_features(groom);
    double sum = 0;
    for (const StrandFeature& f : features) {
        double least = 1e300;
        for (std::uint32_t g : guides) least = std::min(least, squared_distance(f, features[g]));
        sum += std::sqrt(least);
    }
    return sum / double(features.size());
}

}  // namespace

TEST_CASE("the generator gives the numbers of its paper") {
    // First outputs of SplitMix64 for seed 1234567.
    Random random(1234567);
    CHECK(random.next() == 6457827717110365317u);
    CHECK(random.next() == 3203168211198807973u);
    CHECK(random.next() == 9817491932198370423u);
}

TEST_CASE("guides are the wanted share of each group, without repetition") {
    Groom groom = hairy_sphere({0, 0, 0}, 0.1, 1000, 8, 0.05);
    groom.group_names = {"a", "b"};
    for (std::size_t s = 900; s < 1000; ++s) groom.group[s] = 1;
    for (GuideMethod method : {GuideMethod::random, GuideMethod::kmeans}) {
        Recipe recipe = recipe_of();
        recipe.guide_method = method;
        const auto guides = guides_of(groom, recipe);
        CHECK(guides.size() == 100);
        CHECK(std::set<std::uint32_t>(guides.begin(), guides.end()).size() == 100);
        CHECK(std::count_if(guides.begin(), guides.end(), [](auto g) { return g >= 900; }) == 10);
    }
    CHECK(guide_count(3, 0.1) == 1);
    CHECK(guide_count(15, 0.1) == 2);
    CHECK(guide_count(5, 1) == 5);
}

TEST_CASE("the seed decides random guides; k-means places guides better") {
    const Groom groom = hairy_sphere({0, 0, 0}, 0.1, 2000, 8, 0.05);
    Recipe recipe = recipe_of();
    recipe.guide_method = GuideMethod::random;
    const auto first = guides_of(groom, recipe);
    CHECK(first == guides_of(groom, recipe));
    recipe.guide_seed = 2;
    CHECK(first != guides_of(groom, recipe));
    recipe.guide_method = GuideMethod::kmeans;
    CHECK(mean_distance_to_guide(groom, guides_of(groom, recipe)) <
          0.85 * mean_distance_to_guide(groom, first));
}

TEST_CASE("k-means still gives the wanted number when strands coincide") {
    std::vector<std::vector<Vec3>> strands(50, {{0, 0, 0}, {0, 0.1, 0}});
    strands.resize(100, {{1, 0, 0}, {1, 0.1, 0}});
    const auto guides = guides_of(groom_of(strands), recipe_of());
    CHECK(guides.size() == 10);
}

TEST_CASE("authored guides win when the recipe names no method, and are demanded when it does") {
    Groom groom = hairy_sphere({0, 0, 0}, 0.1, 100, 8, 0.05);
    groom.is_guide.assign(100, 0);
    groom.is_guide[3] = groom.is_guide[77] = 1;
    Recipe recipe = recipe_of();
    recipe.defaulted = {"guides.method"};
    CHECK(guides_of(groom, recipe) == std::vector<std::uint32_t>{3, 77});
    recipe.defaulted = {};
    CHECK(guides_of(groom, recipe).size() == 10);
    recipe.guide_method = GuideMethod::authored;
    CHECK(guides_of(groom, recipe) == std::vector<std::uint32_t>{3, 77});
    groom.is_guide.assign(100, 0);
    Findings findings;
    CHECK_FALSE(choose_guides(groom, strand_features(groom), {}, nullptr, recipe, findings));
}

TEST_CASE(
    "weights are >= 0 and sum to one, three guides of the own group, a guide follows itself") {
    Groom groom = hairy_sphere({0, 0, 0}, 0.1, 600, 8, 0.05);
    groom.group_names = {"a", "b"};
    for (std::size_t s = 0; s < 600; s += 3) groom.group[s] = 1;
    const auto guides = guides_of(groom, recipe_of());
    const std::set<std::uint32_t> set(guides.begin(), guides.end());
    Findings findings;
    const auto blends =
        blend_guides(groom, strand_features(groom), guides, {}, recipe_of(), findings);
    std::size_t three = 0;
    for (std::uint32_t s = 0; s < 600; ++s) {
        const GuideBlend& b = blends[s];
        CHECK(b.weight[0] + b.weight[1] + b.weight[2] == Approx(1).epsilon(1e-12));
        for (std::size_t k = 0; k < 3; ++k) {
            CHECK(b.weight[k] >= 0);
            CHECK(set.count(b.guide[k]) == 1);
            CHECK(groom.group[b.guide[k]] == groom.group[s]);
        }
        three += b.weight[2] > 0;
        if (set.count(s)) CHECK((b.guide[0] == s && b.weight[0] == 1));
    }
    CHECK(three > 400);
}

TEST_CASE("weights change little between neighbouring strands") {
    // Strands along a line, guides every tenth: where one guide takes another's place both weigh
    // nothing.
    std::vector<std::vector<Vec3>> strands;
    for (int s = 0; s <= 2000; ++s) {
        const double x = 1e-4 * s;
        strands.push_back({{x, 0, 0}, {x, 0.05, 0}, {x, 0.1, 0}});
    }
    const Groom groom = groom_of(strands);
    std::vector<std::uint32_t> guides;
    for (std::uint32_t g = 0; g <= 2000; g += 100) guides.push_back(g);
    Findings findings;
    const auto blends =
        blend_guides(groom, strand_features(groom), guides, {}, recipe_of(), findings);
    double largest = 0;
    for (std::size_t s = 400; s < 1600; ++s) {
        std::map<std::uint32_t, double> change;
        for (std::size_t k = 0; k < 3; ++k) {
            change[blends[s].guide[k]] += blends[s].weight[k];
            change[blends[s + 1].guide[k]] -= blends[s + 1].weight[k];
        }
        for (const auto& [guide, d] : change) largest = std::max(largest, std::abs(d));
    }
    CHECK(largest < 0.05);
}

TEST_CASE("no strand follows a guide from the other side of a parting") {
    // Roots side by side on a line; left of it hair falls left, right of it right.
    std::vector<std::vector<Vec3>> strands;
    for (int s = 0; s < 400; ++s) {
        const double x = 1e-3 * (s - 199.5);
        const double side = x < 0 ? -1 : 1;
        strands.push_back({{x, 0, 0},
                           {x + side * 0.03, 0.01, 0},
                           {x + side * 0.06, -0.02, 0},
                           {x + side * 0.07, -0.06, 0}});
    }
    const Groom groom = groom_of(strands);
    const auto guides = guides_of(groom, recipe_of());
    Findings findings;
    const auto blends =
        blend_guides(groom, strand_features(groom), guides, {}, recipe_of(), findings);
    std::size_t across = 0;
    for (std::uint32_t s = 0; s < 400; ++s) {
        for (std::size_t k = 0; k < 3; ++k) {
            across += blends[s].weight[k] > 0 && (blends[s].guide[k] < 200) != (s < 200);
        }
    }
    CHECK(across == 0);
}

TEST_CASE("no strand follows a guide on skin that faces the other way") {
    // Two sides of an ear, 2 mm apart, with parallel hair.
    std::vector<std::vector<Vec3>> strands;
    Roots roots;
    for (int s = 0; s < 200; ++s) {
        const double side = s % 2 ? 1 : -1;
        const double y = 1e-4 * s;
        strands.push_back({{1e-3 * side, y, 0}, {1e-3 * side, y + 0.05, 0}});
        roots.normal.push_back({side, 0, 0});
    }
    const Groom groom = groom_of(strands);
    const auto guides = guides_of(groom, recipe_of());
    Findings findings;
    const auto blends =
        blend_guides(groom, strand_features(groom), guides, roots, recipe_of(), findings);
    std::size_t across = 0;
    for (std::uint32_t s = 0; s < 200; ++s) {
        for (std::size_t k = 0; k < 3; ++k) {
            across += blends[s].weight[k] > 0 && blends[s].guide[k] % 2 != s % 2;
        }
    }
    CHECK(across == 0);
}

TEST_CASE("authored weights win where their guides are guides") {
    Groom groom = hairy_sphere({0, 0, 0}, 0.1, 50, 4, 0.05);
    for (std::uint32_t s = 0; s < 50; ++s) groom.id[s] = 100 + s;
    groom.closest_guides.assign(50, {110, 120, 130});
    groom.guide_weights.assign(50, {1, 2, 1});
    groom.closest_guides[5] = {111, 120, 130};
    const std::vector<std::uint32_t> guides{10, 20, 30};
    Findings findings;
    const auto blends =
        blend_guides(groom, strand_features(groom), guides, {}, recipe_of(), findings);
    CHECK(blends[0].guide == std::array<std::uint32_t, 3>{10, 20, 30});
    CHECK(blends[0].weight == std::array<double, 3>{0.25, 0.5, 0.25});
    CHECK(blends[10].weight[0] == 1);
    REQUIRE(findings.size() == 1);
    CHECK(findings[0].rule == Rule::authored_dropped);
    CHECK(findings[0].strands == std::vector<StrandRange>{{5, 5}});
}

TEST_CASE("every prefix of the render strands is spread evenly over the groom") {
    const Groom groom = hairy_sphere({0, 0, 0}, 0.1, 20000, 2, 0.05);
    const std::vector<std::uint32_t> guides{0};
    const AssetOrder order = order_asset(groom, guides);
    CHECK(std::set<std::uint32_t>(order.strand.begin(), order.strand.end()).size() == 20000);
    for (std::size_t count : {100, 500, 1000, 3333, 7777, 10000, 15000}) {
        // Share of the prefix in each octant; the whole groom has an eighth in each.
        std::array<double, 8> octant{};
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3& root = groom.points(order.strand[i]).front();
            octant[(root.x() > 0) + 2 * (root.y() > 0) + 4 * (root.z() > 0)] += 1;
        }
        INFO(count);
        for (double n : octant) CHECK(n / double(count) == Approx(0.125).margin(0.03));
    }
}

TEST_CASE("prefixes of a half to a sixteenth are as uniform a sample as chance, or better") {
    // Dense on one side, sparse on the other, so that a uniform sample is not an even one.
    std::vector<std::vector<Vec3>> strands;
    Random random(7);
    const auto unit = [&] { return double(random.below(1u << 30)) / double(1u << 30); };
    for (int s = 0; s < 20000; ++s) {
        const Vec3 root(unit() * unit(), 0, unit());
        strands.push_back({root, root + Vec3(0, 0.1, 0)});
    }
    const Groom groom = groom_of(strands);
    const std::vector<std::uint32_t> guides{0};
    const AssetOrder order = order_asset(groom, guides);
    // Star discrepancy against the whole groom, over a lattice of boxes from the corner.
    const auto discrepancy = [&](std::span<const std::uint32_t> sample) {
        constexpr int kBoxes = 32;
        std::vector<double> difference(kBoxes * kBoxes, 0);
        const auto count = [&](std::span<const std::uint32_t> of, double weight) {
            for (std::uint32_t s : of) {
                const Vec3& root = strands[s][0];
                const int x = std::min(kBoxes - 1, int(root.x() * kBoxes));
                const int z = std::min(kBoxes - 1, int(root.z() * kBoxes));
                difference[std::size_t(x * kBoxes + z)] += weight;
            }
        };
        count(sample, 1.0 / double(sample.size()));
        count(order.strand, -1.0 / double(order.strand.size()));
        double largest = 0;
        for (std::size_t x = 0; x < kBoxes; ++x) {
            double row = 0;
            for (std::size_t z = 0; z < kBoxes; ++z) {
                row += difference[x * kBoxes + z];
                difference[x * kBoxes + z] = row + (x > 0 ? difference[(x - 1) * kBoxes + z] : 0);
                largest = std::max(largest, std::abs(difference[x * kBoxes + z]));
            }
        }
        return largest;
    };
    for (const std::size_t share : {2, 4, 8, 16}) {
        const std::size_t count = strands.size() / share;
        std::vector<double> of_chance;
        for (std::uint64_t seed = 1; seed <= 21; ++seed) {
            std::vector<std::uint32_t> shuffled = order.strand;
            Random(seed).choose_first(std::span(shuffled), count);
            shuffled.resize(count);
            of_chance.push_back(discrepancy(shuffled));
        }
        std::sort(of_chance.begin(), of_chance.end());
        const double prefix = discrepancy(std::span(order.strand).first(count));
        std::printf("discrepancy of the first 1/%zu: %.5f, of random samples %.5f (median)\n",
                    share, prefix, of_chance[10]);
        CHECK(prefix < of_chance[10]);
    }
}

TEST_CASE("widths of a level make up for the length and radius of the strands left out") {
    // 64 strands of which the first in the asset's order get shorter and thinner.
    std::vector<std::vector<Vec3>> strands;
    for (int s = 0; s < 64; ++s) strands.push_back({{0.01 * s, 0, 0}, {0.01 * s, 0.1, 0}});
    Groom groom = groom_of(strands);
    std::vector<std::uint32_t> guides(64);
    std::iota(guides.begin(), guides.end(), 0u);
    const AssetOrder order = order_asset(groom, guides);
    for (std::size_t i = 0; i < 16; ++i) groom.points(order.strand[i])[1].y() = 0.05;
    groom.radius.assign(64, {4e-5, 4e-5});
    for (std::size_t i = 0; i < 4; ++i) groom.radius[order.strand[i]] = {2e-5, 2e-5};
    std::vector<GuideBlend> blends(64);
    for (std::uint32_t s = 0; s < 64; ++s) blends[s].guide.fill(s);
    const std::vector<GroupInfo> groups{{"default", {}, {}}};
    AssetArrays arrays;
    store_strands(groom, {}, {}, order, blends, groups, arrays);
    const auto levels = width_levels(arrays, groups);
    REQUIRE(levels.size() == 6);
    const double all = 48 * 0.1 * 4 + 12 * 0.05 * 4 + 4 * 0.05 * 2;
    CHECK(levels[0].strand_count == 32);
    CHECK(levels[0].width_scale == Approx(all / (all - 32 * 0.1 * 4)));
    CHECK(levels[2].strand_count == 8);
    CHECK(levels[2].width_scale == Approx(all / (4 * 0.05 * 4 + 4 * 0.05 * 2)));
    CHECK(levels[5].strand_count == 1);
    CHECK(levels[5].width_scale == Approx(all / (0.05 * 2)));
}

TEST_CASE("an order of numbers is a permutation whose prefixes are even") {
    for (std::uint32_t count : {0u, 1u, 2u, 63u, 64u, 65u, 255u, 257u, 4097u, 100000u}) {
        const auto order = prefix_uniform_order(count);
        std::vector<std::uint32_t> sorted = order;
        std::sort(sorted.begin(), sorted.end());
        std::vector<std::uint32_t> all(count);
        std::iota(all.begin(), all.end(), 0u);
        CHECK(sorted == all);
    }
}

TEST_CASE("guides fill quads of one group and equal rows, the longest first") {
    std::vector<std::vector<Vec3>> strands;
    for (int s = 0; s < 150; ++s) {
        std::vector<Vec3> strand;
        for (int p = 0; p < 4 + s % 5; ++p) strand.push_back({0.01 * s, 0.01 * p, 0});
        strands.push_back(strand);
    }
    Groom groom = groom_of(strands);
    groom.group_names = {"a", "b"};
    for (std::size_t s = 100; s < 150; ++s) groom.group[s] = 1;
    std::vector<std::uint32_t> guides(150);
    std::iota(guides.begin(), guides.end(), 0u);
    const AssetOrder order = order_asset(groom, guides);
    const std::size_t tiles = order.tile_first_row.size() - 1;
    CHECK(tiles == 12);
    std::size_t seen = 0;
    for (std::size_t t = 0; t < tiles; ++t) {
        const std::size_t quad = t - t % kQuadTiles;
        const std::uint32_t rows = order.tile_first_row[t + 1] - order.tile_first_row[t];
        CHECK(rows == order.tile_first_row[quad + 1] - order.tile_first_row[quad]);
        for (std::size_t l = 0; l < kTileLanes; ++l) {
            const std::size_t lane = t * kTileLanes + l;
            CHECK(order.lane_group[lane] == order.lane_group[quad * kTileLanes]);
            const std::uint32_t s = order.lane_strand[lane];
            if (s == kNoStrand) continue;
            ++seen;
            CHECK(groom.group[s] == order.lane_group[lane]);
            CHECK(groom.point_count(s) <= rows);
            CHECK(order.lane_of[s] == lane);
        }
        CHECK(groom.point_count(order.lane_strand[quad * kTileLanes]) == rows);
    }
    CHECK(seen == 150);
}

TEST_CASE("the rest shape gives back the strand from its root and first edge") {
    std::vector<double> points;
    for (int p = 0; p < 20; ++p) {
        const double t = 0.5 * p;
        points.insert(points.end(), {0.02 * std::cos(t), 0.01 * t, 0.02 * std::sin(t)});
    }
    std::vector<double> length(20), shape(60);
    const std::array<double, 3> normal{0.3, 1, -0.2};
    rest_frames(points, normal, length, shape);
    const auto at = [](const std::vector<double>& v, std::size_t p) {
        return Vec3(v[3 * p], v[3 * p + 1], v[3 * p + 2]);
    };
    // Carry the frame by rotation matrices instead of the formulas under test.
    Eigen::Matrix3d frame;
    Vec3 t = (at(points, 1) - at(points, 0)).normalized();
    const Vec3 u = at(shape, 0);
    CHECK(u.norm() == Approx(1));
    CHECK(std::abs(u.dot(t)) < 1e-12);
    frame << t, u, t.cross(u);
    Vec3 x = at(points, 0);
    for (std::size_t p = 1; p < 20; ++p) {
        x += frame * at(shape, p);
        CHECK((x - at(points, p)).norm() < 1e-12);
        CHECK(length[p] == Approx(at(shape, p).norm()));
        const Vec3 next = (at(points, p) - at(points, p - 1)).normalized();
        frame = Eigen::Quaterniond::FromTwoVectors(t, next).toRotationMatrix() * frame;
        t = next;
    }
    CHECK(length[0] == 0);
}

TEST_CASE("guides by motion go where strands move apart, and follow the motion better") {
    // A meadow of which one corner ripples.
    std::vector<std::vector<Vec3>> strands;
    GroomMotion motion;
    motion.frame_count = 2;
    std::vector<std::array<float, 3>> tip;
    for (int x = 0; x < 40; ++x) {
        for (int z = 0; z < 40; ++z) {
            const Vec3 root(0.005 * x, 0, 0.005 * z);
            strands.push_back({root, root + Vec3(0, 0.05, 0), root + Vec3(0, 0.1, 0)});
        }
    }
    for (std::size_t frame = 0; frame < 2; ++frame) {
        for (const auto& strand : strands) {
            const bool ripples = strand[0].x() < 0.1 && strand[0].z() < 0.1;
            const float side = ripples ? 0.02f * float(std::sin(120 * (strand[0].x() +
                                                                       strand[0].z()) +
                                                                double(frame)))
                                       : 0.01f;
            motion.displacement.insert(motion.displacement.end(),
                                       {0, 0, 0, side / 2, 0, 0, side, 0, 0});
        }
    }
    const Groom groom = groom_of(strands);
    const auto features = strand_features(groom);
    Recipe recipe = recipe_of();
    recipe.guide_fraction = 0.05;
    const auto error = [&](GuideMethod method, std::size_t& in_corner) {
        recipe.guide_method = method;
        Findings findings;
        const auto guides = choose_guides(groom, features, {}, &motion, recipe, findings);
        REQUIRE(guides);
        CHECK(guides->size() == 80);
        CHECK(std::set<std::uint32_t>(guides->begin(), guides->end()).size() == 80);
        in_corner = static_cast<std::size_t>(std::count_if(
            guides->begin(), guides->end(),
            [](std::uint32_t g) { return g / 40 < 20 && g % 40 < 20; }));
        const auto blends = blend_guides(groom, features, *guides, {}, recipe, findings);
        return reconstruction_error(groom, motion, blends);
    };
    std::size_t even = 0, informed = 0;
    const Spread kmeans = error(GuideMethod::kmeans, even);
    const Spread chosen = error(GuideMethod::motion, informed);
    std::printf("corner guides %zu -> %zu, mean error %.3f -> %.3f mm\n", even, informed,
                1e3 * kmeans.mean, 1e3 * chosen.mean);
    CHECK(even < 30);
    CHECK(2 * informed > 3 * even);
    CHECK(chosen.mean < 0.7 * kmeans.mean);
    CHECK(chosen.p95 < kmeans.p95);
}

TEST_CASE("fitted weights meet a strand's motion as well as any three weights can") {
    Random random(5);
    const auto unit = [&] { return 2 * float(random.below(1u << 24)) / float(1u << 24) - 1; };
    for (int round = 0; round < 20; ++round) {
        Eigen::MatrixXf motion(30, 6);
        for (Eigen::Index i = 0; i < motion.size(); ++i) motion(i) = unit();
        // Half the time the strand is between guides.
        if (round % 2) motion.col(0) = 0.2f * motion.col(0) + 0.4f * (motion.col(2) + motion.col(4));
        const std::vector<std::uint32_t> guides{1, 2, 3, 4, 5};
        const GuideBlend blend = fit_blend(motion, 0, guides);
        CHECK(blend.weight[0] + blend.weight[1] + blend.weight[2] == Approx(1));
        CHECK(blend.weight[0] >= blend.weight[1]);
        CHECK(blend.weight[1] >= blend.weight[2]);
        CHECK(blend.weight[2] >= 0);
        const auto error = [&](const GuideBlend& b) {
            Eigen::VectorXf d = motion.col(0);
            for (std::size_t k = 0; k < 3; ++k)
                d -= static_cast<float>(b.weight[k]) * motion.col(b.guide[k]);
            return double(d.squaredNorm());
        };
        // Against all of three guides with weights of fortieths.
        double least = 1e9;
        for (std::uint32_t a = 1; a <= 5; ++a)
            for (std::uint32_t b = a + 1; b <= 5; ++b)
                for (std::uint32_t c = b + 1; c <= 5; ++c)
                    for (int i = 0; i <= 40; ++i)
                        for (int j = 0; i + j <= 40; ++j)
                            least = std::min(
                                least, error({{a, b, c},
                                              {i / 40.0, j / 40.0, (40 - i - j) / 40.0}}));
        CHECK(error(blend) <= least * 1.0001);
        CHECK(error(blend) >= least * 0.97);
    }
}

TEST_CASE("the reconstruction error is the distance from the blend of the guides' motions") {
    const Groom groom = groom_of(
        {{{0, 0, 0}, {0, 1, 0}}, {{1, 0, 0}, {1, 1, 0}}, {{2, 0, 0}, {2, 0.5, 0}, {2, 1, 0}}});
    GroomMotion motion;
    motion.frame_count = 1;
    motion.displacement = {0, 0, 0, 0.1f, 0,    0, 0, 0,     0, 0.3f, 0,
                           0, 0, 0, 0,    0.1f, 0, 0, 0.25f, 0, 0};
    std::vector<GuideBlend> blends(3);
    blends[0].guide.fill(0);
    blends[1].guide.fill(1);
    blends[2].guide = {0, 1, 1};
    blends[2].weight = {0.5, 0.25, 0.25};
    const Spread error = reconstruction_error(groom, motion, blends);
    CHECK(error.max == Approx(0.05));
    CHECK(error.mean == Approx(0.05 / 3));
}

TEST_CASE("stored densities fill the solver's grid to one where hair is thick") {
    // A block of parallel strands at equal spacing: density is mass over volume.
    std::vector<std::vector<Vec3>> strands;
    for (int i = 0; i < 40; ++i) {
        for (int j = 0; j < 40; ++j) {
            std::vector<Vec3> strand;
            for (int p = 0; p < 28; ++p) strand.push_back({0.0025 * i, 0.1 / 27 * p, 0.0025 * j});
            strands.push_back(strand);
        }
    }
    const Groom groom = groom_of(strands);
    std::vector<std::uint32_t> all(groom.strand_count());
    std::iota(all.begin(), all.end(), 0u);
    const AssetOrder order = order_asset(groom, all);
    std::vector<GuideBlend> blends(all.size());
    for (std::uint32_t s : all) blends[s].guide.fill(s);
    AssetInfo info;
    info.groups.push_back({"default", {}, {}});
    AssetArrays arrays;
    store_strands(groom, {}, {}, order, blends, info.groups, arrays);
    info.strand_count = info.guide_count = static_cast<std::uint32_t>(all.size());
    info.row_count = order.tile_first_row.back();
    info.bounds_max = {0.0975f, 0.1f, 0.0975f};
    store_density(info, arrays);
    CHECK(arrays.guide_density.empty());
    info.groups[0].strand.volume = {0.01f};
    store_density(info, arrays);
    REQUIRE(arrays.guide_density.size() == arrays.guide_length.size());
    const Material& m = info.groups[0].material;
    const double expected =
        double{m.density} * 3.14159265358979 * m.radius * m.radius2 / (0.0025 * 0.0025);
    double sum = 0;
    int count = 0;
    for (std::size_t lane = 0; lane < arrays.guide_strand.size(); ++lane) {
        const Vec3& root =
            groom.points(order.lane_strand[lane] == kNoStrand ? 0 : order.lane_strand[lane])[0];
        if (root.x() < 0.02 || root.x() > 0.08 || root.z() < 0.02 || root.z() > 0.08) continue;
        const std::size_t row = order.tile_first_row[lane / kTileLanes] + 14;
        sum += arrays.guide_density[scalar_index(row, lane % kTileLanes)];
        ++count;
    }
    CHECK(count > 300);
    CHECK(sum / count == Approx(expected).epsilon(0.03));
}
