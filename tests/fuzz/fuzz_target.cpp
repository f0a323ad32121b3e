// One libFuzzer program a reader: KERATIN_FUZZ_TARGET is the function of readers.h that it runs.
#include "tests/fuzz/readers.h"

#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    keratin::fuzz::KERATIN_FUZZ_TARGET({reinterpret_cast<const char*>(data), size});
    return 0;
}
