#include "tools/keratin-view/collider_mesh.h"

#include "schema/formula/quaternion.h"
#include "tools/keratin-view/float3.h"

#include <cmath>
#include <numbers>

namespace keratin::view {
namespace {

Float3 point(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }

void put(BodyMesh& mesh, Float3 p) {
    for (const float v : {p.x, p.y, p.z}) mesh.position.push_back(v);
}

// Two half spheres around a and b and the cone between them.
BodyMesh round(Float3 a, Float3 b, float radius) {
    constexpr int around = 36,
                  rings = 18;  // rings of a half sphere and its equator count once each
    const Float3 axis = length(b - a) > 0 ? normalized(b - a) : Float3{0, 1, 0};
    const Float3 s = perpendicular(axis), t = cross(axis, s);
    BodyMesh mesh;
    constexpr int levels = 2 * rings;
    for (int i = 0; i < levels; ++i) {
        // The equator is there twice, once at each end.
        const int step = i < rings ? i - rings + 1 : i - rings;
        const float angle = float(step) / (rings - 1) * std::numbers::pi_v<float> / 2;
        const Float3 center = i < rings ? a : b;
        for (int j = 0; j < around; ++j) {
            const float phi = 2 * std::numbers::pi_v<float> * j / around;
            put(mesh,
                center + radius * (std::sin(angle) * axis +
                                   std::cos(angle) * (std::cos(phi) * s + std::sin(phi) * t)));
        }
    }
    for (std::uint32_t i = 0; i + 1 < levels; ++i)
        for (std::uint32_t j = 0; j < around; ++j) {
            const std::uint32_t p = i * around + j, q = i * around + (j + 1) % around;
            for (const std::uint32_t v : {p, q, p + around, q, q + around, p + around})
                mesh.triangle.push_back(v);
        }
    return mesh;
}

}  // namespace

BodyMesh collider_mesh(const CacheCollider& collider, float reach) {
    const Float3 a = point(collider.a), b = point(collider.b);
    BodyMesh mesh;
    switch (collider.shape) {
        case CacheShape::sphere:
            return round(a, a, collider.radius);
        case CacheShape::capsule:
            return round(a, b, collider.radius);
        case CacheShape::plane: {
            const Float3 normal = normalized(b), s = perpendicular(normal), t = cross(normal, s);
            const float h = 0.5f * reach;
            for (const Float3 p :
                 {a - h * s - h * t, a + h * s - h * t, a + h * s + h * t, a - h * s + h * t})
                put(mesh, p);
            mesh.triangle = {0, 1, 2, 0, 2, 3};
            break;
        }
        case CacheShape::box: {
            const auto& q = collider.rotation;
            for (int axis = 0; axis < 3; ++axis)
                for (const float side : {-1.0f, 1.0f}) {
                    const std::uint32_t first = std::uint32_t(mesh.position.size() / 3);
                    for (const auto& [u, v] :
                         {std::array{-1.0f, -1.0f}, {1.0f, -1.0f}, {1.0f, 1.0f}, {-1.0f, 1.0f}}) {
                        const float local[3] = {side, u, v};
                        float own[3];
                        for (int c = 0; c < 3; ++c)
                            own[(axis + c) % 3] = local[c] * collider.b[(axis + c) % 3];
                        const Vec3<float> turned = rotate(Vec4<float>(q[0], q[1], q[2], q[3]),
                                                          Vec3<float>(own[0], own[1], own[2]));
                        put(mesh, a + Float3{turned.x, turned.y, turned.z});
                    }
                    for (const std::uint32_t k : {0u, 1u, 2u, 0u, 2u, 3u})
                        mesh.triangle.push_back(first + k);
                }
            break;
        }
    }
    return mesh;
}

}  // namespace keratin::view
