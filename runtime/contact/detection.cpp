#include "runtime/contact/detection.h"

#include "runtime/contact/collider_search.h"
#include "runtime/contact/meeting.h"
#include "runtime/contact/near_filter.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace keratin {
namespace {

constexpr double kStays = 1e-4;         // of the contact distance: a vertex this near has not moved
constexpr std::uint32_t kChunk = 2048;  // pairs or edges a thread takes at a time

double distance_of(const ContactStrands& strands, const DetectionSettings& settings,
                   std::uint32_t e, std::uint32_t f) {
    return settings.contact_distance > 0 ? settings.contact_distance
                                         : strands.radius[e] + strands.radius[f];
}

double half_distance(const ContactStrands& strands, const DetectionSettings& settings,
                     std::size_t e) {
    const auto edge = static_cast<std::uint32_t>(e);
    return 0.5 * distance_of(strands, settings, edge, edge);
}

}  // namespace

struct Detection::Memory {
    BroadPhase broad;
    std::vector<Box> boxes;
    std::vector<FilterEdge> filter;
    std::vector<BoxPair> pairs;
    // A chunk of the pairs: those that may meet, those of them to look at in this call.
    struct Chunk {
        std::vector<BoxPair> near, changed;
    };
    std::vector<Chunk> chunks;
    std::vector<std::vector<FoundContact>> found;
    std::vector<FoundContact> list;
    struct Place {  // one of `found`, with what it is sorted by first
        std::uint64_t pair, feature_moved;
        std::uint32_t number;
        const FoundContact* at;
    };
    std::vector<Place> order;
    std::vector<Vector3> searched_t1;      // x_t1 that the boxes were made for
    std::vector<Vector3> seen_t1;          // x_t1 that each vertex was last looked at with
    std::vector<std::uint8_t> moved;       // 1: the vertex has moved since
    std::uint32_t searches = 0;            // in this step
    std::vector<double> arc;               // m, length of the strand up to each vertex, at x_t
    std::vector<std::uint32_t> free_from;  // per strand, first edge outside the present collider
    Vector3 centre{0, 0, 0};
    double margin = 0;

    std::size_t chunk_count() const { return (pairs.size() + kChunk - 1) / kChunk; }
    bool has_moved(const ContactStrands& strands, std::uint32_t e) const {
        return moved[strands.first_vertex[e]] || moved[strands.first_vertex[e] + 1];
    }
    // Along a strand edges come near each other without a loop between them.
    bool are_joined(const ContactStrands& strands, const BoxPair& pair, double delta) const {
        constexpr double kHalfTurn = 1.6;  // arc of a half circle over its diameter, rounded up
        const std::uint32_t e = pair.first, f = pair.second;
        return strands.strand[e] == strands.strand[f] &&
               arc[strands.first_vertex[f]] - arc[strands.first_vertex[e] + 1] < kHalfTurn * delta;
    }

    bool mark_moved(const ContactStrands& strands, const DetectionSettings& settings, bool again);
    bool must_search(const ContactStrands& strands, bool again) const;
    void begin_search(const ContactStrands& strands, const DetectionSettings& settings);
    void place_edges(const ContactStrands& strands, const DetectionSettings& settings, bool search);
    void find_pairs(const ContactStrands& strands, const DetectionSettings& settings, bool again);
    void look_at(const ContactStrands& strands, const DetectionSettings& settings,
                 const BoxPair& pair, std::vector<FoundContact>& out) const;
    void find_free_edges(const ContactStrands& strands, const MovingShape& collider);
    void sort_and_unite(const ContactStrands& strands, std::size_t jobs);
};

Detection::Detection() : memory_(std::make_unique<Memory>()) {}
Detection::~Detection() = default;
Detection::Detection(Detection&&) noexcept = default;
Detection& Detection::operator=(Detection&&) noexcept = default;

