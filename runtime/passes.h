// The table of passes: the name of each and the buffers it touches, out of runtime/pass/*.bind.h.
#pragma once

#include "runtime/plan.h"

#include <span>
#include <string_view>

namespace keratin {

struct PassEntry {
    PassId id;
    std::string_view name;
    std::span<const BufferId> buffers;
};

// In the order of PassId.
std::span<const PassEntry> pass_table();

}  // namespace keratin
