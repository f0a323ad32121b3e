// The small steps of a quad: block by block, all steps of one while it sits in the cache, five
// sweeps a step.
#include "runtime/pass/kernel.h"
#include "runtime/pass/predict.h"
#include "runtime/pass/prepare.h"
#include "runtime/pass/settle.h"
#include "runtime/pass/tense.h"
#include "runtime/pass/ticks.h"
#include "runtime/pass/yield.h"

namespace keratin::KERATIN_ISA {
KERATIN_DECLARE_KERNELS

namespace {

// Lanes that each sweep takes at a time. Predicting needs many registers and no value of the point
// before late, so one vector keeps the processor busy; the others wait for the point before through
// roots and divisions and take more side by side.
using PredictPack = Native;
using TensePack = Lanes<2 * Native::kLanes>;
using YieldPack = Lanes<2 * Native::kLanes>;
using SettlePack = Lanes<2 * Native::kLanes>;

// Calls body.operator()<flags...>() with the flags as constants.
template <bool... known, class Body>
KERATIN_ALWAYS_INLINE void with_flags(Body&& body) {
    body.template operator()<known...>();
}
template <bool... known, class Body, class... Rest>
KERATIN_ALWAYS_INLINE void with_flags(Body&& body, bool flag, Rest... rest) {
    if (flag)
        with_flags<known..., true>(body, rest...);
    else
        with_flags<known..., false>(body, rest...);
}

void predict_block(const Quad& quad, std::size_t block, const SmallStep& step) {
    for (std::size_t lane = block; lane < block + kBlockLanes; lane += PredictPack::kLanes) {
        const Part<PredictPack> part(quad, lane);
        const QuadClass& group = *quad.group;
        const bool moving = quad.flags.has_wind || quad.flags.has_turbulence;
        const std::span<const WindWave> waves = quad.flags.has_turbulence
                                                    ? std::span<const WindWave>(step.wave)
                                                    : std::span<const WindWave>();
        if (!quad.flags.local_shape) {
            if (moving)
                predict_loose<Air::moving>(part, group, step, waves);
            else
                predict_loose<Air::still>(part, group, step);
            continue;
        }
        bend(part, group, step,
             moving ? predict<Air::moving>(part, group, step, waves)
                    : predict<Air::still>(part, group, step));
    }
}

void yield_block(const Quad& quad, std::size_t block) {
    with_flags(
        [&]<bool shape>() {
            for (std::size_t lane = block; lane < block + kBlockLanes; lane += YieldPack::kLanes)
                yield_to_tension<shape>(Part<YieldPack>(quad, lane));
        },
        quad.flags.local_shape);
}

// Fills quad.near with the colliders that reach the block.
std::uint32_t tense_block(const Quad& quad, std::size_t block, const SmallStep& step) {
    Box<TensePack> box;
    with_flags(
        [&]<bool shape, bool tension, bool boxed>() {
            for (std::size_t lane = block; lane < block + kBlockLanes; lane += TensePack::kLanes) {
                const Box<TensePack> part =
                    tense<shape, tension, boxed>(Part<TensePack>(quad, lane));
                if (lane == block) {
                    box = part;
                } else {
                    box.include(part.low);
                    box.include(part.high);
                }
            }
        },
        quad.flags.local_shape, quad.flags.stretch, quad.flags.collision);
    std::uint32_t count = 0;
    if (quad.flags.collision) {
        // Further than lengths and tension move a point in a small step.
        constexpr float kMargin = 0.05f;
        const float low[3] = {lowest(box.low.x), lowest(box.low.y), lowest(box.low.z)};
        const float high[3] = {highest(box.high.x), highest(box.high.y), highest(box.high.z)};
        for (std::uint32_t k = 0; k < quad.collider_count; ++k)
            if (overlaps(low, high, step.colliders[k], kMargin)) quad.near[count++] = k;
    }
    return count;
}

void settle_block(const Quad& quad, std::size_t block, const SmallStep& step,
                  std::uint32_t near_count) {
    const Near near{quad.shapes, step.colliders, quad.near, near_count};
    with_flags(
        [&]<bool tension, bool exact, bool collide>() {
            for (std::size_t lane = block; lane < block + kBlockLanes; lane += SettlePack::kLanes)
                settle<tension, exact, collide>(Part<SettlePack>(quad, lane), *quad.group, near);
        },
        quad.flags.stretch, quad.flags.final_length, near_count > 0);
}

}  // namespace

void small_steps(Quad& quad, const SmallStep* steps, std::uint32_t count) {
    for (std::size_t block = 0; block < kQuadLanes; block += kBlockLanes) {
        std::uint64_t start = ticks();
        const auto lap = [&](std::uint64_t& sum) {
            const std::uint64_t now = ticks();
            sum += now - start;
            start = now;
        };
        prepare_block(quad, block);
        lap(quad.ticks->prepare);
        for (std::uint32_t i = 0; i < count; ++i) {
            predict_block(quad, block, steps[i]);
            lap(quad.ticks->predict);
            const std::uint32_t near = tense_block(quad, block, steps[i]);
            if (quad.flags.stretch) yield_block(quad, block);
            lap(quad.ticks->tense);
            settle_block(quad, block, steps[i], near);
            lap(quad.ticks->settle);
        }
    }
}

}  // namespace keratin::KERATIN_ISA
