// The sections of keratin-bench. A new one is a function here, a line in the table and a source
// file.
#pragma once

#include "tools/keratin-bench/bench.h"

namespace keratin::bench {

void strand_section(Report& report);
void rod_section(Report& report);
void rod_scaling_section(Report& report);
void contact_section(Report& report);
void contact_methods_section(Report& report);
void hairball_section(Report& report);
void bake_section(Report& report);
void diff_section(Report& report);

struct Section {
    const char* name;
    const char* what;
    void (*run)(Report&);
    bool on_request = false;  // only where it is named
};

inline constexpr Section kSections[] = {
    {"strand", "the strand solver: constraints, grid, interpolation, whole frames", strand_section},
#ifdef KERATIN_WITH_ROD
    {"rod", "the rod solver without contact: quasi-Newton steps", rod_section},
    {"rod-scaling", "how the rod solver's time grows with strands and vertices",
     rod_scaling_section, true},
    {"contact", "contact: broad and narrow phase, Gauss-Seidel sweeps", contact_section},
    {"contact-methods", "time against error of both contact methods on the bundles",
     contact_methods_section, true},
    {"hairball", "steps of the hairball while it turns (takes minutes to get there)",
     hairball_section, true},
#endif
#ifdef KERATIN_WITH_BAKE
    {"bake", "keratin-bake: CPU time and memory, real and synthetic grooms", bake_section},
    {"diff", "keratin-diff: CPU time on large assets", diff_section},
#endif
};

}  // namespace keratin::bench
