#include "runtime/contact/contact_list.h"

#include "runtime/contact/meeting.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

// From parameter low to high of the segment.
MovingSegment part_of(const MovingSegment& m, double low, double high) {
    return {mix(m.a, m.b, low), mix(m.a, m.b, high), mix(m.move_a, m.move_b, low),
            mix(m.move_a, m.move_b, high)};
}

bool is_round(const MovingShape& collider) {
    return collider.shape.kind == ShapeKind::sphere || collider.shape.kind == ShapeKind::capsule;
}

// Whether one of the contacts, ascending by key, is the same place of the edge.
bool is_listed_near(const Contact& c, std::span<const Contact> contacts) {
    auto k = std::lower_bound(contacts.begin(), contacts.end(), c.key.pair,
                              [](const Contact& l, std::uint64_t r) { return l.key.pair < r; });
    for (; k != contacts.end() && k->key.pair == c.key.pair; ++k)
        if (k->by_place && std::fabs(k->parameter[0] - c.parameter[0]) < kPartOnSolid) return true;
    return false;
}

}  // namespace

std::size_t merge_contacts(std::span<const FoundContact> found, std::vector<Contact>& contacts) {
    const std::size_t before = contacts.size();
    for (Contact& c : contacts) c.fresh = false;
    std::size_t i = 0;
    for (const FoundContact& f : found) {
        while (i < before && contacts[i].key < f.contact.key) ++i;
        if (i < before && contacts[i].key == f.contact.key) continue;
        if (f.contact.by_place && is_listed_near(f.contact, std::span(contacts).first(before)))
            continue;
        contacts.push_back(f.contact);
        contacts.back().fresh = true;
    }
    const auto middle = contacts.begin() + static_cast<std::ptrdiff_t>(before);
    std::inplace_merge(contacts.begin(), middle, contacts.end(),
                       [](const Contact& l, const Contact& r) { return l.key < r.key; });
    return contacts.size() - before;
}

United unite_contacts(const ContactStrands& strands, std::vector<Contact>& contacts) {
    constexpr double kOnePlace = 0.1;   // of delta
    constexpr double kOneNormal = 0.9;  // cosine
    auto point = [&](const Contact& c, int side) { return place_of(strands, c, side); };
    auto at_one_place = [&](const Contact& a, const Contact& b) {
        if (a.against_collider != b.against_collider || dot(a.normal, b.normal) < kOneNormal ||
            strands.strand[a.edge[0]] != strands.strand[b.edge[0]])
            return false;
        const double reach = kOnePlace * kOnePlace * a.distance * a.distance;
        if (squared_length(point(a, 0) - point(b, 0)) > reach) return false;
        return a.against_collider || (strands.strand[a.edge[1]] == strands.strand[b.edge[1]] &&
                                      squared_length(point(a, 1) - point(b, 1)) <= reach);
    };
    constexpr double kGone = -1;  // as parameter
    United went;
    auto unite = [&](Contact& a, Contact& b) {
        // The one that was there before stays, or that which carries more, or the first.
        const bool first =
            a.fresh != b.fresh ? b.fresh : squared_length(a.impulse) >= squared_length(b.impulse);
        Contact &kept = first ? a : b, &gone = first ? b : a;
        kept.impulse += gone.impulse;
        kept.applied += gone.applied;
        ++went.all;
        went.fresh += gone.fresh;
        gone.parameter[0] = kGone;
    };
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        Contact& c = contacts[i];
        const std::uint32_t e = c.edge[0], f = c.edge[1];
        // Those after it: on the same edge and on the next.
        for (std::size_t k = i + 1; k < contacts.size() && c.parameter[0] != kGone; ++k) {
            Contact& other = contacts[k];
            if (other.edge[0] != e || other.edge[1] > f + 1) break;
            if (other.parameter[0] != kGone && at_one_place(c, other)) unite(c, other);
        }
        if (c.parameter[0] == kGone || e + 1 >= strands.edge_count() ||
            strands.strand[e + 1] != strands.strand[e])
            continue;
        const std::uint32_t low = c.against_collider || f == 0 ? f : f - 1,
                            high = c.against_collider ? f : f + 1;
        const std::uint64_t mark = c.against_collider ? kAgainstCollider : 0;
        ContactKey key{static_cast<std::uint64_t>(e + 1) << 32 | mark | low, 0};
        auto k =
            std::lower_bound(contacts.begin() + static_cast<std::ptrdiff_t>(i), contacts.end(), key,
                             [](const Contact& l, const ContactKey& r) { return l.key < r; });
        for (; k != contacts.end() && c.parameter[0] != kGone; ++k) {
            if (k->edge[0] != e + 1 || k->edge[1] > high) break;
            if (k->parameter[0] != kGone && at_one_place(c, *k)) unite(c, *k);
        }
    }
    if (went.all > 0)
        std::erase_if(contacts, [](const Contact& c) { return c.parameter[0] == kGone; });
    return went;
}

