// The reference contact solve (METHODS 2.9): Gauss-Seidel on the true Delassus operator
// W = H (grad^2 g)^-1 H^T, each contact solved exactly under the Coulomb law.
//
// W couples the contacts of a strand only, so it is kept strand by strand: a dense block over the
// strand's contact velocities or, where a strand has more contacts than numbers, the columns
// (grad^2 g)^-1 H^T over its velocities. Contacts go in batches of eight that share no strand;
// which batches may run beside each other is fixed by the strands, not by the threads, so the
// result is the same for any number of threads.
#pragma once

#include "runtime/contact/contact_problem.h"
#include "runtime/contact/impulse_pass.h"
#include "runtime/lane/instruction_set.h"

#include <cstdint>
#include <memory>
#include <span>

namespace keratin {

// A contact's side in the strand's own terms.
struct SidePlace {
    std::uint32_t strand, vertex;  // the edge from vertex to vertex + 1 of the strand
};

struct GaussSeidelSettings {
    int threads = 1;
    std::uint32_t most_sweeps = 200;
    std::uint32_t least_sweeps = 1;
    double accepted = 8e-7;  // mean |f_FB| at which impulses are left as they are
    double residual = 1e-7;  // mean |f_FB| to sweep down to, else
    double gain = 0;         // share of the mean |f_FB| at the start that will do as well
    double leeway = 0;  // m/s: change of a contact's constant[0] by which it may suit the others
    double velocity_scale = 1e-2, impulse_scale = 1;  // u* and u* times the mean vertex mass
    InstructionSet instruction_set = InstructionSet::automatic;
};

struct GaussSeidelReport {
    std::uint32_t sweeps = 0;
    double start = 0;     // mean |f_FB| before the first sweep
    double residual = 0;  // mean |f_FB| after the last sweep, by W
    double change = 0;    // sum of |r_new - r_old| over the contacts, N s
};

class GaussSeidel {
  public:
    GaussSeidel();
    ~GaussSeidel();
    GaussSeidel(GaussSeidel&&) noexcept;
    GaussSeidel& operator=(GaussSeidel&&) noexcept;

    // Computes W. laws: the contacts; places: [2 * contacts], of sides that exist. exact: in
    // doubles too, for solve_strands. impulses: [3 * contacts] or empty, a guess that says which
    // contacts to take side by side.
    void assemble(const RodLayout& layout, std::span<const ContactLaw> laws,
                  std::span<const SidePlace> places, const RodInverse& inverse, int threads,
                  bool exact = false, std::span<const double> impulses = {});

    // The same for the same contacts after some blocks' factors have changed: their columns alone.
    void renew(const RodLayout& layout, std::span<const ContactLaw> laws,
               std::span<const SidePlace> places, const RodInverse& inverse, int threads,
               bool exact = false);

    // Sweeps from impulses [3 * contacts] (contact frames), in place. v: velocities that contain
    // the impulses `applied` [3 * contacts]. Laws as at assemble, their constants may differ.
    // eased: [contacts] m/s, by how much each constant[0] has been changed so far and, afterwards,
    // has been changed in all; with a leeway of 0 not used.
    GaussSeidelReport solve(std::span<const ContactLaw> laws, std::span<const double> v,
                            std::span<const double> applied, const GaussSeidelSettings& settings,
                            std::span<double> impulses, std::span<double> eased = {});

    // Goes on where solve() has come to a stand, with W as it was assembled with `exact`: strand
    // after strand, all contacts of a strand together (contact_newton.h), up to most_sweeps times
    // over all strands. Contacts on one strand share its stiffness against stretching, along which
    // sweeps over single contacts move loads at a crawl: thousands lead nowhere where friction
    // winds a rope round a pole. Strands with more than 128 contacts, or more
    // than they have numbers, are left as they are.
    GaussSeidelReport solve_strands(std::span<const ContactLaw> laws,
                                    std::span<const SidePlace> places, std::span<const double> v,
                                    std::span<const double> applied,
                                    const GaussSeidelSettings& settings,
                                    std::span<double> impulses);

    // Bytes that W takes.
    std::size_t bytes() const;

  private:
    struct Memory;
    std::unique_ptr<Memory> memory_;
};

}  // namespace keratin
