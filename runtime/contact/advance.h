// Continuous collision detection by conservative advancement (METHODS 2.8): the time moves on by
// what the distance leaves room for, so that no pair can pass through each other unseen and neither
// parallel nor coplanar motion is a special case.
#pragma once

#include "runtime/shape/closest.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace keratin {

struct FirstContact {
    bool found = false;
    double time = 0;            // 0..1 within the step; the distance then is delta to 1e-3
    double start_distance = 0;  // m, at time 0
};

// distance_at(t): m, the distance at time t in 0..1, changing by no more than `rate` (m) per unit
// of t. apart_for(), asked after distance_at(t): for how long it certainly stays above delta (0
// where nothing more is known). Contact is distance <= delta (1 + 1e-3); a pair that begins that
// close is in contact at time 0. Grazing motion that has not decided after kMostAdvances steps
// counts as contact: a contact too many has no effect as long as it does not close.
template <class Distance, class Apart>
FirstContact first_contact(Distance&& distance_at, Apart&& apart_for, double rate, double delta) {
    constexpr int kMostAdvances = 200;
    constexpr double kSlack = 1e-3;
    FirstContact out;
    double t = 0;
    for (int i = 0; i < kMostAdvances; ++i) {
        const double d = distance_at(t);
        if (i == 0) out.start_distance = d;
        const double room = d - delta;
        if (room <= kSlack * delta) {
            out.found = true;
            out.time = t;
            return out;
        }
        if (room > rate * (1 - t)) return out;
        const double apart = apart_for();
        if (apart > 1 - t) return out;
        t = std::min(1.0, t + std::max(apart, room / rate));
    }
    out.found = true;
    out.time = t;
    return out;
}
template <class Distance>
FirstContact first_contact(Distance&& distance_at, double rate, double delta) {
    return first_contact(
        distance_at, [] { return 0.0; }, rate, delta);
}

// A point or segment on its way: positions at the start and displacements over the step.
struct MovingSegment {
    Vector3 a, b, move_a, move_b;
};

// Takes the mean motion out of both and returns the bound max|move| + max|move| of what is left.
inline double take_out_mean_motion(MovingSegment& p, MovingSegment& q) {
    const Vector3 mean = (p.move_a + p.move_b + q.move_a + q.move_b) * 0.25;
    p.move_a -= mean, p.move_b -= mean, q.move_a -= mean, q.move_b -= mean;
    return std::sqrt(std::max(squared_length(p.move_a), squared_length(p.move_b))) +
           std::sqrt(std::max(squared_length(q.move_a), squared_length(q.move_b)));
}

// The positions at time t.
inline MovingSegment at_time(const MovingSegment& p, double t) {
    return {p.a + p.move_a * t, p.b + p.move_b * t, p.move_a, p.move_b};
}

// Of two segments. Along any unit n they are never nearer than the least n.(x - y) of an end x of p
// and an end y of q, which changes evenly; n is the way between their closest points, where that
// least is the distance itself.
inline FirstContact first_segment_contact(MovingSegment p, MovingSegment q, double delta) {
    const double rate = take_out_mean_motion(p, q);
    MovingSegment pt, qt;
    SegmentPair<double> pair;
    const auto distance_at = [&](double t) {
        pt = at_time(p, t);
        qt = at_time(q, t);
        pair = closest_segments(pt.a, pt.b, qt.a, qt.b);
        return std::sqrt(pair.squared_distance);
    };
    const auto apart_for = [&] {
        const Vector3 n = (mix(pt.a, pt.b, pair.s) - mix(qt.a, qt.b, pair.t)) *
                          (1 / std::sqrt(pair.squared_distance));
        double apart = std::numeric_limits<double>::infinity();
        for (const bool p_end : {false, true})
            for (const bool q_end : {false, true}) {
                const double gap = dot(n, (p_end ? pt.b : pt.a) - (q_end ? qt.b : qt.a)),
                             closing = dot(
                                 n, (q_end ? q.move_b : q.move_a) - (p_end ? p.move_b : p.move_a));
                if (closing > 0) apart = std::min(apart, (gap - delta) / closing);
            }
        return apart;
    };
    return first_contact(distance_at, apart_for, rate, delta);
}

}  // namespace keratin
