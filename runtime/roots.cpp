// The pass `skin`: root transforms from bones, triangles or the one motion of the asset.
#include "runtime/parallel.h"
#include "runtime/state.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace keratin {

namespace {

using Root = RootTransform<float>;

Vec3f vertex(std::span<const float> positions, std::uint32_t v) {
    return mesh_vertex<float>(positions, v);
}

Root bone_root(const Simulation::State& s, const std::uint32_t bone[4], const float weight[4],
               const Vec3f& rest) {
    return keratin::bone_root<float>(s.bone_world, s.settings.origin, bone, weight, rest);
}

Root triangle_root(const Simulation::State& s, std::uint32_t slot, float u, float v,
                   const Vec3f& rest) {
    return keratin::triangle_root<float>(s.fields.mesh_triangle.data() + std::size_t{slot} * 3,
                                         s.fields.mesh_position, s.mesh_next.span(), u, v,
                                         s.motion_next, s.settings.origin, rest);
}

void write_lane(float* tile, std::size_t lane, const Root& r) {
    const float v[kRootFloats] = {r.rotation.x,    r.rotation.y,    r.rotation.z,   r.rotation.w,
                                  r.translation.x, r.translation.y, r.translation.z};
    for (std::size_t c = 0; c < kRootFloats; ++c) tile[c * kTileLanes + lane] = v[c];
}

Root read_lane(const float* tile, std::size_t lane) {
    const auto at = [&](std::size_t c) { return tile[c * kTileLanes + lane]; };
    return {Vec4f(at(0), at(1), at(2), at(3)), Vec3f(at(4), at(5), at(6))};
}

// Whether a root that stands at `rest` in the groom goes further than `far` or turns by more than a
// right angle: |w| = cos(angle / 2) is below cos 45 degrees then.
bool jumped(const Root& a, const Root& b, const Vec3f& rest, float far) {
    const Vec3f move =
        rotate(b.rotation, rest) + b.translation - rotate(a.rotation, rest) - a.translation;
    return length(move) > far || std::fabs(dot(a.rotation, b.rotation)) < 0.70710678f;
}

}  // namespace

void pose_bones(Simulation::State& s) {
    if (s.bones_next.empty())
        s.bone_world[0] = s.motion_next;
    else
        for (std::size_t b = 0; b < s.bones_next.size(); ++b)
            s.bone_world[b] = chained(s.motion_next, s.bones_next[b]);
}

void skin_guides(Simulation::State& s) {
    if (s.shape.one_motion) {
        const Root root = relative<float>(s.motion_next, s.settings.origin);
        for (std::size_t lane = 0; lane < kTileLanes; ++lane)
            write_lane(s.root_end.data(), lane, root);
        return;
    }
    std::atomic<std::uint64_t> refused = 0;
    const std::size_t even = even_grain(s.shape.tiles, s.threads);
    share(s.settings.host, s.threads, s.shape.tiles, even, [&](std::size_t tile) {
        float* out = s.root_end.data() + tile * kRootFloats * kTileLanes;
        for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
            const std::size_t index = tile * kTileLanes + lane;
            const float* p = s.fields.guide_position.data() + s.tile_row(tile) * 48 + lane;
            const Vec3f rest(p[0], p[16], p[32]);
            Root root;
            if (s.shape.by_triangle) {
                const float* bary =
                    s.fields.guide_barycentric.data() + tile * 2 * kTileLanes + lane;
                root = triangle_root(s, s.guide_triangle_slot[index], bary[0], bary[kTileLanes],
                                     rest);
            } else {
                std::uint32_t bone[4];
                float weight[4];
                for (std::size_t k = 0; k < 4; ++k) {
                    const std::size_t place = (tile * 4 + k) * kTileLanes + lane;
                    bone[k] = s.fields.guide_bone[place];
                    weight[k] = s.fields.guide_bone_weight[place];
                }
                root = bone_root(s, bone, weight, rest);
            }
            if (finite(root))
                write_lane(out, lane, root);
            else if (s.fields.guide_point_count[index] > 0)
                ++refused;
        }
    });
    s.health.roots_refused += refused;
}

void skin_strands(Simulation::State& s) {
    if (s.shape.one_motion) {
        const Root root = relative<float>(s.motion_next, s.settings.origin);
        const float v[kRootFloats] = {root.rotation.x,   root.rotation.y,    root.rotation.z,
                                      root.rotation.w,   root.translation.x, root.translation.y,
                                      root.translation.z};
        std::copy(v, v + kRootFloats, s.strand_root.data());
        return;
    }
    const std::size_t even = even_grain(s.strand_count, s.threads);
    share(s.settings.host, s.threads, s.strand_count, even, [&](std::size_t i) {
        const Vec3f rest = vertex(s.fields.strand_position, s.fields.strand_first_point[i]);
        Root root;
        if (s.shape.by_triangle) {
            const float* bary = s.fields.strand_barycentric.data() + i * 2;
            root = triangle_root(s, s.strand_triangle_slot[i], bary[0], bary[1], rest);
        } else {
            root = bone_root(s, s.fields.strand_bone.data() + i * 4,
                             s.fields.strand_bone_weight.data() + i * 4, rest);
        }
        if (!finite(root)) return;
        float* out = s.strand_root.data() + i * kRootFloats;
        out[0] = root.rotation.x, out[1] = root.rotation.y, out[2] = root.rotation.z;
        out[3] = root.rotation.w, out[4] = root.translation.x, out[5] = root.translation.y;
        out[6] = root.translation.z;
    });
}

