#include "bake/stage/size.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstdio>

namespace keratin {
namespace {

constexpr double kShortestHair = 0.001, kLongestHair = 3;  // m, 95th percentile
constexpr double kSmallestBody = 0.01, kLargestBody = 20;  // m, largest extent

std::array<double, 3> extents(const Eigen::AlignedBox3d& box) {
    if (box.isEmpty()) return {0, 0, 0};
    const Vec3 size = box.sizes();
    return {size.x(), size.y(), size.z()};
}

void judge(const char* what, double size, double least, double most, Findings& findings) {
    if (size >= least && size <= most) return;
    char text[160];
    std::snprintf(text, sizeof text,
                  "%s: %.4g m, where %g to %g m are plausible; check scale and up_axis", what, size,
                  least, most);
    findings.push_back({Rule::size, "", text, {}});
}

}  // namespace

void measure_sizes(const Groom& groom, const RawMesh* mesh, const GrowthSurfaces& surfaces,
                   BakeReport& report, Findings& findings) {
    Eigen::AlignedBox3d hair, body, whole;
#pragma omp parallel
    {
        Eigen::AlignedBox3d own;
#pragma omp for schedule(static) nowait
        for (std::size_t i = 0; i < groom.position.size(); ++i) own.extend(groom.position[i]);
#pragma omp critical
        hair.extend(own);
    }
    report.length = spread_of(strand_lengths(groom));
    report.hair_size = extents(hair);
    judge("length of the strands", report.length.p95, kShortestHair, kLongestHair, findings);
    if (mesh == nullptr) return;
    for (const Vec3& p : mesh->position) whole.extend(p);
    for (std::uint32_t t : surfaces.triangles) {
        for (std::uint32_t v : mesh->triangle[t]) body.extend(mesh->position[v]);
    }
    report.body_size = extents(body);
    report.mesh_size = extents(whole);
    judge("size of the body", body.sizes().maxCoeff(), kSmallestBody, kLargestBody, findings);
}

}  // namespace keratin
