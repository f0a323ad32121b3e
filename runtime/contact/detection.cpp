#include "runtime/contact/detection.h"

#include "runtime/contact/collider_search.h"
#include "runtime/contact/meeting.h"
#include "runtime/contact/near_filter.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace keratin {
namespace {

constexpr double kStays = 1e-4;         // of the contact distance: a vertex this near has not moved
constexpr std::uint32_t kChunk = 2048;  // pairs or edges a thread takes at a time

double distance_of(const ContactStrands& strands, const DetectionSettings& settings,
                   std::uint32_t e, std::uint32_t f) {
    return settings.contact_distance > 0 ? settings.contact_distance
                                         : strands.radius[e] + strands.radius[f];
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

struct Detection::Memory {
    BroadPhase broad;
    std::vector<float> low[3], high[3];
    std::vector<FilterEdge> filter;
    std::vector<BoxPair> pairs;
    std::vector<std::vector<BoxPair>> near;
    std::vector<std::vector<FoundContact>> found;
    std::vector<FoundContact> list;
    std::vector<Vector3> searched_t1;      // x_t1 that the boxes were made for
    std::vector<Vector3> seen_t1;          // x_t1 that each vertex was last looked at with
    std::vector<std::uint8_t> moved;       // 1: the vertex has moved since
    std::uint32_t searches = 0;            // in this step
    std::vector<double> arc;               // m, length of the strand up to each vertex, at x_t
    std::vector<std::uint32_t> free_from;  // per strand, first edge outside the present collider
    double margin = 0;

    // Along a strand edges come near each other without a loop between them.
    bool are_joined(const ContactStrands& strands, const BoxPair& pair, double delta) const {
        constexpr double kHalfTurn = 1.6;  // arc of a half circle over its diameter, rounded up
        const std::uint32_t e = pair.first, f = pair.second;
        return strands.strand[e] == strands.strand[f] &&
               arc[strands.first_vertex[f]] - arc[strands.first_vertex[e] + 1] < kHalfTurn * delta;
    }
};

Detection::Detection() : memory_(std::make_unique<Memory>()) {}
Detection::~Detection() = default;
Detection::Detection(Detection&&) noexcept = default;
Detection& Detection::operator=(Detection&&) noexcept = default;

namespace {

// Keeps for each key the earliest, then the nearest; drops a contact found at the end of the edge
// before when its own edge has one in its inside with the same partner within a contact distance.
void sort_and_unite(const ContactStrands& strands, std::vector<FoundContact>& list) {
    std::sort(list.begin(), list.end(), [](const FoundContact& l, const FoundContact& r) {
        if (l.contact.key != r.contact.key) return l.contact.key < r.contact.key;
        if (l.moved != r.moved) return !l.moved;
        if (l.time != r.time) return l.time < r.time;
        return l.contact.gap < r.contact.gap;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < list.size();) {
        std::size_t end = i, last = i;  // of what has its key alone
        for (; end < list.size() && list[end].contact.key.pair == list[i].contact.key.pair; ++end)
            if (end == i || list[end].contact.key != list[last - 1].contact.key)
                list[last++] = list[end];
        const auto has_inside_near = [&](const Contact& c) {
            return std::any_of(
                list.begin() + static_cast<std::ptrdiff_t>(i),
                list.begin() + static_cast<std::ptrdiff_t>(last), [&](const FoundContact& f) {
                    return !f.moved &&
                           (f.contact.key.feature & (kStartOfFirst | kStartOfSecond)) == 0 &&
                           squared_length(place_of(strands, f.contact, 0) -
                                          place_of(strands, c, 0)) < c.distance * c.distance;
                });
        };
        for (std::size_t k = i; k < last; ++k)
            if (!list[k].moved || !has_inside_near(list[k].contact)) list[kept++] = list[k];
        i = end;
    }
    list.resize(kept);
}

}  // namespace

std::span<const FoundContact> Detection::find(const ContactStrands& strands,
                                              std::span<const MovingShape> colliders,
                                              const DetectionSettings& settings, bool again) {
    Memory& m = *memory_;
    const std::size_t edges = strands.edge_count(), vertices = strands.vertex_count();
    const int threads = std::max(1, settings.threads);
    auto start = std::chrono::steady_clock::now();
    counts_ = {};
    again = again && m.seen_t1.size() == vertices;
    m.searches = again ? m.searches + 1 : 0;

    auto half_distance = [&](std::uint32_t e) {
        return settings.contact_distance > 0 ? 0.5 * settings.contact_distance : strands.radius[e];
    };

    // Within a step, what ends where it ended before has no new contacts.
    m.moved.assign(vertices, 1);
    m.seen_t1.resize(vertices);
    bool any = !again;
    for (std::size_t e = 0; again && e < edges; ++e)
        for (const std::uint32_t v : {strands.first_vertex[e], strands.first_vertex[e] + 1}) {
            const double stays = kStays * 2 * half_distance(static_cast<std::uint32_t>(e));
            m.moved[v] = squared_length(strands.x_t1[v] - m.seen_t1[v]) > stays * stays;
            any = any || m.moved[v];
        }
    m.list.clear();
    if (!any && m.searches > 1) return m.list;
    for (std::size_t v = 0; v < vertices; ++v)
        if (m.moved[v]) m.seen_t1[v] = strands.x_t1[v];

    if (settings.between_strands && edges > 1) {
        Vector3 low(1e300), high(-1e300);
        for (const Vector3& x : strands.x_t0) {
            low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
            high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
        }
        const Vector3 centre = (low + high) * 0.5;

        bool search = !again || m.searched_t1.size() != vertices;  // colliders alone before
        if (!search) {
            double moved = 0;
            for (std::size_t i = 0; i < vertices; ++i)
                moved = std::max(moved, squared_length(strands.x_t1[i] - m.searched_t1[i]));
            search = std::sqrt(moved) > m.margin;
        }
        if (search) {
            m.arc.resize(vertices);
            double largest = 0;
            for (std::size_t e = 0; e < edges; ++e) {
                const std::uint32_t v = strands.first_vertex[e];
                if (e == 0 || strands.strand[e] != strands.strand[e - 1]) m.arc[v] = 0;
                m.arc[v + 1] = m.arc[v] + length(strands.x_t0[v + 1] - strands.x_t0[v]);
                largest = std::max(largest, half_distance(static_cast<std::uint32_t>(e)));
            }
            m.searched_t1.assign(strands.x_t1.begin(), strands.x_t1.end());
            m.margin = 2 * largest;  // each vertex may end this far from where this search has it
        }
        m.filter.resize(edges);
        for (int a = 0; a < 3; ++a) m.low[a].resize(edges), m.high[a].resize(edges);
#pragma omp parallel for num_threads(threads) schedule(static)
        for (std::size_t e = 0; e < edges; ++e) {
            const std::uint32_t v = strands.first_vertex[e];
            const Vector3 p[4] = {strands.x_t0[v] - centre, strands.x_t0[v + 1] - centre,
                                  strands.x_t1[v] - centre, strands.x_t1[v + 1] - centre};
            const double half = half_distance(static_cast<std::uint32_t>(e));
            FilterEdge& f = m.filter[e];
            const double value[12] = {p[0].x,          p[0].y,          p[0].z,
                                      p[1].x,          p[1].y,          p[1].z,
                                      p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z,
                                      p[3].x - p[1].x, p[3].y - p[1].y, p[3].z - p[1].z};
            double far = half;
            for (int k = 0; k < 12; ++k) {
                f.value[k] = static_cast<float>(value[k]);
                far = std::max(far, std::fabs(value[k]));
            }
            // Three roundings of numbers of this size, and some for what is computed from them.
            constexpr double kRounding = 8 * 6e-8;
            f.half_distance = static_cast<float>(half);
            f.error = static_cast<float>(kRounding * far);
            f.strand = strands.strand[e];
            if (!search) continue;
            const double grow = half * 1.01 + m.margin + kRounding * far;
            const double x[4] = {p[0].x, p[1].x, p[2].x, p[3].x},
                         y[4] = {p[0].y, p[1].y, p[2].y, p[3].y},
                         z[4] = {p[0].z, p[1].z, p[2].z, p[3].z};
            const double* axis[3] = {x, y, z};
            for (int a = 0; a < 3; ++a) {
                m.low[a][e] = static_cast<float>(*std::min_element(axis[a], axis[a] + 4) - grow);
                m.high[a][e] = static_cast<float>(*std::max_element(axis[a], axis[a] + 4) + grow);
            }
        }
        if (search)
            m.broad.find_pairs({m.low[0], m.low[1], m.low[2], m.high[0], m.high[1], m.high[2]},
                               threads, m.pairs);
    } else {
        m.pairs.clear();
    }
    auto has_moved = [&](std::uint32_t e) {
        return m.moved[strands.first_vertex[e]] || m.moved[strands.first_vertex[e] + 1];
    };
    counts_.candidates = m.pairs.size();
    counts_.broad_seconds = seconds_since(start);
    start = std::chrono::steady_clock::now();

    const std::size_t pair_chunks = (m.pairs.size() + kChunk - 1) / kChunk;
    const std::size_t edge_chunks = (edges + kChunk - 1) / kChunk;
    const std::size_t jobs = pair_chunks + edge_chunks * colliders.size();
    if (m.near.size() < pair_chunks) m.near.resize(pair_chunks);
    if (m.found.size() < jobs) m.found.resize(jobs);
    for (std::vector<FoundContact>& f : m.found) f.clear();
    std::size_t tested = 0;

#pragma omp parallel for num_threads(threads) schedule(dynamic) reduction(+ : tested)
    for (std::size_t c = 0; c < pair_chunks; ++c) {
        std::vector<BoxPair>& near = m.near[c];
        std::vector<FoundContact>& out = m.found[c];
        near.clear();
        const std::size_t count = std::min<std::size_t>(kChunk, m.pairs.size() - c * kChunk);
        keep_near_pairs(m.filter, std::span(m.pairs).subspan(c * kChunk, count), near);
        tested += near.size();
        for (const BoxPair& pair : near) {
            const std::uint32_t e = pair.first, f = pair.second;
            if (!has_moved(e) && !has_moved(f)) continue;
            const double delta = distance_of(strands, settings, e, f);
            if (m.are_joined(strands, pair, delta)) continue;
            const MovingSegment p = world_edge(strands, e), q = world_edge(strands, f);
            const Meetings meetings = meet_segments(p, q, delta, kSnap * delta);
            if (meetings.count == 0) continue;
            const std::uint32_t parts = parts_of_first(p, q, delta);
            auto key_of = [&](const EdgePlace& first, const EdgePlace& second) {
                std::uint32_t feature =
                    (first.at_start ? kStartOfFirst : 0) | (second.at_start ? kStartOfSecond : 0);
                if (feature == 0) feature = part_at(first.parameter, parts) << kFeatureParts;
                return ContactKey{static_cast<std::uint64_t>(first.edge) << 32 | second.edge,
                                  feature};
            };
            auto add = [&](const Meeting& at, double time) {
                if (!can_move(strands, e, at.s) && !can_move(strands, f, at.t)) return ContactKey{};
                const EdgePlace first = file_under(strands, e, at.s),
                                second = file_under(strands, f, at.t);
                FoundContact found;
                found.time = time;
                found.moved = first.moved || second.moved;
                Contact& contact = found.contact;
                contact.edge[0] = first.edge;
                contact.edge[1] = second.edge;
                contact.parameter[0] = first.parameter;
                contact.parameter[1] = second.parameter;
                contact.key = key_of(first, second);
                contact.normal = at.normal;
                contact.distance = delta;
                contact.friction = settings.friction;
                place_contact(strands, settings.step, meetings.start_distance, {}, {}, contact);
                out.push_back(found);
                return contact.key;
            };
            ContactKey last;
            for (int i = 0; i < meetings.count; ++i) last = add(meetings.at[i], meetings.time);
            Meeting end;
            if (meet_at_end(p, q, delta, delta, settings.end_tolerance, meetings, end)) {
                const EdgePlace first = file_under(strands, e, end.s),
                                second = file_under(strands, f, end.t);
                if (key_of(first, second) != last) add(end, 1);
            }
        }
    }
    counts_.tested = tested;

    for (std::size_t k = 0; k < colliders.size(); ++k) {
        const MovingShape& collider = colliders[k];
        // Strands that begin inside a solid and leave it: their edges up to the first vertex
        // outside are let alone.
        const std::uint32_t strand_count = edges > 0 ? strands.strand[edges - 1] + 1 : 0;
        m.free_from.assign(strand_count, 0);
        for (std::size_t e = 0; e < edges; ++e) {
            const std::uint32_t s = strands.strand[e];
            if (e > 0 && strands.strand[e - 1] == s) continue;
            std::uint32_t edge = static_cast<std::uint32_t>(e);
            m.free_from[s] = edge;
            if (!strands.prescribed[strands.first_vertex[e]] ||
                collider.shape.kind == ShapeKind::mesh)
                continue;
            while (edge < edges && strands.strand[edge] == s &&
                   closest_on_shape(
                       collider.shape,
                       to_local(collider.pose_t0, strands.x_t0[strands.first_vertex[edge]]))
                           .distance < 0)
                m.free_from[s] = ++edge;
        }
#pragma omp parallel for num_threads(threads) schedule(dynamic)
        for (std::size_t c = 0; c < edge_chunks; ++c) {
            std::vector<FoundContact>& out = m.found[pair_chunks + k * edge_chunks + c];
            const std::size_t end = std::min(edges, (c + 1) * kChunk);
            for (std::size_t i = c * kChunk; i < end; ++i) {
                const std::uint32_t e = static_cast<std::uint32_t>(i);
                if (e < m.free_from[strands.strand[e]]) continue;
                // The second search is the first that looks for several places of an edge.
                if (m.searches > 1 && !has_moved(e)) continue;
                find_on_collider(strands, settings, collider, static_cast<std::uint32_t>(k), again,
                                 e, out);
            }
        }
    }

    for (std::size_t j = 0; j < jobs; ++j)
        m.list.insert(m.list.end(), m.found[j].begin(), m.found[j].end());
    sort_and_unite(strands, m.list);
    counts_.narrow_seconds = seconds_since(start);
    return m.list;
}

std::size_t Detection::overlapping(const ContactStrands& strands,
                                   const DetectionSettings& settings) const {
    const Memory& m = *memory_;
    const std::size_t chunks = (m.pairs.size() + kChunk - 1) / kChunk;
    std::size_t count = 0;
#pragma omp parallel for num_threads(std::max(1, settings.threads)) schedule(dynamic) \
    reduction(+ : count)
    for (std::size_t c = 0; c < chunks; ++c)
        for (const BoxPair& pair : m.near[c]) {
            const double delta = distance_of(strands, settings, pair.first, pair.second);
            if (m.are_joined(strands, pair, delta)) continue;
            const MovingSegment p = world_edge(strands, pair.first),
                                q = world_edge(strands, pair.second);
            const MovingSegment p1 = at_time(p, 1), q1 = at_time(q, 1);
            const SegmentPair<double> end = closest_segments(p1.a, p1.b, q1.a, q1.b);
            const double apart = (1 - kOverlaps) * delta;
            if (end.squared_distance >= apart * apart) continue;
            const double start = std::sqrt(closest_segments(p.a, p.b, q.a, q.b).squared_distance);
            count +=
                std::sqrt(end.squared_distance) < std::min(delta, start) - kOverlaps * delta &&
                (can_move(strands, pair.first, end.s) || can_move(strands, pair.second, end.t));
        }
    return count;
}

}  // namespace keratin
