// Buffers of the pass collide, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_COLLIDE(X) \
    X(position, float, update)  \
    X(previous, float, read)    \
    X(collider, float, read)
