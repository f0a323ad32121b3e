// Buffers of the pass interpolate, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_INTERPOLATE(X)  \
    X(position, float, read)         \
    X(root, float, read)             \
    X(strand_root, float, read)      \
    X(guide_line, float, update)     \
    X(strand_position, float, write) \
    X(strand_tangent, float, write)  \
    X(strand_previous, float, read)
