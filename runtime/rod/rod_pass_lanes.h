// The passes of rod_pass.h as templates on the lane pack. Included by one file for each instruction
// set, inside a namespace of that file.
#pragma once

#include "runtime/rod/banded_ldlt.h"
#include "runtime/rod/rod_energy.h"
#include "runtime/rod/rod_pass.h"

#include <limits>

namespace keratin {
namespace {

template <class Real>
KERATIN_LANE_INLINE Vector3<Real> load3(const double* p) {
    constexpr std::size_t lanes = Real::width;
    return {Real::load(p), Real::load(p + lanes), Real::load(p + 2 * lanes)};
}
template <class Real>
KERATIN_LANE_INLINE void store3(double* p, const Vector3<Real>& a) {
    constexpr std::size_t lanes = Real::width;
    a.x.store(p);
    a.y.store(p + lanes);
    a.z.store(p + 2 * lanes);
}
template <class Real>
KERATIN_LANE_INLINE JointMaterial<Real> load_joint(const double* p) {
    constexpr std::size_t lanes = Real::width;
    return {Real::load(p),             Real::load(p + lanes),     Real::load(p + 2 * lanes),
            Real::load(p + 3 * lanes), Real::load(p + 4 * lanes), Real::load(p + 5 * lanes),
            Real::load(p + 6 * lanes), Real::load(p + 7 * lanes)};
}

// Four numbers of a vertex.
template <class Real>
struct Row {
    Vector3<Real> x;
    Real angle;
};

template <class Real>
struct Evaluation {
    const RodBlock& block;
    double* gradient;
    const double* d;
    Real step, energy, scale, slope;

