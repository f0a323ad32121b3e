#define KERATIN_ISA avx2
#include "runtime/contact/search_lanes.h"

namespace keratin {

extern const SearchKernels search_kernels_avx2;
const SearchKernels search_kernels_avx2 = avx2::kSearchKernels;

}  // namespace keratin
