// Buffers of the pass stretch, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_STRETCH(X) \
    X(position, float, update)  \
    X(previous, float, update)  \
    X(scratch, float, update)
