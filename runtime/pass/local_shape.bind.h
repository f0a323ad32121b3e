// Buffers of the pass local_shape, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_LOCAL_SHAPE(X) \
    X(position, float, update)      \
    X(rest_edge, float, read)       \
    X(root, float, read)            \
    X(scratch, float, update)
