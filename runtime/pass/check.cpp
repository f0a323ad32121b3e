// After a quad's small steps: which strands are no longer finite or have left any sensible place,
// how fast the fastest point of the others moves, and the box around all of them.
#include "runtime/pass/kernel.h"
#include "runtime/pass/work.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

// One bit a lane that must be reset. The limit of 1e6 m from the origin only serves to catch a
// strand that is on its way to infinity.
std::uint64_t check(Quad& quad) {
    std::uint64_t bad = 0;
    Work fastest(0.0f);
    Work3 low(Work(1e30f)), high(Work(-1e30f));
    for (std::size_t lane = 0; lane < kQuadLanes; lane += kWorkLanes) {
        const Part<Work> b(quad, lane);
        const Work limit(1e6f);
        Work far(0.0f);
        for (std::size_t i = 0; i < b.rows; ++i) {
            const Work3 x = b.x(i), q = b.x_previous(i);
            far = far + (abs(x.x) + abs(x.y) + abs(x.z)) + (abs(q.x) + abs(q.y) + abs(q.z));
            low = Work3(min(low.x, x.x), min(low.y, x.y), min(low.z, x.z));
            high = Work3(max(high.x, x.x), max(high.y, x.y), max(high.z, x.z));
            const Work3 d = x - q;
            fastest = max(fastest, dot(d, d));
        }
        const std::uint64_t good = lane_bits((far < limit) & (-far < limit));
        bad |= (~good & (kWorkLanes == 64 ? ~0ull : (1ull << (kWorkLanes % 64)) - 1)) << lane;
    }
    quad.fastest = highest(fastest);
    const Work* const box[2][3] = {{&low.x, &low.y, &low.z}, {&high.x, &high.y, &high.z}};
    for (int c = 0; c < 3; ++c) {
        quad.bounds_min[c] = lowest(*box[0][c]);
        quad.bounds_max[c] = highest(*box[1][c]);
    }
    return bad;
}

}  // namespace keratin::KERATIN_ISA
