#include "runtime/rod/rod_pass_lanes.h"

namespace keratin {

extern const RodPasses rod_passes_baseline;
const RodPasses rod_passes_baseline = make_passes<Double1>();

}  // namespace keratin
