#include "runtime/pass/pass.h"
#include "schema/read/scene.h"
#include <Eigen/Core>
#include <vector>
#include "rod.h"
