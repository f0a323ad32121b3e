// Chooses the kernels for an instruction set.
#pragma once

#include "runtime/lane/instruction_set.h"
#include "runtime/pass/kernel.h"

namespace keratin {

// `set` must not be automatic.
const KernelTable& kernels_of(InstructionSet set);

}  // namespace keratin
