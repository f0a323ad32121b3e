#include "schema/asset_check.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <sstream>

namespace keratin {

namespace {

// Weights are written in float from normalised doubles; three or four of them sum to 1 within a
// few units in the last place. The bound leaves room for assets of other writers.
constexpr float kWeightSumTolerance = 1e-4f;
// A root lies in its triangle up to the rounding of its barycentrics.
constexpr float kBarycentricTolerance = 1e-4f;

// Stands for "none" in the fields that may say so.
constexpr std::uint32_t kNone = 0xffffffffu;
static_assert(kNone == kNoStrand && kNone == kNoBrick);
// Bricks along one side of a distance grid: keeps their product far from overflow.
constexpr std::uint32_t kMostBricks = 4096;

struct Check {
    const AssetInfo& info;
    const AssetFields& fields;
    const std::string& name;

    template <class... Parts>
    Error error(const Parts&... parts) const {
        std::ostringstream text;
        text.precision(9);
        (text << ... << parts);
        return {ErrorCode::input, name, text.str()};
    }

    template <class Element>
    Result<void> size(const FieldDescription& field, std::span<const Element> values) const {
        const std::uint64_t expected = domain_count(info, field.domain) * field.components;
        if (values.empty() && field.presence == Presence::optional) return {};
        if (values.size() != expected)
            return error(field.name, " has ", values.size(), " elements instead of ", expected);
        return {};
    }

    Result<void> numbers(const FieldDescription& field, std::span<const float> values) const {
        // Infinity and NaN have all exponent bits set.
        constexpr std::uint32_t kExponent = 0x7f800000u;
        bool finite = true;
        for (const float value : values)
            finite &= (std::bit_cast<std::uint32_t>(value) & kExponent) != kExponent;
        if (finite) return {};
        for (std::size_t i = 0; i < values.size(); ++i)
            if (!std::isfinite(values[i]))
                return error(field.name, "[", i, "] is ", values[i], " instead of a finite number");
        return {};
    }

    Result<void> numbers(const FieldDescription& field,
                         std::span<const std::uint32_t> values) const {
        if (field.target == Domain::none) return {};
        const std::uint64_t count = domain_count(info, field.target);
        std::uint32_t largest = 0;
        const bool may_be_none = field.name == "guide_strand" || field.name == "grid_brick";
        for (const std::uint32_t value : values)
            largest = std::max(largest, may_be_none && value == kNone ? 0u : value);
        if (values.empty() || (largest < count)) return {};
        for (std::size_t i = 0; i < values.size(); ++i)
            if (values[i] >= count && !(may_be_none && values[i] == kNone))
                return error(field.name, "[", i, "] is ", values[i], ", outside the ", count,
                             " it points into");
        return error(field.name, " points into nothing");
    }

    // A field and its companion come together.
    template <class A, class B>
    Result<void> together(const char* a_name, std::span<const A> a, const char* b_name,
                          std::span<const B> b) const {
        if (a.empty() != b.empty())
            return error(a.empty() ? b_name : a_name, " is there without ",
                         a.empty() ? a_name : b_name);
        return {};
    }

    Result<void> offsets(const char* field, std::span<const std::uint32_t> first,
                         std::uint32_t total, std::uint32_t least, std::uint32_t most) const {
        if (first.front() != 0) return error(field, "[0] is ", first.front(), " instead of 0");
        for (std::size_t i = 1; i < first.size(); ++i) {
            if (first[i] < first[i - 1])
                return error(field, "[", i, "] is ", first[i], ", less than the entry before it (",
                             first[i - 1], ")");
            const std::uint32_t count = first[i] - first[i - 1];
            if (count < least || count > most)
                return error(field, "[", i, "]: item ", i - 1, " has ", count, " points; ", least,
                             " to ", most, " are possible");
        }
        if (first.back() != total)
            return error(field, " ends at ", first.back(), " instead of ", total);
        return {};
    }