std::size_t refresh_contacts(const ContactStrands& strands, std::span<const MovingShape> colliders,
                             const DetectionSettings& settings, std::span<Contact> contacts) {
    constexpr std::uint32_t kMostRenewals = 3;  // of a contact in a step
    std::size_t changed = 0;
    const int threads = std::max(1, settings.threads);
#pragma omp parallel for num_threads(threads) schedule(static) reduction(+ : changed)
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        Contact& c = contacts[i];
        c.shortfall = 0;
        MovingSegment p = world_edge(strands, c.edge[0]), q{};
        double delta = c.distance, surface = 0;
        const bool start_first = (c.key.feature & kStartOfFirst) != 0;
        const bool start_second = !c.against_collider && (c.key.feature & kStartOfSecond) != 0;
        if (c.against_collider) {
            const MovingShape& collider = colliders[c.edge[1]];
            // Flat sides stay exact: their normal is that of the end of the step already.
            if (!is_round(collider)) continue;
            q = world_axis(collider);
            surface = collider.shape.radius;
            delta += surface;
        } else {
            q = world_edge(strands, c.edge[1]);
        }
        const SegmentPair<double> at_start = closest_segments(p.a, p.b, q.a, q.b);
        if (at_start.squared_distance < surface * surface)
            continue;  // on its way out: see push_aside
        const double start_distance = std::sqrt(at_start.squared_distance);
        const double target = std::min(delta, start_distance + 0.2 * c.distance);
        const MovingSegment p1 = at_time(p, 1), q1 = at_time(q, 1);
        // What other parts of the edges have is other contacts'.
        double low = 0, high = 1;
        if (start_first) {
            high = 0;
        } else if (c.against_collider) {
            const int name = name_on_solid(c.key);
            low = name == 0 ? c.parameter[0] : std::min(1.0, (name - 1) * kPartOnSolid);
            high = name == 0 ? c.parameter[0] : std::min(1.0, name * kPartOnSolid);
        } else if (!start_second) {
            const std::uint32_t parts = parts_of_first(p, q, delta);
            const std::uint32_t part = c.key.feature >> kFeatureParts;
            low = static_cast<double>(part) / parts;
            high = static_cast<double>(part + 1) / parts;
        }
        const double until = start_second ? 0 : 1;
        const SegmentPair<double> pair = closest_segments(
            mix(p1.a, p1.b, low), mix(p1.a, p1.b, high), q1.a, start_second ? q1.a : q1.b);
        double s = low + (high - low) * pair.s, t = until * pair.t;
        const Vector3 w = mix(p1.a, p1.b, s) - mix(q1.a, q1.b, t);
        const double d = length(w);
        if (d < kTouching) continue;
        Vector3 n = w * (1 / d);
        const double along = dot(n, c.normal);
        if (along < 0) n = -n;
        double reached = along < 0 ? -d : d;
        if (reached >= target - settings.end_tolerance * c.distance) continue;
        bool renew = c.renewals < kMostRenewals;
        if (renew && !apart_at_start(p, q, s, t, n, std::min(delta, start_distance))) {
            Meeting at;
            renew = meet_deeper(part_of(p, low, high), part_of(q, 0, until),
                                std::min(delta, start_distance) - kOverlaps * c.distance, at);
            if (renew) {
                s = low + (high - low) * at.s;
                t = until * at.t;
                n = at.normal;
                reached = dot(n, mix(p1.a, p1.b, s) - mix(q1.a, q1.b, t));
                renew = reached < target - settings.end_tolerance * c.distance;
            }
        }
        if (!renew) continue;
        c.parameter[0] = s;
        c.parameter[1] = t;
        c.normal = n;
        const Vector3 surface_t1 = mix(q1.a, q1.b, t) + surface * n;
        const Vector3 surface_t0 =
            c.against_collider ? to_world(colliders[c.edge[1]].pose_t0,
                                          to_local(colliders[c.edge[1]].pose_t1, surface_t1))
                               : Vector3(0);
        place_contact(strands, settings.step, start_distance - surface, surface_t0, surface_t1, c);
        c.shortfall = target - reached;
        ++c.renewals;
        ++changed;
    }
    return changed;
}

std::size_t overlapping_round_solids(const ContactStrands& strands,
                                     std::span<const MovingShape> colliders,
                                     const DetectionSettings& settings,
                                     std::span<const Contact> contacts) {
    std::size_t count = 0;
#pragma omp parallel for num_threads(std::max(1, settings.threads)) schedule(static) \
    reduction(+ : count)
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        const Contact& c = contacts[i];
        if (!c.against_collider || !is_round(colliders[c.edge[1]])) continue;
        const MovingSegment p = world_edge(strands, c.edge[0]),
                            q = world_axis(colliders[c.edge[1]]);
        const double surface = colliders[c.edge[1]].shape.radius;
        if (closest_segments(p.a, p.b, q.a, q.b).squared_distance < surface * surface)
            continue;  // on its way out, as above
        SegmentPair<double> end;
        count += ends_nearer(p, q, surface + c.distance, 2 * kOverlaps * c.distance, end) &&
                 can_move(strands, c.edge[0], end.s);
    }
    return count;
}

}  // namespace keratin
