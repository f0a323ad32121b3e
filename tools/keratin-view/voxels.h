// Hair on a grid of voxels, as the friction and volume passes see it (METHODS 1.2), but worked out
// from the positions alone: for any solver, and apart from the solver's own grid.
#pragma once

#include "tools/keratin-view/subject.h"

#include <span>
#include <vector>

namespace keratin::view {

struct VoxelValues {
    std::vector<float> velocity;  // [points * 3] m/s, mean of the voxels around each point
    std::vector<float> share;     // [points] of the space there that hair fills, 0..1
};

// Every point brings its share of the strand's volume to the eight voxels around it; what they hold
// is read back at the points the same way.
//   velocity  [points * 3] m/s of the points; empty: at rest
//   spacing   m, > 0, side of a voxel
VoxelValues voxel_values(const SubjectStrands& strands, std::span<const float> velocity,
                         float spacing);

// The side of a voxel when the longest side of the box around the strands has 48, the solver's
// default.
float voxel_spacing(const SubjectStrands& strands);

// Gives the hair of frame i its velocity and density on the grid, unless the run stored them.
// Velocities are those of the points since the frame before (for the first, until the next).
// Errors: those of CacheReader::frame.
Result<void> add_voxel_values(const Source& source, std::size_t i, Subject& subject);

}  // namespace keratin::view