    Result<void> info_ranges() const;
    Result<void> distance_grid() const;
    Result<void> tiles() const;
    Result<void> render_strands() const;
    Result<void> mesh() const;
    Result<void> rod_strain() const;
    Result<void> weights(const char* field, std::span<const float> values, std::size_t components,
                         bool tiled) const;
    Result<void> barycentrics(const char* field, std::span<const float> values, bool tiled) const;
};

bool in_range(float value, float low, float high) { return value >= low && value <= high; }

Result<void> Check::info_ranges() const {
    if (info.groups.empty()) return error("groups is empty; an asset has at least one group");
    for (std::size_t g = 0; g < info.groups.size(); ++g) {
        const auto& [group_name, material, strand] = info.groups[g];
        const auto bad = [&](const char* what, auto value, const char* range) {
            return error("groups[", g, "] (", group_name, "): ", what, " is ", value, "; ", range);
        };
        const auto positive = [](float value) { return std::isfinite(value) && value > 0; };
        if (!positive(material.radius)) return bad("radius", material.radius, "it must be > 0");
        if (!positive(material.radius2)) return bad("radius2", material.radius2, "it must be > 0");
        if (!positive(material.density)) return bad("density", material.density, "it must be > 0");
        if (!positive(material.youngs_modulus))
            return bad("youngs_modulus", material.youngs_modulus, "it must be > 0");
        if (!(material.poisson_ratio > -1 && material.poisson_ratio <= 0.5f))
            return bad("poisson_ratio", material.poisson_ratio, "it must be in (-1, 0.5]");
        if (!(std::isfinite(material.viscosity) && material.viscosity >= 0))
            return bad("viscosity", material.viscosity, "it must be >= 0");
        if (strand.iterations < 1 || strand.iterations > 64)
            return bad("iterations", strand.iterations, "it must be in 1..64");
        if (!in_range(strand.global_length, 0, 1))
            return bad("global_length", strand.global_length, "it must be in [0, 1]");
        if (!in_range(strand.length_damping, 0, 1))
            return bad("length_damping", strand.length_damping, "it must be in [0, 1]");
        const auto ramp = [&](const char* what, const Ramp& values, float high) -> Result<void> {
            if (values.empty())
                return error("groups[", g, "] (", group_name, "): ", what, " is empty");
            for (const float value : values)
                if (!(std::isfinite(value) && in_range(value, 0, high)))
                    return bad(what, value, high == 1 ? "it must be in [0, 1]" : "it must be >= 0");
            return {};
        };
        constexpr float kUnbounded = 3.4e38f;
        if (auto ok = ramp("damping", strand.damping, 1); !ok) return ok;
        if (auto ok = ramp("friction", strand.friction, 1); !ok) return ok;
        if (auto ok = ramp("volume", strand.volume, kUnbounded); !ok) return ok;
        if (auto ok = ramp("wind_response", strand.wind_response, kUnbounded); !ok) return ok;
    }
    for (std::size_t c = 0; c < info.colliders.size(); ++c) {
        const AssetCollider& collider = info.colliders[c];
        bool finite = std::isfinite(collider.radius) && collider.radius > 0;
        for (int axis = 0; axis < 3; ++axis)
            finite = finite && std::isfinite(collider.a[axis]) && std::isfinite(collider.b[axis]);
        if (!finite)
            return error("colliders[", c, "] needs finite ends and a radius > 0, it has radius ",
                         collider.radius);
        if (collider.bone >= std::max<std::size_t>(1, info.bones.size()))
            return error("colliders[", c, "].bone is ", collider.bone, ", outside the ",
                         info.bones.size(), " bones");
    }
    if (!(std::isfinite(info.packed_max_error) && info.packed_max_error >= 0))
        return error("packed_max_error is ", info.packed_max_error, "; it must be >= 0");
    for (std::size_t i = 0; i < info.levels.size(); ++i) {
        const auto& [strands, scale] = info.levels[i];
        if (strands < 1 || strands >= (i > 0 ? info.levels[i - 1].strand_count : info.strand_count))
            return error("levels[", i, "] has ", strands,
                         " strands; levels have fewer and fewer, all fewer than the asset");
        const float least = i > 0 ? info.levels[i - 1].width_scale : 1;
        if (!(std::isfinite(scale) && scale >= least))
            return error("levels[", i, "] scales widths by ", scale, "; it must be >= ", least);
    }
    const GuideError& guides = info.guide_error;
    for (const float distance : {guides.mean, guides.p95, guides.max})
        if (!(std::isfinite(distance) && distance >= 0))
            return error("guide_error holds ", distance, "; it must be >= 0");
    for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(info.bounds_min[axis]) || !std::isfinite(info.bounds_max[axis]))
            return error("the bounds are not finite");
    return {};
}

Result<void> Check::distance_grid() const {
    const DistanceGridInfo& grid = info.distance_grid;
    if (auto ok = together("grid_brick", fields.grid_brick, "grid_distance", fields.grid_distance);
        !ok)
        return ok;
    if (fields.grid_brick.empty()) return {};
    bool finite = std::isfinite(grid.spacing) && grid.spacing > 0 &&
                  std::isfinite(grid.max_error) && grid.max_error >= 0;
    for (const float coordinate : grid.origin) finite = finite && std::isfinite(coordinate);
    if (!finite)
        return error("distance_grid needs a finite origin and a spacing > 0, it has ",
                     grid.spacing);
    for (const std::uint32_t count : grid.bricks)
        if (count > kMostBricks)
            return error("distance_grid has ", count, " bricks along a side; ", kMostBricks,
                         " are possible");
    if (grid.bone >= std::max<std::size_t>(1, info.bones.size()))
        return error("distance_grid.bone is ", grid.bone, ", outside the ", info.bones.size(),
                     " bones");
    return {};
}

Result<void> Check::tiles() const {
    if (info.tile_count % kQuadTiles != 0)
        return error("tile_count is ", info.tile_count, ", not a multiple of ", kQuadTiles);
    const auto& first = fields.tile_first_row;
    if (auto ok = offsets("tile_first_row", first, info.row_count, kBakeMinPoints, kBakeMaxPoints);
        !ok)
        return ok;
    std::uint32_t guide_count = 0;
    for (std::size_t t = 0; t < info.tile_count; ++t) {
        const std::size_t quad_tile = t - t % kQuadTiles;
        const std::uint32_t rows = first[t + 1] - first[t];
        if (rows != first[quad_tile + 1] - first[quad_tile])
            return error("tile ", t, " has ", rows, " rows, another tile of its four has ",
                         first[quad_tile + 1] - first[quad_tile]);
        for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
            const std::size_t guide = scalar_index(t, lane);
            const std::uint32_t points = fields.guide_point_count[guide];
            if (points > rows || points == 1)
                return error("guide_point_count[", guide, "] is ", points, "; its tile has ", rows,
                             " rows, a guide at least 2 points");
            if ((points == 0) != (fields.guide_strand[guide] == kNoStrand))
                return error("guide_strand[", guide, "] and guide_point_count[", guide,
                             "] disagree on whether the lane is empty");
            if (fields.guide_group[guide] != fields.guide_group[scalar_index(quad_tile, 0)])
                return error("guide_group[", guide, "] differs within its four tiles");
            guide_count += points > 0;
            for (std::size_t p = 0; p < rows; ++p) {
                const std::size_t at = scalar_index(first[t] + p, lane);
                const float length = fields.guide_length[at];
                const bool segment = p > 0 && p < points;
                if (segment ? !(length > 0) : (points > 0 && length != 0))
                    return error("guide_length[", at, "] is ", length,
                                 "; a segment needs a length > 0",
                                 ", the root and rows below the tip 0");
            }
        }
    }
    if (guide_count != info.guide_count)
        return error("guide_count is ", info.guide_count, " instead of ", guide_count);
    return {};
}

