// Buffers of the pass carry, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_CARRY(X)        \
    X(strand_root, float, read)      \
    X(strand_position, float, write) \
    X(strand_tangent, float, write)  \
    X(strand_previous, float, read)
