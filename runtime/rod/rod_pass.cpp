#include "runtime/rod/rod_pass.h"

namespace keratin {

extern const RodPasses rod_passes_baseline, rod_passes_avx2, rod_passes_avx512;

const RodPasses& rod_passes(InstructionSet wanted) {
#if defined(__x86_64__)
    switch (usable_instruction_set(wanted)) {
        case InstructionSet::avx512: return rod_passes_avx512;
        case InstructionSet::avx2: return rod_passes_avx2;
        default: break;
    }
#else
    (void)wanted;
#endif
    return rod_passes_baseline;
}

}  // namespace keratin
