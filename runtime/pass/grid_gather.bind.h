// Buffers of the pass grid_gather, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_GRID_GATHER(X) \
    X(position, float, read)        \
    X(previous, float, update)      \
    X(filling_rest, float, read)    \
    X(grid_field, float, read)
