// How the iterations of a step converge, from the figures of a run to a chart (METHODS 2.10, 4-11).
#pragma once

#include "schema/result.h"
#include "tools/chart/chart.h"

#include <optional>
#include <string>
#include <vector>

namespace keratin::report {

// One entry an iteration of a run's last step.
struct Convergence {
    std::vector<double> dv;                   // m/s, mean change of the velocities
    std::vector<double> dr;                   // N s, mean change of the impulses
    std::vector<std::optional<double>> f_fb;  // mean Coulomb residual; absent without contact
};

// Reads what keratin-run --convergence --stats FILE wrote. Errors: io when the file cannot be read;
// input, with the place in it, when it is not JSON, holds no "convergence" or no iteration, or a
// value is no number >= 0.
Result<Convergence> read_convergence(const std::string& path);

// All three over the number of the iteration, on a logarithmic axis; what no iteration has is left
// out.
chart::Chart convergence_chart(const Convergence& convergence, const std::string& title);

}  // namespace keratin::report
