#include "runtime/contact/contact_list.h"
#include "runtime/contact/detection.h"

#include "runtime/shape/closest.h"
#include "tests/contact/chains.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

using namespace keratin;

namespace {

constexpr double r = 5e-5;  // m

std::vector<FoundContact> find(const Chains& c, std::vector<MovingShape> colliders = {},
                               int threads = 1) {
    Detection detection;
    DetectionSettings settings;
    settings.threads = threads;
    const auto found = detection.find(c.view(), colliders, settings);
    return {found.begin(), found.end()};
}

// A straight strand of `edges` edges.
std::vector<Vector3> line(const Vector3& from, const Vector3& to, int edges) {
    std::vector<Vector3> points;
    for (int i = 0; i <= edges; ++i)
        points.push_back(mix(from, to, i / static_cast<double>(edges)));
    return points;
}

std::vector<MovingShape> one(const MovingShape& s) { return {s}; }

}  // namespace

TEST_CASE("crossing strands meet in one contact with the right place, normal and gap") {
    Chains c;
    c.add(line({-0.01, 0, 0}, {0.01, 0, 0}, 3), {0, 0, 0}, r);
    c.add(line({0, 3e-4, -0.01}, {0, 3e-4, 0.02}, 4), {0, -1e-3, 0}, r);
    const auto found = find(c);
    REQUIRE(found.size() == 1);
    const Contact& k = found[0].contact;
    CHECK(k.edge[0] == 1);
    CHECK(k.edge[1] == 3 + 1);
    CHECK(k.parameter[0] == Approx(0.5));
    CHECK(k.normal.y == Approx(-1));
    CHECK(k.gap == Approx(3e-4 - 2 * r));
    CHECK(found[0].time == Approx(0.2).epsilon(1e-3));
}

TEST_CASE("strands that pass each other at a distance give no contact") {
    Chains c;
    c.add(line({-0.01, 0, 0}, {0.01, 0, 0}, 3), {0, 0, 0}, r);
    c.add(line({0, 3e-4, -0.01}, {0, 3e-4, 0.02}, 4), {1e-3, 0, 0}, r);
    CHECK(find(c).empty());
}

TEST_CASE("resting strands that never cross are in contact") {
    Chains c;
    c.add(line({-0.01, 0, 0}, {0.01, 0, 0}, 3), {0, 0, 0}, r);
    c.add(line({0, 1.999 * r, -0.01}, {0, 1.999 * r, 0.02}, 4), {0, 0, 0}, r);
    CHECK(find(c).size() == 1);
}

TEST_CASE("a parallel overlap has two contacts, at its ends") {
    Chains c;
    c.add(line({0, 0, 0}, {0.010, 0, 0}, 1), {0, 0, 0}, r);
    c.add(line({0.004, 2 * r, 0}, {0.014, 2 * r, 0}, 1), {0, -1e-5, 0}, r);
    const auto found = find(c);
    REQUIRE(found.size() == 2);
    double low = 1, high = 0;
    for (const FoundContact& f : found) {
        low = std::min(low, f.contact.parameter[0]);
        high = std::max(high, f.contact.parameter[0]);
    }
    CHECK(low == Approx(0.4));
    CHECK(high == Approx(1.0));
}

TEST_CASE("a vertex shared by two edges gives one contact") {
    Chains c;  // a bent strand whose middle vertex comes down on a straight one
    c.add({{0, 1e-3, -0.01}, {0, 2 * r, 0}, {0, 1e-3, 0.01}}, {0, -1e-5, 0}, r);
    c.add(line({-0.01, 0, 0}, {0.01, 0, 0}, 1), {0, 0, 0}, r);
    CHECK(find(c).size() == 1);
}

