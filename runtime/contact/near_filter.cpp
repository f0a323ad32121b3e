#include "runtime/contact/near_filter.h"

namespace keratin {
namespace {

constexpr int kLanes = 16;

// Pairs that wait until there are as many as a kernel takes.
struct Batch {
    EdgePairs lanes{};
    float limit[kLanes] = {};
    BoxPair pair[kLanes];
    int count = 0;

    bool add(const BoxPair& p, std::span<const FilterEdge> edges) {
        const FilterEdge &e = edges[p.first], &f = edges[p.second];
        for (int k = 0; k < 12; ++k)
            lanes.first[k][count] = e.value[k], lanes.second[k][count] = f.value[k];
        limit[count] = (e.half_distance + f.half_distance) * 1.002f + e.error + f.error;
        pair[count] = p;
        return ++count == kLanes;
    }
    // Gives those that may meet to `out` and is empty.
    template <class Out>
    void sift(const SearchKernels& kernels, int rounds, Out&& out) {
        if (count == 0) return;
        std::uint32_t may = kernels.may_meet(lanes, limit, rounds);
        if (count < kLanes) may &= (1u << count) - 1;
        count = 0;
        for (; may != 0; may &= may - 1) out(pair[__builtin_ctz(may)]);
    }
};

}  // namespace

void keep_near_pairs(std::span<const FilterEdge> edges, std::span<const BoxPair> pairs,
                     std::vector<BoxPair>& kept, InstructionSet instruction_set) {
    constexpr int kRounds = 8;
    constexpr std::size_t kAhead = 24;  // pairs
    if (pairs.empty()) return;
    const SearchKernels& kernels = search_kernels(instruction_set);
    Batch all, near;  // most are far apart at once; the rest is looked at more closely
    const auto keep = [&](const BoxPair& p) { kept.push_back(p); };
    const auto look_again = [&](const BoxPair& p) {
        if (near.add(p, edges)) near.sift(kernels, kRounds, keep);
    };
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const BoxPair& p = pairs[i];
        if (i + kAhead < pairs.size()) {
            __builtin_prefetch(&edges[pairs[i + kAhead].first]);
            __builtin_prefetch(&edges[pairs[i + kAhead].second]);
        }
        if (p.second == p.first + 1 && edges[p.first].strand == edges[p.second].strand) continue;
        if (all.add(p, edges)) all.sift(kernels, 1, look_again);
    }
    all.sift(kernels, 1, look_again);
    near.sift(kernels, kRounds, keep);
}

}  // namespace keratin
