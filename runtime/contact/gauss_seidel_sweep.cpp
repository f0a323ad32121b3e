#include "runtime/contact/gauss_seidel_sweep.h"

namespace keratin {

extern const SweepKernels sweep_kernels_baseline, sweep_kernels_avx2, sweep_kernels_avx512;

const SweepKernels& sweep_kernels(InstructionSet wanted) {
#if defined(__x86_64__)
    switch (usable_instruction_set(wanted)) {
        case InstructionSet::avx512:
            return sweep_kernels_avx512;
        case InstructionSet::avx2:
            return sweep_kernels_avx2;
        default:
            break;
    }
#else
    (void)wanted;
#endif
    return sweep_kernels_baseline;
}

}  // namespace keratin
