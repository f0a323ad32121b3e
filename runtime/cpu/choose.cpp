#include "runtime/cpu/kernels.h"

namespace keratin {

namespace baseline {
const KernelTable& table();
}
#if defined(__x86_64__)
namespace avx2 {
const KernelTable& table();
}
namespace avx512 {
const KernelTable& table();
}
#endif

const KernelTable& kernels_of(InstructionSet set) {
#if defined(__x86_64__)
    if (set == InstructionSet::avx512) return avx512::table();
    if (set == InstructionSet::avx2) return avx2::table();
#endif
    (void)set;
    return baseline::table();
}

}  // namespace keratin