Result<void> Check::rod_strain() const {
    const auto& strain = fields.guide_rod_strain;
    static constexpr struct {
        const char* what;
        float most;
    } kRange[] = {{"stretch", kMostRodStretch},
                  {"bend", kMostRodBend},
                  {"bend", kMostRodBend},
                  {"twist", kMostRodTwist}};
    for (std::size_t row = 0; row < strain.size() / (4 * kTileLanes); ++row)
        for (std::size_t c = 0; c < 4; ++c)
            for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
                const std::size_t at = vector_index(row, 4, c, lane);
                if (!in_range(strain[at], -kRange[c].most, kRange[c].most))
                    return error("guide_rod_strain[", at, "] is a ", kRange[c].what, " of ",
                                 strain[at], "; it must be in [", -kRange[c].most, ", ",
                                 kRange[c].most, "]");
            }
    return {};
}

Result<void> Check::weights(const char* field, std::span<const float> values,
                            std::size_t components, bool tiled) const {
    const std::size_t count = values.size() / components;
    for (std::size_t i = 0; i < count; ++i) {
        if (tiled && fields.guide_point_count[i] == 0) continue;
        float sum = 0;
        for (std::size_t k = 0; k < components; ++k) {
            const float weight =
                values[tiled ? vector_index(i / kTileLanes, components, k, i % kTileLanes)
                             : i * components + k];
            if (!in_range(weight, -kWeightSumTolerance, 1 + kWeightSumTolerance))
                return error(field, ": item ", i, " has weight ", weight, ", outside [0, 1]");
            sum += weight;
        }
        if (std::abs(sum - 1) > kWeightSumTolerance)
            return error(field, ": the weights of item ", i, " sum to ", sum, " instead of 1");
    }
    return {};
}

