#include "runtime/rod/rod_pass.h"

#include "runtime/lane/choose_kernels.h"

namespace keratin {

KERATIN_DECLARE_KERNEL_SETS(RodPasses, rod_passes);

const RodPasses& rod_passes(InstructionSet wanted) {
    return KERATIN_CHOOSE_KERNELS(wanted, rod_passes);
}

}  // namespace keratin
