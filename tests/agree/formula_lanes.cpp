// The formulas over lanes; compiled once per instruction set, as the passes are.
#include "runtime/lane/lanes.h"
#include "tests/agree/formulas.h"

namespace keratin::KERATIN_ISA {

int lanes() { return Work::kLanes; }

// in [kInputs][lanes], out [kOutputs][lanes]
void evaluate_lanes(int formula, const float* in, float* out) {
    Work x[agree::kInputs], y[agree::kOutputs];
    for (int i = 0; i < agree::kInputs; ++i) x[i] = load<Work>(in + i * Work::kLanes, 16);
    agree::evaluate<Work>(formula, x, y);
    for (int i = 0; i < agree::kOutputs; ++i) store(y[i], out + i * Work::kLanes, 16);
}

}  // namespace keratin::KERATIN_ISA
