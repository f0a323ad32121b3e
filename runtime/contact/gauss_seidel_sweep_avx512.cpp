#include "runtime/contact/gauss_seidel_sweep_lanes.h"

namespace keratin {

extern const SweepKernels sweep_kernels_avx512;
const SweepKernels sweep_kernels_avx512 = make_kernels<Double8>();

}  // namespace keratin
