// Turns the threads' sums of a brick into what the gather reads, and clears them for the next step.
#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

void grid_resolve(const GridSums* threads, std::uint32_t thread_count, std::size_t brick,
                  float displacement_unit, float* field) {
    const bool friction = threads[0].momentum;
    for (std::size_t v = brick * kBrickVoxels; v < (brick + 1) * kBrickVoxels; ++v) {
        std::int64_t sum[4] = {}, filling = 0;
        for (std::uint32_t t = 0; t < thread_count; ++t) {
            if (friction) {
                std::int64_t* m = threads[t].momentum + v * 4;
                for (int c = 0; c < 4; ++c) sum[c] += m[c], m[c] = 0;
            }
            if (threads[t].filling) filling += threads[t].filling[v], threads[t].filling[v] = 0;
        }
        float* out = field + v * grid_field_floats(friction);
        if (friction) {
            const float inverse = sum[0] > 0 ? displacement_unit / float(sum[0]) : 0.0f;
            for (int c = 0; c < 3; ++c) *out++ = float(sum[c + 1]) * inverse;
        }
        *out = float(filling) * (1.0f / kGridScale);
    }
}

}  // namespace keratin::KERATIN_ISA
