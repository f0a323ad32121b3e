#include "tools/scenes/groom.h"

#include "schema/formula/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace keratin::scenes {

namespace {

using V = Vec3<double>;

V v(const Point& p) { return V(p[0], p[1], p[2]); }

struct Rest {
    std::vector<double> length;  // [points], 0 at the root
    std::vector<V> shape;        // [points], row 0: the director
};

Rest rest_of(const Line& line) {
    Rest r;
    r.length.push_back(0);
    V t = normalize_or(v(line[1]) - v(line[0]), V(0, 1, 0));
    V u = any_perpendicular(t);
    r.shape.push_back(u);
    for (std::size_t i = 1; i < line.size(); ++i) {
        const V e = v(line[i]) - v(line[i - 1]);
        r.length.push_back(length(e));
        r.shape.push_back(to_frame(t, u, e));
        const V next = normalize_or(e, t);
        u = transport_director(t, next, u);
        t = next;
    }
    return r;
}

}  // namespace

Line straight_line(const Point& root, const Point& direction, double length, std::uint32_t points) {
    Line line(points);
    for (std::uint32_t i = 0; i < points; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            line[i][c] = root[c] + direction[c] * length * i / (points - 1);
    return line;
}

std::vector<Line> hair_on_sphere(std::uint32_t count, std::uint32_t points, double radius,
                                 double length, double curl) {
    std::vector<Line> lines;
    const double golden = 2.399963229728653;  // rad
    for (std::uint32_t s = 0; s < count; ++s) {
        const double y = (s + 0.5) / count, ring = std::sqrt(1 - y * y), at = golden * s;
        const V n(ring * std::cos(at), y, ring * std::sin(at));
        const V a = any_perpendicular(n), b = cross(n, a);
        Line line(points);
        for (std::uint32_t i = 0; i < points; ++i) {
            const double f = double(i) / (points - 1), turn = 4 * 3.14159265358979 * f;
            const double grow = curl * std::min(1.0, 3 * f);
            const V p = n * (radius + length * f) + a * (grow * (std::cos(turn) - 1)) +
                        b * (grow * std::sin(turn));
            line[i] = {p.x, p.y, p.z};
        }
        lines.push_back(std::move(line));
    }
    return lines;
}

Groom thick_groom(std::uint32_t guides, std::uint32_t points, std::uint32_t strands_per_guide,
                  GroomOptions options) {
    // Guides sorted along a Morton curve over their roots, as a bake sorts them: tiles are compact.
    std::vector<Line> lines = hair_on_sphere(guides, points, 0.08, 0.25, 0.003);
    const auto key = [](const Line& line) {
        std::uint64_t code = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto v = std::uint64_t((line[0][c] + 0.1) * 5000) & 1023;
            for (std::uint64_t b = 0; b < 10; ++b) code |= (v >> b & 1) << (3 * b + c);
        }
        return code;
    };
    std::ranges::stable_sort(lines, {}, key);
    std::vector<Line> all;
    for (std::uint32_t g = 0; g < guides; ++g)
        for (std::uint32_t k = 0; k < strands_per_guide; ++k) {
            Line line = lines[g];
            for (Point& p : line) p[0] += 0.0002 * k, p[2] -= 0.0001 * k;
            all.push_back(std::move(line));
        }
    options.guide_every = strands_per_guide;
    options.guides_in_a_row = true;
    return make_groom(all, options);
}

