// Discrete elastic rods in implicit Euler steps (METHODS §2): strands are given once, then stepped,
// pushed, re-clamped and read. Double precision throughout; the same result for any number of threads,
// and no strand's result depends on which others are simulated beside it unless they touch.
//
//     auto rods = RodSimulation::create(strands, settings);
//     for (;;) {
//         rods->move_root(0, {.position = head});   // where the root is at the end of the step
//         rods->step(1e-3);
//         draw(rods->points(0));
//     }
//
// create() allocates, attach_contact() once more; a step does not. A RodSimulation is used by one
// thread at a time. No global state. Not handled: torn strands, plasticity.
#pragma once

#include "runtime/contact/contact_problem.h"
#include "runtime/rod/rod_strand.h"
#include "schema/result.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace keratin {

// Where a held end shall be at the end of the next step.
struct RodEndTarget {
    Double3 position{};    // m, world: of the end's point
    Double3 turn{0, 0, 0};  // rad: rotation vector by which tangent and director turn over the step;
                            // any size (a turn of more than a quarter is cut into smaller steps)
};

enum class RodTip { root, tip };

struct RodEnergy {
    double kinetic = 0;                          // J
    double stretch = 0, bend = 0, twist = 0;     // J
    double potential = 0;                        // J: gravity, from the world's origin
    double elastic() const { return stretch + bend + twist; }
};

// How a step went. Counts are over strands unless said otherwise.
struct RodStepReport {
    std::uint64_t iterations = 0;      // Newton iterations, summed over strands
    std::uint32_t most_iterations = 0;
    std::uint32_t halved = 0;      // strands whose step was repeated in halves
    std::uint32_t at_cap = 0;      // strands that did not converge even so; they keep the last iterate
    std::uint32_t indefinite = 0;  // strands whose whole Hessian was not positive definite
    std::uint32_t lost = 0;        // strands that were not finite and were left where they were
    std::uint32_t contact_iterations = 0;  // of the whole scene, with contact
    std::uint32_t contacts = 0;            // listed at the end of the step, with contact
    double mean_change = 0;                // m/s: mean |dv| of the last iteration (METHODS §2.10)
    double mean_impulse_change = 0;        // N s: mean |dr| of the last pass
};

// CPU time of the calling thread's part and the counts over all steps (METHODS §2.10).
struct RodStats {
    std::uint64_t steps = 0, strand_iterations = 0, steps_at_cap = 0, steps_halved = 0;
    double prepare = 0, dynamics = 0, collision_detection = 0, contact_bookkeeping = 0,
           impulse_solve = 0;  // s, wall
    std::uint64_t bytes = 0;   // allocated
};

// Change of v and of the impulses in each iteration of the last step with contact.
struct RodConvergence {
    double dv = 0, dr = 0;
};

struct SettleOptions {
    double tolerance = 1e-10;        // m: largest movement of a point in a step of a second or more
    std::uint32_t steps = 400;       // at most
    double first_step = 1e-3;        // s
    double perturbation = 0;         // m: random displacement of the free points at the start
    std::uint64_t seed = 1;
};
struct SettleReport {
    bool settled = false;
    std::uint32_t steps = 0;
    double last_movement = 0;  // m
};

class RodSimulation {
  public:
    // Errors (input): fewer than two points, numbers that are not finite, coincident neighbours,
    // a radius, density or modulus that is not positive, and so on; `where` names the strand.
    static Result<RodSimulation> create(std::span<const RodStrand> strands,
                                        const RodSettings& settings);
    RodSimulation(RodSimulation&&) noexcept;
    RodSimulation& operator=(RodSimulation&&) noexcept;
    ~RodSimulation();

    std::size_t strand_count() const;
    std::size_t vertex_count(std::size_t strand) const;
    RodLayout layout() const;
    const RodSettings& settings() const;
    double time() const;  // s

    // Contact takes part in every step from now on; it must outlive its use. nullptr: none.
    void attach_contact(ContactSolver* contact);

    // Inputs of the next steps. Errors (input): no such strand, vertex or held end, not finite; the
    // state is as before then.
    Result<void> move_root(std::size_t strand, const RodEndTarget& target);
    Result<void> move_tip(std::size_t strand, const RodEndTarget& target);
    // Force on a vertex, N, until changed.
    Result<void> set_force(std::size_t strand, std::size_t vertex, const Double3& force);
    // Soft fixed point (4.2), until changed; stiffness 0 (N/m) takes it away.
    Result<void> set_spring(std::size_t strand, std::size_t vertex, const Double3& point,
                            double stiffness);
    Result<void> set_material(std::size_t strand, const RodMaterial& material);
    Result<void> set_natural_curvature(std::size_t strand, const std::array<double, 2>& curvature,
                                       double twist);
    Result<void> set_rest_points(std::size_t strand, std::span<const Double3> points);
    // Holds or frees an end where it is now.
    Result<void> set_end(std::size_t strand, RodTip which, RodEnd kind);
    Result<void> set_gravity(const Double3& gravity);
    // Puts a strand's points and velocities; the angles and the frames start anew, without twist.
    Result<void> set_points(std::size_t strand, std::span<const Double3> points,
                            std::span<const Double3> velocities);
    Result<void> set_velocities(std::size_t strand, std::span<const Double3> velocities);
    // Carries a strand rigidly to where its root's target is, shape and velocities kept and turned:
    // for a jump that is no motion.
    Result<void> teleport(std::size_t strand, const RodEndTarget& root);

    // Advances by h seconds, 1e-9..10. Errors (input): h out of range; contact with the midpoint rule.
    Result<RodStepReport> step(double h);
    // Steps without inertia (every step starts at rest), growing until the strands stand still.
    SettleReport settle(const SettleOptions& options);

    // State; positions in the world.
    Double3 position(std::size_t strand, std::size_t vertex) const;
    Double3 velocity(std::size_t strand, std::size_t vertex) const;
    std::vector<Double3> points(std::size_t strand) const;
    std::vector<Double3> velocities(std::size_t strand) const;
    double angle(std::size_t strand, std::size_t edge) const;
    Double3 tangent(std::size_t strand, std::size_t edge) const;
    Double3 director(std::size_t strand, std::size_t edge) const;  // m_1
    double twist(std::size_t strand) const;         // rad: sum over the joints, rest not taken off
    double tension(std::size_t strand, std::size_t edge) const;       // N
    double edge_stretch(std::size_t strand, std::size_t edge) const;  // |e|/|e_rest| - 1
    double vertex_mass(std::size_t strand, std::size_t vertex) const;  // kg
    RodEnergy energy(std::size_t strand) const;
    double max_stretch() const;  // largest | |e|/|e_rest| - 1 | now
    double max_speed() const;    // m/s
    bool finite() const;
    // The start-of-step arrays as contact sees them, see RodLayout; from origin().
    std::span<const double> numbers() const;
    std::span<const double> rates() const;
    const Double3& origin() const;

    const RodStats& stats() const;
    void reset_stats();
    std::span<const RodConvergence> convergence() const;

    // The whole state; a restored simulation of the same strands and settings continues bit by bit.
    std::vector<std::byte> save() const;
    // Errors (input): not a state of these strands.
    Result<void> restore(std::span<const std::byte> state);

  private:
    struct Impl;
    explicit RodSimulation(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace keratin
