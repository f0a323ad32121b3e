#include "runtime/contact/search_kernels.h"

#include "runtime/lane/choose_kernels.h"

namespace keratin {

KERATIN_DECLARE_KERNEL_SETS(SearchKernels, search_kernels);

const SearchKernels& search_kernels(InstructionSet wanted) {
    return KERATIN_CHOOSE_KERNELS(wanted, search_kernels);
}

}  // namespace keratin
