#include "tools/keratin-bench/naive_strand.h"

#include "runtime/formula/bend.h"
#include "runtime/formula/contact.h"
#include "runtime/formula/length.h"
#include "runtime/formula/verlet.h"
#include "runtime/shape/distance.h"

#include <cmath>

namespace keratin::bench {

namespace {

float distance(const BodyCapsule& c, const Vec3<float>& p, Vec3<float>& normal) {
    const Vec3<float> a(c.a[0], c.a[1], c.a[2]), ab = Vec3<float>(c.b[0], c.b[1], c.b[2]) - a;
    return capsule_distance(p, a, ab, 1 / dot(ab, ab), c.radius, normal);
}

}  // namespace

NaiveStrands::NaiveStrands(const scenes::Groom& g, std::uint32_t iterations)
    : iterations_(iterations) {
    const Material& m = g.info.groups[0].material;
    bending_ = m.youngs_modulus * (m.radius * m.radius + m.radius2 * m.radius2) / (8 * m.density);
    pull_ = 1 - std::pow(1 - g.info.groups[0].strand.global_length, 1.0f / float(iterations));
    keep_ = std::pow(1 - g.info.groups[0].strand.damping[0], 1.0f / float(iterations));
    std::size_t longest = 0;
    for (std::size_t lane = 0; lane < g.guide_point_count.size(); ++lane) {
        const std::size_t n = g.guide_point_count[lane];
        if (n == 0) continue;
        first_.push_back(x_.size());
        longest = std::max(longest, n);
        V before(0, 0, 0);
        for (std::size_t p = 0; p < n; ++p) {
            const std::size_t row = g.tile_first_row[lane / 16] + p;
            const auto at = [&](std::size_t c) {
                return g.guide_position[vector_index(row, 3, c, lane % 16)];
            };
            const V x(at(0), at(1), at(2));
            x_.push_back(x);
            edge_.push_back(p > 0 ? x - before : V(0, 0, 0));
            length_.push_back(g.guide_length[scalar_index(row, lane % 16)]);
            before = x;
        }
    }
    first_.push_back(x_.size());
    previous_ = x_;
    direction_.resize(longest), load_.resize(longest);
    for (auto* v : {&stiffness_, &pivot_, &band1_, &band2_, &value_, &share_}) v->resize(longest);
}

// Moves the points 2 .. n by what the bending system answers to the forces in load_.
void NaiveStrands::solve_bending(V* x, std::size_t n) {
    for (std::size_t i = 2; i <= n; ++i) {
        if (i >= 3) load_[i] -= load_[i - 1] * band1_[i];
        if (i >= 4) load_[i] -= load_[i - 2] * band2_[i];
    }
    for (std::size_t i = n; i >= 2; --i) {
        V d = load_[i] * pivot_[i];
        if (i + 1 <= n) d -= load_[i + 1] * band1_[i + 1];
        if (i + 2 <= n) d -= load_[i + 2] * band2_[i + 2];
        load_[i] = d;
        x[i] += d;
    }
}

void NaiveStrands::small_step(float h, std::size_t first, std::size_t count) {
    V* x = &x_[first];
    V* previous = &previous_[first];
    const V* edge = &edge_[first];
    const float* l = &length_[first];
    const std::size_t n = count - 1;
    const auto mass = [&](std::size_t i) { return 0.5f * (l[i] + (i < n ? l[i + 1] : 0)); };

    V move(0, 0, 0);
    for (std::size_t i = 2; i <= n; ++i) {
        const V now = x[i];
        move = resolved_move((now - previous[i]) * keep_, move, longest_turn(l[i]));
        x[i] = now + move;
        previous[i] = now;
    }

    const V fall(0, -9.81f * h * h, 0), none(0, 0, 0);
    V r = normalize_or(edge[1], V(0, 1, 0)), t = r;
    float inverse_length = 1 / l[1];
    for (std::size_t i = 0; i <= n; ++i) load_[i] = none;
    for (std::size_t i = 1; i < n; ++i) {
        const V e = x[i + 1] - x[i];
        const float inverse = 1 / std::sqrt(dot(e, e));
        const V next = e * inverse;
        const float along = dot(r, edge[i + 1]), turn = bend_inverse(r, t);
        const V g = bend_target(r, t, edge[i + 1], along, turn);
        const V f = (next * l[i + 1] - g) * stiffness_[i];
        const V reaction =
            bend_reaction(r, t, g, next, along, turn, stiffness_[i] * l[i + 1] * inverse_length);
        load_[i + 1] -= f;
        load_[i] += f + reaction;
        load_[i - 1] -= reaction;
        r = edge[i + 1] * (1 / l[i + 1]);
        t = next;
        inverse_length = inverse;
    }
    for (std::size_t i = 2; i <= n; ++i) load_[i] += fall * mass(i);
    solve_bending(x, n);

    for (std::size_t i = 2; i <= n; ++i) direction_[i] = x[i] - x[i - 1];
    float carried_value = 0, carried_share = 0;
    for (std::size_t i = n; i >= 2; --i) {
        const float size = length(direction_[i]);
        direction_[i] = direction_[i] * (1 / size);
        const float w = inverse_point_mass(l[i], i < n ? l[i + 1] : 0.0f);
        const float parent = i > 2 ? inverse_point_mass(l[i - 1], l[i]) : 0.0f;
        const float inverse = 1 / (parent + w - carried_share);
        value_[i] = (size - l[i] + carried_value) * inverse;
        share_[i] = 0;
        if (i > 2) {
            const V above = normalize_or(direction_[i - 1], none);
            const float coupling = parent * dot(above, direction_[i]);
            share_[i] = coupling * inverse;
            carried_value = coupling * value_[i];
            carried_share = coupling * share_[i];
        }
    }
    float lambda = value_[2];
    for (std::size_t i = 2; i <= n; ++i) {
        load_[i] = none - direction_[i] * lambda;
        if (i < n) {
            lambda = value_[i + 1] + share_[i + 1] * lambda;
            load_[i] += direction_[i + 1] * lambda;
        }
    }
    solve_bending(x, n);

    V along = normalize_or(x[1] - x[0], V(0, 1, 0)), pulled = x[1];
    for (std::size_t i = 2; i <= n; ++i) {
        V before = x[i];
        pulled = before + pull_to_parent(before - pulled, l[i]) * pull_;
        const V parent = x[i - 1];
        along = normalize_or(pulled - parent, along);
        V now = parent + along * l[i];
        const V free = now;
        int hits = 0;
        const BodyCapsule* hit = nullptr;
        bool deep = false;
        for (const BodyCapsule& c : kBody) {
            V normal;
            const float depth = -distance(c, now, normal);
            if (depth <= 0) continue;
            const bool in_plane = plane_room(along, l[i], normal, depth) > 0;
            now += way_out(along, l[i], normal, depth);
            const V held = friction_move(previous[i] - now, normal, depth, kBodyFriction);
            if (in_plane)
                now = parent + turned_along((now - parent) * (1 / l[i]), l[i], normal, held) * l[i];
            else
                now += held;
            deep = deep || !in_plane || hits > 0;
            hit = &c;
            ++hits;
        }
        if (hits > 0) {
            const V shift = now - free;
            before += shift;
            along = normalize_or(now - parent, along);
            now = parent + along * l[i];
            for (const BodyCapsule& c : kBody) {
                V ignored;
                deep = deep || (&c != hit && distance(c, now, ignored) < 0);
            }
            for (int round = 0; deep && round < 16; ++round) {
                deep = false;
                V out = now;
                for (const BodyCapsule& c : kBody) {
                    V normal;
                    const float depth = -distance(c, out, normal);
                    if (depth <= 2e-6f) continue;
                    out += way_out(along, l[i], normal, depth);
                    deep = true;
                }
                if (!deep) break;
                along = normalize_or(out - parent, along);
                now = parent + along * l[i];
            }
        }
        x[i] = now;
        if (i > 2) previous[i - 1] += (now - before) * 0.9f;
    }
}

void NaiveStrands::step(double h) {
    const float small = float(h) / float(iterations_);
    const float scale = small * small * bending_;
    for (std::size_t s = 0; s + 1 < first_.size(); ++s) {
        const std::size_t count = first_[s + 1] - first_[s], n = count - 1;
        const float* l = &length_[first_[s]];
        const V* edge = &edge_[first_[s]];
        for (std::size_t i = 1; i < n; ++i)
            stiffness_[i] = bend_stiffness(scale, i == 1 ? 0.0f : 0.5f * l[i], l[i + 1]);
        stiffness_[n] = 0;
        float inverse1 = 0, inverse2 = 0, band = 0;
        for (std::size_t i = 2; i <= n; ++i) {
            const auto lever = [&](std::size_t k) {
                return k < n ? bend_lever(edge[k], edge[k + 1]) : 0.0f;
            };
            const auto k = [&](std::size_t j) { return j < n ? stiffness_[j] : 0.0f; };
            const float far = 1 + lever(i);
            const float m = 0.5f * (l[i] + (i < n ? l[i + 1] : 0));
            const float a =
                m + k(i - 1) + k(i) * far * far + k(i + 1) * lever(i + 1) * lever(i + 1);
            const float off1 = i >= 3 ? -k(i - 1) * (1 + lever(i - 1)) - k(i) * lever(i) * far : 0;
            const float off2 = i >= 4 ? k(i - 1) * lever(i - 1) : 0;
            const float coupled = off1 - off2 * band;
            band1_[i] = coupled * inverse1;
            band2_[i] = off2 * inverse2;
            pivot_[i] = 1 / std::max(a - band1_[i] * coupled - band2_[i] * off2, m);
            inverse2 = inverse1;
            inverse1 = pivot_[i];
            band = band1_[i];
        }
        for (std::uint32_t i = 0; i < iterations_; ++i) small_step(small, first_[s], count);
    }
}

}  // namespace keratin::bench
