#define KERATIN_ISA avx2
#include "runtime/contact/search_lanes.h"
