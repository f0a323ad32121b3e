// Counts calls of operator new in the test program; the definitions stand in a file of their own so
// that the compiler does not see through them.
#pragma once

namespace keratin::test {

long allocation_count();

}  // namespace keratin::test