TEST_CASE("a vertex is met though the next edge has met the same partner far from it") {
    Chains c;
    c.add({{-5e-3, 0, 0}, {5e-3, 0, 0}}, {0, 0, 0}, r);
    c.add({{-2e-3, 3e-3, 0}, {0, 2 * r + 6e-5, 0}, {4e-3, 2 * r + 2e-5, 0}}, {0, -1e-4, 0}, r);
    const auto found = find(c);
    REQUIRE(found.size() == 2);
    for (const double along : {0.0, 1.0})
        CHECK(std::ranges::count_if(found, [&](const FoundContact& f) {
                  return f.contact.edge[1] == 2 && f.contact.parameter[1] == along;
              }) == 1);
}

TEST_CASE("parallel strands with facing vertices have one contact a pair of vertices") {
    Chains c;
    c.add(line({0, 0, 0}, {0.03, 0, 0}, 3), {0, 0, 0}, r);
    c.add(line({0, 2 * r, 0}, {0.03, 2 * r, 0}, 3), {0, -1e-6, 0}, r);
    CHECK(find(c).size() == 4);
}

TEST_CASE("neighbouring edges of a strand are no contact but a loop is") {
    Chains bent;
    bent.add({{0, 0, 0}, {0.01, 0, 0}, {0.01, 0.01, 0}, {0.0, 0.01, 0}}, {0, 0, 0}, r);
    CHECK(find(bent).empty());
    Chains fine;  // segments shorter than the strand is thick
    fine.add(line({0, 0, 0}, {1e-3, 0, 0}, 50), {0, 0, 0}, r);
    CHECK(find(fine).empty());
    Chains loop;
    loop.add({{0, 0, 0}, {0.01, 0, 0}, {0.01, 0.01, 0}, {0.005, -0.01, 1.5 * r}}, {0, 0, 0}, r);
    CHECK(find(loop).size() == 1);
}

TEST_CASE("strands in the same place get a normal and a bounded push") {
    Chains c;
    c.add(line({0, 0, 0}, {0.03, 0, 0}, 3), {0, 0, 0}, r);
    c.add(line({0, 0, 0}, {0.03, 0, 0}, 3), {0, 0, 0}, r);
    const auto found = find(c);
    REQUIRE(found.size() == 4);
    for (const FoundContact& f : found) {
        CHECK(length(f.contact.normal) == Approx(1));
        CHECK(dot(f.contact.normal, found[0].contact.normal) == Approx(1));
        CHECK(f.contact.gap == Approx(-0.2 * 2 * r));
    }
}

