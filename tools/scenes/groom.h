// Assets made in memory: strands as points go in, the fields of an asset come out, tiled, sorted
// and padded as schema/layout.h asks. For tests, reports and the bench; keratin-bake makes real
// ones.
#pragma once

#include "schema/asset.h"
#include "schema/fields.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace keratin::scenes {

using Point = std::array<double, 3>;
using Line = std::vector<Point>;  // root first

struct Body {
    std::vector<std::array<float, 3>> vertex;
    std::vector<std::array<std::uint32_t, 3>> triangle;
};

struct GroomOptions {
    std::uint32_t guide_every = 1;  // every n-th strand is a guide
    Attach attach = Attach::bone;
    GroupInfo group;  // one group for all
    std::vector<std::string> bones;
    // With bones: bone of each strand, weight 1.
    std::vector<std::uint32_t> bone_of_strand;
    // With triangles: body and the triangle of each strand's root.
    Body body;
    std::vector<std::uint32_t> triangle_of_strand;
    bool density = false;    // store a density of the groom at rest
    bool fractions = false;  // store the arc-length fractions
    std::vector<AssetCollider> colliders;
    // The three guides of a strand are its own and the next two in the order given, not the
    // nearest: for large grooms whose order is spatial already.
    bool guides_in_a_row = false;
};

// Owns the vectors that `fields` points into; can be moved, not copied.
struct Groom {
    AssetInfo info;
    AssetFields fields;
#define X(name, element, domain, components, presence, target, unit, meaning) \
    std::vector<element> name;
    KERATIN_ASSET_FIELDS(X)
#undef X

    Groom() = default;
    Groom(Groom&&) = default;
    Groom& operator=(Groom&&) = default;
    Groom(const Groom&) = delete;
    Groom& operator=(const Groom&) = delete;
};

// Each line has 2..1024 points (guides: 3..32 for the strand solver). Three guides of a render
// strand are those with the nearest roots, weighted by the inverse distance.
Groom make_groom(std::span<const Line> strands, const GroomOptions& options);

// One straight strand from `root` along the unit `direction`.
Line straight_line(const Point& root, const Point& direction, double length, std::uint32_t points);

// Hair on the upper half of a sphere about the origin, roots evenly spread (Fibonacci lattice),
// leaving along the normal. `curl` (m): radius of a helix wound around the straight line, two
// turns.
std::vector<Line> hair_on_sphere(std::uint32_t count, std::uint32_t points, double radius,
                                 double length, double curl);

// A head of hair as a bake would order it: guides on a sphere of 8 cm, 25 cm long, sorted so that
// tiles are compact; strands_per_guide render strands each, the first of them the guide itself.
Groom thick_groom(std::uint32_t guides, std::uint32_t points, std::uint32_t strands_per_guide,
                  GroomOptions options);

}  // namespace keratin::scenes
