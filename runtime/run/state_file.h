// A run put aside: what --save writes and --resume reads. Bound to the scene's solver, its assets
// and its steps; a resumed run goes on bit for bit as the unbroken one.
#pragma once

#include "runtime/run/solver_run.h"

#include <cstdint>
#include <string>

namespace keratin {

struct SavedRun {
    std::uint64_t steps = 0;            // done so far
    std::uint64_t steps_per_frame = 0;  // of the run that was saved
    double frame = 0;                   // s
    std::vector<std::byte> state;       // of the solver
};

// Errors: io.
Result<void> save_run(const std::string& path, const SavedRun& saved, const RunLayout& layout);
// Errors: io; input when the file is no saved run, is damaged, or belongs to another scene.
Result<SavedRun> load_run(const std::string& path, const RunLayout& layout);

}  // namespace keratin
