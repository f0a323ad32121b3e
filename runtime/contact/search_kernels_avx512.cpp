#define KERATIN_ISA avx512
#include "runtime/contact/search_lanes.h"
