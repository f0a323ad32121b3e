// Which instruction set the lane kernels run on. Files that hold kernels are compiled once for each;
// the choice is made when a simulation is created.
#pragma once

namespace keratin {

// automatic: the widest that the processor and this build have.
enum class InstructionSet { automatic, baseline, avx2, avx512 };

// What `wanted` comes to on this processor: never automatic, and never more than it has.
InstructionSet usable_instruction_set(InstructionSet wanted);

}  // namespace keratin
