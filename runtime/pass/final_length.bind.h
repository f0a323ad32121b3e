// Buffers of the pass final_length, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_FINAL_LENGTH(X) \
    X(position, float, update)       \
    X(previous, float, update)
