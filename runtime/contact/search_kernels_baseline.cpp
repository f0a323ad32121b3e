#define KERATIN_ISA baseline
#include "runtime/contact/search_lanes.h"
