// The kernels of gauss_seidel_sweep.h for a lane pack. Included by one file an instruction set.
#pragma once

#include "runtime/contact/coulomb.h"
#include "runtime/contact/gauss_seidel_sweep.h"

namespace keratin {
namespace {

inline void read_side(const SweepView& view, const SweepSide& side, double out[3]) {
    const double* s = view.state + side.state + side.read;
    if (side.dense == 0) {
        for (int k = 0; k < 3; ++k) out[k] += s[k];
        return;
    }
    const double* row = view.rows_of + side.row;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 7; ++i) out[k] += row[7 * k + i] * s[i];
}

template <class Pack>
void push_side(const SweepView& view, const SweepSide& side, double d0, double d1, double d2) {
    const float* c0 = view.columns + side.column;
    const float* c1 = c0 + side.rows;
    const float* c2 = c1 + side.rows;
    double* s = view.state + side.state;
    const Pack p0(d0), p1(d1), p2(d2);
    for (std::uint32_t i = 0; i < side.rows; i += Pack::width)
        mul_add(p0, Pack::load(c0 + i),
                mul_add(p1, Pack::load(c1 + i), mul_add(p2, Pack::load(c2 + i), Pack::load(s + i))))
            .store(s + i);
}

inline void read_velocities(const SweepView& view, const ContactBatch& batch,
                            double u[3][kContactBatch]) {
    for (std::uint32_t l = 0; l < kContactBatch; ++l) {
        double v[3] = {batch.constant[0][l], batch.constant[1][l], batch.constant[2][l]};
        for (int side = 0; side < 2; ++side)
            if (batch.side[side][l] != kNoSide) read_side(view, view.sides[batch.side[side][l]], v);
        for (int k = 0; k < 3; ++k) u[k][l] = v[k];
    }
}

// The columns that a batch is likely to push with: too short, each, for the processor to see them
// coming.
inline void fetch_ahead(const SweepView& view, const ContactBatch& batch) {
    for (std::uint32_t l = 0; l < kContactBatch; ++l) {
        if (!(batch.impulse[0][l] > 0)) continue;
        for (int side = 0; side < 2; ++side) {
            if (batch.side[side][l] == kNoSide) continue;
            const SweepSide& s = view.sides[batch.side[side][l]];
            const float* column = view.columns + s.column;
            for (std::uint32_t i = 0; i < 3 * s.rows; i += 16) __builtin_prefetch(column + i);
        }
    }
}

template <class Pack>
double sweep(const SweepView& view, std::size_t begin, std::size_t end) {
    double change = 0;
    for (std::size_t b = begin; b < end; ++b) {
        ContactBatch& batch = view.batches[b];
        if (b + 1 < end) fetch_ahead(view, view.batches[b + 1]);
        alignas(64) double u[3][kContactBatch], step[3][kContactBatch], moved[kContactBatch];
        read_velocities(view, batch, u);
        for (std::uint32_t l = 0; l < kContactBatch; l += Pack::width) {
            const Delassus<Pack> w{Pack::load(batch.w[0] + l), Pack::load(batch.w[1] + l),
                                   Pack::load(batch.w[2] + l), Pack::load(batch.w[3] + l),
                                   Pack::load(batch.w[4] + l), Pack::load(batch.w[5] + l)};
            const Local3<Pack> r{Pack::load(batch.impulse[0] + l), Pack::load(batch.impulse[1] + l),
                                 Pack::load(batch.impulse[2] + l)};
            // The velocity without this contact's own impulse.
            const Local3<Pack> rest{
                Pack::load(u[0] + l) - (w.nn * r.n + w.n1 * r.t1 + w.n2 * r.t2),
                Pack::load(u[1] + l) - (w.n1 * r.n + w.t11 * r.t1 + w.t12 * r.t2),
                Pack::load(u[2] + l) - (w.n2 * r.n + w.t12 * r.t1 + w.t22 * r.t2)};
            const Local3<Pack> next = solve_one_contact(w, rest, Pack::load(batch.friction + l), r);
            const Pack dn = next.n - r.n, d1 = next.t1 - r.t1, d2 = next.t2 - r.t2;
            next.n.store(batch.impulse[0] + l);
            next.t1.store(batch.impulse[1] + l);
            next.t2.store(batch.impulse[2] + l);
            dn.store(step[0] + l);
            d1.store(step[1] + l);
            d2.store(step[2] + l);
            sqrt(dn * dn + d1 * d1 + d2 * d2).store(moved + l);
        }
        for (std::uint32_t l = 0; l < kContactBatch; ++l) {
            if (moved[l] == 0) continue;
            change += moved[l];
            for (int side = 0; side < 2; ++side)
                if (batch.side[side][l] != kNoSide)
                    push_side<Pack>(view, view.sides[batch.side[side][l]], step[0][l], step[1][l],
                                    step[2][l]);
        }
    }
    return change;
}

template <class Pack>
double residual(const SweepView& view, std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t b = begin; b < end; ++b) {
        const ContactBatch& batch = view.batches[b];
        alignas(64) double u[3][kContactBatch], f[kContactBatch];
        read_velocities(view, batch, u);
        const Pack us(view.velocity_scale), rs(view.impulse_scale);
        for (std::uint32_t l = 0; l < kContactBatch; l += Pack::width)
            coulomb_residual(Local3<Pack>{rs * Pack::load(batch.impulse[0] + l),
                                          rs * Pack::load(batch.impulse[1] + l),
                                          rs * Pack::load(batch.impulse[2] + l)},
                             Local3<Pack>{us * Pack::load(u[0] + l), us * Pack::load(u[1] + l),
                                          us * Pack::load(u[2] + l)},
                             Pack::load(batch.friction + l))
                .store(f + l);
        for (std::uint32_t l = 0; l < kContactBatch; ++l)
            if (batch.side[0][l] != kNoSide) sum += f[l];
    }
    return sum;
}

