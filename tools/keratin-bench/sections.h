// The sections of keratin-bench. A new one is a function here, a line in the table and a source
// file.
#pragma once

#include "tools/keratin-bench/bench.h"

namespace keratin::bench {

void strand_section(Report& report);
void rod_section(Report& report);

struct Section {
    const char* name;
    const char* what;
    void (*run)(Report&);
};

inline constexpr Section kSections[] = {
    {"strand", "the strand solver: constraints, grid, interpolation, whole frames", strand_section},
#ifdef KERATIN_WITH_ROD
    {"rod", "the rod solver without contact: quasi-Newton steps", rod_section},
#endif
};

}  // namespace keratin::bench
