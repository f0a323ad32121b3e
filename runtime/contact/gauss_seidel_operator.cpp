// W: assembled, renewed, and read.
#include "runtime/contact/gauss_seidel_memory.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace keratin {
namespace {

constexpr std::size_t kAlign = 8;  // numbers: columns and states start at multiples of 8

std::uint32_t rounded_up(std::size_t n) {
    return static_cast<std::uint32_t>((n + kAlign - 1) / kAlign * kAlign);
}

}  // namespace

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
    std::uint32_t total = 0, groups = 0;
    std::size_t column_numbers = 0, state_numbers = 0;
    for (std::uint32_t s = 0; s < strand_count; ++s) {
        Memory::StrandPart& part = m.now.strands[s];
        while (groups <= m.group_of(s)) m.group_state[groups++] = state_numbers;
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
    while (groups <= kGroups) m.group_state[groups++] = state_numbers;
    m.now.side_order.resize(total);
    m.sides.resize(2 * contacts);
    m.now.columns.resize(column_numbers);
    m.now.exact.clear();
    m.now.first.resize(2 * contacts);
    m.state.resize(state_numbers);
    m.now.rows.resize(42 * contacts);
    for (std::size_t c = 0; c < contacts; ++c)
        for (std::uint32_t side = 0; side < laws[c].sides; ++side) {
            const std::uint32_t k = static_cast<std::uint32_t>(2 * c + side);
            Memory::StrandPart& part = m.now.strands[places[k].strand];
            m.now.side_order[part.first_side + part.side_count++] = k;
        }
        // Along each strand, see renew.
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t i = 0; i < m.touched.size(); ++i) {
        const Memory::StrandPart& part = m.now.strands[m.touched[i]];
        const std::span order =
            std::span(m.now.side_order).subspan(part.first_side, part.side_count);
        std::ranges::sort(order, [&](std::uint32_t l, std::uint32_t r) {
            return places[l].vertex != places[r].vertex ? places[l].vertex < places[r].vertex
                                                        : l < r;
        });
        for (std::uint32_t place = 0; place < part.side_count; ++place) {
            const std::size_t k = order[place];
            m.sides[k] = {part.columns + 3 * static_cast<std::size_t>(place) * part.rows,
                          part.state,
                          part.rows,
                          part.dense ? 4 * places[k].vertex : 3 * place,
                          part.dense ? 1u : 0u,
                          21 * k};
            const SideRows& rows = laws[k / 2].rows[k % 2];
            std::copy(&rows.weight[0][0], &rows.weight[0][0] + 21, &m.now.rows[21 * k]);
            m.now.first[k] = rows.first;
        }
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

    m.fill_batches(laws, places, impulses, threads);
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

// Column k of a side, from the vector that its weights lead to: number n of the layout stands at
// vector_at(n), the strand's numbers from there on 3 lanes apart.
template <class VectorAt>
void GaussSeidel::Memory::write_column(std::span<const ContactLaw> laws, const RodLayout& layout,
                                       std::uint32_t strand, std::uint32_t place, std::size_t k,
                                       VectorAt&& vector_at) {
    const StrandPart& part = now.strands[strand];
    const std::size_t apart = 3 * std::size_t{layout.lanes};
    auto put = [&](std::size_t column, std::size_t row, double x) {
        const std::size_t to = part.columns + column * part.rows + row;
        now.columns[to] = static_cast<float>(x);
        if (!now.exact.empty()) now.exact[to] = x;
    };
    const std::size_t own = 3 * static_cast<std::size_t>(place) + k;
    const std::size_t used = part.dense ? 4 * std::size_t{layout.vertex_count[strand]}
                                        : 3 * std::size_t{part.side_count};
    for (std::size_t i = used; i < part.rows; ++i) put(own, i, 0);
    if (part.dense) {
        const double* at = vector_at(layout.first[strand]);
        for (std::size_t i = 0; i < used; ++i) put(own, i, at[i * apart]);
        return;
    }
    for (std::size_t j = place; j < part.side_count; ++j) {
        const std::uint32_t other = now.side_order[part.first_side + j];
        const SideRows& rows = laws[other / 2].rows[other % 2];
        const double* at = vector_at(rows.first);
        double velocity[3] = {0, 0, 0};
        for (std::size_t i = 0; i < 7; ++i)
            for (std::size_t d = 0; d < 3; ++d) velocity[d] += rows.weight[d][i] * at[i * apart];
        for (std::size_t d = 0; d < 3; ++d) {
            put(own, 3 * j + d, velocity[d]);
            if (j > place) put(3 * j + d, own, velocity[d]);
        }
    }
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
    // W, or its half, by one solve a column: a strand's next column beside those of its block.
#pragma omp parallel num_threads(threads)
    {
        AlignedNumbers numbers;
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
            const std::size_t begin = layout.block_first[b], lanes = layout.lanes,
                              length = 3 * (layout.block_first[b + 1] - begin);
            numbers.assign(length + 2 * inverse.margin(), 0.0);
            const std::span values = std::span(numbers).subspan(inverse.margin(), length);
            // Where a number of the layout stands in vector k.
            const auto vector_at = [&](std::size_t number, std::size_t k) {
                const std::size_t at = number - begin, lane = at % lanes;
                return values.data() + 3 * (at - lane) + lane + k * lanes;
            };
            std::uint32_t most = 0;
            for (const std::uint32_t s : members)
                most = std::max(most, m.now.strands[s].side_count);
            for (std::uint32_t place = 0; place < most; ++place) {
                // The sides lie in order along the strand and W is symmetric: what a column gives
                // to its own side and those after it is enough, and that needs its rows from there
                // on only. Columns over the strand's numbers must be whole.
                std::size_t from = length;
                for (const std::uint32_t s : members) {
                    const Memory::StrandPart& part = m.now.strands[s];
                    if (place >= part.side_count) continue;
                    const std::uint32_t side = m.now.side_order[part.first_side + place];
                    const SideRows& rows = laws[side / 2].rows[side % 2];
                    from =
                        part.dense ? 0 : std::min<std::size_t>(from, (rows.first - begin) / lanes);
                    for (std::size_t k = 0; k < 3; ++k) {
                        double* at = vector_at(rows.first, k);
                        for (std::size_t i = 0; i < 7; ++i) at[3 * i * lanes] = rows.weight[k][i];
                    }
                }
                inverse.apply_block(static_cast<std::uint32_t>(b), from, values);
                for (const std::uint32_t s : members) {
                    const Memory::StrandPart& part = m.now.strands[s];
                    if (place >= part.side_count) continue;
                    for (std::size_t k = 0; k < 3; ++k)
                        m.write_column(laws, layout, s, place, k,
                                       [&](std::size_t number) { return vector_at(number, k); });
                }
                std::ranges::fill(values.subspan(3 * from * lanes), 0.0);
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

template void GaussSeidel::Memory::add_coupling(std::span<const ContactLaw>,
                                                std::span<const SidePlace>, std::size_t,
                                                std::size_t, const double*, double*,
                                                std::size_t) const;
template void GaussSeidel::Memory::write_state(std::span<const ContactLaw>, std::span<const double>,
                                               std::span<const double>, std::span<const double>,
                                               const float*, int);
template void GaussSeidel::Memory::write_state(std::span<const ContactLaw>, std::span<const double>,
                                               std::span<const double>, std::span<const double>,
                                               const double*, int);

}  // namespace keratin
