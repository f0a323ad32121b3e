// Runs robustness cases on any solver and judges what it measures: the solver only says where its
// points are, this file decides whether that is right. A solver takes part by a StressSolver
// (stability_strand.cpp, stability_rod.cpp).
#pragma once

#include "tools/keratin-report/case.h"
#include "tools/keratin-report/stress.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace keratin::report {

struct StressEnergy {
    double kinetic = 0, elastic = 0, potential = 0;  // J; potential of gravity
    double total() const { return kinetic + elastic + potential; }
};

// Where everything that is prescribed is at the end of a step.
struct StressStep {
    double h = 0;                    // s
    RigidTransform root;             // of all strands: initial place to world
    Double3 turn{};                  // rad: rotation of the root over the step, any angle
    std::span<const Double3> solids;  // places of Stress::solids
};

// One running simulation.
class StressRun {
  public:
    virtual ~StressRun() = default;
    virtual Result<void> step(const StressStep& step) = 0;

    virtual std::vector<Double3> points(std::size_t strand) const = 0;      // m, world
    virtual std::vector<Double3> velocities(std::size_t strand) const = 0;  // m/s
    virtual std::vector<double> masses(std::size_t strand) const = 0;       // kg
    // How far the root and its frame are from where they were told to be: m or rad, the larger.
    virtual double root_error(std::size_t strand, const RigidTransform& root) const = 0;
    // The solver's own energy, its parts taken at the same time.
    virtual StressEnergy energy() const = 0;
    // J that the roots have put in, where the solver knows; otherwise it follows from the momentum.
    virtual std::optional<double> work() const { return {}; }
    // Strands that the solver had to put back, leave behind or give up, since the start.
    virtual std::uint64_t given_up() const = 0;

    // Writes NaN into a vertex's state, as a fault of memory would.
    virtual void spoil(std::size_t strand, std::size_t vertex) = 0;
    virtual std::vector<std::byte> save() const = 0;
    virtual Result<void> load(std::span<const std::byte> state) = 0;
};

struct StressSolver {
    const char* name;
    // The root is exact to this, m; of its distance from the origin where that is larger than 1 m.
    double root_tolerance;
    // What a case asks of float64 (paths of two runs alike) is multiplied by this; and no shape is
    // asked to be closer to its rest than `resolution` of the length.
    double rounding, resolution;
    // Vertices that are prescribed: 1, or 2 with the first segment. The strand is clamped at the last
    // of them.
    std::size_t prescribed;
    // Errors: unsupported = the solver cannot express this (message says why), input = refused.
    std::function<Result<std::unique_ptr<StressRun>>(const Stress& stress, int threads)> create;
};

// nullptr: no such solver.
const StressSolver* find_stress_solver(const std::string& name);
const StressSolver& strand_stress_solver();
const StressSolver& rod_stress_solver();

Outcome run_stress(const StressCase& test, const StressSolver& solver);

}  // namespace keratin::report
