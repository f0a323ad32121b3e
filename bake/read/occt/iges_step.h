// Curves of IGES and STEP files, through OpenCASCADE. Only in builds with KERATIN_WITH_OCCT.
#pragma once

#include "bake/raw_groom.h"
#include "schema/result.h"

#include <string>

namespace keratin {

enum class CadFormat { iges, step };

// The free edges of a file as NURBS curves, in its order, in millimetres whatever unit it is in
// (metres_per_unit says so). Edges of faces are passed over. Nothing is printed.
// Errors (input): the file cannot be read.
Result<RawGroom> read_cad_curves(const std::string& path, CadFormat format);

}  // namespace keratin
