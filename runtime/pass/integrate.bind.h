// Buffers of the pass integrate, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_INTEGRATE(X) \
    X(position, float, update)    \
    X(previous, float, update)    \
    X(root, float, read)          \
    X(scratch, float, update)     \
    X(quad_state, uint, update)
