// Gives free points what the grid found: friction blends their displacement with their neighbours'
// mean, volume preservation pushes them down the gradient of the filling (METHODS 1.3). Both change
// the previous position only, so what follows sees a velocity.
#include "runtime/formula/grid.h"
#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

using Float4 = float __attribute__((vector_size(16)));
using Tile = Lanes<16>;

// Trilinear values at one row of a tile: mean displacement and gradient of the filling. Points
// outside of the grid get their own displacement and no gradient.
struct Samples {
    alignas(64) float mean[3][16];
    alignas(64) float gradient[3][16];
};

template <bool volume>
void sample(const GridView& grid, const float* x, const float* q, Samples& out) {
    const GridShape& g = grid.shape;
    const float top[3] = {float(g.bricks[0] * kBrickSide - 1), float(g.bricks[1] * kBrickSide - 1),
                          float(g.bricks[2] * kBrickSide - 1)};
    const std::uint32_t row_stride = g.bricks[0] * kBrickVoxels;
    const std::uint32_t slab_stride = row_stride * g.bricks[1];
    alignas(64) float cell[3][16], share[3][16];
    for (int c = 0; c < 3; ++c) {
        const Tile s = (load<Tile>(x + c * 16, 0) - Tile(g.origin[c])) * Tile(g.inverse_spacing);
        const Tile whole = floor_of(s);
        store(whole, cell[c], 0);
        store(s - whole, share[c], 0);
    }
    const Float4* field = reinterpret_cast<const Float4*>(grid.field);
    for (std::uint32_t l = 0; l < kTileLanes; ++l) {
        Float4 value = {x[l] - q[l], x[16 + l] - q[16 + l], x[32 + l] - q[32 + l], 0};
        float dx = 0, dy = 0, dz = 0;
        if (cell[0][l] >= 0 && cell[0][l] < top[0] && cell[1][l] >= 0 && cell[1][l] < top[1] &&
            cell[2][l] >= 0 && cell[2][l] < top[2]) {
            const auto cx = std::uint32_t(cell[0][l]), cy = std::uint32_t(cell[1][l]),
                       cz = std::uint32_t(cell[2][l]);
            const auto part = [](std::uint32_t v, std::uint32_t brick, std::uint32_t step) {
                return (v >> 2) * brick + (v & 3) * step;
            };
            const std::uint32_t x0 = part(cx, kBrickVoxels, 1), x1 = part(cx + 1, kBrickVoxels, 1);
            const std::uint32_t y0 = part(cy, row_stride, 4), y1 = part(cy + 1, row_stride, 4);
            const std::uint32_t z0 = part(cz, slab_stride, 16), z1 = part(cz + 1, slab_stride, 16);
            const float fx = share[0][l], fy = share[1][l], fz = share[2][l];
            const Float4 v000 = field[x0 + y0 + z0], v100 = field[x1 + y0 + z0];
            const Float4 v010 = field[x0 + y1 + z0], v110 = field[x1 + y1 + z0];
            const Float4 v001 = field[x0 + y0 + z1], v101 = field[x1 + y0 + z1];
            const Float4 v011 = field[x0 + y1 + z1], v111 = field[x1 + y1 + z1];
            const Float4 e00 = v000 + (v100 - v000) * fx, e10 = v010 + (v110 - v010) * fx;
            const Float4 e01 = v001 + (v101 - v001) * fx, e11 = v011 + (v111 - v011) * fx;
            const Float4 f0 = e00 + (e10 - e00) * fy, f1 = e01 + (e11 - e01) * fy;
            value = f0 + (f1 - f0) * fz;
            if constexpr (volume) {
                const float s00 = v100[3] - v000[3], s10 = v110[3] - v010[3];
                const float s01 = v101[3] - v001[3], s11 = v111[3] - v011[3];
                const float t0 = s00 + (s10 - s00) * fy, t1 = s01 + (s11 - s01) * fy;
                dx = (t0 + (t1 - t0) * fz) * g.inverse_spacing;
                const float u0 = e10[3] - e00[3], u1 = e11[3] - e01[3];
                dy = (u0 + (u1 - u0) * fz) * g.inverse_spacing;
                dz = (f1[3] - f0[3]) * g.inverse_spacing;
            }
        }
        out.mean[0][l] = value[0], out.mean[1][l] = value[1], out.mean[2][l] = value[2];
        if constexpr (volume)
            out.gradient[0][l] = dx, out.gradient[1][l] = dy, out.gradient[2][l] = dz;
    }
}

template <bool volume>
void gather_quad(Quad& quad, const GridView& grid) {
    const QuadClass& group = *quad.group;
    for (std::size_t tile = 0; tile < kQuadTiles; ++tile)
        for (std::uint32_t row = 2; row < quad.rows; ++row) {
            float* at = quad.position + (tile * quad.rows + row) * 48;
            float* before = quad.previous + (tile * quad.rows + row) * 48;
            Samples s;
            sample<volume>(grid, at, before, s);
            const Vec3<Tile> x = load3<Tile>(at, 0), q = load3<Tile>(before, 0);
            Vec3<Tile> d = x - q;
            if (grid.friction) {
                const Vec3<Tile> mean(load<Tile>(s.mean[0], 0), load<Tile>(s.mean[1], 0),
                                      load<Tile>(s.mean[2], 0));
                d = rubbed(d, mean, Tile(group.friction[row]));
            }
            if constexpr (volume) {
                const Vec3<Tile> gradient(load<Tile>(s.gradient[0], 0),
                                          load<Tile>(s.gradient[1], 0),
                                          load<Tile>(s.gradient[2], 0));
                const Vec3<Tile> a =
                    volume_acceleration(gradient, Tile(group.volume[row]), Tile(grid.limit));
                d = d + a * Tile(grid.step * grid.previous_step);
            }
            store3(x - d, before, 0);
        }
}

}  // namespace

void grid_gather(Quad& quad, const GridView& grid) {
    if (grid.volume)
        gather_quad<true>(quad, grid);
    else
        gather_quad<false>(quad, grid);
}

}  // namespace keratin::KERATIN_ISA
