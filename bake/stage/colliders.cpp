#include "bake/stage/colliders.h"

#include "bake/stage/mesh_tree.h"
#include "bake/stage/random.h"

#include <Eigen/Geometry>
#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace keratin {
namespace {

constexpr std::size_t kSurfaceSamples = 16000;
constexpr std::size_t kCandidates = 4000;
constexpr std::size_t kMostSpheres = 96;
constexpr double kLargestBulge = 0.002;  // m
constexpr double kBulgeShare = 0.01;     // of the smallest extent of the reachable body
constexpr double kGapShare = 0.25;       // of the bulge: a sample this far out is still covered
constexpr double kNegligible = 0.0005;   // share of the samples for which no sphere is added
constexpr int kShrinkSteps = 40;
constexpr std::size_t kSpherePoints = 256;  // at which a sphere's surface is measured
constexpr double kNoticedGap = 0.001;       // m, worth a warning

struct Sample {
    Vec3 position, normal;
};

class PointTree {
  public:
    explicit PointTree(const std::vector<Vec3>& points)
        : cloud_{points}, tree_(3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}
    std::uint32_t nearest(const Vec3& p) const {
        std::uint32_t index = 0;
        double squared = 0;
        tree_.knnSearch(p.data(), 1, &index, &squared);
        return index;
    }

  private:
    struct Cloud {
        const std::vector<Vec3>& points;
        std::size_t kdtree_get_point_count() const { return points.size(); }
        double kdtree_get_pt(std::size_t i, std::size_t k) const {
            return points[i][static_cast<int>(k)];
        }
        template <class Box>
        bool kdtree_get_bbox(Box&) const {
            return false;
        }
    };
    Cloud cloud_;
    nanoflann::KDTreeSingleIndexAdaptor<
        nanoflann::L2_Simple_Adaptor<double, Cloud, double, std::uint32_t>, Cloud, 3, std::uint32_t>
        tree_;
};

// Samples spread over the triangles in proportion to their area; within a triangle by the R2
// sequence folded into it.
std::vector<Sample> sample_surface(const RawMesh& mesh, const std::vector<std::uint32_t>& triangles,
                                   std::size_t wanted) {
    const auto area_of = [&](std::uint32_t t) {
        const auto& c = mesh.triangle[t];
        return 0.5 * (mesh.position[c[1]] - mesh.position[c[0]])
                         .cross(mesh.position[c[2]] - mesh.position[c[0]])
                         .norm();
    };
    double total = 0;
    for (std::uint32_t t : triangles) total += area_of(t);
    std::vector<Sample> out;
    if (!(total > 0)) return out;
    double owed = 0.5;
    std::size_t k = 0;
    for (std::uint32_t t : triangles) {
        owed += area_of(t) / total * static_cast<double>(wanted);
        const auto& c = mesh.triangle[t];
        const Vec3 normal = triangle_normal(mesh, t);
        for (; owed >= 1; owed -= 1, ++k) {
            // Plastic number: 1/1.3247..., its square.
            double u = std::fmod(0.5 + 0.7548776662466927 * static_cast<double>(k), 1.0);
            double v = std::fmod(0.5 + 0.5698402909980532 * static_cast<double>(k), 1.0);
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            out.push_back({(1 - u - v) * mesh.position[c[0]] + u * mesh.position[c[1]] +
                               v * mesh.position[c[2]],
                           normal});
        }
    }
    return out;
}

// Centre of the largest ball that touches the surface at `sample` from inside and holds no other.
Vec3 medial_centre(const Sample& sample, const std::vector<Vec3>& points, const PointTree& tree,
                   double largest) {
    double radius = largest;
    for (int step = 0; step < kShrinkSteps; ++step) {
        const Vec3 centre = sample.position - radius * sample.normal;
        const Vec3& q = points[tree.nearest(centre)];
        const Vec3 d = sample.position - q;
        const double along = d.dot(sample.normal);
        if ((q - centre).norm() >= radius * (1 - 1e-6) || along <= 0) return centre;
        radius = d.squaredNorm() / (2 * along);
    }
    return sample.position - radius * sample.normal;
}

struct Ball {
    Vec3 centre;
    double radius;
};

// Indices of the samples that each ball covers.
std::vector<std::vector<std::uint32_t>> covered_by(const std::vector<Ball>& balls,
                                                   const std::vector<Sample>& samples, double gap) {
    std::vector<std::vector<std::uint32_t>> out(balls.size());
#pragma omp parallel for schedule(dynamic, 32)
    for (std::size_t b = 0; b < balls.size(); ++b) {
        const double reach = balls[b].radius + gap;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            if ((samples[i].position - balls[b].centre).squaredNorm() <= reach * reach) {
                out[b].push_back(static_cast<std::uint32_t>(i));
            }
        }
    }
    return out;
}

