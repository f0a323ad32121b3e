// Sweeps over all contacts.
#include "runtime/contact/coulomb.h"
#include "runtime/contact/gauss_seidel_memory.h"
#include "runtime/contact/spin_wait.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <omp.h>

namespace keratin {
namespace {

constexpr std::uint32_t kResidualEvery = 4;  // sweeps
// Contacts of one pair of strands press on numbers that the two share: there are more contacts than
// numbers, and their gaps, each rounded and linearised alone, contradict each other by nanometres.
// The law then holds only once sweeps have moved whole loads from one contact to the next, at a
// rate that such a mismatch drives (thousands of sweeps). After so many sweeps, and again each time
// so many later, a gap takes the value that the others leave it, within the leeway.
constexpr std::uint32_t kEaseEvery = 16;
constexpr double kUphill = 1.2;  // growth of the squared step at which the directions begin anew
constexpr std::uint32_t kPatience = 100;  // sweeps: see kProgress
constexpr double kFarWorse =
    10;  // than the best residual seen: the impulses of then are taken back

}  // namespace

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

#pragma omp parallel for num_threads(settings.threads) schedule(static)
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
    m.impulse_along.assign(numbers, 0.0);
    m.state_before.assign(m.state.begin(), m.state.end());
    m.state_along.assign(states, 0.0);
    double last_square = std::numeric_limits<double>::infinity();
    const double enough = std::max(settings.residual, settings.gain * report.start);
    double best = last_square, kept = 0;  // kept: mean |f_FB| of the impulses kept
    std::uint32_t best_sweep = 0;
    m.best_impulse.resize(numbers);
    m.best_eased.resize(m.batches.size() * kContactBatch);
    auto each_kept = [&](const Memory::Bucket& bucket, auto&& visit) {
        for (std::size_t b = bucket.first_batch; b < bucket.last_batch; ++b) {
            visit(&m.batches[b].impulse[0][0], m.best_impulse.data() + b * kBatchImpulses,
                  kBatchImpulses);
            visit(m.batches[b].eased, m.best_eased.data() + b * kContactBatch, kContactBatch);
        }
    };
    auto keep = [&](const Memory::Bucket& bucket) {
        each_kept(bucket,
                  [](double* now, double* then, std::size_t n) { std::copy_n(now, n, then); });
    };
    auto take_back = [&](const Memory::Bucket& bucket) {
        each_kept(bucket,
                  [](double* now, double* then, std::size_t n) { std::copy_n(then, n, now); });
    };
    for (const Memory::Bucket& bucket : m.buckets) keep(bucket);
    m.impulse_before.assign(m.best_impulse.begin(), m.best_impulse.end());
    SpinBarrier barrier;
    SpinTurns turns[kGroups];
    // Every thread decides the same from the same sums, in the same order.
#pragma omp parallel num_threads(settings.threads) firstprivate(best, best_sweep, last_square)
    {
        const auto thread = static_cast<std::uint32_t>(omp_get_thread_num()),
                   team = static_cast<std::uint32_t>(omp_get_num_threads());
#pragma omp single
        m.share_out(team);
        const auto meet = [&] { barrier.wait(team); };
        const auto each = [&](auto&& body) {
            for (std::size_t k = 0; k < buckets; ++k)
                if (m.owner[k] == thread) body(k);
        };
        double least = report.start;  // of those kept
        for (std::uint32_t sweeps = 1;; ++sweeps) {
            each([&](std::size_t b) {
                const Memory::Bucket& bucket = m.buckets[b];
                const std::uint32_t groups = bucket.group[0] == bucket.group[1] ? 1 : 2;
                for (std::uint32_t g = 0; g < groups; ++g)
                    turns[bucket.group[g]].wait_for((sweeps - 1) * m.group_turns[bucket.group[g]] +
                                                    bucket.turn[g]);
                kernels.sweep(view, bucket.first_batch, bucket.last_batch);
                for (std::uint32_t g = 0; g < groups; ++g) turns[bucket.group[g]].end();
            });
            if (sweeps % kResidualEvery == 0 || sweeps >= settings.most_sweeps) {
                meet();
                each([&](std::size_t b) {
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
                if (done) {
                    if (thread == 0) {
                        report.residual = residual;
                        report.sweeps = sweeps;
                        kept = least;
                    }
                    break;
                }
                if (residual < least) {
                    least = residual;
                    each([&](std::size_t b) { keep(m.buckets[b]); });
                }
                if (settings.leeway > 0 && sweeps % kEaseEvery == 0) {
                    each([&](std::size_t b) {
                        kernels.ease(view, m.buckets[b].first_batch, m.buckets[b].last_batch,
                                     settings.leeway);
                    });
                    last_square = std::numeric_limits<double>::infinity();
                }
            }
            each([&](std::size_t b) {
                m.bucket_square[b] =
                    kernels.square(view, m.buckets[b].first_batch, m.buckets[b].last_batch,
                                   m.impulse_before.data());
            });
            meet();
            double square = 0;
            for (std::size_t b = 0; b < buckets; ++b) square += m.bucket_square[b];
            // Well uphill, or the first: begin anew.
            const double along =
                square < kUphill * last_square ? std::min(1.0, square / last_square) : 0;
            last_square = square;
            each([&](std::size_t b) {
                kernels.carry_impulses(view, m.buckets[b].first_batch, m.buckets[b].last_batch,
                                       along, m.impulse_before.data(), m.impulse_along.data());
            });
            for (std::uint32_t g = 0; g < kGroups; ++g) {
                if (Memory::owner_of(g, team) != thread) continue;
                const std::size_t at = m.group_state[g];
                kernels.carry(m.group_state[g + 1] - at, along, m.state.data() + at,
                              m.state_before.data() + at, m.state_along.data() + at);
            }
            meet();
        }
    }

    // Not for a little: from there the next pass would do the same again.
    if (!(report.residual <= kFarWorse * kept)) {
        for (const Memory::Bucket& bucket : m.buckets) take_back(bucket);
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

}  // namespace keratin