// Lists what the first `jobs` of `found` hold. Keeps for each key the earliest, then the nearest;
// drops a contact found at the end of the edge before when its own edge has one in its inside with
// the same partner within a contact distance.
void Detection::Memory::sort_and_unite(const ContactStrands& strands, std::size_t jobs) {
    order.clear();
    for (std::size_t j = 0; j < jobs; ++j)
        for (const FoundContact& f : found[j])
            order.push_back({f.contact.key.pair,
                             static_cast<std::uint64_t>(f.contact.key.feature) << 1 | f.moved,
                             static_cast<std::uint32_t>(order.size()), &f});
    std::ranges::sort(order, [](const Place& l, const Place& r) {
        if (l.pair != r.pair) return l.pair < r.pair;
        if (l.feature_moved != r.feature_moved) return l.feature_moved < r.feature_moved;
        const FoundContact &a = *l.at, &b = *r.at;
        if (a.time != b.time) return a.time < b.time;
        if (a.contact.gap != b.contact.gap) return a.contact.gap < b.contact.gap;
        return l.number < r.number;
    });
    list.clear();
    std::vector<const FoundContact*> firsts;  // of a pair, the first of each key
    for (std::size_t i = 0; i < order.size();) {
        firsts.clear();
        const std::uint64_t pair = order[i].pair;
        for (; i < order.size() && order[i].pair == pair; ++i)
            if (firsts.empty() || order[i].at->contact.key != firsts.back()->contact.key)
                firsts.push_back(order[i].at);
        const auto has_inside_near = [&](const Contact& c) {
            return std::ranges::any_of(firsts, [&](const FoundContact* f) {
                return !f->moved &&
                       (f->contact.key.feature & (kStartOfFirst | kStartOfSecond)) == 0 &&
                       squared_length(place_of(strands, f->contact, 0) - place_of(strands, c, 0)) <
                           c.distance * c.distance;
            });
        };
        for (const FoundContact* f : firsts)
            if (!f->moved || !has_inside_near(f->contact)) list.push_back(*f);
    }
}

// Which vertices end elsewhere than they were last looked at; whether there are any.
bool Detection::Memory::mark_moved(const ContactStrands& strands, const DetectionSettings& settings,
                                   bool again) {
    const std::size_t edges = strands.edge_count(), vertices = strands.vertex_count();
    moved.assign(vertices, 1);
    seen_t1.resize(vertices);
    if (!again) {
        std::copy(strands.x_t1.begin(), strands.x_t1.end(), seen_t1.begin());
        return true;
    }
    int any = 0;
#pragma omp parallel for num_threads(std::max(1, settings.threads)) schedule(static) \
    reduction(|                                                                      \
              : any)
    for (std::size_t e = 0; e < edges; ++e) {
        const double stays = kStays * 2 * half_distance(strands, settings, e);
        auto mark = [&](std::uint32_t v) {
            moved[v] = squared_length(strands.x_t1[v] - seen_t1[v]) > stays * stays;
            if (!moved[v]) return;
            seen_t1[v] = strands.x_t1[v];
            any = 1;
        };
        mark(strands.first_vertex[e]);
        if (e + 1 == edges || strands.strand[e + 1] != strands.strand[e])
            mark(strands.first_vertex[e] + 1);
    }
    return any != 0;
}

// Whether pairs must be looked for anew: a vertex ends farther from where the last search of this
// step had it than that allowed for.
bool Detection::Memory::must_search(const ContactStrands& strands, bool again) const {
    if (!again || searched_t1.size() != strands.vertex_count())
        return true;  // colliders alone before
    double farthest = 0;
    for (std::size_t i = 0; i < searched_t1.size(); ++i)
        if (moved[i])
            farthest = std::max(farthest, squared_length(strands.x_t1[i] - searched_t1[i]));
    return std::sqrt(farthest) > margin;
}

void Detection::Memory::begin_search(const ContactStrands& strands,
                                     const DetectionSettings& settings) {
    const std::size_t edges = strands.edge_count();
    Vector3 lowest(1e300), highest(-1e300);
    for (const Vector3& x : strands.x_t0) {
        lowest = {std::min(lowest.x, x.x), std::min(lowest.y, x.y), std::min(lowest.z, x.z)};
        highest = {std::max(highest.x, x.x), std::max(highest.y, x.y), std::max(highest.z, x.z)};
    }
    centre = (lowest + highest) * 0.5;
    arc.resize(strands.vertex_count());
    double largest = 0;
    for (std::size_t e = 0; e < edges; ++e) {
        const std::uint32_t v = strands.first_vertex[e];
        if (e == 0 || strands.strand[e] != strands.strand[e - 1]) arc[v] = 0;
        arc[v + 1] = arc[v] + length(strands.x_t0[v + 1] - strands.x_t0[v]);
        largest = std::max(largest, half_distance(strands, settings, e));
    }
    searched_t1.assign(strands.x_t1.begin(), strands.x_t1.end());
    margin = 2 * largest;  // each vertex may end this far from where this search has it
    filter.resize(edges);
    boxes.resize(edges);
}