TEST_CASE("a strand falls on each shape and meets it at the surface") {
    MovingShape plane{{ShapeKind::plane, {0, 0, 0}, {0, 1, 0}, 0, nullptr}, {}, {}};
    MovingShape sphere{{ShapeKind::sphere, {0, -0.05, 0}, {0, 0, 0}, 0.05, nullptr}, {}, {}};
    MovingShape capsule{
        {ShapeKind::capsule, {0, -0.05, -0.1}, {0, -0.05, 0.1}, 0.05, nullptr}, {}, {}};
    MovingShape box{{ShapeKind::box, {0, -0.05, 0}, {0.05, 0.05, 0.05}, 0, nullptr}, {}, {}};
    const std::vector<Vector3> points{{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
    const std::vector<std::uint32_t> triangles{0, 1, 2, 0, 2, 3};
    const TriangleTree tree(points, triangles);
    MovingShape mesh{{ShapeKind::mesh, {0, 0, 0}, {0, 1, 0}, 0, &tree}, {}, {}};
    int shape = 0;
    for (const MovingShape& s : {plane, sphere, capsule, box, mesh}) {
        INFO("shape " << shape++);
        Chains c;
        c.add(line({-0.011, 1e-3, 0.003}, {0.013, 1e-3, 0.003}, 4), {0, -2e-3, 0}, r);
        const auto found = find(c, one(s));
        REQUIRE(found.size() >= 1);
        double gap = 1;
        for (const FoundContact& f : found) {
            CHECK(f.contact.against_collider);
            CHECK(f.contact.normal.y > 0.98);
            gap = std::min(gap, f.contact.gap);
        }
        // The strand is 3 mm off the top of the sphere: the normal there is tilted by that.
        CHECK(gap == Approx(1e-3 - r).epsilon(0.15));
        Chains above;
        above.add(line({-0.011, 1e-3, 0.003}, {0.013, 1e-3, 0.003}, 4), {0, -0.9e-3, 0}, r);
        CHECK(find(above, one(s)).empty());
    }
}

TEST_CASE("a vertex between the triangles of a flat mesh meets one of them") {
    const std::vector<Vector3> points{{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
    const std::vector<std::uint32_t> triangles{0, 1, 2, 0, 2, 3};
    const TriangleTree tree(points, triangles);
    const MovingShape mesh{{ShapeKind::mesh, {0, 0, 0}, {0, 1, 0}, 0, &tree}, {}, {}};
    Chains c;
    c.add({{0.1, 1e-4, 0.1}, {0.11, 1e-3, 0.11}}, {0, -2e-4, 0}, r);
    const auto found = find(c, one(mesh));
    REQUIRE(found.size() == 1);
    CHECK(found[0].contact.normal.y == Approx(1));
}

TEST_CASE("a fast sphere does not pass through a strand") {
    MovingShape sphere{{ShapeKind::sphere, {0, 0, 0}, {0, 0, 0}, 0.03, nullptr}, {}, {}};
    sphere.pose_t0.origin = {0.07, 0.3, 0};
    sphere.pose_t1.origin = {0.07, -0.3, 0};
    Chains c;
    c.add(line({0, 0, 0}, {0.15, 0, 0}, 31), {0, 0, 0}, r);
    const auto found = find(c, one(sphere));
    REQUIRE(found.size() >= 1);
    CHECK(found[0].contact.obstacle_velocity.y == Approx(-600));
}

TEST_CASE("a root below the surface is let alone and the free part is not") {
    MovingShape sphere{{ShapeKind::sphere, {0, 0, 0}, {0, 0, 0}, 0.1, nullptr}, {}, {}};
    Chains c;
    c.add(line({0, 0.099, 0}, {0, 0.15, 0}, 10), {0, 0, 0}, r);
    c.prescribed[0] = 1;
    CHECK(find(c, one(sphere)).empty());
    c.prescribed[0] = 0;
    CHECK(find(c, one(sphere)).size() >= 1);
}

TEST_CASE("the contacts and their order do not depend on the number of threads") {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(0, 0.02);
    Chains c;
    for (int s = 0; s < 300; ++s) {
        const Vector3 a{unit(random), unit(random), unit(random)},
            b{unit(random), unit(random), unit(random)};
        c.add(line(a, b, 10), {unit(random) * 0.1, unit(random) * 0.1, 0}, r);
    }
    MovingShape sphere{{ShapeKind::sphere, {0.01, 0.01, 0.01}, {0, 0, 0}, 0.004, nullptr}, {}, {}};
    const auto a = find(c, one(sphere), 1), b = find(c, one(sphere), 2);
    REQUIRE(a.size() == b.size());
    CHECK(a.size() > 200);
    bool same = true, ascending = true;
    for (std::size_t i = 0; i < a.size(); ++i) {
        same &= a[i].contact.key == b[i].contact.key && a[i].contact.gap == b[i].contact.gap;
        if (i > 0) ascending &= a[i - 1].contact.key < a[i].contact.key;
    }
    CHECK(same);
    CHECK(ascending);
}

TEST_CASE("every pair that comes within delta is found") {
    std::mt19937 random(14);
    std::uniform_real_distribution<double> unit(0, 0.02);
    Chains c;
    for (int s = 0; s < 120; ++s)
        c.add(line({unit(random), unit(random), unit(random)},
                   {unit(random), unit(random), unit(random)}, 3),
              {unit(random) * 0.2, unit(random) * 0.2, 0}, r);
    const auto found = find(c);
    std::size_t met = 0, missed = 0;
    for (std::uint32_t e = 0; e < c.first_vertex.size(); ++e)
        for (std::uint32_t f = e + 1; f < c.first_vertex.size(); ++f) {
            if (c.strand[e] == c.strand[f]) continue;
            bool close = false;
            for (int k = 0; k <= 200 && !close; ++k) {
                auto at = [&](std::uint32_t v) { return mix(c.x_t0[v], c.x_t1[v], k / 200.0); };
                const std::uint32_t a = c.first_vertex[e], b = c.first_vertex[f];
                close = closest_segments(at(a), at(a + 1), at(b), at(b + 1)).squared_distance <
                        4 * r * r;
            }
            if (!close) continue;
            ++met;
            // Filed under this pair or, at a shared vertex, under a neighbour's.
            bool listed = false;
            for (const FoundContact& k : found)
                listed |= (k.contact.edge[0] == e || k.contact.edge[0] == e + 1) &&
                          (k.contact.edge[1] == f || k.contact.edge[1] == f + 1);
            missed += !listed;
        }
    CHECK(met > 100);
    CHECK(missed == 0);
}

TEST_CASE("a contact that ends too near is taken anew at the end of the step") {
    // A strand slides along another while it turns: along the first normal nothing is too near.
    Chains c;
    c.add(line({-0.01, 0, 0}, {0.01, 0, 0}, 1), {0, 0, 0}, r);
    c.add({{0.000, 2 * r, -0.01}, {0.000, 2 * r, 0.01}}, {0, 0, 0}, r);
    c.x_t1[0] += Vector3(0, 1e-4, 0);
    c.x_t1[1] += Vector3(0, -1e-4, 0);
    c.x_t1[2] += Vector3(-5e-3, 0, 0);
    c.x_t1[3] += Vector3(-5e-3, 0, 0);
    Detection detection;
    DetectionSettings settings;
    std::vector<Contact> list;
    CHECK(merge_contacts(detection.find(c.view(), {}, settings), list) == 1);
    CHECK(merge_contacts(detection.find(c.view(), {}, settings, true), list) == 0);
    const double before = list[0].gap;
    CHECK(refresh_contacts(c.view(), {}, settings, list) == 1);
    CHECK(list[0].parameter[0] == Approx(0.25).margin(1e-3));
    CHECK(before == Approx(0).margin(1e-12));
    // With the new place the law asks for the missing 5e-5 m.
    const Vector3 p0 = mix(c.x_t1[0], c.x_t1[1], list[0].parameter[0]),
                  p1 = mix(c.x_t1[2], c.x_t1[3], list[0].parameter[1]);
    CHECK(dot(list[0].normal, p0 - p1) - list[0].distance == Approx(-5e-5).epsilon(1e-2));
    // Turned as often as a step allows, it is left as it is, and said to overlap.
    list[0].renewals = 100;
    CHECK(refresh_contacts(c.view(), {}, settings, list) == 0);
    CHECK(detection.overlapping(c.view(), settings) == 1);
    // What began the step as near is on its way out.
    for (std::size_t i = 0; i < c.x_t0.size(); ++i) c.x_t0[i] = c.x_t1[i];
    CHECK(detection.overlapping(c.view(), settings) == 0);
}

TEST_CASE("edges along each other have a contact in each part that is too near, crossing ones one") {
    for (const double across : {2e-5, 2e-3}) {
        // Two edges of 5 mm, one over the other, `across` apart at the ends. First they touch near
        // one end; the step ends with their middles too near.
        Chains c;
        const double half = 2.5e-3, y = 2 * r;
        c.add({{-half, 0, 0}, {half, 0, 0}}, {0, 0, 0}, r);
        c.add({{-half, y, -across / 2}, {half, y + 2e-6, across / 2}}, {0, 0, 0}, r);
        c.x_t1[2] += Vector3(0, 0, 0.3 * across);
        c.x_t1[3] += Vector3(0, -4e-6, 0.3 * across);
        Detection detection;
        DetectionSettings settings;
        std::vector<Contact> list;
        merge_contacts(detection.find(c.view(), {}, settings), list);
        REQUIRE(!list.empty());
        const Contact first = list[0];
        c.x_t1[2] -= Vector3(0, 2e-6, 0.3 * across);
        c.x_t1[3] -= Vector3(0, 2e-6, 0.3 * across);
        merge_contacts(detection.find(c.view(), {}, settings, true), list);
        refresh_contacts(c.view(), {}, settings, list);
        INFO("across " << across << ", contacts " << list.size());
        const auto stays = std::ranges::find(list, first.key, &Contact::key);
        REQUIRE(stays != list.end());
        const auto in_middle = [](const Contact& contact) {
            return std::abs(contact.parameter[0] - 0.5) < 0.06;
        };
        CHECK(std::ranges::count_if(list, in_middle) == 1);
        if (across < 1e-4) {
            CHECK(list.size() >= 2);
            CHECK(!in_middle(*stays));
        } else {
            CHECK(list.size() == 1);
        }
    }
}

TEST_CASE("an edge that leans on a sphere beside its contact is said to overlap") {
    // It lies on the sphere with its middle; the step turns it so that it ends too deep elsewhere.
    const std::vector<MovingShape> sphere =
        one({{ShapeKind::sphere, {0, -0.05, 0}, {0, 0, 0}, 0.05, nullptr}, {}, {}});
    Chains c;
    c.add({{-5e-3, r, 0}, {5e-3, r, 0}}, {0, 0, 0}, r);
    Detection detection;
    DetectionSettings settings;
    std::vector<Contact> list;
    REQUIRE(merge_contacts(detection.find(c.view(), sphere, settings), list) == 1);
    CHECK(overlapping_round_solids(c.view(), sphere, settings, list) == 0);
    c.x_t1[0] -= Vector3(0, 1e-4, 0);
    c.x_t1[1] += Vector3(0, 1e-4, 0);
    const double middle = c.x_t1[0].y + c.x_t1[1].y;
    CHECK(middle == Approx(2 * r));  // the contact itself holds
    CHECK(overlapping_round_solids(c.view(), sphere, settings, list) == 1);
    // What began the step as near is on its way out.
    c.x_t0 = c.x_t1;
    CHECK(overlapping_round_solids(c.view(), sphere, settings, list) == 0);
}

TEST_CASE("edges along each other that turn about their contact meet again before they pass") {
    // The second edge lies on the first with its start and is turned down through it: the end of
    // the step, with middles 6e-6 m apart, does not tell from which side they came.
    Chains c;
    const double half = 2.5e-3, y = 2 * r;
    c.add({{-half, 0, 0}, {half, 0, 0}}, {0, 0, 0}, r);
    c.add({{-half / 2, y, -2e-6}, {half, y + 2e-4, 1e-5}}, {0, 0, 0}, r);
    c.x_t1[3] += Vector3(0, -4.4e-4, 0);
    Detection detection;
    DetectionSettings settings;
    std::vector<Contact> list;
    merge_contacts(detection.find(c.view(), {}, settings), list);
    REQUIRE(closest_segments(c.x_t1[0], c.x_t1[1], c.x_t1[2], c.x_t1[3]).squared_distance < 1e-10);
    REQUIRE(list.size() == 2);
    CHECK(list[0].parameter[1] == 0);
    const Contact next = list[1];
    for (const Contact& k : list) CHECK(k.normal.y < -0.99);
    // By its law this motion is not allowed.
    const auto at = [&](std::size_t v, double s) { return mix(c.x_t1[v], c.x_t1[v + 1], s); };
    CHECK(dot(next.normal, at(0, next.parameter[0]) - at(2, next.parameter[1])) < 0);

    // A contact that stands inside already is taken anew on the side that they come from.
    std::vector<Contact> stale{next};
    stale[0].key.feature = 3 << 2;
    stale[0].parameter[0] = stale[0].parameter[1] = 0.5;
    CHECK(refresh_contacts(c.view(), {}, settings, stale) == 1);
    CHECK(stale[0].normal.y < -0.99);
    CHECK(stale[0].shortfall > 0);
}

TEST_CASE("contacts of neighbouring edges that stand at one place are made one") {
    // A strand with a vertex over the middle of another: sliding has taken the contact of its first
    // edge to the vertex, where that of its second edge is.
    Chains c;
    c.add(line({-0.01, 2 * r, 0}, {0.01, 2 * r, 0}, 2), {0, 0, 0}, r);
    c.add({{0.0, 0.0, -0.01}, {0.0, 0.0, 0.01}}, {0, 0, 0}, r);
    auto contact = [&](std::uint32_t edge, double parameter) {
        Contact k;
        k.edge[0] = edge;
        k.edge[1] = 2;
        k.key = {static_cast<std::uint64_t>(edge) << 32 | 2, 0};
        k.parameter[0] = parameter;
        k.parameter[1] = 0.5;
        k.distance = 2 * r;
        k.impulse = {0, 1, 0};
        return k;
    };
    std::vector<Contact> apart{contact(0, 0.9), contact(1, 0.0)},
        near{contact(0, 0.9999), contact(1, 0.0)};
    CHECK(unite_contacts(c.view(), apart).all == 0);
    near[1].fresh = true;
    const United went = unite_contacts(c.view(), near);
    CHECK(went.all == 1);
    CHECK(went.fresh == 1);
    REQUIRE(near.size() == 1);
    CHECK(near[0].edge[0] == 0);
    CHECK(near[0].impulse.y == 2);
}

TEST_CASE("a strand that begins inside a sphere leaves sideways, all of it on one side") {
    const MovingShape sphere{{ShapeKind::sphere, {0, 0, 0}, {0, 0, 0}, 0.02, nullptr}, {}, {}};
    for (const double aside : {0.0, 2e-3}) {
        Chains c;
        c.add(line({-0.051, aside, 0}, {0.049, aside, 0}, 20), {0, 0, 0}, r);
        const auto found = find(c, one(sphere));
        REQUIRE(found.size() > 5);
        for (const FoundContact& f : found) {
            CHECK(std::fabs(f.contact.normal.x) < 1e-9);
            CHECK(dot(f.contact.normal, found[0].contact.normal) == Approx(1));
            CHECK(f.contact.gap < -0.199 * r);
        }
    }
}

TEST_CASE(
    "an edge along a sphere that ends too deep away from its contact gets another one there") {
    // It touches with its left end first and ends level, its middle and right end too deep.
    const MovingShape sphere{{ShapeKind::sphere, {0, -1, 0}, {0, 0, 0}, 1, nullptr}, {}, {}};
    Chains c;
    c.add({{-2e-3, 1e-4, 0}, {2e-3, 1e-3, 0}}, {0, 0, 0}, r);
    c.x_t1[0].y = -2e-5;
    c.x_t1[1].y = -2e-5;
    Detection detection;
    // The first search's motion knows of no contact: what it leads to is no place to hold on to.
    CHECK(detection.find(c.view(), one(sphere), {}).size() == 1);
    const auto found = detection.find(c.view(), one(sphere), {}, true);
    REQUIRE(found.size() == 2);
    CHECK(std::fabs(found[0].contact.parameter[0] - found[1].contact.parameter[0]) > 0.3);
}

TEST_CASE("on a sphere a place less than a part of the edge from a known one is that place") {
    Chains c;
    c.add({{0, 0, 0}, {5e-3, 0, 0}}, {0, 0, 0}, r);
    // The edge rests on the sphere's top, at the share s of its length.
    const auto touching = [&](double s) {
        return find(
            c,
            one({{ShapeKind::sphere, {5e-3 * s, -0.1, 0}, {0, 0, 0}, 0.1 - r, nullptr}, {}, {}}));
    };
    for (const double s : {0.49, 0.30, 0.72}) {
        std::vector<Contact> list;
        CHECK(merge_contacts(touching(s), list) == 1);
        CHECK(merge_contacts(touching(s + 0.05), list) == 0);
        CHECK(merge_contacts(touching(s - 0.05), list) == 0);
        CHECK(merge_contacts(touching(s + 0.13), list) == 1);
        CHECK(list.size() == 2);
    }
}
