// Where two segments that move linearly through a time step meet: one place, or both ends of the
// overlap of nearly parallel ones (METHODS 2.8).
#pragma once

#include "runtime/contact/advance.h"
#include "runtime/contact/contact.h"
#include "runtime/shape/closest.h"
#include "runtime/shape/moving_shape.h"

#include <algorithm>
#include <cstdint>

namespace keratin {

// Of delta: what strands may end a step nearer by.
inline constexpr double kOverlaps = 0.01;
inline constexpr double kTouching = 1e-9;  // m; below it two closest points give no normal
// Of delta: how much farther an end of a segment may be and count as the closest point.
inline constexpr double kSnap = 4e-3;
// Of delta: how deep an edge on a round solid must be for another place of it to be a contact.
inline constexpr double kElsewhere = 5e-3;

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

// The first moment at which segments p and q come within delta (m), and where; count 0: never.
// slack: m, by which an end of a segment may be farther and count as the closest point.
Meetings meet_segments(const MovingSegment& p, const MovingSegment& q, double delta, double slack);

// Whether the points s of p and t of q begin the step on the two sides that the normal says: no
// less apart along it than half the distance that the segments have. A normal found at the end of a
// step that leads one through the other does not.
bool apart_at_start(const MovingSegment& p, const MovingSegment& q, double s, double t,
                    const Vector3& normal, double distance);

// The first moment at which the segments come within distance (m), and where. With less than delta:
// where they meet next while the contact that they met in first holds them off.
bool meet_deeper(const MovingSegment& p, const MovingSegment& q, double distance, Meeting& out);

// The end of the step, where it is nearer than reach (m) by more than a tolerance (of delta) on the
// side that `first` found; where they have turned past each other by then, the moment at which they
// first are nearer by kOverlaps (of delta).
bool meet_at_end(const MovingSegment& p, const MovingSegment& q, double reach, double delta,
                 double tolerance, const Meetings& first, Meeting& out);

// Whether the segments end the step nearer than reach (m), and than they begin it, by more than
// depth (m); `end`: where they are nearest then.
bool ends_nearer(const MovingSegment& p, const MovingSegment& q, double reach, double depth,
                 SegmentPair<double>& end);

// An edge of a strand on its way, in world space, and the axis of a sphere or capsule.
MovingSegment world_edge(const ContactStrands& strands, std::uint32_t edge);
MovingSegment world_axis(const MovingShape& collider);

// Bits of ContactKey::feature; between strands the part of the first edge stands above them.
inline constexpr std::uint32_t kStartOfFirst = 1, kStartOfSecond = 2;
inline constexpr std::uint32_t kFeatureParts = 2;  // bits below the part

// Edges that lie along each other touch at several places at once, and the nearest of them jumps
// from one end to the other when they turn a little: each part of the first edge then has a contact
// of its own. How many parts the pair has by its place at the start of the step: 1 for edges that
// cross, where the nearest place is the only one.
std::uint32_t parts_of_first(const MovingSegment& p, const MovingSegment& q, double delta);
// An edge may lean on a round solid in several places. A place inside the edge is named by the part
// in which it was first met; what is met less than a part from a known one is that place again,
// whatever its name (a vertex is a place of its own). So neither a tip that comes down beside a
// known place is missed, nor do ropes that slide round a pole get new contacts at every part. The
// bow of a part is 1/256 of the edge's: below a hundredth of the radius for edges of 5 mm on a
// head.
inline constexpr std::uint32_t kPartsOnSolid = 16;
inline constexpr double kPartOnSolid = 1.0 / kPartsOnSolid;  // of the edge
// Part of a place s, 0 .. parts - 1.
inline std::uint32_t part_at(double s, std::uint32_t parts) {
    return std::min(static_cast<std::uint32_t>(s * parts), parts - 1);
}

// Number of the part plus 1 in the key of a contact with a round solid; 0: a vertex, or what leaves
// the solid sideways; kPartsOnSolid + 1: the end of a strand.
inline int name_on_solid(const ContactKey& key) {
    return static_cast<int>(key.feature >> (kFeatureParts + 1));
}

// The edge that a place of an edge is filed under.
struct EdgePlace {
    std::uint32_t edge;
    double parameter;
    bool at_start, moved;  // at the start of its edge; filed under another edge
};
// The end of an edge that another edge goes on from belongs to the next one.
EdgePlace file_under(const ContactStrands& strands, std::uint32_t edge, double parameter);

// Whether a force at this place of the edge can move it. Beside a held end it could only by
// throwing the other end about.
bool can_move(const ContactStrands& strands, std::uint32_t edge, double parameter);

}  // namespace keratin
