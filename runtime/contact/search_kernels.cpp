#include "runtime/contact/search_kernels.h"

namespace keratin {

namespace baseline {
const SearchKernels& search_kernels();
}
#if defined(__x86_64__)
namespace avx2 {
const SearchKernels& search_kernels();
}
namespace avx512 {
const SearchKernels& search_kernels();
}
#endif

const SearchKernels& search_kernels(InstructionSet wanted) {
#if defined(__x86_64__)
    switch (usable_instruction_set(wanted)) {
        case InstructionSet::avx512:
            return avx512::search_kernels();
        case InstructionSet::avx2:
            return avx2::search_kernels();
        default:
            break;
    }
#else
    (void)wanted;
#endif
    return baseline::search_kernels();
}

}  // namespace keratin
