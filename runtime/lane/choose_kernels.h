// Kernels that are compiled once for each instruction set stand in constants of one name with the
// endings _baseline, _avx2 and _avx512, the last two on x86-64 alone.
#pragma once

#include "runtime/lane/instruction_set.h"

#if defined(__x86_64__)
#define KERATIN_DECLARE_KERNEL_SETS(type, name) \
    extern const type name##_baseline, name##_avx2, name##_avx512
// The ones that `wanted` comes to on this processor.
#define KERATIN_CHOOSE_KERNELS(wanted, name) \
    ::keratin::choose_kernels(wanted, name##_baseline, name##_avx2, name##_avx512)
#else
#define KERATIN_DECLARE_KERNEL_SETS(type, name) extern const type name##_baseline
#define KERATIN_CHOOSE_KERNELS(wanted, name) (static_cast<void>(wanted), name##_baseline)
#endif

namespace keratin {

template <class Kernels>
const Kernels& choose_kernels(InstructionSet wanted, const Kernels& baseline, const Kernels& avx2,
                              const Kernels& avx512) {
    switch (usable_instruction_set(wanted)) {
        case InstructionSet::avx512:
            return avx512;
        case InstructionSet::avx2:
            return avx2;
        default:
            return baseline;
    }
}

}  // namespace keratin
