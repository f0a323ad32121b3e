#include "runtime/lane/instruction_set.h"

#include <algorithm>

namespace keratin {

InstructionSet usable_instruction_set(InstructionSet wanted) {
#if defined(__x86_64__)
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") &&
                        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
                        __builtin_cpu_supports("avx512vl");
    const InstructionSet widest = avx512 ? InstructionSet::avx512
                                  : avx2 ? InstructionSet::avx2
                                         : InstructionSet::baseline;
#else
    const InstructionSet widest = InstructionSet::baseline;
#endif
    return wanted == InstructionSet::automatic ? widest : std::min(wanted, widest);
}

}  // namespace keratin
