// Runs a contact scene and judges it: overlaps by tools/measure/strand_distance, energy, the
// Coulomb residual, the share of steps at the cap (METHODS 2.10).
#pragma once

#include "tools/scenes/contact_scenes.h"

namespace keratin::scenes {

enum class Contacts { on, off };

struct ContactQuality {
    std::uint64_t steps = 0;
    double worst_share = 0;  // largest overlap of two strands at the end of a step, share of delta
    double worst_solid_share = 0;         // the same against the solids
    std::uint64_t overlapping_pairs = 0;  // pairs deeper than 1 % of delta, summed over steps
    double energy_rise = 0;   // J: largest rise of kinetic + elastic + potential energy in a step
    double energy_scale = 0;  // J: range of the energy over the run, largest - smallest
    double mean_contacts = 0;
    std::size_t most_contacts = 0;
    double mean_residual = 0,
           worst_residual = 0;  // of the steps' mean |f_FB|, steps at the cap left out
    std::uint64_t steps_at_cap = 0, steps_halved = 0;
    double mean_iterations = 0;
    double wall_seconds = 0;  // in step()
    double last_speed = 0;    // m/s, largest of any point at the end
    double tip_fall = 0;      // m, how far the last strand's last point moved
};

// measure_every: steps between measurements of overlap.
ContactQuality run_contact_scene(const ContactScene& scene, Contacts contacts,
                                 std::uint64_t measure_every = 1);

}  // namespace keratin::scenes