Result<void> Check::barycentrics(const char* field, std::span<const float> values,
                                 bool tiled) const {
    for (std::size_t i = 0; i < values.size() / 2; ++i) {
        if (tiled && fields.guide_point_count[i] == 0) continue;
        const float u = values[tiled ? vector_index(i / kTileLanes, 2, 0, i % kTileLanes) : i * 2];
        const float v =
            values[tiled ? vector_index(i / kTileLanes, 2, 1, i % kTileLanes) : i * 2 + 1];
        if (u < -kBarycentricTolerance || v < -kBarycentricTolerance ||
            u + v > 1 + kBarycentricTolerance)
            return error(field, ": item ", i, " is (", u, ", ", v, "), outside its triangle");
    }
    return {};
}

Result<void> Check::render_strands() const {
    if (auto ok = offsets("strand_first_point", fields.strand_first_point, info.point_count,
                          kBakeMinPoints, kBakeMaxPoints);
        !ok)
        return ok;
    for (std::size_t i = 0; i < fields.strand_guide.size(); ++i)
        if (fields.guide_point_count[fields.strand_guide[i]] == 0)
            return error("strand_guide[", i, "] is ", fields.strand_guide[i], ", an empty lane");
    for (std::size_t i = 0; i < fields.strand_radius.size(); ++i)
        if (!(fields.strand_radius[i] > 0))
            return error("strand_radius[", i, "] is ", fields.strand_radius[i], "; it must be > 0");
    for (std::size_t i = 0; i < fields.strand_fraction.size(); ++i)
        if (!in_range(fields.strand_fraction[i], 0, 1))
            return error("strand_fraction[", i, "] is ", fields.strand_fraction[i],
                         ", outside [0, 1]");
    if (auto ok = weights("strand_weight", fields.strand_weight, 3, false); !ok) return ok;
    if (auto ok = weights("strand_bone_weight", fields.strand_bone_weight, 4, false); !ok)
        return ok;
    if (auto ok = weights("guide_bone_weight", fields.guide_bone_weight, 4, true); !ok) return ok;
    if (auto ok = barycentrics("strand_barycentric", fields.strand_barycentric, false); !ok)
        return ok;
    return barycentrics("guide_barycentric", fields.guide_barycentric, true);
}

