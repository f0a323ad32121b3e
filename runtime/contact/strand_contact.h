// The contact side of a rod step (contact_problem.h): finds the contacts of the strands with each
// other and with colliders, and answers with impulses, locally (METHODS 2.7) or by the Gauss-Seidel
// reference solve (METHODS 2.9).
#pragma once

#include "runtime/contact/contact_problem.h"
#include "runtime/contact/detection.h"
#include "runtime/contact/gauss_seidel.h"
#include "runtime/contact/impulse_pass.h"
#include "schema/result.h"

#include <cstddef>
#include <functional>
#include <vector>

namespace keratin {

enum class ContactMethod { impulse, gauss_seidel };

struct ContactSettings {
    ContactMethod method = ContactMethod::gauss_seidel;
    LocalInertia local_inertia = LocalInertia::lumped;  // impulse only
    double friction = 0.3;                              // strand on strand, >= 0; infinite allowed
    double contact_distance = 0;                        // m, strand on strand; 0: r1 + r2
    bool between_strands = true;
    // Contacts that were there in the step before begin with the impulse they had. **Beyond**
    // METHODS 2.4, which begins with 0: the solution is the same, reached in fewer iterations.
    bool warm_start = true;
    std::uint32_t most_sweeps = 200;  // gauss_seidel: sweeps of one pass
    // gauss_seidel: mean |f_FB| at which a pass leaves the impulses alone, and to which it sweeps
    // else.
    double accepted_residual = 8e-7, sweep_residual = 4e-7;
    // gauss_seidel: share of the mean |f_FB| at its start that a pass sweeps down to at most. The
    // next pass, with the velocities that this one leads to, goes on from there; to come nearer with
    // contacts and velocities of now would be for nothing.
    double sweep_gain = 0.03;
    // gauss_seidel: share of the contact distance by which a pressing contact's gap may be moved to
    // where the other contacts of its strands leave it. Geometry of neighbouring contacts
    // contradicts itself by less, and to meet it exactly takes thousands of sweeps.
    double gap_leeway = 1e-3;
    int threads = 0;  // 0: as many as OpenMP would take
    InstructionSet instruction_set = InstructionSet::automatic;
};

// A collider and its way through time.
struct ContactCollider {
    RigidShape shape;
    double friction = 0.3;
    double contact_distance = 0;                 // m from the surface; 0: the strand's radius
    std::function<RigidPose(double time)> pose;  // world; empty: at rest where the shape says
};

// What the last step had, and what all steps since reset_totals took.
struct ContactReport {
    std::size_t contacts = 0;     // listed at the end of the step
    std::size_t active = 0;       // with r_N > 0
    std::size_t overlapping = 0;  // nearer at the end than delta and the start by more than 1 %
    double coulomb_residual = 0;  // mean |f_FB| over the list, with the final velocity
    std::uint32_t detections = 0, passes = 0, sweeps = 0;
};
struct ContactTotals {
    double detection_seconds = 0, bookkeeping_seconds = 0, solve_seconds = 0;  // wall time
    std::uint64_t steps = 0, contacts = 0, sweeps = 0;
    std::size_t most_contacts = 0;
    double residual_sum = 0, residual_most = 0;  // of the steps' mean |f_FB|
};

class StrandContact final : public ContactSolver {
  public:
    StrandContact(ContactSettings settings, std::vector<ContactCollider> colliders);
    ~StrandContact() override;

    void attached() override;
    void begin_step(const ContactProblem& problem) override;
    std::size_t detect(const ContactProblem& problem, std::span<const double> v) override;
    bool overlaps() const override;
    ContactPass pass(const ContactProblem& problem, std::span<const double> v,
                     const RodInverse& inverse, std::span<double> impulse) override;
    void end_step(const ContactProblem& problem, std::span<const double> v) override;

    // Friction may change from step to step.
    void set_friction(double strands, double colliders);

    std::span<const Contact> contacts() const;  // of the last step
    // Mean |f_FB| at each pass of the last step, of the impulses so far and the velocity that the
    // Newton step leads to with them.
    std::span<const double> residuals() const;
    const ContactReport& report() const;
    const ContactTotals& totals() const;
    void reset_totals();

    // What the next step begins with, to go on later bit for bit: contacts and impulses of the last
    // step, or of its last part where it was taken in halves.
    std::vector<std::byte> save() const;
    // Errors (input): not such a state.
    Result<void> restore(std::span<const std::byte> state);

  private:
    struct Memory;
    std::unique_ptr<Memory> memory_;
};

}  // namespace keratin