    // The numbers of row i are complete: inertia and the like are added, the row is written.
    KERATIN_LANE_INLINE void finish(std::size_t i, const Row<Real>& v, const Row<Real>& elastic) {
        constexpr std::size_t lanes = Real::width;
        const Real value[4] = {v.x.x, v.x.y, v.x.z, v.angle};
        const Real force[4] = {elastic.x.x, elastic.x.y, elastic.x.z, elastic.angle};
#pragma GCC unroll 4
        for (std::size_t c = 0; c < 4; ++c) {
            const std::size_t at = (4 * i + c) * lanes;
            const Real off = value[c] - Real::load(block.target + at);
            const Real weight = Real::load(block.weight + at), pull = weight * off;
            const Real start = Real::load(block.v_t0 + at), change = value[c] - start;
            const Real lean = mul_add(Real(-0.5), change, off);  // (v + v_t0)/2 - target
            const Real term = weight * change * lean;
            energy = energy + term;
            scale = scale + abs(term);
            Real g = mul_add(step, force[c], pull);
            const std::uint8_t free = block.free_lanes[4 * i + c];
            if (free != static_cast<std::uint8_t>((1u << lanes) - 1))
                g = select(mask_from_bits(g, free), g, Real(0.0));
            g.store(gradient + at);
            slope = mul_add(g, Real::load(d + at), slope);
        }
    }
};

template <class Real>
void evaluate(const RodBlock& block, const double* v, const double* d, const double* alpha_in,
              const double* frames, double* v_try, double* frames_try, double* gradient,
              double* energy, double* scale, double* slope) {
    constexpr std::size_t lanes = Real::width;
    const Real step(block.step), alpha = Real::load(alpha_in), zero(0.0);
    const Real edge_count = Real::load(block.edge_count);
    const Vector3<Real> tip_tangent = load3<Real>(block.ends + 6 * lanes);
    const Vector3<Real> tip_director = load3<Real>(block.ends + 9 * lanes);

    const auto moved = [&](std::size_t i, Row<Real>& velocity) {
        Row<Real> x;
        Real u[4];
#pragma GCC unroll 4
        for (std::size_t c = 0; c < 4; ++c) {
            const std::size_t at = (4 * i + c) * lanes;
            u[c] = mul_add(alpha, Real::load(d + at), Real::load(v + at));
            u[c].store(v_try + at);
        }
        velocity = {{u[0], u[1], u[2]}, u[3]};
        const double* t0 = block.x_t0 + 4 * i * lanes;
        x.x = mul_add(step, velocity.x, load3<Real>(t0));
        x.angle = mul_add(step, velocity.angle, Real::load(t0 + 3 * lanes));
        return x;
    };

    Evaluation<Real> out{block, gradient, d, step, zero, zero, zero};
    const Vector3<Real> none{zero, zero, zero};
    Row<Real> v_here, v_before{none, zero};
    Row<Real> here = moved(0, v_here);
    Real angle_before(0.0);
    Vector3<Real> t = load3<Real>(block.ends), a_before = load3<Real>(block.ends + 3 * lanes);
    Real inverse_before(1.0);
    Directors<Real> before{a_before, cross(t, a_before)};
    Row<Real> force_before{none, zero}, force_here{none, zero};

    const std::size_t count = block.vertex_count;
    for (std::size_t i = 0; i < count; ++i) {
        Row<Real> next = here, v_next = v_here;
        Vector3<Real> edge = tip_tangent;
        if (i + 1 < count) {
            next = moved(i + 1, v_next);
            edge = next.x - here.x;
        }
        const double* frame = frames + i * kRodFrame * lanes;
        double* frame_try = frames_try + i * kRodFrame * lanes;
        const bool all_real = i < block.min_edge_count;
        const auto real = Real(static_cast<double>(i)) < edge_count;
        const EdgeGeometry<Real> e =
            edge_geometry(all_real ? edge : select(real, edge, tip_tangent));
        // Of the turn since the start of the step and of that at the joint: one division for both.
        const Vector3<Real> tangent_t0 = load3<Real>(frame);
        const Real cosine = dot(tangent_t0, e.tangent), cosine_joint = dot(t, e.tangent);
        const Real one_plus = max(Real(1.0) + cosine, Real(kFoldLimit));
        const Real chi = fold_floored(cosine_joint);
        const Real inverse_both = Real(1.0) / (one_plus * chi);
        const Real inverse_chi = inverse_both * one_plus;
        Vector3<Real> a = near_unit(carry_director(
            tangent_t0, e.tangent, load3<Real>(frame + 3 * lanes), cosine, inverse_both * chi));
        if (!all_real) a = select(real, a, tip_director);
        const Directors<Real> after = material_directors(e.tangent, a, here.angle);
        const Joint<Real> joint =
            make_joint(t, inverse_before, before, e.tangent, e.inverse_length, after, inverse_chi);
        const Vector3<Real> carried =
            near_unit(carry_director(t, e.tangent, a_before, cosine_joint, inverse_chi));
        const Real reference = turn_near(carried, a, e.tangent, Real::load(frame + 6 * lanes));
        const Real twist = here.angle - angle_before + reference;
        store3(frame_try, e.tangent);
        store3(frame_try + 3 * lanes, a);
        reference.store(frame_try + 6 * lanes);

        const JointMaterial<Real> material =
            load_joint<Real>(block.joints + i * kRodJoint * lanes);
        const Real k = Real::load(block.edges + i * kRodEdge * lanes);
        const Real rest = Real::load(block.edges + (i * kRodEdge + 1) * lanes);
        const Real stored = bend_energy(material, joint) + twist_energy(material, twist) +
                            stretch_energy(k, rest, e.length);
        out.energy = out.energy + stored;
        out.scale = out.scale + stored;
        const JointGradient<Real> g = joint_gradient(material, joint, twist);
        const Vector3<Real> tension = stretch_gradient(k, rest, e);
        if (i > 0) {
            force_before.x = force_before.x - g.e;
            force_before.angle = force_before.angle + g.before;
            out.finish(i - 1, v_before, force_before);
        }
        force_before = {force_here.x + g.e - g.f - tension, g.after};
        force_here = {g.f + tension, zero};

        v_before = v_here;
        v_here = v_next;
        angle_before = here.angle;
        here = next;
        t = e.tangent;
        inverse_before = e.inverse_length;
        before = after;
        a_before = a;
    }
    out.finish(count - 1, v_before, force_before);
    out.energy.store(energy);
    out.scale.store(scale);
    out.slope.store(slope);
}

template <class Real>
void measure(const RodBlock& block, const double* frames, double* strains) {
    constexpr std::size_t lanes = Real::width;
    const Real edge_count = Real::load(block.edge_count);
    const Vector3<Real> tip_tangent = load3<Real>(block.ends + 6 * lanes);
    Vector3<Real> t = load3<Real>(block.ends), here = load3<Real>(block.x_t0);
    const Vector3<Real> root_director = load3<Real>(block.ends + 3 * lanes);
    Directors<Real> before{root_director, cross(t, root_director)};
    Real angle_before(0.0);
    const std::size_t count = block.vertex_count;
    for (std::size_t i = 0; i < count; ++i) {
        const double* x = block.x_t0 + 4 * i * lanes;
        Vector3<Real> edge = tip_tangent, next = here;
        if (i + 1 < count) {
            next = load3<Real>(x + 4 * lanes);
            edge = select(Real(static_cast<double>(i)) < edge_count, next - here, tip_tangent);
        }
        const EdgeGeometry<Real> e = edge_geometry(edge);
        const double* frame = frames + i * kRodFrame * lanes;
        const Real angle = Real::load(x + 3 * lanes);
        const Directors<Real> after =
            material_directors(e.tangent, load3<Real>(frame + 3 * lanes), angle);
        const Joint<Real> j =
            make_joint(t, Real(1.0), before, e.tangent, e.inverse_length, after);
        const Real out[kRodStrain] = {e.length,     j.w1_before, j.w2_before, j.w1_after,
                                      j.w2_after, angle - angle_before + Real::load(frame + 6 * lanes)};
        for (std::size_t c = 0; c < kRodStrain; ++c)
            out[c].store(strains + (i * kRodStrain + c) * lanes);
        here = next;
        t = e.tangent;
        before = after;
        angle_before = angle;
    }
}

// What a joint gives the rows of the vertex after it: columns of the vertices two and one before
// that, and its own.
template <class Real>
struct RowsAhead {
    Real two[3][4], one[3][4], own[3][3];
};

// Place in the band row of a vertex's number q of the column of number p of the vertex `before`
// places back.
constexpr std::size_t band_place(std::size_t q, std::size_t p, std::size_t before) {
    return kRodHalfBand + p - q - 4 * before;
}

// The 3 x 3 blocks and vectors of a joint's Hessian as a full lower triangle [11][11] of its local
// numbers, times scale. x_{i-1} carries -e, x_i e - f, x_{i+1} f.
template <class Real>
KERATIN_LANE_INLINE void local_matrix(const JointHessian<Real>& h, const Real& scale,
                                      Real (&m)[11][11]) {
    const Real ee[3][3] = {{h.ee.xx, h.ee.xy, h.ee.xz}, {h.ee.xy, h.ee.yy, h.ee.yz}, {h.ee.xz, h.ee.yz, h.ee.zz}};
    const Real ff[3][3] = {{h.ff.xx, h.ff.xy, h.ff.xz}, {h.ff.xy, h.ff.yy, h.ff.yz}, {h.ff.xz, h.ff.yz, h.ff.zz}};
    const Real ef[3][3] = {{h.ef.xx, h.ef.xy, h.ef.xz}, {h.ef.yx, h.ef.yy, h.ef.yz}, {h.ef.zx, h.ef.zy, h.ef.zz}};
    const Real eb[3] = {h.e_before.x, h.e_before.y, h.e_before.z};
    const Real fb[3] = {h.f_before.x, h.f_before.y, h.f_before.z};
    const Real ea[3] = {h.e_after.x, h.e_after.y, h.e_after.z};
    const Real fa[3] = {h.f_after.x, h.f_after.y, h.f_after.z};
#pragma GCC unroll 3
    for (std::size_t r = 0; r < 3; ++r) {
#pragma GCC unroll 3
        for (std::size_t c = 0; c < 3; ++c) {
            m[r][c] = scale * ee[r][c];
            m[4 + r][c] = scale * (ef[c][r] - ee[r][c]);
            m[4 + r][4 + c] = scale * (ee[r][c] + ff[r][c] - ef[r][c] - ef[c][r]);
            m[8 + r][c] = -(scale * ef[c][r]);
            m[8 + r][4 + c] = scale * (ef[c][r] - ff[r][c]);
            m[8 + r][8 + c] = scale * ff[r][c];
        }
        m[3][r] = -(scale * eb[r]);
        m[7][r] = -(scale * ea[r]);
        m[4 + r][3] = scale * (eb[r] - fb[r]);
        m[7][4 + r] = scale * (ea[r] - fa[r]);
        m[8 + r][3] = scale * fb[r];
        m[8 + r][7] = scale * fa[r];
    }
    m[3][3] = scale * h.before_before;
    m[7][3] = scale * h.before_after;
    m[7][7] = scale * h.after_after;
}

template <class Real>
void assemble(const RodBlock& block, const double* v, const double* frames, const double* exact_in,
              double* band) {
    constexpr std::size_t lanes = Real::width;
    const Real step(block.step), square = step * step, zero(0.0), exact = Real::load(exact_in);
    const Real edge_count = Real::load(block.edge_count);
    const Vector3<Real> tip_tangent = load3<Real>(block.ends + 6 * lanes);
    const std::size_t count = block.vertex_count, rows = 4 * count;
    const auto at = [&](std::size_t i) {
        return mul_add(step, load3<Real>(v + 4 * i * lanes), load3<Real>(block.x_t0 + 4 * i * lanes));
    };
    const auto angle_at = [&](std::size_t i) {
        const std::size_t k = (4 * i + 3) * lanes;
        return mul_add(step, Real::load(v + k), Real::load(block.x_t0 + k));
    };
    Vector3<Real> here = at(0), t = load3<Real>(block.ends);
    Vector3<Real> director = load3<Real>(block.ends + 3 * lanes);
    Directors<Real> before{director, cross(t, director)};
    Real inverse_before(1.0), angle_before(0.0);
    // Rows are written once: three joints give to those of a vertex.
    RowsAhead<Real> ahead{};
    Real own[4][4] = {};  // of the vertex before, among its own numbers
    const auto store_own = [&](std::size_t i) {
#pragma GCC unroll 4
        for (std::size_t q = 0; q < 4; ++q)
#pragma GCC unroll 4
            for (std::size_t p = 0; p <= q; ++p)
                own[q][p].store(band + ((4 * i + q) * kRodBandWidth + band_place(q, p, 0)) * lanes);
    };
    for (std::size_t i = 0; i < count; ++i) {
        const Vector3<Real> next = i + 1 < count ? at(i + 1) : here + tip_tangent;
        Vector3<Real> edge = i + 1 < count ? next - here : tip_tangent;
        if (i >= block.min_edge_count)
            edge = select(Real(static_cast<double>(i)) < edge_count, edge, tip_tangent);
        const EdgeGeometry<Real> e = edge_geometry(edge);
        const double* frame = frames + i * kRodFrame * lanes;
        const Real angle = angle_at(i);
        const Directors<Real> after =
            material_directors(e.tangent, load3<Real>(frame + 3 * lanes), angle);
        const Joint<Real> joint =
            make_joint(t, inverse_before, before, e.tangent, e.inverse_length, after);
        const Real twist = angle - angle_before + Real::load(frame + 6 * lanes);
        const JointHessian<Real> h = joint_hessian(
            load_joint<Real>(block.joints + i * kRodJoint * lanes), joint, twist, exact);
        Real m[11][11];
        local_matrix(h, square, m);
        // the edge after the joint stretches
        const Real k = square * Real::load(block.edges + i * kRodEdge * lanes);
        const Real rest = Real::load(block.edges + (i * kRodEdge + 1) * lanes);
        const StretchHessian<Real> s = stretch_hessian(k, rest, e, exact);
        const Real tangent[3] = {e.tangent.x, e.tangent.y, e.tangent.z};
#pragma GCC unroll 3
        for (std::size_t r = 0; r < 3; ++r) {
#pragma GCC unroll 3
            for (std::size_t c = 0; c < 3; ++c) {
                Real x = s.along * tangent[r] * tangent[c];
                if (r == c) x = x + s.across;
                m[4 + r][4 + c] = m[4 + r][4 + c] + x;
                m[8 + r][8 + c] = m[8 + r][8 + c] + x;
                m[8 + r][4 + c] = m[8 + r][4 + c] - x;
            }
        }
        if (i > 0) {
#pragma GCC unroll 4
            for (std::size_t q = 0; q < 4; ++q)
#pragma GCC unroll 4
                for (std::size_t p = 0; p <= q; ++p) own[q][p] = own[q][p] + m[q][p];
            store_own(i - 1);
        } else {  // no vertex there
#pragma GCC unroll 7
            for (std::size_t r = 4; r < 11; ++r)
#pragma GCC unroll 4
                for (std::size_t c = 0; c < 4; ++c) m[r][c] = zero;
        }
#pragma GCC unroll 4
        for (std::size_t q = 0; q < 4; ++q) {
            const std::size_t number = 4 * i + q;
            double* row = band + number * kRodBandWidth * lanes;
#pragma GCC unroll 2
            for (std::size_t none = 0; none + q < 2; ++none) zero.store(row + none * lanes);
#pragma GCC unroll 4
            for (std::size_t p = q == 3; p < 4; ++p)
                (q < 3 ? ahead.two[q][p] : zero).store(row + band_place(q, p, 2) * lanes);
#pragma GCC unroll 4
            for (std::size_t p = 0; p < 4; ++p)
                (q < 3 ? ahead.one[q][p] + m[4 + q][p] : m[4 + q][p])
                    .store(row + band_place(q, p, 1) * lanes);
#pragma GCC unroll 4
            for (std::size_t p = 0; p <= q; ++p) {
                const Real weight = p == q ? Real::load(block.weight + number * lanes) : zero;
                own[q][p] = (q < 3 ? weight + ahead.own[q][p] : weight) + m[4 + q][4 + p];
            }
        }
#pragma GCC unroll 3
        for (std::size_t q = 0; q < 3; ++q)
#pragma GCC unroll 4
            for (std::size_t p = 0; p < 4; ++p) {
                ahead.two[q][p] = m[8 + q][p];
                ahead.one[q][p] = m[8 + q][4 + p];
                if (p <= q) ahead.own[q][p] = m[8 + q][8 + p];
            }
        here = next;
        t = e.tangent;
        before = after;
        inverse_before = e.inverse_length;
        angle_before = angle;
    }
    store_own(count - 1);
    // prescribed numbers: a row and column of zeros with 1 on the diagonal
    for (std::size_t r = 0; r < rows; ++r) {
        const std::uint8_t free = block.free_lanes[r];
        if (free == static_cast<std::uint8_t>((1u << lanes) - 1)) continue;
        const auto mask = mask_from_bits(zero, free);
        double* row = band + r * kRodBandWidth * lanes;
        for (std::size_t k = 1; k <= kRodHalfBand; ++k) {
            double* left = row + (kRodHalfBand - k) * lanes;
            select(mask, Real::load(left), zero).store(left);
            if (r + k >= rows) continue;
            double* below = row + (k * kRodBandWidth + kRodHalfBand - k) * lanes;
            select(mask, Real::load(below), zero).store(below);
        }
        double* diagonal = row + kRodHalfBand * lanes;
        select(mask, Real::load(diagonal), Real(1.0)).store(diagonal);
    }
}

template <class Real>
std::uint32_t factor(std::size_t rows, double* band) {
    return factor_band<Real>(rows, band);
}

template <class Real>
void solve(const RodBlock& block, const double* band, const double* gradient, double* d,
           double* norm_square, double* slope) {
    constexpr std::size_t lanes = Real::width;
    const std::size_t rows = 4 * static_cast<std::size_t>(block.vertex_count);
    solve_lower<Real>(rows, band, d, [&](std::size_t r) { return -Real::load(gradient + r * lanes); });
    const Real spin = Real::load(block.spin_weight), spin_square = spin * spin;
    Real squares(0.0), spins(0.0), down(0.0);
    solve_upper<Real>(rows, band, d, [&](std::size_t r, const Real& x) {
        down = mul_add(Real::load(gradient + r * lanes), x, down);
        if (r % 4 == 3)
            spins = mul_add(x, x, spins);
        else
            squares = mul_add(x, x, squares);
    });
    mul_add(spin_square, spins, squares).store(norm_square);
    down.store(slope);
}

template <class Real>
void apply_inverse(std::size_t first, std::size_t rows, const double* band, double* x) {
    solve_three<Real>(first, rows, band, x);
}

template <class Real>
void prepare(const RodBlock& block, const RodPull& pull, double* weight, double* target,
             double* reach) {
    constexpr std::size_t lanes = Real::width;
    const Real h(block.step);
    Real farthest(0.0);
    for (std::size_t i = 0; i < block.vertex_count; ++i)
#pragma GCC unroll 4
        for (std::size_t c = 0; c < 4; ++c) {
            const std::size_t at = (4 * i + c) * lanes;
            const Real x = Real::load(block.x_t0 + at), m = Real::load(pull.mass + at);
            const Real drag = h * Real::load(pull.drag + at);
            const Real spring = h * Real::load(pull.spring + at);
            if (c < 3) farthest = max(farthest, abs(x));
            const Real fall(c < 3 ? block.step * pull.gravity[c] : 0);
            const Real air(c < 3 ? pull.air[c] : 0);
            const Real sum = m + drag + h * spring;
            sum.store(weight + at);
            const Real kick = m * (Real::load(block.v_t0 + at) + fall) + drag * air +
                              h * Real::load(pull.force + at) +
                              spring * (Real::load(pull.spring_target + at) - x);
            (kick / sum).store(target + at);
        }
    farthest.store(reach);
}

template <class Real>
void look_ahead(const RodBlock& block, std::uint32_t moving, const double* v, const double* d,
                double* ahead) {
    constexpr std::size_t lanes = Real::width;
    const Real zero(0.0);
    const auto mask = mask_from_bits(zero, moving);
    for (std::size_t at = 0; at < 4 * block.vertex_count * lanes; at += lanes)
        (Real::load(v + at) + select(mask, Real::load(d + at), zero)).store(ahead + at);
}

template <class Real>
std::uint32_t push(const RodBlock& block, const double* change, const double* v, double* target,
                   double* gradient, double* energy, double* scale) {
    constexpr std::size_t lanes = Real::width;
    const Real zero(0.0);
    Real sum = Real::load(energy), size = Real::load(scale);
    std::uint32_t pushed = 0;
    for (std::size_t r = 0; r < 4 * static_cast<std::size_t>(block.vertex_count); ++r) {
        const std::size_t at = r * lanes;
        const Real whole = Real::load(change + at);
        // Anything but 0: what is not a number shall be seen, too.
        const auto none = abs(whole) < Real(std::numeric_limits<double>::denorm_min());
        const auto mask = mask_from_bits(zero, block.free_lanes[r]) & !none;
        if (bits(mask) == 0) continue;
        pushed |= bits(mask);
        const Real kick = select(mask, whole, zero);
        const Real weight = select(mask, Real::load(block.weight + at), Real(1.0));
        (Real::load(target + at) + kick / weight).store(target + at);
        (Real::load(gradient + at) - kick).store(gradient + at);
        const Real term =
            select(mask, kick * (Real::load(v + at) - Real::load(block.v_t0 + at)), zero);
        sum = sum - term;
        size = size + abs(term);
    }
    sum.store(energy);
    size.store(scale);
    return pushed;
}

template <class Real>
std::uint32_t move(const RodBlock& block, std::uint32_t moving, double h, bool midpoint,
                   const double* v, double* x, double* v_t0) {
    constexpr std::size_t lanes = Real::width;
    const std::size_t numbers = 4 * block.vertex_count * lanes;
    const Real zero(0.0), step(h);
    Real size = zero;
    for (std::size_t at = 0; at < numbers; at += lanes)
        size = size + abs(Real::load(v + at)) + abs(Real::load(x + at));
    const std::uint32_t finite = bits(size < Real(HUGE_VAL));
    const std::uint32_t lost = moving & ~finite;
    const auto mask = mask_from_bits(zero, moving & finite), stopped = mask_from_bits(zero, lost);
    for (std::size_t at = 0; at < numbers; at += lanes) {
        const Real now = Real::load(v + at), before = Real::load(v_t0 + at),
                   place = Real::load(x + at);
        Real after = now;
        if (midpoint)
            after = select(mask_from_bits(zero, block.free_lanes[at / lanes]),
                           Real(2.0) * now - before, now);
        select(mask, place + step * now, place).store(x + at);
        select(mask, after, select(stopped, zero, before)).store(v_t0 + at);
    }
    return lost;
}

template <class Real>
void keep(std::size_t count, std::uint32_t lanes_kept, const double* from, double* to) {
    constexpr std::size_t lanes = Real::width;
    const auto mask = mask_from_bits(Real(0.0), lanes_kept);
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t at = k * lanes;
        select(mask, Real::load(from + at), Real::load(to + at)).store(to + at);
    }
}

template <class Real>
constexpr RodPasses make_passes() {
    return {static_cast<std::uint32_t>(Real::width),
            &prepare<Real>,
            &evaluate<Real>,
            &measure<Real>,
            &assemble<Real>,
            &factor<Real>,
            &solve<Real>,
            &apply_inverse<Real>,
            &look_ahead<Real>,
            &push<Real>,
            &move<Real>,
            &keep<Real>};
}

}  // namespace
}  // namespace keratin
