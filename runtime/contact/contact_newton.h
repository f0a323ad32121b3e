// Some contacts that lean on each other, solved together under the Coulomb law: Newton's method on
// the function of Alart and Curnier (1991), which is 0 exactly where the law holds (METHODS 2.7).
// For contacts on one stiff strand, where sweeps over single contacts shift loads along it at a
// crawl.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace keratin {

struct ContactNewtonSettings {
    double velocity_scale = 1e-2, impulse_scale = 1;  // u* and u* times the mean mass, METHODS 2.10
    double residual = 1e-8;                           // sum of |f_FB| to come to
};

// Sum of |f_FB| over contacts, scaled. friction: [n]; r: [3n] N s; u: [3n] m/s.
double sum_of_residuals(std::span<const double> friction, const ContactNewtonSettings& settings,
                        std::span<const double> r, std::span<const double> u);

// Keeps its memory from call to call.
class ContactNewton {
  public:
    // w: [3n][3n] 1/kg, symmetric and positive semidefinite, in contact frames (normal, first,
    // second tangent). friction: [n] >= 0, finite. impulses: [3n] N s and velocities: [3n] m/s with
    // the gap over the step, u = W r + b, both in place. Leaves what has the least sum of |f_FB|,
    // which it returns; never more than at the start.
    double solve(std::span<const double> w, std::span<const double> friction,
                 const ContactNewtonSettings& settings, std::span<double> impulses,
                 std::span<double> velocities);

  private:
    // One step of Newton's method from r, u: the change of r to `step_`. damping: of W's diagonal,
    // added to it. False where the linear system has no solution in numbers.
    bool step(std::span<const double> w, std::span<const double> friction,
              std::span<const double> r, std::span<const double> u, double damping);
    // Each contact in turn solved for itself.
    void sweep(std::span<const double> w, std::span<const double> friction, std::span<double> r,
               std::span<double> u);

    std::vector<double> matrix_, step_, r_, u_;
};

}  // namespace keratin
