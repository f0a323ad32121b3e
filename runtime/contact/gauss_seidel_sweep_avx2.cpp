#include "runtime/contact/gauss_seidel_sweep_lanes.h"

namespace keratin {

extern const SweepKernels sweep_kernels_avx2;
const SweepKernels sweep_kernels_avx2 = make_kernels<Double4>();

}  // namespace keratin