// Where the edges are on their way: of those that have moved, or in a search of all, and then their
// boxes.
void Detection::Memory::place_edges(const ContactStrands& strands,
                                    const DetectionSettings& settings, bool search) {
#pragma omp parallel for num_threads(std::max(1, settings.threads)) schedule(static)
    for (std::size_t e = 0; e < strands.edge_count(); ++e) {
        if (!search && !has_moved(strands, static_cast<std::uint32_t>(e))) continue;
        const std::uint32_t v = strands.first_vertex[e];
        const Vector3 p[4] = {strands.x_t0[v] - centre, strands.x_t0[v + 1] - centre,
                              strands.x_t1[v] - centre, strands.x_t1[v + 1] - centre};
        const double half = half_distance(strands, settings, e);
        FilterEdge& f = filter[e];
        const double value[12] = {p[0].x,          p[0].y,          p[0].z,
                                  p[1].x,          p[1].y,          p[1].z,
                                  p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z,
                                  p[3].x - p[1].x, p[3].y - p[1].y, p[3].z - p[1].z};
        double far = half;
        for (int k = 0; k < 12; ++k) {
            f.value[k] = static_cast<float>(value[k]);
            far = std::max(far, std::fabs(value[k]));
        }
        // Five roundings of numbers of this size, and some for what is computed from them.
        constexpr double kRounding = 10 * 6e-8;
        f.half_distance = static_cast<float>(half);
        f.error = static_cast<float>(kRounding * far);
        f.strand = strands.strand[e];
        if (!search) continue;
        const double grow = half * 1.01 + margin + kRounding * far;
        for (int a = 0; a < 3; ++a) {
            const auto [least, most] = std::minmax(
                {value[a], value[3 + a], value[a] + value[6 + a], value[3 + a] + value[9 + a]});
            boxes[e].bound[a] = static_cast<float>(least - grow);
            boxes[e].bound[3 + a] = static_cast<float>(most + grow);
        }
    }
}

// Makes `near` and `changed` of the chunks.
void Detection::Memory::find_pairs(const ContactStrands& strands, const DetectionSettings& settings,
                                   bool again) {
    const int threads = std::max(1, settings.threads);
    const bool search = must_search(strands, again);
    if (search) begin_search(strands, settings);
    place_edges(strands, settings, search);
    if (search) {
        broad.find_pairs(boxes, threads, pairs, BroadPhaseMethod::automatic,
                         settings.instruction_set);
        if (chunks.size() < chunk_count()) chunks.resize(chunk_count());
    }

    auto changes = [&](const BoxPair& pair) {
        return has_moved(strands, pair.first) || has_moved(strands, pair.second);
    };
#pragma omp parallel num_threads(threads)
    {
        std::vector<BoxPair> waiting;
#pragma omp for schedule(dynamic)
        for (std::size_t c = 0; c < chunk_count(); ++c) {
            auto& [near, changed] = chunks[c];
            const std::span all = std::span(pairs).subspan(
                c * kChunk, std::min<std::size_t>(kChunk, pairs.size() - c * kChunk));
            changed.clear();
            if (search) {
                near.clear();
                keep_near_pairs(filter, all, near, settings.instruction_set);
                std::ranges::copy_if(near, std::back_inserter(changed), changes);
                continue;
            }
            waiting.clear();
            std::ranges::copy_if(all, std::back_inserter(waiting), changes);
            keep_near_pairs(filter, waiting, changed, settings.instruction_set);
            std::erase_if(near, changes);
            near.insert(near.end(), changed.begin(), changed.end());
        }
    }
}

