// Buffers of the pass grid_scatter, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_GRID_SCATTER(X) \
    X(position, float, read)         \
    X(previous, float, read)         \
    X(grid_sum, int64_t, add)        \
    X(grid_brick, uint, write)
