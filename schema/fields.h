// The bulk fields of an asset, listed once. The writer, the opener with its range checks, the diff,
// the inspector and the tests walk this list; nothing about a field is said anywhere else.
//
// KERATIN_ASSET_FIELDS(X) expands to one line a field:
//   X(name, element, domain, components, presence, target, unit, meaning)
//     element     std::uint32_t or float
//     domain      what there is one of (see Domain); the number of elements is the domain's count
//                 times components
//     presence    always | optional (absent when the asset does not need it)
//     target      for indices: the Domain they must stay inside; none for numbers
//     unit        of one element; "1" for pure numbers and indices
//
// The file may hold strand_position packed (schema/packed_positions.h); the opener unpacks it.
//
// Index layout of the tiled domains (lane, row): schema/layout.h. All other domains are
// interleaved: component c of item i at i * components + c. The groom space of an asset is metres,
// y up, right-handed, with the body in the pose it was bound in.
#pragma once

#include "schema/layout.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace keratin {

enum class Domain {
    none,
    tile_edge,     // tiles + 1: offsets
    lane,          // tiles x 16: one a guide strand, tiled
    row,           // rows x 16: one a guide point, tiled
    strand,        // render strands
    strand_edge,   // render strands + 1: offsets
    point,         // render points
    vertex,        // stored mesh vertices
    triangle,      // stored mesh triangles
    group,         // index target only
    bone,          // index target only
    mesh_vertex,   // index target only: vertices of the source mesh
    mesh_triangle, // index target only: triangles of the source mesh
    brick,         // bricks of the distance grid, x fastest, stored or not
    brick_node,    // stored bricks x 125 nodes
    stored_brick   // index target only
};

enum class Presence { always, optional };

