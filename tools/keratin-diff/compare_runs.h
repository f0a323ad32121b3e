// Compares two cached runs (*.kcache): frames by their place in the cache, points by their index.
#pragma once

#include "schema/cache.h"
#include "schema/result.h"
#include "tools/keratin-diff/compare.h"
#include "tools/keratin-diff/judge.h"

#include <string>
#include <vector>

namespace keratin::diff {

// Something of a run, compared frame by frame.
struct RunDifference {
    std::string name;                         // as run_subjects()
    std::string_view unit;                    // of value and spread; "" for counts
    std::size_t compared = 0, differing = 0;  // items over all frames
    Spread spread;                            // numbers; p99 to 1 %
    std::string worst;  // "frame 12 render strand 3 point 5: (0, 0, 0) -> (0, 0, 1)"
    std::string note;

    // What limits are compared with: the largest difference, or the number of items that differ.
    double value() const { return unit.empty() ? static_cast<double>(differing) : spread.max; }
};

// frames, strands, guide_position, strand_position, body_position, time, assets.
std::vector<Subject> run_subjects();

// All subjects in that order, also where nothing differs. Positions are compared only where both
// runs have the same strands. Errors (input): a damaged frame.
Result<std::vector<RunDifference>> compare_runs(const CacheReader& a, const CacheReader& b);

// One finding a subject; tolerances are made for run_subjects().
std::vector<Finding> judge(const std::vector<RunDifference>& differences,
                           const Tolerances& tolerances);

// As the function of the same name for assets: one line; empty where nothing differs.
std::string describe(const std::vector<RunDifference>& differences, const std::string& name);

// One JSON document (schema/report/keratin-diff-runs.schema.json).
std::string runs_json(const std::vector<RunDifference>& differences,
                      const std::vector<Finding>& findings, const std::string& a,
                      const std::string& b, bool passed, const std::string& version);

}  // namespace keratin::diff