Groom make_groom(std::span<const Line> strands, const GroomOptions& options) {
    Groom g;
    AssetInfo& info = g.info;
    info.attach = options.attach;
    info.groups.push_back(options.group);
    info.bones = options.bones;
    info.colliders = options.colliders;
    info.tool_version = "scenes";

    std::vector<std::uint32_t> guides;
    for (std::uint32_t s = 0; s < strands.size(); s += options.guide_every) guides.push_back(s);
    std::ranges::stable_sort(guides, {}, [&](std::uint32_t s) { return strands[s].size(); });
    info.guide_count = std::uint32_t(guides.size());
    const std::size_t quads =
        (guides.size() + kTileLanes * kQuadTiles - 1) / (kTileLanes * kQuadTiles);
    info.tile_count = std::uint32_t(quads * kQuadTiles);

    const auto guide_of = [&](std::size_t lane) -> std::int64_t {
        return lane < guides.size() ? std::int64_t(guides[lane]) : -1;
    };
    std::uint32_t row = 0;
    std::vector<std::uint32_t> rows_of_tile;
    for (std::size_t q = 0; q < quads; ++q) {
        std::size_t rows = 0;
        for (std::size_t l = q * 64; l < std::min(guides.size(), q * 64 + 64); ++l)
            rows = std::max(rows, strands[guides[l]].size());
        for (std::size_t t = 0; t < kQuadTiles; ++t) {
            g.tile_first_row.push_back(row);
            rows_of_tile.push_back(std::uint32_t(rows));
            row += std::uint32_t(rows);
        }
    }
    g.tile_first_row.push_back(row);
    info.row_count = row;

    g.guide_position.resize(std::size_t{row} * 48);
    g.guide_length.resize(std::size_t{row} * 16);
    g.guide_shape.resize(std::size_t{row} * 48);
    if (options.density) g.guide_density.resize(std::size_t{row} * 16);
    const std::size_t lanes = std::size_t{info.tile_count} * kTileLanes;
    g.guide_point_count.resize(lanes);
    g.guide_strand.assign(lanes, kNoStrand);
    g.guide_group.assign(lanes, 0);
    const bool bones = !options.bones.empty();
    const bool triangles = options.attach == Attach::triangle;
    if (bones) g.guide_bone.resize(lanes * 4), g.guide_bone_weight.resize(lanes * 4);
    if (triangles) g.guide_triangle.resize(lanes), g.guide_barycentric.resize(lanes * 2);

    const auto barycentric = [&](std::uint32_t s) {
        const auto& t = options.body.triangle[options.triangle_of_strand[s]];
        const auto corner = [&](int k) {
            const auto& p = options.body.vertex[t[std::size_t(k)]];
            return V(double(p[0]), double(p[1]), double(p[2]));
        };
        const V a = corner(0), e1 = corner(1) - a, e2 = corner(2) - a, p = v(strands[s][0]) - a;
        const double d11 = dot(e1, e1), d12 = dot(e1, e2), d22 = dot(e2, e2);
        const double p1 = dot(p, e1), p2 = dot(p, e2), det = d11 * d22 - d12 * d12;
        return std::array<float, 2>{float((d22 * p1 - d12 * p2) / det),
                                    float((d11 * p2 - d12 * p1) / det)};
    };

    for (std::size_t lane = 0; lane < lanes; ++lane) {
        const std::size_t tile = lane / kTileLanes, l = lane % kTileLanes;
        std::int64_t s = guide_of(lane);
        const bool empty = s < 0;
        if (empty) {  // repeats the last strand of its tile, or of the groom
            std::size_t other = lane;
            while (other > 0 && guide_of(other) < 0) --other;
            s = guide_of(other);
        }
        const Line& line = strands[std::size_t(s)];
        const Rest rest = rest_of(line);
        if (!empty) {
            g.guide_point_count[lane] = std::uint32_t(line.size());
            g.guide_strand[lane] = std::uint32_t(s);
        }
        for (std::uint32_t p = 0; p < rows_of_tile[tile]; ++p) {
            const std::size_t r = g.tile_first_row[tile] + p;
            const bool below = p >= line.size();
            const Point& x = line[below ? line.size() - 1 : p];
            for (std::size_t c = 0; c < 3; ++c)
                g.guide_position[vector_index(r, 3, c, l)] = float(x[c]);
            g.guide_length[scalar_index(r, l)] = below ? 0.0f : float(rest.length[p]);
            const V shape = below ? V(0, 0, 0) : rest.shape[p];
            g.guide_shape[vector_index(r, 3, 0, l)] = float(shape.x);
            g.guide_shape[vector_index(r, 3, 1, l)] = float(shape.y);
            g.guide_shape[vector_index(r, 3, 2, l)] = float(shape.z);
        }
        if (bones) {
            g.guide_bone[(tile * 4) * kTileLanes + l] = options.bone_of_strand[std::size_t(s)];
            g.guide_bone_weight[(tile * 4) * kTileLanes + l] = 1;
        }
        if (triangles) {
            g.guide_triangle[lane] = options.triangle_of_strand[std::size_t(s)];
            const auto uv = barycentric(std::uint32_t(s));
            g.guide_barycentric[(tile * 2) * kTileLanes + l] = uv[0];
            g.guide_barycentric[(tile * 2 + 1) * kTileLanes + l] = uv[1];
        }
    }

    for (std::size_t c = 0; c < 3; ++c) {
        info.bounds_min[c] = std::numeric_limits<float>::max();
        info.bounds_max[c] = std::numeric_limits<float>::lowest();
    }
    g.strand_first_point.push_back(0);
    for (std::uint32_t s = 0; s < strands.size(); ++s) {
        const Line& line = strands[s];
        double total = 0, at = 0;
        for (std::size_t p = 1; p < line.size(); ++p) total += length(v(line[p]) - v(line[p - 1]));
        for (std::size_t p = 0; p < line.size(); ++p) {
            if (p > 0) at += length(v(line[p]) - v(line[p - 1]));
            if (options.fractions)
                g.strand_fraction.push_back(p + 1 == line.size() ? 1.0f : float(at / total));
            for (std::size_t c = 0; c < 3; ++c) {
                const float x = float(line[p][c]);
                g.strand_position.push_back(x);
                info.bounds_min[c] = std::min(info.bounds_min[c], x);
                info.bounds_max[c] = std::max(info.bounds_max[c], x);
            }
        }
        g.strand_first_point.push_back(std::uint32_t(g.strand_position.size() / 3));
        g.strand_id.push_back(s);
        g.strand_group.push_back(0);

        // The three guides with the nearest roots. Guides on a line of three or more: all distinct.
        struct Near {
            double distance;
            std::uint32_t lane;
        };
        std::vector<Near> near;
        if (options.guides_in_a_row) {
            const std::uint32_t own = s / options.guide_every;
            for (std::uint32_t k = 0; k < 3; ++k)
                near.push_back({1.0 + k, std::min(own + k, std::uint32_t(guides.size()) - 1)});
        } else if (s % options.guide_every == 0) {
            const auto lane = std::uint32_t(std::ranges::find(guides, s) - guides.begin());
            near.assign(3, Near{1, lane});
            near[0].distance = 0;
        } else {
            for (std::uint32_t lane = 0; lane < guides.size(); ++lane)
                near.push_back({length(v(strands[guides[lane]][0]) - v(line[0])), lane});
            while (near.size() < 3) near.push_back(near.back());
            std::ranges::partial_sort(near, near.begin() + 3, {}, &Near::distance);
        }
        double sum = 0, w[3];
        for (std::size_t k = 0; k < 3; ++k) sum += w[k] = 1 / (near[k].distance + 1e-9);
        for (std::size_t k = 0; k < 3; ++k) {
            g.strand_guide.push_back(near[k].lane);
            g.strand_weight.push_back(float(w[k] / sum));
        }
        if (bones) {
            for (int k = 0; k < 4; ++k) {
                g.strand_bone.push_back(k == 0 ? options.bone_of_strand[s] : 0);
                g.strand_bone_weight.push_back(k == 0 ? 1.0f : 0.0f);
            }
        }
        if (triangles) {
            g.strand_triangle.push_back(options.triangle_of_strand[s]);
            const auto uv = barycentric(s);
            g.strand_barycentric.insert(g.strand_barycentric.end(), uv.begin(), uv.end());
        }
    }
    info.strand_count = std::uint32_t(strands.size());
    info.point_count = std::uint32_t(g.strand_position.size() / 3);
    if (triangles) {
        for (const auto& p : options.body.vertex)
            g.mesh_position.insert(g.mesh_position.end(), p.begin(), p.end());
        for (const auto& t : options.body.triangle)
            g.mesh_triangle.insert(g.mesh_triangle.end(), t.begin(), t.end());
        info.vertex_count = info.mesh_vertex_count = std::uint32_t(options.body.vertex.size());
        info.triangle_count = info.mesh_triangle_count =
            std::uint32_t(options.body.triangle.size());
    }
    if (options.density) {
        // Everything alike: the hair's mass over the box of the groom.
        double mass = 0, box = 1;
        const Material& m = options.group.material;
        for (float l : g.guide_length)
            mass += double(l) * double(m.density) * 3.14159265358979 * m.radius * m.radius2;
        for (std::size_t c = 0; c < 3; ++c)
            box *= std::max(1e-3, double(info.bounds_max[c]) - info.bounds_min[c]);
        std::ranges::fill(
            g.guide_density,
            float(mass * std::max(1.0, double(strands.size()) / double(guides.size())) / box));
    }
#define X(name, element, domain, components, presence, target, unit, meaning) \
    g.fields.name = g.name;
    KERATIN_ASSET_FIELDS(X)
#undef X
    return g;
}

}  // namespace keratin::scenes
