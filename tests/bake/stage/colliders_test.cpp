#include "bake/stage/colliders.h"

#include "tests/bake/stage/shapes.h"

#include <catch2/catch.hpp>

using namespace keratin;

namespace {

double outside(const Vec3& p, const std::vector<AssetCollider>& colliders) {
    double least = 1e300;
    for (const AssetCollider& c : colliders) {
        const Vec3 a(c.a[0], c.a[1], c.a[2]), b(c.b[0], c.b[1], c.b[2]);
        const Vec3 e = b - a;
        double t = e.squaredNorm() > 0 ? (p - a).dot(e) / e.squaredNorm() : 0;
        t = std::min(1.0, std::max(0.0, t));
        least = std::min(least, (p - a - t * e).norm() - c.radius);
    }
    return least;
}

}  // namespace

TEST_CASE("a round head is filled by few colliders that barely stand out") {
    const RawMesh mesh = test::sphere_mesh({0.2, 1.5, 0}, 0.1, 40);
    const Groom groom = test::hairy_sphere({0.2, 1.5, 0}, 0.1, 500, 8, 0.25);
    Findings findings;
    const ColliderFit fit = fit_colliders(mesh, groom, {}, findings);
    REQUIRE_FALSE(fit.colliders.empty());
    CHECK(fit.colliders.size() <= 4);
    CHECK(fit.measured.outside.max < 0.0021);
    CHECK(fit.measured.gap.max < 0.0006);
    for (std::size_t v = 0; v < mesh.position.size(); v += 7) {
        CHECK(outside(mesh.position[v], fit.colliders) < 0.0006);
    }
}

TEST_CASE("colliders cover an egg and a ball on it, and leave the far side of the body alone") {
    RawMesh mesh = test::sphere_mesh({0, 0, 0}, 1, 48);
    for (Vec3& p : mesh.position) p = p.cwiseProduct(Vec3(0.07, 0.11, 0.09));
    const Groom groom = [&] {
        Groom g = test::hairy_sphere({0, 0, 0}, 1, 400, 4, 0.2);
        for (Vec3& p : g.position) p = p.cwiseProduct(Vec3(0.07, 0.11, 0.09));
        return g;
    }();
    Findings findings;
    const ColliderFit fit = fit_colliders(mesh, groom, {}, findings);
    CHECK(fit.measured.outside.max < 0.0021);
    CHECK(fit.measured.gap.p95 < 0.0006);
    CHECK(fit.colliders.size() < 60);

    // A single short strand on the top reaches only what is near.
    const Groom tuft = test::groom_of({{{0, 0.11, 0}, {0, 0.14, 0}}});
    const ColliderFit near = fit_colliders(mesh, tuft, {}, findings);
    REQUIRE_FALSE(near.colliders.empty());
    CHECK(outside({0, 0.11, 0}, near.colliders) < 0.0006);
    CHECK(near.colliders.size() < fit.colliders.size());
}
