#include "runtime/contact/detection.h"

#include "runtime/contact/advance.h"
#include "runtime/contact/near_filter.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace keratin {
namespace {

constexpr double kTouching = 1e-9;  // m; below it two closest points give no normal
constexpr double kParallel = 1e-2;  // squared sine; about 6 degrees
constexpr double kSnap = 4e-3;      // of delta: how much farther an end may be and count as closest
constexpr double kElsewhere =
    0.05;  // of delta: how deep an edge on a solid calls for another place
constexpr double kOverlapReach = 1.05;  // of delta: an end of a parallel overlap this near counts
constexpr double kStays = 1e-4;         // of the contact distance: a vertex this near has not moved
constexpr std::uint32_t kChunk = 2048;  // pairs or edges a thread takes at a time

constexpr std::uint32_t kStartOfFirst = 1, kStartOfSecond = 2;
constexpr std::uint32_t kElementShift = 3,
                        kEdgeElement = 4;  // of a mesh or box: bit 2, edge or face

// One place where two segments meet.
struct Meeting {
    double s, t;
    Vector3 normal;
};
struct Meetings {
    int count = 0;
    Meeting at[3];
    double time = 0, start_distance = 0;
};

// Unit vector from q(t) to p(s); where they coincide, perpendicular to both, on the side of x_t.
Vector3 normal_between(const MovingSegment& p, const MovingSegment& q, double s, double t,
                       const Vector3& start_side) {
    const Vector3 w = mix(p.a, p.b, s) - mix(q.a, q.b, t);
    const double d = length(w);
    if (d > kTouching) return w * (1 / d);
    const Vector3 ep = p.b - p.a, eq = q.b - q.a;
    Vector3 n = cross(ep, eq);
    const double nn = length(n), scale = length(ep) * length(eq);
    if (nn > 1e-6 * scale && nn > 0) {
        n *= 1 / nn;
    } else {
        const double l = length(ep);
        n = l > 0 ? any_perpendicular(ep * (1 / l)) : Vector3(0, 1, 0);
    }
    return dot(n, start_side) < 0 ? -n : n;
}

// Moves a closest point to the end of its segment where that is as near, to the slack (m): beside a
// joint both edges then have the same contact, at the vertex, and not two that hardly differ.
SegmentPair<double> snapped_to_ends(const MovingSegment& p, const MovingSegment& q,
                                    SegmentPair<double> pair, double slack) {
    const double reach = std::sqrt(pair.squared_distance) + slack;
    for (const double end : {0.0, 1.0}) {
        const Vector3 x = end > 0 ? p.b : p.a;
        const double t = closest_on_segment(x, q.a, q.b);
        const double along = (end - pair.s) * (end - pair.s) * squared_length(p.b - p.a);
        if (pair.s == end || along > reach * reach ||
            squared_length(x - mix(q.a, q.b, t)) > reach * reach)
            continue;
        pair.s = end;
        pair.t = t;
        break;
    }
    for (const double end : {0.0, 1.0}) {
        const Vector3 y = end > 0 ? q.b : q.a;
        const double s = pair.s <= 0 || pair.s >= 1 ? pair.s : closest_on_segment(y, p.a, p.b);
        const double along = (end - pair.t) * (end - pair.t) * squared_length(q.b - q.a);
        if (pair.t == end || along > reach * reach ||
            squared_length(y - mix(p.a, p.b, s)) > reach * reach)
            continue;
        pair.t = end;
        pair.s = s;
        break;
    }
    return pair;
}

// The places where segments p and q, as they stand, are in contact: one, or both ends of the
// overlap of nearly parallel ones.
void meet_at(const MovingSegment& p, const MovingSegment& q, double delta, double slack,
             const Vector3& start_side, Meetings& out) {
    const SegmentPair<double> pair = closest_segments(p.a, p.b, q.a, q.b);
    const double reach = kOverlapReach * delta;
    out.count = 0;
    auto add = [&](double s, double t) {
        if (out.count < 3) out.at[out.count++] = {s, t, normal_between(p, q, s, t, start_side)};
    };
    const Vector3 ep = p.b - p.a, eq = q.b - q.a;
    const double pp = squared_length(ep), qq = squared_length(eq);
    const Vector3 n = cross(ep, eq);
    if (pp > 0 && qq > 0 && squared_length(n) < kParallel * pp * qq) {
        double s0 = dot(q.a - p.a, ep) / pp, s1 = dot(q.b - p.a, ep) / pp;
        const bool same_way = s0 <= s1;
        if (!same_way) std::swap(s0, s1);
        const double low = std::max(0.0, s0), high = std::min(1.0, s1);
        // Ends of the overlap: an end of p with its foot on q, or an end of q with its foot on p.
        if ((high - low) * std::sqrt(pp) > reach) {
            auto offer = [&](double s, bool end_of_p, double t_of_q) {
                const double t = end_of_p ? closest_on_segment(mix(p.a, p.b, s), q.a, q.b) : t_of_q;
                const double d2 = squared_length(mix(p.a, p.b, s) - mix(q.a, q.b, t));
                if (d2 > reach * reach) return;
                const SegmentPair<double> place = snapped_to_ends(p, q, {s, t, d2}, slack);
                add(place.s, place.t);
            };
            offer(low, s0 <= 0, same_way ? 0.0 : 1.0);
            offer(high, s1 >= 1, same_way ? 1.0 : 0.0);
            const bool crossing = pair.s > 0 && pair.s < 1 && pair.t > 0 && pair.t < 1;
            if (crossing || out.count == 0) add(pair.s, pair.t);
            return;
        }
    }
    const SegmentPair<double> place = snapped_to_ends(p, q, pair, slack);
    add(place.s, place.t);
}

Meetings meet_segments(MovingSegment p, MovingSegment q, double delta, double slack) {
    Meetings out;
    const double rate = take_out_mean_motion(p, q);
    const FirstContact first = first_contact(
        [&](double t) {
            const MovingSegment pt = at_time(p, t), qt = at_time(q, t);
            return std::sqrt(closest_segments(pt.a, pt.b, qt.a, qt.b).squared_distance);
        },
        rate, delta);
    out.start_distance = first.start_distance;
    out.time = first.time;
    if (!first.found) return out;
    const SegmentPair<double> start = closest_segments(p.a, p.b, q.a, q.b);
    const Vector3 start_side = mix(p.a, p.b, start.s) - mix(q.a, q.b, start.t);
    meet_at(at_time(p, first.time), at_time(q, first.time), delta, slack, start_side, out);
    return out;
}

// Whether the points s of p and t of q begin the step on the two sides that the normal says: no
// less apart along it than half the distance that the segments have. A normal found at the end of a
// step that leads one through the other does not.
bool apart_at_start(const MovingSegment& p, const MovingSegment& q, double s, double t,
                    const Vector3& normal, double distance) {
    return dot(normal, mix(p.a, p.b, s) - mix(q.a, q.b, t)) >= 0.5 * distance;
}

// The end of the step, where it is too close on the side that `first` found.
bool meet_at_end(const MovingSegment& p, const MovingSegment& q, double reach, double delta,
                 double tolerance, const Meetings& first, Meeting& out) {
    const double target = std::min(reach, first.start_distance + 0.2 * delta) - tolerance * delta;
    const MovingSegment p1 = at_time(p, 1), q1 = at_time(q, 1);
    const SegmentPair<double> pair = closest_segments(p1.a, p1.b, q1.a, q1.b);
    if (pair.squared_distance >= target * target || pair.squared_distance < kTouching * kTouching)
        return false;
    const Vector3 n = normal_between(p1, q1, pair.s, pair.t, first.at[0].normal);
    constexpr double kSameSide = 0.2;  // cosine; less may have passed through
    if (dot(n, first.at[0].normal) < kSameSide ||
        !apart_at_start(p, q, pair.s, pair.t, n, std::min(reach, first.start_distance)))
        return false;
    out = {pair.s, pair.t, n};
    return true;
}

struct Place {
    std::uint32_t edge;
    double parameter;
    bool at_start, moved;
};

// The end of an edge that another edge goes on from belongs to the next one.
Place file_under(const ContactStrands& strands, std::uint32_t edge, double parameter) {
    if (parameter >= 1 && edge + 1 < strands.edge_count() &&
        strands.strand[edge + 1] == strands.strand[edge])
        return {edge + 1, 0.0, true, true};
    return {edge, parameter, parameter <= 0, false};
}

// Whether a force at this place of the edge can move it. Beside a held end it could only by
// throwing the other end about.
bool can_move(const ContactStrands& strands, std::uint32_t edge, double parameter) {
    constexpr double kBeside = 0.05;
    const std::uint32_t v = strands.first_vertex[edge];
    return !((strands.prescribed[v] || parameter >= 1 - kBeside) &&
             (strands.prescribed[v + 1] || parameter <= kBeside));
}

MovingSegment world_edge(const ContactStrands& strands, std::uint32_t edge) {
    const std::uint32_t v = strands.first_vertex[edge];
    const Vector3 &a = strands.x_t0[v], &b = strands.x_t0[v + 1];
    return {a, b, strands.x_t1[v] - a, strands.x_t1[v + 1] - b};
}

MovingSegment local_edge(const ContactStrands& strands, std::uint32_t edge,
                         const MovingShape& collider) {
    const std::uint32_t v = strands.first_vertex[edge];
    const Vector3 a = to_local(collider.pose_t0, strands.x_t0[v]),
                  b = to_local(collider.pose_t0, strands.x_t0[v + 1]);
    return {a, b, to_local(collider.pose_t1, strands.x_t1[v]) - a,
            to_local(collider.pose_t1, strands.x_t1[v + 1]) - b};
}

// Axis of a sphere or capsule on its way, in world space.
MovingSegment world_axis(const MovingShape& c) {
    const Vector3 b = c.shape.kind == ShapeKind::capsule ? c.shape.b : c.shape.a;
    const Vector3 a0 = to_world(c.pose_t0, c.shape.a), b0 = to_world(c.pose_t0, b);
    return {a0, b0, to_world(c.pose_t1, c.shape.a) - a0, to_world(c.pose_t1, b) - b0};
}

double edge_delta(const ContactStrands& strands, const MovingShape& c, std::uint32_t edge) {
    return c.contact_distance > 0 ? c.contact_distance : strands.radius[edge];
}

// Corner pairs of the 12 edges of a box, bit k of a corner: positive side of axis k.
constexpr int kBoxEdges[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                  {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
Vector3 box_corner(const RigidShape& box, int corner) {
    return {box.a.x + ((corner & 1) ? box.b.x : -box.b.x),
            box.a.y + ((corner & 2) ? box.b.y : -box.b.y),
            box.a.z + ((corner & 4) ? box.b.z : -box.b.z)};
}

// Looks at one edge and one collider.
struct ColliderSearch {
    const ContactStrands& strands;
    const DetectionSettings& settings;
    const MovingShape& collider;
    std::uint32_t index;
    std::vector<FoundContact>& out;
    bool again;  // not the first search of the step, whose motion knows of no contact

    void add(std::uint32_t edge, double parameter, const Vector3& normal, const Vector3& surface_t1,
             double time, double start_distance, std::uint32_t element) {
        if (!can_move(strands, edge, parameter)) return;
        const Place place = file_under(strands, edge, parameter);
        FoundContact f;
        f.time = time;
        f.moved = place.moved;
        Contact& c = f.contact;
        c.against_collider = true;
        c.edge[0] = place.edge;
        c.edge[1] = index;
        c.parameter[0] = place.parameter;
        c.key = {static_cast<std::uint64_t>(place.edge) << 32 | kAgainstCollider | index,
                 element << 2 | (place.at_start ? kStartOfFirst : 0)};
        c.normal = normal;
        c.distance = edge_delta(strands, collider, edge);
        c.friction = collider.friction;
        place_contact(strands, settings.step, start_distance,
                      to_world(collider.pose_t0, to_local(collider.pose_t1, surface_t1)),
                      surface_t1, c);
        out.push_back(f);
    }

    void against_axis(std::uint32_t edge) {
        const double delta = edge_delta(strands, collider, edge);
        const double radius = collider.shape.radius;
        const MovingSegment axis = world_axis(collider);
        const Meetings m =
            meet_segments(world_edge(strands, edge), axis, radius + delta, kSnap * delta);
        if (m.count > 0 && m.start_distance < radius) {
            push_aside(edge, m.at[0].s, axis, m.at[0].t);
            return;
        }
        const MovingSegment end = at_time(axis, 1);
        for (int i = 0; i < m.count; ++i)
            add(edge, m.at[i].s, m.at[i].normal,
                mix(end.a, end.b, m.at[i].t) + radius * m.at[i].normal, m.time,
                m.start_distance - radius, element(m.at[i].t));
        // An edge that lies along the solid at the end may lean on it in several places, each a
        // point of the strand. They are told apart by the part of the edge.
        constexpr double kParts = 8;
        Meeting at;
        if (m.count == 0 || !again ||
            !meet_at_end(world_edge(strands, edge), axis, radius + delta, delta, kElsewhere, m, at))
            return;
        for (int i = 0; i < m.count; ++i)
            if (std::fabs(at.s - m.at[i].s) * kParts < 1) return;
        const std::uint32_t part =
            at.s > 0 && at.s < 1 ? 2 * (1 + static_cast<std::uint32_t>(at.s * kParts)) : 0;
        add(edge, at.s, at.normal, mix(end.a, end.b, at.t) + radius * at.normal, 1,
            m.start_distance - radius, part + element(at.t));
    }
    // An edge that begins the step inside leaves sideways. The nearest way out would be along the
    // strand wherever it runs towards the middle, two ways from there on, and tear it apart.
    void push_aside(std::uint32_t edge, double s, const MovingSegment& axis, double t) {
        constexpr double kSideways = 1e-3;  // of the way out, less is a strand through the middle
        const MovingSegment e = world_edge(strands, edge);
        const Vector3 p = mix(e.a, e.b, s), along = e.b - e.a, from = p - mix(axis.a, axis.b, t);
        const double l = length(along), radius = collider.shape.radius;
        const Vector3 tangent = l > 0 ? along * (1 / l) : Vector3(1, 0, 0);
        Vector3 normal = from - dot(from, tangent) * tangent;
        const double aside = length(normal);
        if (aside < kSideways * radius) {
            // The same way for all edges of a straight strand, whatever their rounding.
            const Vector3 way = std::fabs(tangent.x) < 0.9 ? Vector3(1, 0, 0) : Vector3(0, 1, 0);
            normal = way - dot(way, tangent) * tangent;
        }
        normal = normal * (1 / length(normal));
        const double b = dot(from, normal);
        const double depth =
            std::sqrt(std::max(b * b - squared_length(from) + radius * radius, 0.0)) - b;
        add(edge, s, normal,
            to_world(collider.pose_t1, to_local(collider.pose_t0, p + depth * normal)), 0, -depth,
            element(t));
    }
    static std::uint32_t element(double t) { return t > 0 && t < 1 ? 1 : 0; }

    template <class Distance>
    void vertex_against_solid(std::uint32_t edge, double parameter, const MovingSegment& e,
                              Distance&& surface) {
        const double delta = edge_delta(strands, collider, edge);
        const Vector3 &p = parameter > 0 ? e.b : e.a, &move = parameter > 0 ? e.move_b : e.move_a;
        const FirstContact first = first_contact(
            [&](double t) { return surface(p + move * t).distance; }, length(move), delta);
        if (!first.found) return;
        const SurfacePoint at = surface(p + move * first.time);
        add(edge, parameter, rotate(collider.pose_t1, at.normal),
            to_world(collider.pose_t1, at.point), first.time, first.start_distance, 0);
    }

    // The other vertices of the strand are the starts of its other edges.
    bool ends_strand(std::uint32_t edge) const {
        return edge + 1 == strands.edge_count() || strands.strand[edge + 1] != strands.strand[edge];
    }

    void against_solid(std::uint32_t edge) {
        const MovingSegment e = local_edge(strands, edge, collider);
        auto surface = [&](const Vector3& p) { return closest_on_shape(collider.shape, p); };
        vertex_against_solid(edge, 0, e, surface);
        if (ends_strand(edge)) vertex_against_solid(edge, 1, e, surface);
        if (collider.shape.kind != ShapeKind::box) return;
        const double delta = edge_delta(strands, collider, edge);
        for (std::uint32_t k = 0; k < 12; ++k) {
            const Vector3 a = box_corner(collider.shape, kBoxEdges[k][0]),
                          b = box_corner(collider.shape, kBoxEdges[k][1]);
            const Meetings m =
                meet_segments(e, {a, b, Vector3(0), Vector3(0)}, delta, kSnap * delta);
            for (int i = 0; i < m.count; ++i) {
                // Inside the strand's edge, and outside of the box as seen from the box's edge.
                if (m.at[i].s <= 0 || m.at[i].s >= 1) continue;
                const Vector3 outward = mix(a, b, 0.5) - collider.shape.a;
                const Vector3& n = m.at[i].normal;
                if (n.x * outward.x < 0 || n.y * outward.y < 0 || n.z * outward.z < 0) continue;
                add(edge, m.at[i].s, rotate(collider.pose_t1, n),
                    to_world(collider.pose_t1, mix(a, b, m.at[i].t)), m.time, m.start_distance,
                    (k << 1) | 1);
            }
        }
    }

    void vertex_against_mesh(std::uint32_t edge, double parameter, const MovingSegment& e,
                             const Vector3& low, const Vector3& high) {
        const TriangleTree& tree = *collider.shape.mesh;
        const double delta = edge_delta(strands, collider, edge);
        const Vector3 &p = parameter > 0 ? e.b : e.a, &move = parameter > 0 ? e.move_b : e.move_a;
        struct Hit {
            FirstContact first;
            TrianglePoint<double> place;
            std::uint32_t triangle;
            double distance;
        };
        // Faces that are met in their inside all count; of edges and corners only the nearest, and
        // only when no face is met: beside a face they are the seams of a smooth surface.
        Hit seam{};
        bool face_met = false, seam_met = false;
        auto report = [&](const Hit& h) {
            const std::uint32_t* c = tree.triangles().data() + 3 * h.triangle;
            const Vector3 &a = tree.points()[c[0]], &b = tree.points()[c[1]],
                          &d = tree.points()[c[2]];
            const Vector3 foot = a + h.place.u * (b - a) + h.place.v * (d - a),
                          w = p + move * h.first.time - foot;
            const double l = length(w);
            Vector3 n = l > kTouching ? w * (1 / l) : cross(b - a, d - a);
            if (l <= kTouching) {
                const double nl = length(n);
                n = nl > 0 ? n * ((dot(n, p - foot) < 0 ? -1 : 1) / nl) : Vector3(0, 1, 0);
            }
            add(edge, parameter, rotate(collider.pose_t1, n), to_world(collider.pose_t1, foot),
                h.first.time, h.first.start_distance, h.triangle << 1);
        };
        tree.overlapping(low, high, [&](std::uint32_t triangle) {
            const std::uint32_t* c = tree.triangles().data() + 3 * triangle;
            const Vector3 &a = tree.points()[c[0]], &b = tree.points()[c[1]],
                          &d = tree.points()[c[2]];
            const FirstContact first = first_contact(
                [&](double t) {
                    return std::sqrt(closest_on_triangle(p + move * t, a, b, d).squared_distance);
                },
                length(move), delta);
            if (!first.found) return;
            const TrianglePoint<double> place = closest_on_triangle(p + move * first.time, a, b, d);
            const Hit hit{first, place, triangle, std::sqrt(place.squared_distance)};
            constexpr double kInside = 1e-9;
            if (place.u > kInside && place.v > kInside && place.u + place.v < 1 - kInside) {
                face_met = true;
                report(hit);
            } else if (!seam_met || hit.first.time < seam.first.time ||
                       (hit.first.time == seam.first.time &&
                        (hit.distance < seam.distance ||
                         (hit.distance == seam.distance && triangle < seam.triangle)))) {
                seam_met = true;
                seam = hit;
            }
        });
        if (seam_met && !face_met) report(seam);
    }

    void against_mesh(std::uint32_t edge) {
        const TriangleTree& tree = *collider.shape.mesh;
        const MovingSegment e = local_edge(strands, edge, collider);
        const double delta = edge_delta(strands, collider, edge);
        const Vector3 a1 = e.a + e.move_a, b1 = e.b + e.move_b;
        const double r = 1.01 * delta;
        const Vector3 low{std::min({e.a.x, e.b.x, a1.x, b1.x}) - r,
                          std::min({e.a.y, e.b.y, a1.y, b1.y}) - r,
                          std::min({e.a.z, e.b.z, a1.z, b1.z}) - r};
        const Vector3 high{std::max({e.a.x, e.b.x, a1.x, b1.x}) + r,
                           std::max({e.a.y, e.b.y, a1.y, b1.y}) + r,
                           std::max({e.a.z, e.b.z, a1.z, b1.z}) + r};
        vertex_against_mesh(edge, 0, e, low, high);
        if (ends_strand(edge)) vertex_against_mesh(edge, 1, e, low, high);
        // An edge that is held at one end may stick in the surface (a root below the skin): only
        // its free vertex meets the mesh.
        const std::uint32_t v = strands.first_vertex[edge];
        if (strands.prescribed[v] || strands.prescribed[v + 1]) return;
        tree.overlapping(low, high, [&](std::uint32_t triangle) {
            for (const TriangleTree::Edge& seam : tree.edges_of(triangle)) {
                const Vector3 &a = tree.points()[seam.point[0]], &b = tree.points()[seam.point[1]];
                const Meetings m =
                    meet_segments(e, {a, b, Vector3(0), Vector3(0)}, delta, kSnap * delta);
                for (int i = 0; i < m.count; ++i) {
                    if (m.at[i].s <= 0 || m.at[i].s >= 1) continue;
                    // Beside one of its faces the face is nearer than the edge.
                    bool beside = false;
                    for (const std::uint32_t corner : seam.corner) {
                        const Vector3 along = b - a, in = tree.points()[corner] - a;
                        const Vector3 inward =
                            in - along * (dot(in, along) / std::max(squared_length(along), 1e-300));
                        constexpr double kAcross = 1e-6;
                        if (dot(m.at[i].normal, inward) > kAcross * length(inward)) beside = true;
                    }
                    if (beside) continue;
                    add(edge, m.at[i].s, rotate(collider.pose_t1, m.at[i].normal),
                        to_world(collider.pose_t1, mix(a, b, m.at[i].t)), m.time, m.start_distance,
                        (tree.edge_index(seam) << 1) | 1);
                }
            }
        });
    }
};

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
};

Detection::Detection() : memory_(std::make_unique<Memory>()) {}
Detection::~Detection() = default;
Detection::Detection(Detection&&) noexcept = default;
Detection& Detection::operator=(Detection&&) noexcept = default;

namespace {

// Keeps for each key the earliest, then the nearest; drops a contact found at the end of the edge
// before when its own edge has one in its inside with the same partner.
void sort_and_unite(std::vector<FoundContact>& list) {
    std::sort(list.begin(), list.end(), [](const FoundContact& l, const FoundContact& r) {
        if (l.contact.key != r.contact.key) return l.contact.key < r.contact.key;
        if (l.moved != r.moved) return !l.moved;
        if (l.time != r.time) return l.time < r.time;
        return l.contact.gap < r.contact.gap;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < list.size();) {
        std::size_t end = i;
        bool inside = false;
        while (end < list.size() && list[end].contact.key.pair == list[i].contact.key.pair) {
            inside |= !list[end].moved &&
                      (list[end].contact.key.feature & (kStartOfFirst | kStartOfSecond)) == 0;
            ++end;
        }
        for (std::size_t k = i; k < end; ++k) {
            if (k > i && list[k].contact.key == list[k - 1].contact.key) continue;
            if (inside && list[k].moved) continue;
            list[kept++] = list[k];
        }
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

    auto distance_of = [&](std::uint32_t a, std::uint32_t b) {
        return settings.contact_distance > 0 ? settings.contact_distance
                                             : strands.radius[a] + strands.radius[b];
    };
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
            const double delta = distance_of(e, f);
            if (strands.strand[e] == strands.strand[f]) {
                // Along a strand edges come near each other without a loop between them.
                constexpr double kHalfTurn =
                    1.6;  // arc of a half circle over its diameter, rounded up
                if (m.arc[strands.first_vertex[f]] - m.arc[strands.first_vertex[e] + 1] <
                    kHalfTurn * delta)
                    continue;
            }
            const MovingSegment p = world_edge(strands, e), q = world_edge(strands, f);
            const Meetings meetings = meet_segments(p, q, delta, kSnap * delta);
            if (meetings.count == 0) continue;
            auto add = [&](const Meeting& at, double time) {
                if (!can_move(strands, e, at.s) && !can_move(strands, f, at.t)) return ContactKey{};
                const Place first = file_under(strands, e, at.s),
                            second = file_under(strands, f, at.t);
                FoundContact found;
                found.time = time;
                found.moved = first.moved || second.moved;
                Contact& contact = found.contact;
                contact.edge[0] = first.edge;
                contact.edge[1] = second.edge;
                contact.parameter[0] = first.parameter;
                contact.parameter[1] = second.parameter;
                contact.key = {
                    static_cast<std::uint64_t>(first.edge) << 32 | second.edge,
                    (first.at_start ? kStartOfFirst : 0) | (second.at_start ? kStartOfSecond : 0)};
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
                const Place first = file_under(strands, e, end.s),
                            second = file_under(strands, f, end.t);
                const ContactKey key{
                    static_cast<std::uint64_t>(first.edge) << 32 | second.edge,
                    (first.at_start ? kStartOfFirst : 0) | (second.at_start ? kStartOfSecond : 0)};
                if (key != last) add(end, 1);
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
            ColliderSearch search{strands,
                                  settings,
                                  collider,
                                  static_cast<std::uint32_t>(k),
                                  m.found[pair_chunks + k * edge_chunks + c],
                                  again};
            const std::size_t end = std::min(edges, (c + 1) * kChunk);
            for (std::size_t i = c * kChunk; i < end; ++i) {
                const std::uint32_t e = static_cast<std::uint32_t>(i);
                if (e < m.free_from[strands.strand[e]]) continue;
                // The second search is the first that looks for several places of an edge.
                if (m.searches > 1 && !has_moved(e)) continue;
                switch (collider.shape.kind) {
                    case ShapeKind::sphere:
                    case ShapeKind::capsule:
                        search.against_axis(e);
                        break;
                    case ShapeKind::plane:
                    case ShapeKind::box:
                        search.against_solid(e);
                        break;
                    case ShapeKind::mesh:
                        search.against_mesh(e);
                        break;
                }
            }
        }
    }

    for (std::size_t j = 0; j < jobs; ++j)
        m.list.insert(m.list.end(), m.found[j].begin(), m.found[j].end());
    sort_and_unite(m.list);
    counts_.narrow_seconds = seconds_since(start);
    return m.list;
}

std::size_t merge_contacts(std::span<const FoundContact> found, std::vector<Contact>& contacts) {
    const std::size_t before = contacts.size();
    for (Contact& c : contacts) c.fresh = false;
    std::size_t i = 0;
    for (const FoundContact& f : found) {
        while (i < before && contacts[i].key < f.contact.key) ++i;
        if (i < before && contacts[i].key == f.contact.key) continue;
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
    auto point = [&](const Contact& c, int side) {
        const std::uint32_t v = strands.first_vertex[c.edge[side]];
        return mix(strands.x_t0[v], strands.x_t0[v + 1], c.parameter[side]);
    };
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
        if (c.renewals >= kMostRenewals) continue;
        MovingSegment p = world_edge(strands, c.edge[0]), q{};
        double delta = c.distance, surface = 0;
        const bool start_first = (c.key.feature & kStartOfFirst) != 0;
        const bool start_second = !c.against_collider && (c.key.feature & kStartOfSecond) != 0;
        if (c.against_collider) {
            const MovingShape& collider = colliders[c.edge[1]];
            // Flat sides stay exact: their normal is that of the end of the step already.
            if (collider.shape.kind != ShapeKind::sphere &&
                collider.shape.kind != ShapeKind::capsule)
                continue;
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
        double s = start_first ? 0 : c.parameter[0], t = c.parameter[1];
        if (start_first && start_second) {
            t = 0;
        } else if (start_first) {
            t = closest_on_segment(p1.a, q1.a, q1.b);
        } else if (start_second) {
            t = 0;
            s = closest_on_segment(q1.a, p1.a, p1.b);
        } else {
            const SegmentPair<double> pair = closest_segments(p1.a, p1.b, q1.a, q1.b);
            if (c.against_collider &&
                std::sqrt(pair.squared_distance) <= target - kElsewhere * c.distance) {
                // Far too deep a place is another contact's (against_axis), this one stays.
                t = closest_on_segment(mix(p1.a, p1.b, s), q1.a, q1.b);
            } else {
                s = pair.s;
                t = pair.t;
            }
        }
        const Vector3 w = mix(p1.a, p1.b, s) - mix(q1.a, q1.b, t);
        const double d = length(w);
        if (d < kTouching) continue;
        Vector3 n = w * (1 / d);
        const double along = dot(n, c.normal);
        if (along < 0) n = -n;
        const double reached = along < 0 ? -d : d;
        if (reached >= target - settings.end_tolerance * c.distance ||
            !apart_at_start(p, q, s, t, n, std::min(delta, start_distance)))
            continue;
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

}  // namespace keratin