std::vector<Ball> greedy_cover(const std::vector<Ball>& balls, const std::vector<Sample>& samples,
                               double gap) {
    const auto covered = covered_by(balls, samples, gap);
    std::vector<std::uint8_t> done(samples.size(), 0);
    std::vector<std::size_t> gain(balls.size());
    for (std::size_t b = 0; b < balls.size(); ++b) gain[b] = covered[b].size();
    const auto least =
        static_cast<std::size_t>(std::max(1.0, kNegligible * static_cast<double>(samples.size())));
    std::vector<Ball> out;
    while (out.size() < kMostSpheres) {
        // Gains only fall: an entry that is still the best after being counted anew is the best.
        std::size_t best = balls.size();
        std::size_t most = 0;
        for (std::size_t b = 0; b < balls.size(); ++b) {
            if (gain[b] <= most) continue;
            gain[b] = static_cast<std::size_t>(std::count_if(
                covered[b].begin(), covered[b].end(), [&](std::uint32_t i) { return !done[i]; }));
            if (gain[b] > most) {
                most = gain[b];
                best = b;
            }
        }
        if (best == balls.size() || most < least) break;
        out.push_back(balls[best]);
        for (std::uint32_t i : covered[best]) done[i] = 1;
    }
    return out;
}

// How far a point stands outside the union of the balls; negative inside.
double outside_balls(const Vec3& p, const std::vector<Ball>& balls) {
    double least = std::numeric_limits<double>::infinity();
    for (const Ball& ball : balls) least = std::min(least, (p - ball.centre).norm() - ball.radius);
    return least;
}

// Points spread evenly over a unit sphere (Fibonacci lattice).
Vec3 sphere_point(std::size_t i, std::size_t count) {
    const double y = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double r = std::sqrt(1 - y * y);
    const double angle = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    return {r * std::cos(angle), y, r * std::sin(angle)};
}

std::uint32_t bone_at(const Vec3& p, const RawMesh& mesh, const MeshTree& tree, const Groom& groom,
                      const Carriers& carriers) {
    if (carriers.bone.empty()) return 0;
    if (mesh.skin) {
        const NearestTriangle near = tree.nearest(p);
        const auto& weight = near.at.barycentric;
        const auto heaviest = static_cast<std::size_t>(
            std::max_element(weight.begin(), weight.end()) - weight.begin());
        const std::uint32_t v = mesh.triangle[near.triangle][heaviest];
        const auto& w = mesh.skin->weight[v];
        const auto k = static_cast<std::size_t>(std::max_element(w.begin(), w.end()) - w.begin());
        const std::string& name = mesh.skin->bones[mesh.skin->bone[v][k]];
        const auto at = std::find(carriers.bones.begin(), carriers.bones.end(), name);
        if (at != carriers.bones.end()) {
            return static_cast<std::uint32_t>(at - carriers.bones.begin());
        }
    }
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t s = 0; s < groom.strand_count(); ++s) {
        const double d = (groom.points(s).front() - p).squaredNorm();
        if (d < least) {
            least = d;
            nearest = s;
        }
    }
    return carriers.bone[nearest][0];
}

}  // namespace

