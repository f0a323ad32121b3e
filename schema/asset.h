// What an asset says about itself besides its bulk fields: plain values that the writer takes and
// the opener hands out. Lengths in m, SI units.
#pragma once

#include "schema/fields.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// The revision of the format this code writes. A reader refuses another major revision; a minor
// revision only adds fields.
inline constexpr std::uint16_t kAssetMajor = 1;
inline constexpr std::uint16_t kAssetMinor = 2;

// Largest strains in guide_rod_strain: of an edge, omega of a joint about either axis, its twist
// (rad).
inline constexpr float kMostRodStretch = 0.5f, kMostRodBend = 8, kMostRodTwist = 30;

struct Hash128 {
    std::uint64_t low = 0, high = 0;
    bool operator==(const Hash128&) const = default;
};

// What carries the roots (METHODS 1.1).
enum class Attach : std::uint8_t {
    bone,     // the first segment follows bones (or the asset's one rigid motion)
    all,      // every point follows, nothing is simulated
    triangle  // the root follows its mesh triangle
};

// Values at equal steps of arc length from root to tip, linear between; one value: constant.
using Ramp = std::vector<float>;

// METHODS 1. Gains "per 1/60 s" are normalised by the step at run time.
struct StrandParameters {
    Ramp damping{0.05f};           // 0..1, share of the velocity lost per 1/60 s
    Ramp friction{0.0f};           // 0..1, blend towards the grid's mean displacement per 1/60 s
    Ramp volume{0.0f};             // m^2/s^2, k_v
    std::uint32_t iterations = 4;  // 1..64 constraint iterations a step
    float global_length =
        0.1f;  // 0..1, factor inside the iterations; a full pass always ends a step
    float length_damping = 0.9f;  // 0..1, s_damp
    Ramp wind_response{1.0f};     // >= 0, factor on the wind's force
    bool operator==(const StrandParameters&) const = default;
};

struct Material {
    float radius = 4e-5f;         // m; semi-axis along m1 when elliptic
    float radius2 = 4e-5f;        // m; semi-axis along m2
    float density = 1300;         // kg/m^3
    float youngs_modulus = 2e9f;  // Pa
    float poisson_ratio = 0.48f;  // -1..0.5
    float viscosity = 0;          // Pa s
    bool operator==(const Material&) const = default;
};

struct GroupInfo {
    std::string name;
    Material material;
    StrandParameters strand;
};

// A collider fitted to the body, in groom space; a == b for a sphere.
struct AssetCollider {
    std::array<float, 3> a{}, b{};  // m, ends of the core segment
    float radius = 0;               // m
    std::uint32_t bone = 0;         // that carries it; 0 when the asset has no bones
};

// Signed distances to the mesh in groom space on a sparse grid; absent when bricks are 0. Node (0,
// 0, 0) of brick (0, 0, 0) stands at origin; layout of a brick: schema/layout.h.
struct DistanceGridInfo {
    std::array<float, 3> origin{};          // m
    float spacing = 0;                      // m between nodes
    std::array<std::uint32_t, 3> bricks{};  // along x, y, z
    std::uint32_t stored_bricks = 0;
    std::uint32_t bone = 0;  // that carries it; 0 when the asset has no bones
    float max_error = 0;     // m, measured at the mesh and half-way between nodes
};

// How wide the first strand_count render strands are drawn to cover what all cover at width 1: the
// sum of length times radius of all strands over that of the prefix.
struct LevelOfDetail {
    std::uint32_t strand_count = 0;
    float width_scale = 1;
    bool operator==(const LevelOfDetail&) const = default;
};

// Factor on the widths when the first `drawn` of `strand_count` render strands are drawn: the covered
// share runs straight between the levels. Without levels (assets before revision 1.1), or above the
// first, every strand counts alike. 1 when nothing is drawn.
float width_scale(std::span<const LevelOfDetail> levels, std::uint32_t strand_count,
                  std::uint32_t drawn);

// How far render strands, interpolated from the guides, were from where they would have been had
// they been simulated themselves, in a motion of the bake's own (bake/stage/motion.h).
struct GuideError {
    std::string method;             // by which the guides were chosen; empty: not measured
    float mean = 0, p95 = 0, max = 0;  // m, over points and frames
    bool operator==(const GuideError&) const = default;
};

// A file the bake read: its role, its name without folder, the hash of its content.
struct InputRecord {
    std::string role;  // "curves", "mesh", "bones"
    std::string name;
    Hash128 hash;
};

struct AssetInfo {
    std::uint16_t format_major = kAssetMajor, format_minor = kAssetMinor;
    std::string tool_version;
    Hash128 file_hash;            // XXH3-128 over the file with this field zeroed
    std::uint64_t file_size = 0;  // bytes
    Hash128 recipe_hash;          // of the recipe's text
    std::vector<InputRecord> inputs;

    Attach attach = Attach::bone;
    std::vector<GroupInfo> groups;   // at least one
    std::vector<std::string> bones;  // empty: one rigid motion carries everything
    std::vector<AssetCollider> colliders;
    DistanceGridInfo distance_grid;
    std::vector<LevelOfDetail> levels;  // fewer and fewer strands; empty: not stored
    GuideError guide_error;
    bool packed = false;          // the file holds strand_position in 16 bits a coordinate
    float packed_max_error = 0;   // m, distance of a stored point from the baked one

    std::uint32_t tile_count = 0;      // multiple of kQuadTiles
    std::uint32_t row_count = 0;       // = tile_first_row[tile_count]
    std::uint32_t guide_count = 0;     // lanes with points
    std::uint32_t strand_count = 0;    // render strands
    std::uint32_t point_count = 0;     // render points
    std::uint32_t vertex_count = 0;    // stored mesh vertices
    std::uint32_t triangle_count = 0;  // stored mesh triangles

    // The body the roots were bound to; zero without one. The hash is over the triangles' vertex
    // indices as read: a mesh with another topology cannot carry these roots.
    std::uint32_t mesh_vertex_count = 0, mesh_triangle_count = 0;
    Hash128 mesh_topology_hash;

    std::array<float, 3> bounds_min{}, bounds_max{};  // m, of all rest positions of strands
};

// Number of items of a domain, from the counts in info; tile_edge and strand_edge count one more.
std::uint64_t domain_count(const AssetInfo& info, Domain domain);

}  // namespace keratin
