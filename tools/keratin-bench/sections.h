// The sections of keratin-bench. A new one is a function here, a line in the table and a source
// file.
#pragma once

#include "tools/keratin-bench/bench.h"

namespace keratin::bench {

void strand_section(Report& report);

struct Section {
    const char* name;
    const char* what;
    void (*run)(Report&);
};

inline constexpr Section kSections[] = {
    {"strand", "the strand solver: constraints, grid, interpolation, whole frames", strand_section},
};

}  // namespace keratin::bench
