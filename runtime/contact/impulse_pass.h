// Local impulses with mass correction (Algorithm 3, METHODS 2.7): every contact answers alone for
// the velocity it sees, from the inertia of its own end points; all read first, then all change.
#pragma once

#include "runtime/contact/contact.h"

#include <cstdint>
#include <span>
#include <vector>

namespace keratin {

// lumped: the inertia that the lumped masses have. rigid: the largest eigenvalue of the edge as a
// rigid rod, as the source has it: the same solution, reached more slowly.
enum class LocalInertia { lumped, rigid };

// A contact ready to be solved: its law's constants and its rows.
struct ContactLaw {
    double constant[3];  // m/s: gap over the step, less the obstacle's velocity
    double friction;
    std::uint32_t sides;  // 1 or 2
    SideRows rows[2];
};

// Keeps its memory from call to call.
class ImpulsePass {
  public:
    // Changes impulses [3 * contacts] (contact frames) by one pass at velocity v.
    //   inverse_mass  1/kg, 1/(kg m^2): of every number, 0 where prescribed
    // Returns the sum of |r_new - r_old|.
    double run(std::span<const ContactLaw> laws, std::span<const double> v,
               std::span<const double> inverse_mass, LocalInertia inertia, int threads,
               std::span<double> impulses);

  private:
    std::vector<std::uint8_t> active_;
    std::vector<float> count_;  // active contacts at each number
    std::vector<double> u_;
};

// u of one contact, gap over the step included.
void relative_velocity(const ContactLaw& law, std::span<const double> v, double* u);

}  // namespace keratin
