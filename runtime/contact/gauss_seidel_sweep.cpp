#include "runtime/contact/gauss_seidel_sweep.h"

#include "runtime/lane/choose_kernels.h"

namespace keratin {

KERATIN_DECLARE_KERNEL_SETS(SweepKernels, sweep_kernels);

const SweepKernels& sweep_kernels(InstructionSet wanted) {
    return KERATIN_CHOOSE_KERNELS(wanted, sweep_kernels);
}

}  // namespace keratin
