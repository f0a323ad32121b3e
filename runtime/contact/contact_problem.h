// What a rod step and a contact solver hand each other (METHODS §2.4). The step owns the motion;
// the contact solver owns the contacts and the impulses r, and is called by the step, which passes
// the velocity and the inverse of its Hessian as arguments: neither includes the other's code.
//
//     begin_step            once a step (and once for each half of a repeated step)
//     repeat
//         (the step)        Newton directions of all strands on g(.; impulse): v + d
//         detect            at first, and whenever the iteration seems to have converged
//         pass              changes r from v + d, writes impulse = H^T r
//         (the step)        directions for the new impulse with the same factors, line search along
//         them
//     end_step              after the last Newton iteration, with the velocity that is kept
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace keratin {

// Where the numbers of the strands stand. Strands lie side by side in blocks of `lanes`; number
// 4 i + c of strand s stands at first[s] + (4 i + c) * lanes, with c = 0, 1, 2 the position of
// vertex i and c = 3 the angle of the edge i from vertex i to i + 1 (the last vertex has none: its
// number is not used). Strand s is lane `first[s] % (block length)` of its block, see `block`.
struct RodLayout {
    std::span<const std::uint32_t> first;         // [strands]
    std::span<const std::uint32_t> vertex_count;  // [strands] >= 2
    std::span<const std::uint32_t> block;         // [strands]
    std::span<const std::uint32_t> block_first;   // [blocks + 1] where a block's numbers start
    std::uint32_t lanes = 1;

    std::size_t index(std::size_t s, std::size_t vertex, std::size_t component) const {
        return first[s] + (4 * vertex + component) * lanes;
    }
    std::size_t lane(std::size_t s) const { return first[s] - block_first[block[s]]; }
    std::size_t number_count() const { return block_first.empty() ? 0 : block_first.back(); }
};

// One time step as contact sees it. Everything is laid out as RodLayout says unless an extent is
// given, is valid during the step only, and positions count from an origin of the rod simulation's.
struct ContactProblem {
    RodLayout layout;
    double time = 0;                       // s, at the start of the step
    double step = 0;                       // s, h
    double origin[3] = {0, 0, 0};          // m, world position that x counts from
    std::span<const double> x_t0;          // m, rad: start of the step
    std::span<const double> v_t0;          // m/s, rad/s: start of the step
    std::span<const double> inverse_mass;  // 1/kg, 1/(kg m^2); 0 where prescribed
    std::span<const double> radius;        // [strands] m: the larger semi-axis
    std::span<const double> spin_weight;   // [strands] m: length that an angle counts with (r)
    double gravity_speed = 0;     // m/s: h |g|, u* of METHODS §2.10 (1e-2 without gravity)
    double mean_vertex_mass = 0;  // kg, of the vertices that are not prescribed
};

// Applies (grad^2 g)^-1 of the last Newton iteration, (M + h^2 grad^2 E)^-1: impulse to change of
// velocity. Prescribed numbers come out as 0. Thread-safe.
class RodInverse {
  public:
    virtual ~RodInverse() = default;
    // Changes whenever a factor of the block does: the same number, the same inverse.
    virtual std::uint64_t version(std::uint32_t block) const = 0;
    // Three vectors for each strand of a block at once, in place: as fast as half of them one by
    // one. values: [3 * block length]; what stands at r * lanes + l of the block's part of the
    // arrays above is, of vector c, at (3 r + c) * lanes + l. Before and after the values stand
    // margin() zeros. The vectors are 0 before row `first`, and only from there on is the result
    // asked for: what comes before stays 0.
    virtual void apply_block(std::uint32_t block, std::size_t first,
                             std::span<double> values) const = 0;
    virtual std::size_t margin() const { return 0; }
};

struct ContactPass {
    double mean_change = 0;    // N s: mean over the contacts of |r_new - r_old|
    std::size_t contacts = 0;  // listed
    // Left off before the law held: another pass from here will not do better, or will.
    bool stalled = false, unfinished = false;
};

class ContactSolver {
  public:
    virtual ~ContactSolver() = default;
    // From now on it serves other strands, or the same anew: what it knows of their factors is
    // void.
    virtual void attached() {}
    virtual void begin_step(const ContactProblem& problem) = 0;
    // Finds contacts of the motion x_t0 + s h v, s in [0, 1], adds those that are new with r = 0,
    // keeps the others' r. Returns the number added.
    virtual std::size_t detect(const ContactProblem& problem, std::span<const double> v) = 0;
    // Whether the last detect, which added none, saw strands or colliders that end the step too
    // near each other and can do no better in a step of this size.
    virtual bool overlaps() const { return false; }
    // Updates r from the velocity v and writes the whole impulse H^T r (0 where there is none).
    virtual ContactPass pass(const ContactProblem& problem, std::span<const double> v,
                             const RodInverse& inverse, std::span<double> impulse) = 0;
    // The step ends with this velocity: the place to measure f_FB.
    virtual void end_step(const ContactProblem& problem, std::span<const double> v) = 0;
};

}  // namespace keratin
