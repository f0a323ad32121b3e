// Which axis of a file points up.
#pragma once

namespace keratin {

enum class UpAxis { y, z, x };

}  // namespace keratin
