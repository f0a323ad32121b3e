// Adds the mass and the displacement of a quad's free points to the eight voxels around each
// (METHODS 1.2), in exact integer sums.
#include "runtime/formula/grid.h"
#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));
using Long4 = long long __attribute__((vector_size(32), aligned(32)));

}  // namespace

void grid_scatter(const Quad& quad, const ScatterInput& in, const GridSums& sums) {
    using Tile = Lanes<16>;
    const GridShape& g = in.shape;
    const float top[3] = {float(g.bricks[0] * kBrickSide - 1), float(g.bricks[1] * kBrickSide - 1),
                          float(g.bricks[2] * kBrickSide - 1)};
    const std::uint32_t row_stride = g.bricks[0] * kBrickVoxels;
    const std::uint32_t slab_stride = row_stride * g.bricks[1];
    Long4* momentum = reinterpret_cast<Long4*>(sums.momentum);

    for (std::size_t tile = 0; tile < kQuadTiles; ++tile) {
        const float* x = quad.position + tile * quad.rows * 48;
        const float* q = quad.previous + tile * quad.rows * 48;
        const float* length = quad.length + tile * quad.rows * 16;
        const float* density = in.density ? in.density + tile * quad.rows * 16 : nullptr;
        for (std::uint32_t row = 2; row < quad.rows; ++row) {
            alignas(64) float cell[3][16], share[3][16], mass[16];
            alignas(64) float motion[3][16];
            const Tile unit(in.inverse_displacement_unit);
            for (int c = 0; c < 3; ++c) {
                const Tile xc = load<Tile>(x + row * 48 + c * 16, 0);
                const Tile s = (xc - Tile(g.origin[c])) * Tile(g.inverse_spacing);
                const Tile whole = floor_of(s);
                store(whole, cell[c], 0);
                store(s - whole, share[c], 0);
                const Tile d = (xc - load<Tile>(q + row * 48 + c * 16, 0)) * unit;
                // Points faster than the unit count as if they moved by it.
                store(min(max(d, Tile(-1.0f)), Tile(1.0f)), motion[c], 0);
            }
            const Tile below =
                row + 1 < quad.rows ? load<Tile>(length + (row + 1) * 16, 0) : Tile(0.0f);
            store((load<Tile>(length + row * 16, 0) + below) * Tile(0.5f), mass, 0);

            for (std::uint32_t l = 0; l < kTileLanes; ++l) {
                if (row >= in.point_count[tile * 16 + l]) continue;
                // A comparison that not-a-number fails.
                if (!(cell[0][l] >= 0 && cell[0][l] < top[0] && cell[1][l] >= 0 &&
                      cell[1][l] < top[1] && cell[2][l] >= 0 && cell[2][l] < top[2]))
                    continue;
                const auto cx = std::uint32_t(cell[0][l]), cy = std::uint32_t(cell[1][l]),
                           cz = std::uint32_t(cell[2][l]);
                const auto part = [](std::uint32_t v, std::uint32_t brick, std::uint32_t step) {
                    return (v >> 2) * brick + (v & 3) * step;
                };
                const std::uint32_t px[2] = {part(cx, kBrickVoxels, 1),
                                             part(cx + 1, kBrickVoxels, 1)};
                const std::uint32_t py[2] = {part(cy, row_stride, 4), part(cy + 1, row_stride, 4)};
                const std::uint32_t pz[2] = {part(cz, slab_stride, 16),
                                             part(cz + 1, slab_stride, 16)};
                sums.touched[(cx >> 2) + g.bricks[0] * ((cy >> 2) + g.bricks[1] * (cz >> 2))] = 1;

                const float m = mass[l] * in.mass_scale * kGridScale;
                const Float4 value = Float4{1, motion[0][l], motion[1][l], motion[2][l]} * m;
                const float wx[2] = {1 - share[0][l], share[0][l]};
                const float wy[2] = {1 - share[1][l], share[1][l]};
                const float wz[2] = {1 - share[2][l], share[2][l]};
                for (int k = 0; k < 2; ++k)
                    for (int j = 0; j < 2; ++j)
                        for (int i = 0; i < 2; ++i) {
                            const float w = wx[i] * wy[j] * wz[k];
                            const Int4 fixed = __builtin_convertvector(value * w, Int4);
                            momentum[px[i] + py[j] + pz[k]] +=
                                __builtin_convertvector(fixed, Long4);
                        }
                if (sums.filling) {
                    const float rho = density ? density[row * 16 + l] : in.mean_density;
                    const float filling = rho > 0 ? mass[l] * in.filling_scale / rho : 0;
                    const float scaled = keratin::min(filling, 64.0f) * kGridScale;
                    for (int k = 0; k < 2; ++k)
                        for (int j = 0; j < 2; ++j)
                            for (int i = 0; i < 2; ++i)
                                sums.filling[px[i] + py[j] + pz[k]] +=
                                    std::int32_t(scaled * (wx[i] * wy[j] * wz[k]));
                }
            }
        }
    }
}

}  // namespace keratin::KERATIN_ISA