std::uint64_t carry_jumps(Simulation::State& s, bool all, Velocity velocity) {
    const float far = s.settings.teleport_distance;
    if (!all && far <= 0) return 0;
    const std::size_t stride = s.shape.one_motion ? 0 : kRootFloats * kTileLanes;
    // One motion carries all or none: by how far it takes the middle of the groom.
    if (s.shape.one_motion && !all) {
        const Root a = read_lane(s.root_begin.data(), 0), b = read_lane(s.root_end.data(), 0);
        const auto& lo = s.info.bounds_min;
        const auto& hi = s.info.bounds_max;
        const Vec3f middle((lo[0] + hi[0]) / 2, (lo[1] + hi[1]) / 2, (lo[2] + hi[2]) / 2);
        all = jumped(a, b, middle, far);
        if (!all) return 0;
    }
    std::atomic<std::uint64_t> carried = 0;
    const std::size_t even = even_grain(s.shape.tiles, s.threads);
    share(s.settings.host, s.threads, s.shape.tiles, even, [&](std::size_t tile) {
        const float* end_tile = s.root_end.data() + tile * stride;
        const float* begin_tile = s.root_begin.data() + tile * stride;
        const std::size_t rows = s.quad_rows(tile / kQuadTiles);
        for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
            const Root a = read_lane(begin_tile, lane), b = read_lane(end_tile, lane);
            const float* p = s.fields.guide_position.data() + s.tile_row(tile) * 48 + lane;
            const Vec3f rest(p[0], p[16], p[32]);
            const Vec3f from = rotate(a.rotation, rest) + a.translation;
            const Vec3f to = rotate(b.rotation, rest) + b.translation;
            const Vec4f turn = product(b.rotation, conjugate(a.rotation));
            if (!all && !jumped(a, b, rest, far)) continue;
            for (std::size_t row = 0; row < rows; ++row) {
                const std::size_t place = (s.tile_row(tile) + row) * 48 + lane;
                float* x = s.position.data() + place;
                float* q = s.previous.data() + place;
                const Vec3f x_new = to + rotate(turn, Vec3f(x[0], x[16], x[32]) - from);
                const Vec3f q_new = velocity == Velocity::zero
                                        ? x_new
                                        : to + rotate(turn, Vec3f(q[0], q[16], q[32]) - from);
                x[0] = x_new.x, x[16] = x_new.y, x[32] = x_new.z;
                q[0] = q_new.x, q[16] = q_new.y, q[32] = q_new.z;
            }
            if (!s.shape.one_motion) write_lane(s.root_begin.data() + tile * stride, lane, b);
            if (s.fields.guide_point_count[tile * kTileLanes + lane] > 0) ++carried;
        }
    });
    if (s.shape.one_motion && carried > 0)
        std::copy(s.root_end.span().begin(), s.root_end.span().end(), s.root_begin.data());
    return carried;
}

double root_kick(const Simulation::State& s, double h) {
    const std::size_t stride = s.shape.one_motion ? 0 : kRootFloats * kTileLanes;
    const float rate = float(1 / h), rate_before = s.first_step ? 0 : float(1 / s.previous_step);
    std::atomic<float> most = 0;
    const std::size_t even = even_grain(s.shape.tiles, s.threads);
    share(s.settings.host, s.threads, s.shape.tiles, even, [&](std::size_t tile) {
        const float* begin = s.root_begin.data() + tile * stride;
        const float* end = s.root_end.data() + tile * stride;
        const std::size_t first = s.tile_row(tile) * 48;
        float here = 0;
        for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
            const float* p = s.fields.guide_position.data() + first + lane;
            const float* x = s.position.data() + first + lane;
            const float* q = s.previous.data() + first + lane;
            const Root a = read_lane(begin, lane), b = read_lane(end, lane);
            const Vec3f rest(p[0], p[16], p[32]);
            const Vec3f now = rotate(b.rotation, rest) + b.translation -
                              (rotate(a.rotation, rest) + a.translation);
            const Vec3f last(x[0] - q[0], x[16] - q[16], x[32] - q[32]);
            const Vec3f kick = now * rate - last * rate_before;
            here = std::max(here, dot(kick, kick));
        }
        float known = most.load();
        while (here > known && !most.compare_exchange_weak(known, here)) {
        }
    });
    return std::sqrt(double(most.load()));
}

void put_to_rest(Simulation::State& s, std::size_t tile, std::size_t lane) {
    const std::size_t stride = s.shape.one_motion ? 0 : kRootFloats * kTileLanes;
    const Root root = read_lane(s.root_end.data() + tile * stride, lane);
    const std::size_t rows = s.quad_rows(tile / kQuadTiles);
    for (std::size_t row = 0; row < rows; ++row) {
        const std::size_t place = (s.tile_row(tile) + row) * 48 + lane;
        const float* p = s.fields.guide_position.data() + place;
        const Vec3f x = rotate(root.rotation, Vec3f(p[0], p[16], p[32])) + root.translation;
        float* out = s.position.data() + place;
        float* before = s.previous.data() + place;
        out[0] = before[0] = x.x;
        out[16] = before[16] = x.y;
        out[32] = before[32] = x.z;
    }
}

}  // namespace keratin
