// Adds the mass and the displacement of a quad's free points to the eight voxels around each
// (METHODS 1.2), in exact integer sums.
#include "runtime/pass/grid_cells.h"
#include "runtime/pass/kernel.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));
using Long4 = std::int64_t __attribute__((vector_size(32), aligned(32)));

// Values of four components, component by component, to one vector a lane.
void transpose(const Tile (&component)[4], Float4 (&lane)[kTileLanes]) {
    alignas(64) float v[4][kTileLanes];
    for (int c = 0; c < 4; ++c) store(component[c], v[c], 0);
    for (std::size_t l = 0; l < kTileLanes; l += 4) {
        const auto four = [&](int c) { return *reinterpret_cast<const Float4*>(v[c] + l); };
        const Float4 a = four(0), b = four(1), c = four(2), d = four(3);
        const Float4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
        const Float4 cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
        const Float4 ab2 = __builtin_shufflevector(a, b, 2, 6, 3, 7);
        const Float4 cd2 = __builtin_shufflevector(c, d, 2, 6, 3, 7);
        lane[l] = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
        lane[l + 1] = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
        lane[l + 2] = __builtin_shufflevector(ab2, cd2, 0, 1, 4, 5);
        lane[l + 3] = __builtin_shufflevector(ab2, cd2, 2, 3, 6, 7);
    }
}

template <bool friction, bool volume>
void scatter(const Quad& quad, const ScatterInput& in, const GridSums& sums) {
    Long4* const momentum = reinterpret_cast<Long4*>(sums.momentum);
    std::int64_t* const fill = sums.filling;
    const Tile unit(in.inverse_displacement_unit), one(1.0f);
    // Of a point's mass: beyond, the fixed point of 32 bits would end.
    const Tile most(64.0f);
    for (std::size_t tile = 0; tile < kQuadTiles; ++tile) {
        const float* x = quad.position + tile * quad.rows * 48;
        const float* q = quad.previous + tile * quad.rows * 48;
        const std::size_t first = tile * quad.rows;
        alignas(64) float counts[kTileLanes];
        for (std::size_t l = 0; l < kTileLanes; ++l)
            counts[l] = float(in.point_count[tile * kTileLanes + l]);
        const Tile points = load<Tile>(counts, 0);

        for (std::uint32_t row = 2; row < quad.rows; ++row) {
            const Vec3<Tile> now = load3<Tile>(x + row * 48, 0);
            const Cells cells(in.shape, now);
            const auto alive = cells.inside & (Tile(float(row)) < points);
            alignas(64) float weight[8][kTileLanes];
            for (unsigned k = 0; k < 8; ++k) store(cells.weight(k), weight[k], 0);

            const bool has_child = row + 1 < quad.rows;
            Float4 value[kTileLanes];
            if constexpr (friction) {
                const Tile carried = carried_length(quad.length, first + row, has_child);
                const Tile mass = min(carried * Tile(in.mass_scale), most) * Tile(kGridScale);
                // Points faster than the unit count as if they moved by it.
                const auto motion = [&](const Tile& d) {
                    return min(max(d * unit, -one), one) * mass;
                };
                const Vec3<Tile> moved = now - load3<Tile>(q + row * 48, 0);
                transpose({mass, motion(moved.x), motion(moved.y), motion(moved.z)}, value);
            }

            alignas(64) std::int32_t filling[8][kTileLanes];
            if constexpr (volume) {
                alignas(64) float scaled[kTileLanes];
                store(filled(in, quad.length, first + row, has_child) * Tile(kGridScale), scaled, 0);
                for (unsigned k = 0; k < 8; ++k)
                    for (std::size_t l = 0; l < kTileLanes; ++l)
                        filling[k][l] = std::int32_t(scaled[l] * weight[k][l]);
            }

            for_each_lane(alive, [&](std::size_t l) {
                std::uint32_t at[8];
                cells.corners(l, at);
                sums.touched[cells.brick[l]] = 1;
                if constexpr (friction) {
                    const Float4 v = value[l];
                    for (int k = 0; k < 8; ++k) {
                        const Int4 fixed = __builtin_convertvector(v * weight[k][l], Int4);
                        momentum[at[k]] += __builtin_convertvector(fixed, Long4);
                    }
                }
                if constexpr (volume)
                    for (int k = 0; k < 8; ++k) fill[at[k]] += filling[k][l];
            });
        }
    }
}

}  // namespace

void grid_scatter(const Quad& quad, const ScatterInput& in, const GridSums& sums) {
    if (!sums.filling)
        scatter<true, false>(quad, in, sums);
    else if (sums.momentum)
        scatter<true, true>(quad, in, sums);
    else
        scatter<false, true>(quad, in, sums);
}

}  // namespace keratin::KERATIN_ISA
