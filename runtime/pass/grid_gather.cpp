// Gives free points what the grid found: friction blends their displacement with their neighbours'
// mean, volume preservation pushes them down the gradient of the filling (METHODS 1.3). Both change
// the previous position only, so what follows sees a velocity.
#include "runtime/pass/grid_cells.h"
#include "runtime/pass/kernel.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

using Float4 = float __attribute__((vector_size(16)));

// Trilinear values at one row of a tile: mean displacement and gradient of the filling. Points
// outside of the grid get their own displacement and no gradient.
struct Samples {
    Vec3<Tile> mean, gradient;
};

template <bool friction, bool volume>
KERATIN_ALWAYS_INLINE Samples sample(const GridView& grid, const Vec3<Tile>& x,
                                     const Vec3<Tile>& own) {
    const Cells cells(grid.shape, x);
    alignas(64) float share[3][kTileLanes], mean[3][kTileLanes] = {}, filling[8][kTileLanes] = {};
    for (int c = 0; c < 3; ++c) store(cells.share[c], share[c], 0);
    for_each_lane(cells.inside, [&](std::size_t l) {
        std::uint32_t at[8];
        cells.corners(l, at);
        if constexpr (friction) {
            Float4 v[8];
            for (int k = 0; k < 8; ++k) v[k] = reinterpret_cast<const Float4*>(grid.field)[at[k]];
            const auto between = [&](const Float4& a, const Float4& b, int c) {
                return a + (b - a) * share[c][l];
            };
            const Float4 near = between(between(v[0], v[1], 0), between(v[2], v[3], 0), 1);
            const Float4 far = between(between(v[4], v[5], 0), between(v[6], v[7], 0), 1);
            const Float4 value = between(near, far, 2);
            for (int c = 0; c < 3; ++c) mean[c][l] = value[c];
        }
        if constexpr (volume) {
            constexpr std::size_t stride = grid_field_floats(friction);
            for (int k = 0; k < 8; ++k) filling[k][l] = grid.field[at[k] * stride + stride - 1];
        }
    });
    Samples out;
    if constexpr (friction)
        out.mean = select(
            cells.inside,
            Vec3<Tile>(load<Tile>(mean[0], 0), load<Tile>(mean[1], 0), load<Tile>(mean[2], 0)),
            own);
    if constexpr (volume) {
        Tile corner[8];
        for (int k = 0; k < 8; ++k) corner[k] = load<Tile>(filling[k], 0);
        trilinear(corner, cells.share, out.gradient);
        out.gradient = out.gradient * Tile(grid.shape.inverse_spacing);
    }
    return out;
}

template <bool friction, bool volume>
void gather_quad(Quad& quad, const GridView& grid) {
    const QuadClass& group = *quad.group;
    for (std::size_t tile = 0; tile < kQuadTiles; ++tile)
        for (std::uint32_t row = 2; row < quad.rows; ++row) {
            const float* at = quad.position + (tile * quad.rows + row) * 48;
            float* before = quad.previous + (tile * quad.rows + row) * 48;
            const Vec3<Tile> x = load3<Tile>(at, 0);
            Vec3<Tile> d = x - load3<Tile>(before, 0);
            const Samples s = sample<friction, volume>(grid, x, d);
            if constexpr (friction) d = rubbed(d, s.mean, Tile(group.friction[row]));
            if constexpr (volume) {
                const Vec3<Tile> a =
                    volume_acceleration(s.gradient, Tile(group.volume[row]), Tile(grid.limit));
                d = d + a * Tile(grid.step * grid.previous_step);
            }
            store3(x - d, before, 0);
        }
}

}  // namespace

void grid_gather(Quad& quad, const GridView& grid) {
    if (!grid.volume)
        gather_quad<true, false>(quad, grid);
    else if (grid.friction)
        gather_quad<true, true>(quad, grid);
    else
        gather_quad<false, true>(quad, grid);
}

}  // namespace keratin::KERATIN_ISA
