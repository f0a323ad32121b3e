// The state of all strands of a rod simulation: blocks of strands side by side, one a lane, as
// rod_pass.h and RodLayout (contact_problem.h) lay them out, and what each strand is made of.
// Positions count from an origin near the strands, so that scenes far from the world's keep their
// precision.
#pragma once

#include "runtime/contact/contact_problem.h"
#include "runtime/rod/rod_pass.h"
#include "runtime/rod/rod_strand.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace keratin {

// Doubles on a 64-byte boundary.
class AlignedDoubles {
  public:
    AlignedDoubles() = default;
    explicit AlignedDoubles(std::size_t count);
    double* data() { return data_.get(); }
    const double* data() const { return data_.get(); }
    std::size_t size() const { return size_; }
    std::span<double> span() { return {data_.get(), size_}; }
    std::span<const double> span() const { return {data_.get(), size_}; }
    double& operator[](std::size_t k) { return data_[k]; }
    const double& operator[](std::size_t k) const { return data_[k]; }

  private:
    struct Free {
        void operator()(double* p) const;
    };
    std::unique_ptr<double[], Free> data_;
    std::size_t size_ = 0;
};

// A held end, now and where it shall be at the end of the next step.
struct RodEndState {
    RodEnd kind = RodEnd::free;
    Double3 position{};  // m, from the origin
    Double3 tangent{}, director{};  // unit; director: m_1
    Double3 span{};      // m, clamped_two_points: from the end's point to its neighbour
    Double3 target{};    // m: position at the end of the step
    Double3 turn{};      // rad: rotation vector of the whole step
};

// What a strand is made of, one number an edge or joint.
struct RodShape {
    RodMaterial material;
    std::vector<double> rest_length;              // [edges] m
    std::vector<double> added_mass;               // [vertices] kg, or empty
    std::vector<std::array<double, 5>> rest;      // [vertices] rest values of JointMaterial
    RodEndState root, tip;
};

struct RodBlocks {
    std::uint32_t lanes = 1;
    Double3 origin{};  // m, world

    // strands
    std::vector<std::uint32_t> first, vertex_count, block;  // [strands], see RodLayout
    std::vector<double> radius, spin_weight;                // [strands] m
    std::vector<RodShape> shapes;                           // [strands]

    // blocks
    std::vector<std::uint32_t> block_first;     // [blocks + 1]
    std::vector<std::uint32_t> strand_of_lane;  // [blocks * lanes]; kNoLane: empty
    std::vector<std::uint32_t> min_edges;       // [blocks]
    static constexpr std::uint32_t kNoLane = 0xffffffffu;

    // numbers, as RodLayout
    AlignedDoubles x, v;                   // m, rad; at the end of the last step
    AlignedDoubles mass, inverse_mass;     // kg, kg m^2
    AlignedDoubles force;                  // N: per vertex, set from outside
    AlignedDoubles spring;                 // N/m, of soft fixed points
    AlignedDoubles spring_target;          // m
    AlignedDoubles drag;                   // N s/m
    std::vector<std::uint8_t> free_lanes;  // one mask a row: [numbers / lanes]

    // rows of blocks, [rows of all blocks][...][lanes]
    AlignedDoubles frames, edges, joints;
    // [blocks][...][lanes]
    AlignedDoubles ends, edge_count, spin;

    std::size_t block_count() const { return block_first.empty() ? 0 : block_first.size() - 1; }
    std::size_t rows(std::size_t b) const {  // V of the block
        return (block_first[b + 1] - block_first[b]) / (4 * lanes);
    }
    // Where the block's rows start, in rows of all blocks.
    std::size_t first_row(std::size_t b) const { return block_first[b] / (4 * lanes); }
    std::size_t lane(std::size_t s) const { return first[s] - block_first[block[s]]; }
    std::size_t edge_count_of(std::size_t s) const { return vertex_count[s] - 1; }
    std::size_t index(std::size_t s, std::size_t vertex, std::size_t c) const {
        return first[s] + (4 * vertex + c) * lanes;
    }
    std::size_t frame_index(std::size_t s, std::size_t vertex, std::size_t c) const {
        return ((first_row(block[s]) + vertex) * kRodFrame + c) * lanes + lane(s);
    }
    std::size_t joint_index(std::size_t s, std::size_t vertex, std::size_t c) const {
        return ((first_row(block[s]) + vertex) * kRodJoint + c) * lanes + lane(s);
    }
    std::size_t edge_index(std::size_t s, std::size_t edge, std::size_t c) const {
        return ((first_row(block[s]) + edge) * kRodEdge + c) * lanes + lane(s);
    }
    std::size_t end_index(std::size_t s, std::size_t c) const {
        return (block[s] * 12 + c) * lanes + lane(s);
    }
    RodLayout layout() const {
        return {first, vertex_count, block, block_first, lanes};
    }
    std::uint32_t used_lanes(std::size_t b) const;  // mask
};

// Rest omega, twist of every joint from rest points (METHODS §2.2, rest state): Bishop frames from
// the root's clamp, or from `director` on the first edge.
void rest_from_points(std::span<const Double3> points, RodShape& shape);
// The same from natural curvature and twist, 1/m: what a joint of a curve of constant curvature and
// twist shows between the middles of its edges.
//
// Deviation from METHODS §2.2, which takes omega = l (u_2, -u_1), tau = l u_3: the two agree to second
// order in l, but this one is exact at any bend (a helix of 20 edges: tip error 0.0025 L, not 0.030 L).
// A joint with a rest bend also has its stiffness corrected, see rest_stiffness.
void rest_from_curvature(const std::array<double, 2>& curvature, double twist, RodShape& shape);

// Rest values of a joint less a strain: the joint turns back by the twist that is taken off, half
// of it on either edge (METHODS §2.2, rest state).
std::array<double, 5> relieved(const std::array<double, 5>& rest, const RodStrain& strain);
// Takes the strain, [edges] or empty, off a rest shape that came from points.
void relieve(std::span<const RodStrain> strain, RodShape& shape);

// Lays out strands that have been checked; ends that clamp need their directions (fill_end_frames).
RodBlocks make_blocks(std::span<const RodStrand> strands, std::uint32_t lanes);

// Writes masses, stiffnesses and rest values of a strand from its shape.
struct RodScales {
    double stretch = 1, bend = 1, twist = 1;
};
void write_strand(RodBlocks& blocks, std::size_t s, const RodScales& scales);
// Stiffness and rest values of joint i, as JointMaterial in rod_energy.h.
std::array<double, kRodJoint> joint_numbers(const RodShape& shape, std::size_t i,
                                            const RodScales& scales);

// Puts a strand as given: positions, velocities and angles, its ends' frames and its rest shape,
// and frames without twist. Held ends stay to be anchored and write_strand to be called.
void place_strand(RodBlocks& blocks, std::size_t s, const RodStrand& strand);

// Frames without twist from the root on, from positions and the root's director; angles are kept.
void reset_frames(RodBlocks& blocks, std::size_t s);

}  // namespace keratin
