// Gives free points what the grid found: friction blends their displacement with their neighbours'
// mean, volume preservation pushes them down the gradient of the filling (METHODS 1.3). Both change
// the previous position only, so what follows sees a velocity. Where no more is filled than in
// the groom at rest, nothing is pushed. A point does not count itself: of sparse hair most of what
// is filled at a point's place would be its own, and mean nothing but where it stands in its voxel.
#include "runtime/pass/grid_cells.h"
#include "runtime/pass/kernel.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

using Float4 = float __attribute__((vector_size(16)));

// Trilinear values at one row of a tile, from a field of `stride` numbers a voxel: mean
// displacement, and the filling and its gradient but for the point's own share. Points outside of
// the grid get their own displacement and no gradient.
struct Samples {
    Vec3<Tile> mean, gradient;
    Tile filling;
};

template <bool friction, bool volume>
KERATIN_ALWAYS_INLINE Samples sample(const GridView& grid, std::size_t stride, const Vec3<Tile>& x,
                                     const Vec3<Tile>& own, const Tile& own_share) {
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
        out.filling = trilinear(corner, cells.share, out.gradient);
        Tile part[3], slope[3];
        for (int c = 0; c < 3; ++c) {
            part[c] = own_part(cells.share[c]);
            slope[c] = cells.share[c] + cells.share[c] - Tile(1.0f);
        }
        const Tile counts = select(cells.inside, own_share, Tile(0.0f));
        out.filling = out.filling - counts * (part[0] * part[1] * part[2]);
        out.gradient = transposed_times(
            grid.shape.to_own,
            (out.gradient - Vec3<Tile>(slope[0] * part[1] * part[2], slope[1] * part[0] * part[2],
                                       slope[2] * part[0] * part[1]) *
                                counts) *
                Tile(grid.shape.inverse_spacing));
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
            Tile rest(0.0f), share(0.0f);
            if constexpr (volume) {
                const float* kept =
                    quad.filling_rest + (tile * quad.rows + row) * kFillingRestFloats * kTileLanes;
                rest = load<Tile>(kept, 0), share = load<Tile>(kept + kTileLanes, 0);
            }
            const Samples s =
                sample<friction, volume>(grid, grid_field_floats(friction), x, d, share);
            if constexpr (friction) d = rubbed(d, s.mean, Tile(group.friction[row]));
            if constexpr (volume) {
                const Vec3<Tile> a = volume_acceleration(s.filling, rest, s.gradient,
                                                         Tile(group.volume[row]), Tile(grid.limit));
                d = d + a * Tile(grid.step * grid.previous_step);
            }
            store3(x - d, before, 0);
        }
}

}  // namespace

void grid_at_rest(const Quad& quad, const ScatterInput& in, const GridView& grid,
                  float* filling_rest) {
    for (std::size_t tile = 0; tile < kQuadTiles; ++tile)
        for (std::uint32_t row = 2; row < quad.rows; ++row) {
            const std::size_t at = tile * quad.rows + row;
            const Vec3<Tile> x = load3<Tile>(quad.position + at * 48, 0);
            const Tile share = filled(in, quad.length, at, row + 1 < quad.rows);
            float* out = filling_rest + at * kFillingRestFloats * kTileLanes;
            store(sample<false, true>(grid, grid_field_floats(grid.friction), x, x, share).filling,
                  out, 0);
            store(share, out + kTileLanes, 0);
        }
}

void grid_gather(Quad& quad, const GridView& grid) {
    if (!grid.volume)
        gather_quad<true, false>(quad, grid);
    else if (grid.friction)
        gather_quad<true, true>(quad, grid);
    else
        gather_quad<false, true>(quad, grid);
}

}  // namespace keratin::KERATIN_ISA
