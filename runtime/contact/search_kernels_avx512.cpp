#define KERATIN_ISA avx512
#include "runtime/contact/search_lanes.h"

namespace keratin {

extern const SearchKernels search_kernels_avx512;
const SearchKernels search_kernels_avx512 = avx512::kSearchKernels;

}  // namespace keratin
