// Buffers of the pass skin, for C++ and GLSL: X(buffer, element, access).
#define KERATIN_BIND_SKIN(X)      \
    X(root, float, write)         \
    X(strand_root, float, write)  \
    X(bone_pose, float, read)     \
    X(mesh_position, float, read) \
    X(triangle_slot, uint, read)
