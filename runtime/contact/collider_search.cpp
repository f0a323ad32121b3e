#include "runtime/contact/collider_search.h"

#include "runtime/contact/advance.h"
#include "runtime/contact/meeting.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

MovingSegment local_edge(const ContactStrands& strands, std::uint32_t edge,
                         const MovingShape& collider) {
    const std::uint32_t v = strands.first_vertex[edge];
    const Vector3 a = to_local(collider.pose_t0, strands.x_t0[v]),
                  b = to_local(collider.pose_t0, strands.x_t0[v + 1]);
    return {a, b, to_local(collider.pose_t1, strands.x_t1[v]) - a,
            to_local(collider.pose_t1, strands.x_t1[v + 1]) - b};
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
             double time, double start_distance, std::uint32_t element, bool by_place = false) {
        if (!can_move(strands, edge, parameter)) return;
        const EdgePlace place = file_under(strands, edge, parameter);
        FoundContact f;
        f.time = time;
        f.moved = place.moved;
        Contact& c = f.contact;
        c.against_collider = true;
        c.edge[0] = place.edge;
        c.edge[1] = index;
        c.parameter[0] = place.parameter;
        c.by_place = by_place;
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
        auto meet = [&](const Meeting& at, double time) {
            add(edge, at.s, at.normal, mix(end.a, end.b, at.t) + radius * at.normal, time,
                m.start_distance - radius, place_name(edge, at.s) + element(at.t),
                at.s > 0 && at.s < 1);
        };
        for (int i = 0; i < m.count; ++i) meet(m.at[i], m.time);
        // An edge that lies along the solid at the end may lean on it in several places, each a
        // point of the strand.
        Meeting at;
        if (m.count == 0 || !again ||
            !meet_at_end(world_edge(strands, edge), axis, radius + delta, delta, kElsewhere, m, at))
            return;
        for (int i = 0; i < m.count; ++i)
            if (std::fabs(at.s - m.at[i].s) < kPartOnSolid) return;
        meet(at, 1);
    }
    // A vertex has its name as the start of an edge, but for the last of a strand.
    std::uint32_t place_name(std::uint32_t edge, double s) const {
        if (s <= 0 || (s >= 1 && !ends_strand(edge))) return 0;
        return 2 * (1 + static_cast<std::uint32_t>(s * kPartsOnSolid));
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

}  // namespace

void find_on_collider(const ContactStrands& strands, const DetectionSettings& settings,
                      const MovingShape& collider, std::uint32_t index, bool again,
                      std::uint32_t edge, std::vector<FoundContact>& out) {
    ColliderSearch search{strands, settings, collider, index, out, again};
    switch (collider.shape.kind) {
        case ShapeKind::sphere:
        case ShapeKind::capsule:
            return search.against_axis(edge);
        case ShapeKind::plane:
        case ShapeKind::box:
            return search.against_solid(edge);
        case ShapeKind::mesh:
            return search.against_mesh(edge);
    }
}

}  // namespace keratin
