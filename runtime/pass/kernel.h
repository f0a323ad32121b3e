// Every pass that is compiled once per instruction set, and the table through which the rest of the
// program calls them. X(result, name, parameters).
#pragma once

#include "runtime/pass/grid.h"
#include "runtime/pass/quad.h"
#include "runtime/pass/strands.h"

#define KERATIN_KERNELS(X)                                                                  \
    X(void, small_steps, (Quad & quad, const SmallStep* steps, std::uint32_t count))        \
    X(std::uint64_t, check, (Quad & quad))                                                  \
    X(void, grid_scatter, (const Quad& quad, const ScatterInput& in, const GridSums& sums)) \
    X(void, grid_resolve,                                                                   \
      (const GridSums* threads, std::uint32_t thread_count, std::size_t brick,              \
       float displacement_unit, float* field))                                              \
    X(void, grid_gather, (Quad & quad, const GridView& grid))                               \
    X(void, grid_at_rest,                                                                   \
      (const Quad& quad, const ScatterInput& in, const GridView& grid, float* filling_rest))  \
    X(void, guide_lines, (const Quad& quad, float* lines))                                  \
    X(void, interpolate, (const StrandBatch& batch, std::uint32_t begin, std::uint32_t end))

namespace keratin {

struct KernelTable {
#define X(result, name, parameters) result(*name) parameters;
    KERATIN_KERNELS(X)
#undef X
};

}  // namespace keratin

#define KERATIN_DECLARE_KERNEL(result, name, parameters) result name parameters;
#define KERATIN_DECLARE_KERNELS KERATIN_KERNELS(KERATIN_DECLARE_KERNEL)
