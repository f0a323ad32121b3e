// In which order contacts are swept, and by whom.
#include "runtime/contact/gauss_seidel_memory.h"

#include <algorithm>
#include <utility>

namespace keratin {
namespace {

constexpr std::uint32_t kBuckets = kGroups * kGroups * kGroups;  // phase, first and second group
// Within a bucket those that slide come together, whose solve is the longest, then those that
// stick, then the open ones.
constexpr std::uint32_t kKinds = 3;

// In which round of a tournament two different groups meet: pairs of one round are disjoint.
std::uint32_t round_of(std::uint32_t a, std::uint32_t b) {
    constexpr std::uint32_t m = kGroups - 1;
    if (a > b) std::swap(a, b);
    return 1 + (b == m ? 2 * a % m : (a + b) % m);
}

std::uint32_t kind_of(const ContactLaw& law, const double* impulse) {
    constexpr double kSlides = 1 - 1e-6;
    const double most = law.friction * impulse[0];
    if (!(impulse[0] > 0)) return 2;
    return impulse[1] * impulse[1] + impulse[2] * impulse[2] < kSlides * most * most ? 1 : 0;
}

// Open for good.
void clear(ContactBatch& batch) {
    for (std::uint32_t l = 0; l < kContactBatch; ++l) {
        for (int k = 0; k < 6; ++k) batch.w[k][l] = k == 0 || k == 3 || k == 5 ? 1 : 0;
        for (int k = 0; k < 3; ++k) batch.constant[k][l] = k == 0 ? 1 : 0, batch.impulse[k][l] = 0;
        batch.friction[l] = batch.eased[l] = 0;
        batch.side[0][l] = batch.side[1][l] = kNoSide;
    }
}

}  // namespace

void GaussSeidel::Memory::fill_batches(std::span<const ContactLaw> laws,
                                       std::span<const SidePlace> places,
                                       std::span<const double> impulses, int threads) {
    const std::size_t contacts = laws.size();
    bucket_of.resize(contacts);
    count.assign(kBuckets * kKinds + 1, 0);
    for (std::size_t c = 0; c < contacts; ++c) {
        const std::uint32_t a = group_of(places[2 * c].strand),
                            b = laws[c].sides > 1 ? group_of(places[2 * c + 1].strand) : a;
        const std::uint32_t phase = a == b ? 0 : round_of(a, b);
        const std::uint32_t kind = impulses.empty() ? 0 : kind_of(laws[c], &impulses[3 * c]);
        bucket_of[c] =
            ((phase * kGroups + std::min(a, b)) * kGroups + std::max(a, b)) * kKinds + kind;
        ++count[bucket_of[c] + 1];
    }
    for (std::uint32_t i = 0; i < kBuckets * kKinds; ++i) count[i + 1] += count[i];
    buckets.clear();
    std::ranges::fill(group_turns, 0u);
    for (std::uint32_t i = 0; i < kBuckets; ++i) {
        if (count[(i + 1) * kKinds] == count[i * kKinds]) continue;
        const std::uint32_t a = i / kGroups % kGroups, b = i % kGroups;
        buckets.push_back({i / (kGroups * kGroups),
                           {a, b},
                           {group_turns[a], group_turns[b]},
                           count[i * kKinds],
                           count[(i + 1) * kKinds],
                           0,
                           0});
        ++group_turns[a];
        if (a != b) ++group_turns[b];
    }
    order.resize(contacts);
    for (std::size_t c = 0; c < contacts; ++c)
        order[count[bucket_of[c]]++] = static_cast<std::uint32_t>(c);
    batch_of.resize(contacts);

    auto each_side = [&](std::uint32_t c, auto&& visit) {
        for (std::uint32_t side = 0; side < laws[c].sides; ++side)
            visit(side, places[2 * c + side].strand);
    };
    // Each bucket is filled greedily, so that no strand is twice in a batch.
#pragma omp parallel num_threads(threads)
    {
        std::vector<std::uint32_t> after(now.strands.size(), 0);  // last batch with the strand, + 1
        std::vector<std::uint32_t> filled;                        // lanes of each batch
#pragma omp for schedule(dynamic)
        for (std::size_t b = 0; b < buckets.size(); ++b) {
            Bucket& bucket = buckets[b];
            const auto members = std::span(order).subspan(
                bucket.first_contact, bucket.last_contact - bucket.first_contact);
            filled.clear();
            std::uint32_t open = 0;  // batches before it are full
            for (const std::uint32_t c : members) {
                std::uint32_t at = open;
                each_side(c, [&](std::uint32_t, std::uint32_t s) { at = std::max(at, after[s]); });
                while (at < filled.size() && filled[at] == kContactBatch) ++at;
                if (at == filled.size()) filled.push_back(0);
                batch_of[c] = at * kContactBatch + filled[at]++;
                while (open < filled.size() && filled[open] == kContactBatch) ++open;
                each_side(c, [&](std::uint32_t, std::uint32_t s) { after[s] = at + 1; });
            }
            for (const std::uint32_t c : members)
                each_side(c, [&](std::uint32_t, std::uint32_t s) { after[s] = 0; });
            bucket.last_batch = static_cast<std::uint32_t>(filled.size());
        }
    }
    std::uint32_t total = 0;
    for (Bucket& bucket : buckets) {
        bucket.first_batch = total;
        bucket.last_batch = total += bucket.last_batch;
    }
    batches.resize(total);
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (std::size_t b = 0; b < buckets.size(); ++b) {
        const Bucket& bucket = buckets[b];
        for (std::uint32_t k = bucket.first_batch; k < bucket.last_batch; ++k) clear(batches[k]);
        for (std::uint32_t i = bucket.first_contact; i < bucket.last_contact; ++i) {
            const std::uint32_t c = order[i];
            batch_of[c] += bucket.first_batch * kContactBatch;
            ContactBatch& batch = batches[batch_of[c] / kContactBatch];
            each_side(c, [&](std::uint32_t side, std::uint32_t) {
                batch.side[side][batch_of[c] % kContactBatch] = 2 * c + side;
            });
        }
    }
    bucket_sum.resize(buckets.size());
    bucket_square.resize(buckets.size());
}

void GaussSeidel::Memory::share_out(std::uint32_t team) {
    owner.resize(buckets.size());
    std::vector<std::uint32_t> load(team);
    for (std::size_t first = 0; first < buckets.size();) {
        std::size_t last = first;
        while (last < buckets.size() && buckets[last].phase == buckets[first].phase) ++last;
        std::ranges::fill(load, 0);
        auto give = [&](std::size_t b, std::uint32_t thread) {
            owner[b] = thread;
            load[thread] += buckets[b].last_batch - buckets[b].first_batch;
        };
        // Those between the groups of two threads go where there is less to do.
        for (const bool between : {false, true})
            for (std::size_t b = first; b < last; ++b) {
                const std::uint32_t one = owner_of(buckets[b].group[0], team),
                                    other = owner_of(buckets[b].group[1], team);
                if ((one != other) == between) give(b, load[other] < load[one] ? other : one);
            }
        first = last;
    }
}

}  // namespace keratin
