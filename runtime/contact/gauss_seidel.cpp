#include "runtime/contact/gauss_seidel.h"

#include "runtime/contact/contact_newton.h"
#include "runtime/contact/coulomb.h"
#include "runtime/contact/gauss_seidel_sweep.h"
#include "runtime/contact/spin_barrier.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <omp.h>
#include <vector>

namespace keratin {
namespace {

// Groups of strands; contacts within a group and between two groups are swept together. Fixed, so
// that the order of work does not depend on the threads; bounds how many can be busy.
constexpr std::uint32_t kGroups = 8;
constexpr std::size_t kAlign = 8;            // numbers: columns and states start at multiples of 8
constexpr std::uint32_t kResidualEvery = 4;  // sweeps
// Contacts of one pair of strands press on numbers that the two share: there are more contacts than
// numbers, and their gaps, each rounded and linearised alone, contradict each other by nanometres.
// The law then holds only once sweeps have moved whole loads from one contact to the next, at a
// rate that such a mismatch drives (thousands of sweeps). After so many sweeps, and again each time
// so many later, a gap takes the value that the others leave it, within the leeway.
constexpr std::uint32_t kEaseEvery = 16;
constexpr double kUphill = 1.2;  // growth of the squared step at which the directions begin anew
// Sweeps that do not bring the residual to this share of its best in so many more lead nowhere.
constexpr double kProgress = 0.9;
constexpr std::uint32_t kPatience = 100;
constexpr double kFarWorse =
    10;  // than the best residual seen: the impulses of then are taken back
// Contacts of a strand that are solved together at most.
constexpr std::uint32_t kMostTogether = 128;
constexpr std::uint32_t kStrandPatience = 4;  // rounds over the strands without progress
constexpr std::size_t kBatchImpulses = 3 * kContactBatch;
constexpr std::size_t kChunk = 1024;  // numbers that a thread takes at a time

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

std::uint32_t rounded_up(std::size_t n) {
    return static_cast<std::uint32_t>((n + kAlign - 1) / kAlign * kAlign);
}

// In which round of a tournament two different groups meet: pairs of one round are disjoint.
std::uint32_t round_of(std::uint32_t a, std::uint32_t b) {
    constexpr std::uint32_t m = kGroups - 1;
    if (a > b) std::swap(a, b);
    return 1 + (b == m ? 2 * a % m : (a + b) % m);
}

}  // namespace

struct GaussSeidel::Memory {
    struct StrandPart {
        std::uint32_t first_side, side_count;  // in side_order
        std::uint32_t rows;
        bool dense;
        std::size_t columns, state;
    };
    struct Bucket {
        std::uint32_t phase, first_batch, last_batch;
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
    std::vector<double> rows;                 // 21 a side, for dense strands
    std::vector<ContactBatch, AlignedAllocator<ContactBatch>> batches;
    std::vector<std::uint32_t> batch_of;  // 8 * batch + lane of each contact
    std::vector<Bucket> buckets;
    std::vector<double> bucket_sum, bucket_square;
    std::vector<std::uint32_t> count, last_batch, bucket_of, order;
    std::vector<std::uint32_t> block_strands, block_start;
    std::vector<std::uint64_t> block_version;  // of the inverse that the block's columns come from

    ContactNewton contact_newton;
    std::vector<std::uint32_t> together;  // contacts that are solved together
    std::vector<double> w, u, r, friction;