ColliderFit fit_colliders(const RawMesh& mesh, const Groom& groom, const Carriers& carriers,
                          Findings& findings) {
    ColliderFit out;
    std::vector<std::uint32_t> all;
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
        if (!triangle_normal(mesh, t).isZero()) all.push_back(t);
    }
    const MeshTree tree(mesh, all);
    const std::vector<Sample> surface = sample_surface(mesh, all, kSurfaceSamples);
    std::vector<Vec3> points;
    for (const Sample& s : surface) points.push_back(s.position);
    const PointTree point_tree(points);

    // Longest strand that is rooted near each sample; a strand reaches what is nearer to its root
    // than its length. Roots are thinned to those that differ.
    std::vector<std::uint8_t> reached(surface.size(), 0);
    {
        std::vector<Ball> roots;
        const std::size_t step = std::max<std::size_t>(1, groom.strand_count() / 2000);
        for (std::size_t s = 0; s < groom.strand_count(); s += step) {
            roots.push_back({groom.points(s).front(), polyline_length(groom.points(s))});
        }
#pragma omp parallel for schedule(static)
        for (std::size_t i = 0; i < surface.size(); ++i) {
            for (const Ball& root : roots) {
                if ((surface[i].position - root.centre).squaredNorm() <=
                    root.radius * root.radius) {
                    reached[i] = 1;
                    break;
                }
            }
        }
    }
    Eigen::AlignedBox3d body;
    for (std::size_t i = 0; i < surface.size(); ++i) {
        if (reached[i]) body.extend(surface[i].position);
    }
    if (body.isEmpty()) return out;
    const double bulge = std::min(kLargestBulge, kBulgeShare * body.sizes().minCoeff());
    const double gap = kGapShare * bulge;

    // Surface that lies inside another part (teeth, the back of an eye) cannot be touched.
    std::vector<Sample> wanted;
    for (std::size_t i = 0; i < surface.size(); ++i) {
        if (reached[i] && !tree.inside(surface[i].position + bulge * surface[i].normal)) {
            wanted.push_back(surface[i]);
        }
    }

    std::vector<Ball> candidates;
    {
        std::vector<std::uint32_t> from(wanted.size());
        std::iota(from.begin(), from.end(), 0u);
        const std::size_t count = std::min(kCandidates, from.size());
        Random(1).choose_first(std::span(from), count);
        std::vector<Ball> found(count);
        const double largest = body.diagonal().norm();
#pragma omp parallel for schedule(dynamic, 32)
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3 centre = medial_centre(wanted[from[i]], points, point_tree, largest);
            found[i] = {centre, bulge - tree.signed_distance(centre)};
        }
        for (const Ball& ball : found) {
            if (ball.radius > bulge) candidates.push_back(ball);
        }
    }
    const std::vector<Ball> chosen = greedy_cover(candidates, wanted, gap);
    if (chosen.empty()) return out;

    std::vector<double> outside, sticking;
    for (const Ball& ball : chosen) {
        AssetCollider collider;
        for (int k = 0; k < 3; ++k) {
            collider.a[static_cast<std::size_t>(k)] = static_cast<float>(ball.centre[k]);
        }
        collider.b = collider.a;
        collider.radius = static_cast<float>(ball.radius);
        collider.bone = bone_at(ball.centre, mesh, tree, groom, carriers);
        out.colliders.push_back(collider);
        for (std::size_t i = 0; i < kSpherePoints; ++i) {
            const Vec3 p = ball.centre + ball.radius * sphere_point(i, kSpherePoints);
            if (outside_balls(p, chosen) < -1e-9) continue;
            outside.push_back(std::max(0.0, tree.signed_distance(p)));
        }
    }
    for (const Sample& sample : wanted) {
        sticking.push_back(std::max(0.0, outside_balls(sample.position, chosen)));
    }
    out.measured.count = chosen.size();
    out.measured.outside = spread_of(std::move(outside));
    out.measured.gap = spread_of(std::move(sticking));
    if (out.measured.gap.max > kNoticedGap) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "the mesh sticks out of the colliders by up to %.1f mm (95 %% of it by less "
                      "than %.2f mm)",
                      1000 * out.measured.gap.max, 1000 * out.measured.gap.p95);
        findings.push_back({Rule::collider_gap, mesh.file, text, {}});
    }
    return out;
}

}  // namespace keratin