template <class Pack>
void ease(const SweepView& view, std::size_t begin, std::size_t end, double leeway) {
    const Pack most(leeway), least(-leeway);
    for (std::size_t b = begin; b < end; ++b) {
        ContactBatch& batch = view.batches[b];
        alignas(64) double u[3][kContactBatch];
        read_velocities(view, batch, u);
        for (std::uint32_t l = 0; l < kContactBatch; l += Pack::width) {
            const Pack before = Pack::load(batch.eased + l);
            const Pack after = min(max(before - Pack::load(u[0] + l), least), most);
            const auto pressing = Pack::load(batch.impulse[0] + l) > Pack(0.0);
            const Pack eased = select(pressing, after, before);
            (Pack::load(batch.constant[0] + l) + (eased - before)).store(batch.constant[0] + l);
            eased.store(batch.eased + l);
        }
    }
}

template <class Pack>
double square(const SweepView& view, std::size_t begin, std::size_t end, const double* before) {
    alignas(64) double sum[kContactBatch] = {};
    for (std::size_t b = begin; b < end; ++b)
        for (std::size_t i = 0; i < kBatchImpulses; i += Pack::width) {
            double* of_lane = sum + i % kContactBatch;
            const Pack d = Pack::load(&view.batches[b].impulse[0][0] + i) -
                           Pack::load(before + b * kBatchImpulses + i);
            (Pack::load(of_lane) + d * d).store(of_lane);
        }
    double all = 0;
    for (const double s : sum) all += s;
    return all;
}

template <class Pack>
void carry(std::size_t count, double along, double* value, double* before, double* way) {
    const Pack share(along);
    for (std::size_t i = 0; i < count; i += Pack::width) {
        const Pack carried = share * Pack::load(way + i), now = Pack::load(value + i);
        (carried + (now - Pack::load(before + i))).store(way + i);
        const Pack next = now + carried;
        next.store(value + i);
        next.store(before + i);
    }
}

template <class Pack>
void carry_impulses(const SweepView& view, std::size_t begin, std::size_t end, double along,
                    double* before, double* way) {
    for (std::size_t b = begin; b < end; ++b)
        carry<Pack>(kBatchImpulses, along, &view.batches[b].impulse[0][0],
                    before + b * kBatchImpulses, way + b * kBatchImpulses);
}

template <class Pack>
constexpr SweepKernels make_kernels() {
    return {sweep<Pack>,  residual<Pack>,       ease<Pack>,
            square<Pack>, carry_impulses<Pack>, carry<Pack>};
}

}  // namespace
}  // namespace keratin
