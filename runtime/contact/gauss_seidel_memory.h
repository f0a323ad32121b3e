// What the parts of the Gauss-Seidel solve share: W strand by strand, and the batches of contacts
// that sweep over it. Private to gauss_seidel*.cpp.
#pragma once

#include "runtime/contact/contact_newton.h"
#include "runtime/contact/gauss_seidel.h"
#include "runtime/contact/gauss_seidel_sweep.h"

#include <cstdint>
#include <new>
#include <vector>

namespace keratin {

template <class T>
struct AlignedAllocator {
    using value_type = T;
    AlignedAllocator() = default;
    template <class U>
    AlignedAllocator(const AlignedAllocator<U>&) {}
    T* allocate(std::size_t n) {
        return static_cast<T*>(::operator new(n * sizeof(T), std::align_val_t(64)));
    }
    void deallocate(T* p, std::size_t) { ::operator delete(p, std::align_val_t(64)); }
    template <class U>
    bool operator==(const AlignedAllocator<U>&) const {
        return true;
    }
};
using AlignedNumbers = std::vector<double, AlignedAllocator<double>>;
using AlignedFloats = std::vector<float, AlignedAllocator<float>>;

// Groups of strands, each a run of them; contacts within a group and between two groups are swept
// together. Fixed, so that the order of work does not depend on the threads; bounds how many can be
// busy.
inline constexpr std::uint32_t kGroups = 8;

// A solve whose residual does not come to this share of its best in so many more sweeps, or rounds
// over the strands, leads nowhere.
inline constexpr double kProgress = 0.9;

struct GaussSeidel::Memory {
    struct StrandPart {
        std::uint32_t first_side, side_count;  // in side_order
        std::uint32_t rows;
        bool dense;
        std::size_t columns, state;
    };
    // The contacts between two groups of strands, or within one. Those of a phase share no strand
    // and may be swept beside each other; a group's own come in the order of the phases.
    struct Bucket {
        std::uint32_t phase, group[2];
        std::uint32_t turn[2];                      // which of its group's in a sweep
        std::uint32_t first_contact, last_contact;  // in `order`
        std::uint32_t first_batch, last_batch;
    };

    // W strand by strand.
    struct Operator {
        std::vector<StrandPart> strands;
        std::vector<std::uint32_t> side_order;  // 2 * contact + side, strand by strand
        std::vector<double> rows;               // 21 a side
        std::vector<std::uint32_t> first;       // of a side: SideRows::first
        // Floats: a sweep reads them all, and what they lack the next pass's velocities make good.
        AlignedFloats columns;
        AlignedNumbers exact;  // the same in doubles, where they are asked for
    };
    Operator now, before;             // before: as last assembled, for what has not changed since
    std::vector<std::uint8_t> stale;  // [strands] 1: the columns are still to be found
    std::vector<std::uint32_t> touched;  // strands with contacts
    std::vector<SweepSide> sides;        // by 2 * contact + side
    AlignedNumbers state;
    AlignedNumbers impulse_before, impulse_along, state_before, state_along;  // of solve
    AlignedNumbers best_impulse, best_eased;  // with the least residual seen
    AlignedNumbers first_impulse;             // of solve_strands
    std::vector<ContactBatch, AlignedAllocator<ContactBatch>> batches;
    std::vector<std::uint32_t> batch_of;  // 8 * batch + lane of each contact
    std::vector<Bucket> buckets;
    std::vector<double> bucket_sum, bucket_square;
    std::uint32_t group_turns[kGroups];    // buckets of each group
    std::size_t group_state[kGroups + 1];  // where the numbers of each group's strands begin
    std::vector<std::uint32_t> owner;      // [buckets] thread of the running solve
    std::vector<std::uint32_t> count, bucket_of, order;
    std::vector<std::uint32_t> block_strands, block_start;
    std::vector<std::uint64_t> block_version;  // of the inverse that the block's columns come from

    ContactNewton contact_newton;
    std::vector<std::uint32_t> together;  // contacts that are solved together
    std::vector<double> w, u, r, friction;

    std::uint32_t group_of(std::uint32_t strand) const {
        return static_cast<std::uint32_t>(static_cast<std::uint64_t>(strand) * kGroups /
                                          now.strands.size());
    }
    // Orders the contacts into buckets and batches. impulses: as assemble.
    void fill_batches(std::span<const ContactLaw> laws, std::span<const SidePlace> places,
                      std::span<const double> impulses, int threads);
    static std::uint32_t owner_of(std::uint32_t group, std::uint32_t team) {
        return group * team / kGroups;
    }
    // Gives each bucket a thread of a team. A thread has neighbouring groups, with their strands'
    // numbers, so that these seldom go from core to core.
    void share_out(std::uint32_t team);
    // The columns of a strand that has the same contacts at the same places as when W was last
    // assembled; they hold as long as the version of its block does.
    void take_over(std::uint32_t strand);
    template <class VectorAt>
    void write_column(std::span<const ContactLaw> laws, const RodLayout& layout,
                      std::uint32_t strand, std::uint32_t place, std::size_t k,
                      VectorAt&& vector_at);
    // The strands' numbers at v, and what the impulses not yet in v will add.
    template <class Column>
    void write_state(std::span<const ContactLaw> laws, std::span<const double> v,
                     std::span<const double> applied, std::span<const double> impulses,
                     const Column* columns_of, int threads);
    void read_velocity(std::span<const ContactLaw> laws, std::uint32_t contact, double* u) const;
    // Adds three by three numbers of W: what an impulse of contact `from` gives contact `to`
    // through the strands that they share.
    template <class Column>
    void add_coupling(std::span<const ContactLaw> laws, std::span<const SidePlace> places,
                      std::size_t to, std::size_t from, const Column* columns_of, double* w,
                      std::size_t stride) const;
    // The contacts in `together`, solved with all others' impulses as they are.
    void solve_together(std::span<const ContactLaw> laws, std::span<const SidePlace> places,
                        const GaussSeidelSettings& settings, std::span<double> impulses);
};

}  // namespace keratin