// The contacts of a pair of edges.
void Detection::Memory::look_at(const ContactStrands& strands, const DetectionSettings& settings,
                                const BoxPair& pair, std::vector<FoundContact>& out) const {
    const std::uint32_t e = pair.first, f = pair.second;
    const double delta = distance_of(strands, settings, e, f);
    if (are_joined(strands, pair, delta)) return;
    const MovingSegment p = world_edge(strands, e), q = world_edge(strands, f);
    const Meetings meetings = meet_segments(p, q, delta, kSnap * delta);
    if (meetings.count == 0) return;
    const std::uint32_t parts = parts_of_first(p, q, delta);
    auto key_of = [&](const EdgePlace& first, const EdgePlace& second) {
        std::uint32_t feature =
            (first.at_start ? kStartOfFirst : 0) | (second.at_start ? kStartOfSecond : 0);
        if (feature == 0) feature = part_at(first.parameter, parts) << kFeatureParts;
        return ContactKey{static_cast<std::uint64_t>(first.edge) << 32 | second.edge, feature};
    };
    auto add = [&](const Meeting& at, double time) {
        if (!can_move(strands, e, at.s) && !can_move(strands, f, at.t)) return ContactKey{};
        const EdgePlace first = file_under(strands, e, at.s), second = file_under(strands, f, at.t);
        FoundContact found_at;
        found_at.time = time;
        found_at.moved = first.moved || second.moved;
        Contact& contact = found_at.contact;
        contact.edge[0] = first.edge;
        contact.edge[1] = second.edge;
        contact.parameter[0] = first.parameter;
        contact.parameter[1] = second.parameter;
        contact.key = key_of(first, second);
        contact.normal = at.normal;
        contact.distance = delta;
        contact.friction = settings.friction;
        place_contact(strands, settings.step, meetings.start_distance, {}, {}, contact);
        out.push_back(found_at);
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

// Strands that begin inside a solid and leave it: their edges up to the first vertex outside are
// let alone.
void Detection::Memory::find_free_edges(const ContactStrands& strands,
                                        const MovingShape& collider) {
    const std::size_t edges = strands.edge_count();
    free_from.assign(edges > 0 ? strands.strand[edges - 1] + 1 : 0, 0);
    for (std::size_t e = 0; e < edges; ++e) {
        const std::uint32_t s = strands.strand[e];
        if (e > 0 && strands.strand[e - 1] == s) continue;
        std::uint32_t edge = static_cast<std::uint32_t>(e);
        free_from[s] = edge;
        if (!strands.prescribed[strands.first_vertex[e]] || collider.shape.kind == ShapeKind::mesh)
            continue;
        while (edge < edges && strands.strand[edge] == s &&
               closest_on_shape(collider.shape, to_local(collider.pose_t0,
                                                         strands.x_t0[strands.first_vertex[edge]]))
                       .distance < 0)
            free_from[s] = ++edge;
    }
}

std::span<const FoundContact> Detection::find(const ContactStrands& strands,
                                              std::span<const MovingShape> colliders,
                                              const DetectionSettings& settings, bool again) {
    Memory& m = *memory_;
    const std::size_t edges = strands.edge_count();
    const int threads = std::max(1, settings.threads);
    again = again && m.seen_t1.size() == strands.vertex_count();
    m.searches = again ? m.searches + 1 : 0;

    // Within a step, what ends where it ended before has no new contacts.
    m.list.clear();
    if (!m.mark_moved(strands, settings, again) && m.searches > 1) return m.list;
    if (settings.between_strands && edges > 1)
        m.find_pairs(strands, settings, again);
    else
        m.pairs.clear();

    const std::size_t pair_chunks = m.chunk_count();
    const std::size_t edge_chunks = (edges + kChunk - 1) / kChunk;
    const std::size_t jobs = pair_chunks + edge_chunks * colliders.size();
    if (m.found.size() < jobs) m.found.resize(jobs);
    for (std::vector<FoundContact>& f : m.found) f.clear();
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (std::size_t c = 0; c < pair_chunks; ++c)
        for (const BoxPair& pair : m.chunks[c].changed)
            m.look_at(strands, settings, pair, m.found[c]);

    for (std::size_t k = 0; k < colliders.size(); ++k) {
        const MovingShape& collider = colliders[k];
        m.find_free_edges(strands, collider);
#pragma omp parallel for num_threads(threads) schedule(dynamic)
        for (std::size_t c = 0; c < edge_chunks; ++c) {
            std::vector<FoundContact>& out = m.found[pair_chunks + k * edge_chunks + c];
            const std::size_t end = std::min(edges, (c + 1) * kChunk);
            for (std::size_t i = c * kChunk; i < end; ++i) {
                const std::uint32_t e = static_cast<std::uint32_t>(i);
                if (e < m.free_from[strands.strand[e]]) continue;
                // The second search is the first that looks for several places of an edge.
                if (m.searches > 1 && !m.has_moved(strands, e)) continue;
                find_on_collider(strands, settings, collider, static_cast<std::uint32_t>(k), again,
                                 e, out);
            }
        }
    }

    m.sort_and_unite(strands, jobs);
    return m.list;
}

std::size_t Detection::overlapping(const ContactStrands& strands,
                                   const DetectionSettings& settings) const {
    const Memory& m = *memory_;
    std::size_t count = 0;
#pragma omp parallel for num_threads(std::max(1, settings.threads)) schedule(dynamic) \
    reduction(+ : count)
    for (std::size_t c = 0; c < m.chunk_count(); ++c)
        for (const BoxPair& pair : m.chunks[c].near) {
            const double delta = distance_of(strands, settings, pair.first, pair.second);
            if (m.are_joined(strands, pair, delta)) continue;
            SegmentPair<double> end;
            count +=
                ends_nearer(world_edge(strands, pair.first), world_edge(strands, pair.second),
                            delta, kOverlaps * delta, end) &&
                (can_move(strands, pair.first, end.s) || can_move(strands, pair.second, end.t));
        }
    return count;
}

}  // namespace keratin