// clang-format off
#define KERATIN_ASSET_FIELDS(X)                                                                                         \
    X(tile_first_row,    std::uint32_t, tile_edge,   1, always,   none,          "1", "first row of each tile; the last entry is the number of rows")            \
    X(guide_point_count, std::uint32_t, lane,        1, always,   none,          "1", "points of the guide, 0 for an empty lane")                                 \
    X(guide_strand,      std::uint32_t, lane,        1, always,   strand,        "1", "render strand that the guide is; kNoStrand for an empty lane")             \
    X(guide_group,       std::uint32_t, lane,        1, always,   group,         "1", "group; one group a quad of tiles")                                         \
    X(guide_position,    float,         row,         3, always,   none,          "m", "rest position")                                                            \
    X(guide_length,      float,         row,         1, always,   none,          "m", "rest length of the segment that ends here; 0 in row 0")                    \
    X(guide_shape,       float,         row,         3, always,   none,          "m", "rest edge that ends here in its parent's frame, METHODS 1.4; row 0: first edge's unit director u of the root frame (schema/formula/frame.h)") \
    X(guide_density,     float,         row,         1, optional, none,          "kg/m^3", "rest density of the groom at the point (volume preservation)")        \
    X(guide_bone,        std::uint32_t, lane,        4, optional, bone,          "1", "bones that carry the root")                                                \
    X(guide_bone_weight, float,         lane,        4, optional, none,          "1", "their weights, sum 1")                                                     \
    X(guide_triangle,    std::uint32_t, lane,        1, optional, mesh_triangle, "1", "source mesh triangle nearest to the root")                                 \
    X(guide_barycentric, float,         lane,        2, optional, none,          "1", "barycentrics (u, v) of the root, schema/formula/barycentric.h")            \
    X(strand_first_point,std::uint32_t, strand_edge, 1, always,   none,          "1", "first point of each render strand; the last entry is the number of points") \
    X(strand_position,   float,         point,       3, always,   none,          "m", "rest position")                                                            \
    X(strand_fraction,   float,         point,       1, optional, none,          "1", "arc length from the root over the strand's length; absent when point p of n stands at p/(n-1)") \
    X(strand_guide,      std::uint32_t, strand,      3, always,   lane,          "1", "lane index of the three guides")                                           \
    X(strand_weight,     float,         strand,      3, always,   none,          "1", "their weights, sum 1")                                                     \
    X(strand_id,         std::uint32_t, strand,      1, always,   none,          "1", "number of the strand in the curves as read, counted through all files, or the authored id") \
    X(strand_group,      std::uint32_t, strand,      1, always,   group,         "1", "group")                                                                    \
    X(strand_radius,     float,         strand,      1, optional, none,          "m", "radius at the root; absent: the group's")                                  \
    X(strand_bone,       std::uint32_t, strand,      4, optional, bone,          "1", "bones that carry the root")                                                \
    X(strand_bone_weight,float,         strand,      4, optional, none,          "1", "their weights, sum 1")                                                     \
    X(strand_triangle,   std::uint32_t, strand,      1, optional, mesh_triangle, "1", "source mesh triangle nearest to the root")                                 \
    X(strand_barycentric,float,         strand,      2, optional, none,          "1", "barycentrics (u, v) of the root, schema/formula/barycentric.h")            \
    X(strand_uv,         float,         strand,      2, optional, none,          "1", "texture coordinate at the root")                                           \
    X(mesh_position,     float,         vertex,      3, optional, none,          "m", "rest position of a stored mesh vertex")                                    \
    X(mesh_uv,           float,         vertex,      2, optional, none,          "1", "texture coordinate of a stored mesh vertex")                               \
    X(mesh_vertex_source,std::uint32_t, vertex,      1, optional, mesh_vertex,   "1", "its number in the source mesh; absent: the same")                          \
    X(mesh_triangle,     std::uint32_t, triangle,    3, optional, vertex,        "1", "stored vertices of a stored triangle")                                     \
    X(mesh_triangle_source, std::uint32_t, triangle, 1, optional, mesh_triangle, "1", "its number in the source mesh, ascending; absent: the same") \
    X(grid_brick,        std::uint32_t, brick,       1, optional, stored_brick,  "1", "stored brick of the distance grid; kNoBrick: all of it lies outside the mesh") \
    X(grid_distance,     float,         brick_node,  1, optional, none,          "m", "signed distance of a node to the mesh, negative inside") \
    X(guide_rod_strain,  float,         row,         4, optional, none,          "1", "rod: elastic strain that the groomed pose is under, of the segment that ends here (stretch |e|/|e_rest| - 1) and of the joint at its start (bend omega about m2 and -m1, METHODS 2.2; twist in rad); absent: the rest shape is the groom")
// clang-format on

// The fields as spans, member for member as listed above; an absent field is empty. Written by
// bake/write, handed out by AssetView: the spans never own.
struct AssetFields {
#define X(name, element, domain, components, presence, target, unit, meaning) \
    std::span<const element> name;
    KERATIN_ASSET_FIELDS(X)
#undef X
};

struct FieldDescription {
    std::string_view name;
    bool is_float;
    Domain domain;
    std::size_t components;
    Presence presence;
    Domain target;
    std::string_view unit;
    std::string_view meaning;
};

inline constexpr auto kAssetFields = std::to_array<FieldDescription>({
#define X(name, element, domain, components, presence, target, unit, meaning) \
    {#name,                                                                   \
     std::is_same_v<element, float>,                                          \
     Domain::domain,                                                          \
     components,                                                              \
     Presence::presence,                                                      \
     Domain::target,                                                          \
     unit,                                                                    \
     meaning},
    KERATIN_ASSET_FIELDS(X)
#undef X
});

// Calls visit(description, span) for each field in the order of the list.
template <class Visit>
void for_each_field(const AssetFields& fields, Visit&& visit) {
    std::size_t i = 0;
#define X(name, element, domain, components, presence, target, unit, meaning) \
    visit(kAssetFields[i++], fields.name);
    KERATIN_ASSET_FIELDS(X)
#undef X
}

}  // namespace keratin
