#include "runtime/contact/gauss_seidel_sweep_lanes.h"

namespace keratin {

extern const SweepKernels sweep_kernels_baseline;
const SweepKernels sweep_kernels_baseline = make_kernels<Double1>();

}  // namespace keratin
