#define KERATIN_ISA baseline
#include "runtime/contact/search_lanes.h"

namespace keratin {

extern const SearchKernels search_kernels_baseline;
const SearchKernels search_kernels_baseline = baseline::kSearchKernels;

}  // namespace keratin
