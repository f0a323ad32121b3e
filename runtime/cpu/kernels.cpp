// The table of one instruction set's kernels; compiled once for each, like the passes.
#include "runtime/cpu/kernels.h"

namespace keratin {
namespace KERATIN_ISA {
KERATIN_DECLARE_KERNELS

const KernelTable& table() {
    static constexpr KernelTable kernels{
#define X(result, name, parameters) &name,
        KERATIN_KERNELS(X)
#undef X
    };
    return kernels;
}

}  // namespace KERATIN_ISA
}  // namespace keratin
