// Buffers of the pass grid_resolve, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_GRID_RESOLVE(X) \
    X(grid_sum, int64_t, read)       \
    X(grid_brick, uint, read)        \
    X(grid_field, float, write)