Result<void> Check::mesh() const {
    if (auto ok = together("guide_bone", fields.guide_bone, "guide_bone_weight",
                           fields.guide_bone_weight);
        !ok)
        return ok;
    if (auto ok = together("strand_bone", fields.strand_bone, "strand_bone_weight",
                           fields.strand_bone_weight);
        !ok)
        return ok;
    if (auto ok = together("guide_bone", fields.guide_bone, "strand_bone", fields.strand_bone); !ok)
        return ok;
    if (auto ok = together("guide_triangle", fields.guide_triangle, "guide_barycentric",
                           fields.guide_barycentric);
        !ok)
        return ok;
    if (auto ok = together("strand_triangle", fields.strand_triangle, "strand_barycentric",
                           fields.strand_barycentric);
        !ok)
        return ok;
    if (auto ok = together("guide_triangle", fields.guide_triangle, "strand_triangle",
                           fields.strand_triangle);
        !ok)
        return ok;
    if (auto ok =
            together("mesh_position", fields.mesh_position, "mesh_triangle", fields.mesh_triangle);
        !ok)
        return ok;
    if (info.vertex_count > info.mesh_vertex_count ||
        info.triangle_count > info.mesh_triangle_count)
        return error("more mesh vertices or triangles are stored than the source mesh has");
    if (!fields.mesh_position.empty() && fields.mesh_vertex_source.empty() &&
        info.vertex_count != info.mesh_vertex_count)
        return error("mesh_vertex_source is missing");
    if (!fields.mesh_triangle.empty() && fields.mesh_triangle_source.empty() &&
        info.triangle_count != info.mesh_triangle_count)
        return error("mesh_triangle_source is missing");
    const auto& source = fields.mesh_triangle_source;
    for (std::size_t i = 1; i < source.size(); ++i)
        if (source[i] <= source[i - 1])
            return error("mesh_triangle_source[", i, "] is ", source[i],
                         ", not above the entry before it");
    if (info.attach != Attach::triangle) return {};

    if (fields.guide_triangle.empty() || fields.mesh_triangle.empty())
        return error("attach is triangle, but the asset has no ",
                     fields.guide_triangle.empty() ? "guide_triangle" : "stored mesh");
    const auto stored = [&](std::uint32_t triangle) {
        return source.empty() || std::binary_search(source.begin(), source.end(), triangle);
    };
    for (std::size_t i = 0; i < fields.guide_triangle.size(); ++i)
        if (fields.guide_point_count[i] > 0 && !stored(fields.guide_triangle[i]))
            return error("guide_triangle[", i, "] is ", fields.guide_triangle[i],
                         ", which is not stored");
    for (std::size_t i = 0; i < fields.strand_triangle.size(); ++i)
        if (!stored(fields.strand_triangle[i]))
            return error("strand_triangle[", i, "] is ", fields.strand_triangle[i],
                         ", which is not stored");
    return {};
}

}  // namespace

Result<void> check_asset(const AssetInfo& info, const AssetFields& fields,
                         const std::string& name) {
    const Check check{info, fields, name};
    Result<void> result;
    for_each_field(fields, [&](const FieldDescription& field, auto values) {
        if (result) result = check.size(field, values);
        if (result) result = check.numbers(field, values);
    });
    if (result) result = check.info_ranges();
    if (result) result = check.distance_grid();
    if (result) result = check.tiles();
    if (result) result = check.rod_strain();
    if (result) result = check.render_strands();
    if (result) result = check.mesh();
    return result;
}

}  // namespace keratin
