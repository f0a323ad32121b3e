#include "runtime/rod/rod_pass_lanes.h"

namespace keratin {

extern const RodPasses rod_passes_avx512;
const RodPasses rod_passes_avx512 = make_passes<Double8>();

}  // namespace keratin
