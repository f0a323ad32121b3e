#include "runtime/rod/rod_pass_lanes.h"

namespace keratin {

extern const RodPasses rod_passes_avx2;
const RodPasses rod_passes_avx2 = make_passes<Double4>();

}  // namespace keratin