    // The columns of a strand that has the same contacts at the same places as when W was last
    // assembled; they hold as long as the version of its block does.
    void take_over(std::uint32_t strand);
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

GaussSeidel::GaussSeidel() : memory_(std::make_unique<Memory>()) {}
GaussSeidel::~GaussSeidel() = default;
GaussSeidel::GaussSeidel(GaussSeidel&&) noexcept = default;
GaussSeidel& GaussSeidel::operator=(GaussSeidel&&) noexcept = default;

std::size_t GaussSeidel::bytes() const {
    const Memory& m = *memory_;
    return (m.now.columns.size() + m.before.columns.size()) * sizeof(float) +
           (m.state.size() + m.now.rows.size() + m.before.rows.size() + m.now.exact.size()) *
               sizeof(double) +
           m.batches.size() * sizeof(ContactBatch) + m.sides.size() * sizeof(SweepSide);
}

void GaussSeidel::assemble(const RodLayout& layout, std::span<const ContactLaw> laws,
                           std::span<const SidePlace> places, const RodInverse& inverse,
                           int threads, bool exact, std::span<const double> impulses) {
    Memory& m = *memory_;
    const std::size_t contacts = laws.size(), strand_count = layout.first.size();

    std::swap(m.now, m.before);
    // Sides strand by strand, and where each strand's numbers go.
    m.now.strands.assign(strand_count, {0, 0, 0, false, 0, 0});
    for (std::size_t c = 0; c < contacts; ++c)
        for (std::uint32_t side = 0; side < laws[c].sides; ++side)
            ++m.now.strands[places[2 * c + side].strand].side_count;
    m.touched.clear();
    std::uint32_t total = 0;
    std::size_t column_numbers = 0, state_numbers = 0;
    for (std::uint32_t s = 0; s < strand_count; ++s) {
        Memory::StrandPart& part = m.now.strands[s];
        part.first_side = total;
        if (part.side_count == 0) continue;
        total += part.side_count;
        m.touched.push_back(s);
        const std::size_t numbers = 4 * static_cast<std::size_t>(layout.vertex_count[s]);
        part.dense = 3 * static_cast<std::size_t>(part.side_count) > numbers;
        part.rows =
            rounded_up(part.dense ? numbers : 3 * static_cast<std::size_t>(part.side_count));
        part.columns = column_numbers;
        part.state = state_numbers;
        column_numbers += 3 * static_cast<std::size_t>(part.side_count) * part.rows;
        state_numbers += part.rows;
        part.side_count = 0;
    }
    m.now.side_order.resize(total);
    m.sides.resize(2 * contacts);
    m.now.columns.resize(column_numbers);
    m.now.exact.clear();
    m.now.first.resize(2 * contacts);
    m.state.resize(state_numbers);
    m.now.rows.resize(42 * contacts);
    for (std::size_t c = 0; c < contacts; ++c)
        for (std::uint32_t side = 0; side < laws[c].sides; ++side) {
            const std::size_t k = 2 * c + side;
            Memory::StrandPart& part = m.now.strands[places[k].strand];
            const std::uint32_t place = part.side_count++;
            m.now.side_order[part.first_side + place] = static_cast<std::uint32_t>(k);
            m.sides[k] = {part.columns + 3 * static_cast<std::size_t>(place) * part.rows,
                          part.state,
                          part.rows,
                          part.dense ? 4 * places[k].vertex : 3 * place,
                          part.dense ? 1u : 0u,
                          21 * k};
            std::copy(&laws[c].rows[side].weight[0][0], &laws[c].rows[side].weight[0][0] + 21,
                      &m.now.rows[21 * k]);
            m.now.first[k] = laws[c].rows[side].first;
        }
    m.stale.assign(strand_count, 1);
    if (m.before.strands.size() == strand_count && m.before.exact.empty() && !exact) {
#pragma omp parallel for num_threads(threads) schedule(static)
        for (std::size_t i = 0; i < m.touched.size(); ++i) m.take_over(m.touched[i]);
    }

    // Strands with contacts, block by block.
    const std::size_t blocks = layout.block_first.empty() ? 0 : layout.block_first.size() - 1;
    m.block_start.assign(blocks + 1, 0);
    for (const std::uint32_t s : m.touched) ++m.block_start[layout.block[s] + 1];
    for (std::size_t b = 0; b < blocks; ++b) m.block_start[b + 1] += m.block_start[b];
    m.block_strands.resize(m.touched.size());
    for (std::size_t i = m.touched.size(); i-- > 0;)
        m.block_strands[--m.block_start[layout.block[m.touched[i]] + 1]] = m.touched[i];
    for (std::size_t b = 0; b < blocks; ++b) m.block_start[b] = m.block_start[b + 1];
    if (blocks > 0) m.block_start[blocks] = static_cast<std::uint32_t>(m.touched.size());

    // Batches: by phase, within a phase by pair of groups, each bucket filled greedily in the order
    // of the contacts so that no strand is twice in a batch.
    auto group = [&](std::uint32_t s) {
        return static_cast<std::uint32_t>(static_cast<std::uint64_t>(s) * kGroups / strand_count);
    };
    // Within a bucket those that slide come together, whose solve is the longest, then those that
    // stick, then the open ones.
    constexpr std::uint32_t kKinds = 3;
    auto kind = [&](std::size_t c) {
        if (impulses.empty()) return 0u;
        const double* r = impulses.data() + 3 * c;
        const double most = laws[c].friction * r[0];
        constexpr double kSlides = 1 - 1e-6;
        if (!(r[0] > 0)) return 2u;
        return r[1] * r[1] + r[2] * r[2] < kSlides * most * most ? 1u : 0u;
    };
    constexpr std::uint32_t kBuckets = kGroups * kGroups * kGroups * kKinds;
    m.bucket_of.resize(contacts);
    m.count.assign(kBuckets + 1, 0);
    for (std::size_t c = 0; c < contacts; ++c) {
        const std::uint32_t a = group(places[2 * c].strand),
                            b = laws[c].sides > 1 ? group(places[2 * c + 1].strand) : a;
        const std::uint32_t phase = a == b ? 0 : round_of(a, b);
        m.bucket_of[c] =
            ((phase * kGroups + std::min(a, b)) * kGroups + std::max(a, b)) * kKinds + kind(c);
        ++m.count[m.bucket_of[c] + 1];
    }
    for (std::uint32_t i = 0; i < kBuckets; ++i) m.count[i + 1] += m.count[i];
    m.order.resize(contacts);
    for (std::size_t c = 0; c < contacts; ++c)
        m.order[m.count[m.bucket_of[c]]++] = static_cast<std::uint32_t>(c);
    m.batches.clear();
    m.buckets.clear();
    m.batch_of.resize(contacts);
    m.last_batch.assign(strand_count, 0);  // 1 + last batch that holds the strand
    for (std::size_t i = 0; i < contacts;) {
        const std::uint32_t bucket = m.bucket_of[m.order[i]] / kKinds;
        const std::uint32_t first = static_cast<std::uint32_t>(m.batches.size());
        std::uint32_t open = first;  // batches before it are full
        for (; i < contacts && m.bucket_of[m.order[i]] / kKinds == bucket; ++i) {
            const std::uint32_t c = m.order[i];
            std::uint32_t at = open;
            for (std::uint32_t side = 0; side < laws[c].sides; ++side)
                at = std::max(at, m.last_batch[places[2 * c + side].strand]);
            while (at < m.batches.size() && m.batches[at].side[0][kContactBatch - 1] != kNoSide)
                ++at;
            if (at == m.batches.size()) {
                m.batches.emplace_back();
                ContactBatch& batch = m.batches.back();
                for (std::uint32_t l = 0; l < kContactBatch; ++l) {
                    for (int k = 0; k < 6; ++k) batch.w[k][l] = k == 0 || k == 3 || k == 5 ? 1 : 0;
                    for (int k = 0; k < 3; ++k)
                        batch.constant[k][l] = k == 0 ? 1 : 0, batch.impulse[k][l] = 0;
                    batch.friction[l] = batch.eased[l] = 0;
                    batch.side[0][l] = batch.side[1][l] = kNoSide;
                }
            }
            ContactBatch& batch = m.batches[at];
            std::uint32_t lane = 0;
            while (batch.side[0][lane] != kNoSide) ++lane;
            m.batch_of[c] = at * kContactBatch + lane;
            while (open < m.batches.size() && m.batches[open].side[0][kContactBatch - 1] != kNoSide)
                ++open;
            for (std::uint32_t side = 0; side < laws[c].sides; ++side) {
                batch.side[side][lane] = 2 * c + side;
                m.last_batch[places[2 * c + side].strand] = at + 1;
            }
        }
        m.buckets.push_back(
            {bucket / (kGroups * kGroups), first, static_cast<std::uint32_t>(m.batches.size())});
    }
    m.bucket_sum.resize(m.buckets.size());
    m.bucket_square.resize(m.buckets.size());
    if (m.block_version.size() != blocks)
        m.block_version.assign(blocks, std::numeric_limits<std::uint64_t>::max());
    renew(layout, laws, places, inverse, threads, exact);
}

template <class Column>
void GaussSeidel::Memory::add_coupling(std::span<const ContactLaw> laws,
                                       std::span<const SidePlace> places, std::size_t to,
                                       std::size_t from, const Column* columns_of, double* out,
                                       std::size_t stride) const {
    for (std::uint32_t a = 0; a < laws[to].sides; ++a)
        for (std::uint32_t b = 0; b < laws[from].sides; ++b) {
            if (places[2 * to + a].strand != places[2 * from + b].strand) continue;
            const SweepSide &read = sides[2 * to + a], &give = sides[2 * from + b];
            for (std::size_t col = 0; col < 3; ++col) {
                const Column* column = columns_of + give.column + col * give.rows + read.read;
                for (std::size_t row = 0; row < 3; ++row) {
                    if (read.dense == 0) {
                        out[row * stride + col] += column[row];
                        continue;
                    }
                    for (int k = 0; k < 7; ++k)
                        out[row * stride + col] += laws[to].rows[a].weight[row][k] * column[k];
                }
            }
        }
}

void GaussSeidel::Memory::take_over(std::uint32_t strand) {
    const StrandPart &part = now.strands[strand], &was = before.strands[strand];
    if (part.side_count != was.side_count) return;
    for (std::uint32_t j = 0; j < part.side_count; ++j) {
        const std::uint32_t k = now.side_order[part.first_side + j],
                            old = before.side_order[was.first_side + j];
        if (now.first[k] != before.first[old] ||
            !std::equal(&now.rows[21 * k], &now.rows[21 * k] + 21, &before.rows[21 * old]))
            return;
    }
    std::copy_n(before.columns.begin() + static_cast<std::ptrdiff_t>(was.columns),
                3 * static_cast<std::size_t>(part.side_count) * part.rows,
                now.columns.begin() + static_cast<std::ptrdiff_t>(part.columns));
    stale[strand] = 0;
}

void GaussSeidel::renew(const RodLayout& layout, std::span<const ContactLaw> laws,
                        std::span<const SidePlace> places, const RodInverse& inverse, int threads,
                        bool exact) {
    Memory& m = *memory_;
    const std::size_t contacts = laws.size();
    const std::size_t blocks = m.block_version.size();
    if (exact && m.now.exact.empty()) {
        m.now.exact.resize(m.now.columns.size());
        for (const std::uint32_t s : m.touched) m.stale[s] = 1;
    }
    exact = !m.now.exact.empty();
    // W, or its half, by one solve a column: a strand's next column beside those of its block.
#pragma omp parallel num_threads(threads)
    {
        AlignedNumbers values;
        std::vector<double> column;
        std::vector<std::uint32_t> members;  // whose columns are to be found
#pragma omp for schedule(dynamic)
        for (std::size_t b = 0; b < blocks; ++b) {
            const std::uint64_t version = inverse.version(static_cast<std::uint32_t>(b));
            if (m.block_version[b] != version)
                for (std::uint32_t i = m.block_start[b]; i < m.block_start[b + 1]; ++i)
                    m.stale[m.block_strands[i]] = 1;
            m.block_version[b] = version;
            members.clear();
            for (std::uint32_t i = m.block_start[b]; i < m.block_start[b + 1]; ++i)
                if (m.stale[m.block_strands[i]]) members.push_back(m.block_strands[i]);
            if (members.empty()) continue;
            for (const std::uint32_t s : members) m.stale[s] = 0;
            const std::size_t begin = layout.block_first[b],
                              length = layout.block_first[b + 1] - begin;
            values.resize(length);
            std::uint32_t most = 0;
            for (const std::uint32_t s : members)
                most = std::max(most, m.now.strands[s].side_count);
            for (std::uint32_t place = 0; place < most; ++place)
                for (int k = 0; k < 3; ++k) {
                    std::fill(values.begin(), values.end(), 0.0);
                    for (const std::uint32_t s : members) {
                        const Memory::StrandPart& part = m.now.strands[s];
                        if (place >= part.side_count) continue;
                        const std::uint32_t side = m.now.side_order[part.first_side + place];
                        const SideRows& rows = laws[side / 2].rows[side % 2];
                        for (int i = 0; i < 7; ++i)
                            values[rows.first - begin +
                                   static_cast<std::size_t>(i) * rows.stride] += rows.weight[k][i];
                    }
                    inverse.apply_block(static_cast<std::uint32_t>(b), values);
                    for (const std::uint32_t s : members) {
                        const Memory::StrandPart& part = m.now.strands[s];
                        if (place >= part.side_count) continue;
                        const std::size_t at =
                            part.columns + (3 * static_cast<std::size_t>(place) + k) * part.rows;
                        column.assign(part.rows, 0.0);
                        std::uint32_t written = 0;
                        if (part.dense) {
                            const std::size_t numbers =
                                4 * static_cast<std::size_t>(layout.vertex_count[s]);
                            const std::size_t first = layout.first[s] - begin;
                            for (std::size_t i = 0; i < numbers; ++i)
                                column[written++] = values[first + i * layout.lanes];
                        } else {
                            for (std::uint32_t j = 0; j < part.side_count; ++j) {
                                const std::uint32_t other = m.now.side_order[part.first_side + j];
                                const SideRows& rows = laws[other / 2].rows[other % 2];
                                double u[3] = {0, 0, 0};
                                for (int i = 0; i < 7; ++i) {
                                    const double x =
                                        values[rows.first - begin +
                                               static_cast<std::size_t>(i) * rows.stride];
                                    for (int d = 0; d < 3; ++d) u[d] += rows.weight[d][i] * x;
                                }
                                for (int d = 0; d < 3; ++d) column[written++] = u[d];
                            }
                        }
                        for (std::uint32_t i = 0; i < part.rows; ++i)
                            m.now.columns[at + i] = static_cast<float>(column[i]);
                        if (exact)
                            std::copy(column.begin(), column.end(),
                                      m.now.exact.begin() + static_cast<std::ptrdiff_t>(at));
                    }
                }
        }
    }

#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t c = 0; c < contacts; ++c) {
        ContactBatch& batch = m.batches[m.batch_of[c] / kContactBatch];
        const std::uint32_t lane = m.batch_of[c] % kContactBatch;
        // Its own block: both sides, and between them where they are on one strand.
        double w[3][3] = {};
        m.add_coupling(laws, places, c, c, m.now.columns.data(), &w[0][0], 3);
        if (w[0][0] > 0) {
            const double own[6] = {w[0][0], 0.5 * (w[0][1] + w[1][0]), 0.5 * (w[0][2] + w[2][0]),
                                   w[1][1], 0.5 * (w[1][2] + w[2][1]), w[2][2]};
            for (int k = 0; k < 6; ++k) batch.w[k][lane] = own[k];
        }
    }
}

template <class Column>
void GaussSeidel::Memory::write_state(std::span<const ContactLaw> laws, std::span<const double> v,
                                      std::span<const double> applied,
                                      std::span<const double> impulses, const Column* columns_of,
                                      int threads) {
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t i = 0; i < touched.size(); ++i) {
        const StrandPart& part = now.strands[touched[i]];
        double* numbers = state.data() + part.state;
        std::fill(numbers, numbers + part.rows, 0.0);
        for (std::uint32_t j = 0; j < part.side_count; ++j) {
            const std::uint32_t k = now.side_order[part.first_side + j];
            const SideRows& side = laws[k / 2].rows[k % 2];
            if (part.dense) {
                for (int d = 0; d < 7; ++d)
                    numbers[sides[k].read + d] =
                        v[side.first + static_cast<std::size_t>(d) * side.stride];
            } else {
                add_velocity(side, v, numbers + sides[k].read);
            }
        }
        for (std::uint32_t j = 0; j < part.side_count; ++j) {
            const std::uint32_t k = now.side_order[part.first_side + j];
            for (int d = 0; d < 3; ++d) {
                const double missing = impulses[3 * (k / 2) + d] - applied[3 * (k / 2) + d];
                if (missing == 0) continue;
                const Column* column =
                    columns_of + sides[k].column + static_cast<std::size_t>(d) * part.rows;
                for (std::uint32_t row = 0; row < part.rows; ++row)
                    numbers[row] += missing * column[row];
            }
        }
    }
}

GaussSeidelReport GaussSeidel::solve(std::span<const ContactLaw> laws, std::span<const double> v,
                                     std::span<const double> applied,
                                     const GaussSeidelSettings& settings,
                                     std::span<double> impulses, std::span<double> eased) {
    Memory& m = *memory_;
    const std::size_t contacts = laws.size();
    GaussSeidelReport report;
    if (contacts == 0) return report;
    const SweepKernels& kernels = sweep_kernels(settings.instruction_set);
    const SweepView view{m.batches.data(),          m.sides.data(),
                         m.now.columns.data(),      m.state.data(),
                         m.now.rows.data(),         1 / settings.velocity_scale,
                         1 / settings.impulse_scale};

    for (std::size_t c = 0; c < contacts; ++c) {
        ContactBatch& batch = m.batches[m.batch_of[c] / kContactBatch];
        const std::uint32_t lane = m.batch_of[c] % kContactBatch;
        for (int k = 0; k < 3; ++k) {
            batch.constant[k][lane] = laws[c].constant[k];
            batch.impulse[k][lane] = impulses[3 * c + k];
        }
        batch.friction[lane] = std::min(laws[c].friction, kMostFriction);
        batch.eased[lane] = settings.leeway > 0 ? eased[c] : 0;
    }
    m.write_state(laws, v, applied, impulses, m.now.columns.data(), settings.threads);

    const std::size_t buckets = m.buckets.size();
    auto mean_residual = [&] {
        double sum = 0;
        for (std::size_t b = 0; b < buckets; ++b) sum += m.bucket_sum[b];
        return sum / static_cast<double>(contacts);
    };
#pragma omp parallel for num_threads(settings.threads) schedule(static, 1)
    for (std::size_t b = 0; b < buckets; ++b)
        m.bucket_sum[b] = kernels.residual(view, m.buckets[b].first_batch, m.buckets[b].last_batch);
    // Where contacts share a load in more than one way, further sweeps would only shift it about.
    report.start = report.residual = mean_residual();
    if (report.residual <= settings.accepted) return report;
    // Contacts near each other on a stiff strand nearly repeat each other, and sweeps alone shift
    // the load between them at a crawl (a factor 0.9994 a sweep in the bundles of METHODS 2.10). So
    // each sweep counts as the step of a nonlinear conjugate gradient method that it preconditions
    // (Silcowitz-Hansen, Niebe and Erleben 2010): the state is linear in the impulses, so both are
    // carried on together and W is not applied again. What is kept always comes from a sweep, which
    // puts the impulses back under the law.
    const std::size_t numbers = m.batches.size() * kBatchImpulses, states = m.state.size();
    for (AlignedNumbers* a : {&m.impulse_before, &m.impulse_along}) a->assign(numbers, 0.0);
    for (AlignedNumbers* a : {&m.state_before, &m.state_along}) a->assign(states, 0.0);
    const std::size_t chunks = (states + kChunk - 1) / kChunk;
    double last_square = std::numeric_limits<double>::infinity();
    const double enough = std::max(settings.residual, settings.gain * report.start);
    double best = last_square, kept = report.start;
    std::uint32_t best_sweep = 0;
    auto each_kept = [&](auto&& visit) {
        for (std::size_t b = 0; b < m.batches.size(); ++b) {
            visit(&m.batches[b].impulse[0][0], m.best_impulse.data() + b * kBatchImpulses,
                  kBatchImpulses);
            visit(m.batches[b].eased, m.best_eased.data() + b * kContactBatch, kContactBatch);
        }
    };
    auto keep = [&] {
        each_kept([](double* now, double* then, std::size_t n) { std::copy_n(now, n, then); });
        kept = report.residual;
    };
    m.best_impulse.resize(numbers);
    m.best_eased.resize(m.batches.size() * kContactBatch);
    keep();
    auto each_impulse = [&](std::size_t bucket, auto&& visit) {
        for (std::size_t b = m.buckets[bucket].first_batch; b < m.buckets[bucket].last_batch; ++b)
            for (std::size_t i = 0; i < kBatchImpulses; ++i)
                visit(m.batches[b].impulse[i / kContactBatch][i % kContactBatch],
                      b * kBatchImpulses + i);
    };
    SpinBarrier barrier;
    // Every thread decides the same from the same sums, in the same order.
#pragma omp parallel num_threads(settings.threads) firstprivate(best, best_sweep, last_square)
    {
        const auto thread = static_cast<std::size_t>(omp_get_thread_num()),
                   team = static_cast<std::size_t>(omp_get_num_threads());
        const auto meet = [&] { barrier.wait(static_cast<std::uint32_t>(team)); };
        const auto each = [&](std::size_t first, std::size_t last, auto&& body) {
            for (std::size_t k = first + thread; k < last; k += team) body(k);
        };
        const auto each_state = [&](auto&& body) {
            each(0, chunks, [&](std::size_t c) {
                const std::size_t end = std::min(states, (c + 1) * kChunk);
                for (std::size_t i = c * kChunk; i < end; ++i) body(i);
            });
        };
        for (std::uint32_t sweeps = 1;; ++sweeps) {
            each(0, buckets, [&](std::size_t b) {
                each_impulse(b, [&](double& r, std::size_t i) { m.impulse_before[i] = r; });
            });
            each_state([&](std::size_t i) { m.state_before[i] = m.state[i]; });
            meet();
            for (std::size_t first = 0; first < buckets;) {
                std::size_t last = first;
                while (last < buckets && m.buckets[last].phase == m.buckets[first].phase) ++last;
                each(first, last, [&](std::size_t b) {
                    kernels.sweep(view, m.buckets[b].first_batch, m.buckets[b].last_batch);
                });
                meet();
                first = last;
            }
            if (sweeps % kResidualEvery == 0 || sweeps >= settings.most_sweeps) {
                each(0, buckets, [&](std::size_t b) {
                    m.bucket_sum[b] =
                        kernels.residual(view, m.buckets[b].first_batch, m.buckets[b].last_batch);
                });
                meet();
                const double residual = mean_residual();
                if (residual < kProgress * best) {
                    best = residual;
                    best_sweep = sweeps;
                }
                const bool done = sweeps >= settings.most_sweeps ||
                                  (sweeps >= settings.least_sweeps &&
                                   (residual <= enough || sweeps >= best_sweep + kPatience));
                if (thread == 0) {
                    report.residual = residual;
                    report.sweeps = sweeps;
                    if (!done && residual < kept) keep();
                }
                if (done) break;
                if (settings.leeway > 0 && sweeps % kEaseEvery == 0) {
                    meet();
                    each(0, buckets, [&](std::size_t b) {
                        kernels.ease(view, m.buckets[b].first_batch, m.buckets[b].last_batch,
                                     settings.leeway);
                    });
                    last_square = std::numeric_limits<double>::infinity();
                }
            }
            each(0, buckets, [&](std::size_t b) {
                double square = 0;
                each_impulse(b, [&](double& r, std::size_t i) {
                    const double d = r - m.impulse_before[i];
                    square += d * d;
                });
                m.bucket_square[b] = square;
            });
            meet();
            double square = 0;
            for (std::size_t b = 0; b < buckets; ++b) square += m.bucket_square[b];
            // Well uphill, or the first: begin anew.
            const double along =
                square < kUphill * last_square ? std::min(1.0, square / last_square) : 0;
            last_square = square;
            // The same thread copies the same numbers when the next sweep begins.
            each(0, buckets, [&](std::size_t b) {
                each_impulse(b, [&](double& r, std::size_t i) {
                    const double carried = along * m.impulse_along[i];
                    const double d = r - m.impulse_before[i];
                    r += carried;
                    m.impulse_along[i] = carried + d;
                });
            });
            each_state([&](std::size_t i) {
                const double carried = along * m.state_along[i];
                const double d = m.state[i] - m.state_before[i];
                m.state[i] += carried;
                m.state_along[i] = carried + d;
            });
        }
    }

    // Not for a little: from there the next pass would do the same again.
    if (!(report.residual <= kFarWorse * kept)) {
        each_kept([](double* now, double* then, std::size_t n) { std::copy_n(then, n, now); });
        report.residual = kept;
    }
    for (std::size_t c = 0; c < contacts; ++c) {
        const ContactBatch& batch = m.batches[m.batch_of[c] / kContactBatch];
        const std::uint32_t lane = m.batch_of[c] % kContactBatch;
        if (settings.leeway > 0) eased[c] = batch.eased[lane];
        double change = 0;
        for (int k = 0; k < 3; ++k) {
            const double step = batch.impulse[k][lane] - impulses[3 * c + k];
            change += step * step;
            impulses[3 * c + k] = batch.impulse[k][lane];
        }
        report.change += std::sqrt(change);
    }
    return report;
}

void GaussSeidel::Memory::read_velocity(std::span<const ContactLaw> laws, std::uint32_t contact,
                                        double* out) const {
    for (int k = 0; k < 3; ++k) out[k] = laws[contact].constant[k];
    for (std::uint32_t side = 0; side < laws[contact].sides; ++side) {
        const SweepSide& at = sides[2 * contact + side];
        const double* numbers = state.data() + at.state + at.read;
        for (int k = 0; k < 3; ++k) {
            if (at.dense == 0) {
                out[k] += numbers[k];
                continue;
            }
            for (int i = 0; i < 7; ++i)
                out[k] += laws[contact].rows[side].weight[k][i] * numbers[i];
        }
    }
}

void GaussSeidel::Memory::solve_together(std::span<const ContactLaw> laws,
                                         std::span<const SidePlace> places,
                                         const GaussSeidelSettings& settings,
                                         std::span<double> impulses) {
    const std::size_t number = together.size(), n = 3 * number;
    u.resize(n);
    r.resize(n);
    friction.resize(number);
    for (std::size_t i = 0; i < number; ++i) {
        const std::uint32_t c = together[i];
        read_velocity(laws, c, &u[3 * i]);
        friction[i] = std::min(laws[c].friction, kMostFriction);
        for (std::size_t k = 0; k < 3; ++k) r[3 * i + k] = impulses[3 * c + k];
    }
    ContactNewtonSettings newton{settings.velocity_scale, settings.impulse_scale,
                                 settings.residual * static_cast<double>(number)};
    if (sum_of_residuals(friction, newton, r, u) <= newton.residual) return;
    w.assign(n * n, 0.0);
    for (std::size_t i = 0; i < number; ++i)
        for (std::size_t j = 0; j < number; ++j)
            add_coupling(laws, places, together[i], together[j], now.exact.data(),
                         &w[3 * i * n + 3 * j], n);
    contact_newton.solve(w, friction, newton, r, u);
    for (std::size_t i = 0; i < number; ++i) {
        const std::uint32_t c = together[i];
        for (std::size_t k = 0; k < 3; ++k) {
            const double change = r[3 * i + k] - impulses[3 * c + k];
            if (change == 0) continue;
            impulses[3 * c + k] = r[3 * i + k];
            for (std::uint32_t side = 0; side < laws[c].sides; ++side) {
                const SweepSide& give = sides[2 * c + side];
                const double* column = now.exact.data() + give.column + k * give.rows;
                double* numbers = state.data() + give.state;
                for (std::uint32_t row = 0; row < give.rows; ++row)
                    numbers[row] += change * column[row];
            }
        }
    }
}

GaussSeidelReport GaussSeidel::solve_strands(std::span<const ContactLaw> laws,
                                             std::span<const SidePlace> places,
                                             std::span<const double> v,
                                             std::span<const double> applied,
                                             const GaussSeidelSettings& settings,
                                             std::span<double> impulses) {
    Memory& m = *memory_;
    const std::size_t contacts = laws.size();
    GaussSeidelReport report;
    if (contacts == 0 || m.now.exact.empty()) return report;
    m.write_state(laws, v, applied, impulses, m.now.exact.data(), settings.threads);
    m.first_impulse.assign(impulses.begin(), impulses.end());
    m.best_impulse.assign(impulses.begin(), impulses.end());
    const ContactNewtonSettings scales{settings.velocity_scale, settings.impulse_scale, 0};
    auto mean_residual = [&] {
        double sum = 0;
        for (std::uint32_t c = 0; c < contacts; ++c) {
            double u[3];
            m.read_velocity(laws, c, u);
            const double mu[1] = {std::min(laws[c].friction, kMostFriction)};
            sum += sum_of_residuals(mu, scales, impulses.subspan(3 * c, 3), u);
        }
        return sum / static_cast<double>(contacts);
    };
    report.start = report.residual = mean_residual();
    double best = report.residual;
    std::uint32_t best_round = 0;
    double kept_residual = report.residual;
    while (report.sweeps < settings.most_sweeps && report.residual > settings.residual) {
        for (const std::uint32_t s : m.touched) {
            const Memory::StrandPart& part = m.now.strands[s];
            // More contacts than numbers contradict each other: sweeps with eased gaps do better.
            // And the time goes with the cube.
            if (part.dense || part.side_count > kMostTogether) continue;
            m.together.clear();
            for (std::uint32_t j = 0; j < part.side_count; ++j)
                m.together.push_back(m.now.side_order[part.first_side + j] / 2);
            std::sort(m.together.begin(), m.together.end());
            m.together.erase(std::unique(m.together.begin(), m.together.end()), m.together.end());
            m.solve_together(laws, places, settings, impulses);
        }
        ++report.sweeps;
        report.residual = mean_residual();
        if (report.residual < kept_residual) {
            kept_residual = report.residual;
            std::copy(impulses.begin(), impulses.end(), m.best_impulse.begin());
        }
        if (report.residual < kProgress * best) {
            best = report.residual;
            best_round = report.sweeps;
        } else if (report.sweeps >= best_round + kStrandPatience) {
            break;
        }
    }
    report.residual = kept_residual;
    std::copy(m.best_impulse.begin(), m.best_impulse.end(), impulses.begin());
    for (std::size_t c = 0; c < contacts; ++c) {
        double square = 0;
        for (std::size_t k = 3 * c; k < 3 * c + 3; ++k)
            square += (impulses[k] - m.first_impulse[k]) * (impulses[k] - m.first_impulse[k]);
        report.change += std::sqrt(square);
    }
    return report;
}

}  // namespace keratin
