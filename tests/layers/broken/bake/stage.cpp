#include "runtime/pass/pass.h"
