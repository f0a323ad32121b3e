#include "bake/stage/colliders.h"

#include "bake/stage/mesh_tree.h"
#include "bake/stage/random.h"

#include <Eigen/Geometry>
#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <queue>

namespace keratin {
namespace {

constexpr std::size_t kSurfaceSamples = 10000;
constexpr std::size_t kMedialBalls = 1500;
constexpr std::size_t kPairs = 2, kPairTries = 60;  // capsules for each ball, and how hard to look
constexpr double kAlikeRadii = 0.6;                 // smaller radius over larger, at least
constexpr double kReachRadii = 3, kTooNearRadii = 0.2;
constexpr std::size_t kCorePoints = 12;  // places along a core at which the body is measured
constexpr std::size_t kMostColliders = 96;
constexpr double kLargestBulge = 0.002;  // m
constexpr double kBulgeShare = 0.01;     // of the smallest extent of the reachable body
constexpr double kGapShare = 0.25;       // of the bulge: a sample this far out is still covered
constexpr double kLargestProbe = 0.008;  // m
constexpr double kProbeShare = 0.04;     // of that extent
constexpr double kExposedShare = 0.98;   // of the probe's radius
constexpr std::size_t kWeighedRoots = 2000;
constexpr double kNegligible = 0.0002;  // share of the weight for which no sphere is added
constexpr int kShrinkSteps = 40;
constexpr std::size_t kSurfacePoints = 512;  // at which a collider's surface is measured
constexpr double kOnSurface = 1e-9;          // m
constexpr double kNoticedGap = 0.001;        // m, worth a warning

struct Sample {
    Vec3 position, normal;
    std::uint32_t triangle;
    double weight;  // how much hair can come here
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
                           normal, t, 0.0});
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

// A sphere when a == b.
struct Capsule {
    Vec3 a, b;
    double radius;
};

double distance_to_core(const Vec3& p, const Capsule& capsule) {
    const Vec3 axis = capsule.b - capsule.a;
    const double squared = axis.squaredNorm();
    const double t = squared > 0 ? std::clamp((p - capsule.a).dot(axis) / squared, 0.0, 1.0) : 0.0;
    return (p - capsule.a - t * axis).norm();
}

// Indices of the samples that each capsule covers.
std::vector<std::vector<std::uint32_t>> covered_by(const std::vector<Capsule>& capsules,
                                                   const std::vector<Sample>& samples, double gap) {
    std::vector<std::vector<std::uint32_t>> out(capsules.size());
#pragma omp parallel for schedule(dynamic, 32)
    for (std::size_t c = 0; c < capsules.size(); ++c) {
        const double reach = capsules[c].radius + gap;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            if (distance_to_core(samples[i].position, capsules[c]) <= reach) {
                out[c].push_back(static_cast<std::uint32_t>(i));
            }
        }
    }
    return out;
}

std::vector<Capsule> greedy_cover(const std::vector<Capsule>& capsules,
                                  const std::vector<Sample>& samples, double gap) {
    const auto covered = covered_by(capsules, samples, gap);
    double total = 0;
    for (const Sample& sample : samples) total += sample.weight;
    std::vector<std::uint8_t> done(samples.size(), 0);
    const auto weigh = [&](std::size_t b) {
        double sum = 0;
        for (std::uint32_t i : covered[b]) sum += done[i] ? 0 : samples[i].weight;
        return sum;
    };
    // Gains only fall: a candidate whose gain, counted anew, is still above the next one's old gain
    // is the best. Equal gains: the lower number.
    struct Entry {
        double gain;
        std::size_t index;
        bool operator<(const Entry& other) const {
            return gain < other.gain || (gain == other.gain && index > other.index);
        }
    };
    std::priority_queue<Entry> queue;
    for (std::size_t c = 0; c < capsules.size(); ++c) queue.push({weigh(c), c});
    std::vector<Capsule> out;
    while (out.size() < kMostColliders && !queue.empty()) {
        const Entry entry = queue.top();
        queue.pop();
        const Entry now{weigh(entry.index), entry.index};
        if (!queue.empty() && now < queue.top()) {
            queue.push(now);
            continue;
        }
        if (now.gain < kNegligible * total) break;
        out.push_back(capsules[now.index]);
        for (std::uint32_t i : covered[now.index]) done[i] = 1;
    }
    return out;
}

// How far a point stands outside the union of the capsules; negative inside.
double outside_capsules(const Vec3& p, const std::vector<Capsule>& capsules) {
    double least = std::numeric_limits<double>::infinity();
    for (const Capsule& c : capsules) least = std::min(least, distance_to_core(p, c) - c.radius);
    return least;
}

// Points spread evenly over a unit sphere (Fibonacci lattice).
Vec3 sphere_point(std::size_t i, std::size_t count) {
    const double y = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double r = std::sqrt(1 - y * y);
    const double angle = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    return {r * std::cos(angle), y, r * std::sin(angle)};
}

// How far the surface sticks out of the capsules; mean and percentile by the samples' weights.
Spread weighted_gap(const std::vector<Sample>& samples, const std::vector<Capsule>& capsules) {
    std::vector<std::pair<double, double>> gaps;
    double total = 0, sum = 0;
    for (const Sample& sample : samples) {
        const double gap = std::max(0.0, outside_capsules(sample.position, capsules));
        gaps.emplace_back(gap, sample.weight);
        total += sample.weight;
        sum += sample.weight * gap;
    }
    std::sort(gaps.begin(), gaps.end());
    Spread out{sum / total, 0, gaps.back().first};
    double below = 0;
    for (const auto& [gap, weight] : gaps) {
        below += weight;
        out.p95 = gap;
        if (below >= 0.95 * total) break;
    }
    return out;
}

// Capsules between medial balls that are not far from each other in place and size, each as thick
// as the thinnest place of the body along its core allows.
std::vector<Capsule> join_balls(const std::vector<Ball>& balls, const MeshTree& skin,
                                double bulge) {
    std::vector<std::array<std::uint32_t, 2>> pairs;
    Random random(2);
    for (std::uint32_t i = 0; i < balls.size(); ++i) {
        for (std::size_t tries = 0, found = 0; tries < kPairTries && found < kPairs; ++tries) {
            const auto j = static_cast<std::uint32_t>(random.below(balls.size()));
            const double smaller = std::min(balls[i].radius, balls[j].radius);
            const double larger = std::max(balls[i].radius, balls[j].radius);
            const double distance = (balls[i].centre - balls[j].centre).norm();
            if (j == i || smaller < kAlikeRadii * larger || distance > kReachRadii * larger ||
                distance < kTooNearRadii * larger) {
                continue;
            }
            pairs.push_back({i, j});
            ++found;
        }
    }
    std::vector<Capsule> out(pairs.size());
#pragma omp parallel for schedule(dynamic, 32)
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const Ball &a = balls[pairs[k][0]], &b = balls[pairs[k][1]];
        double radius = std::min(a.radius, b.radius);
        for (std::size_t i = 1; i < kCorePoints; ++i) {
            const double t = static_cast<double>(i) / static_cast<double>(kCorePoints);
            const Vec3 p = (1 - t) * a.centre + t * b.centre;
            radius = std::min(radius, bulge + skin.nearest(p).at.distance);
        }
        out[k] = {a.centre, b.centre, radius};
    }
    // What became much thinner than its ends crosses a gap of the body.
    std::vector<Capsule> kept;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const double ends = std::min(balls[pairs[k][0]].radius, balls[pairs[k][1]].radius);
        if (out[k].radius > kAlikeRadii * ends) kept.push_back(out[k]);
    }
    return kept;
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

// A sample of the surface as a ball of this radius sees it from outside: true when the ball can lie
// on it without touching the surface elsewhere.
bool exposed(const Sample& sample, const std::vector<Vec3>& points, const PointTree& tree,
             double radius) {
    const Sample outward{sample.position, -sample.normal, sample.triangle, 0};
    const Vec3 centre = medial_centre(outward, points, tree, radius);
    return (centre - sample.position).norm() > kExposedShare * radius;
}

// Weighs each sample by the strands that reach it: one with its root there counts 1, one whose
// length just reaches counts 0.
void weigh_by_reach(const Groom& groom, std::vector<Sample>& samples) {
    std::vector<Ball> roots;
    const std::size_t step = std::max<std::size_t>(1, groom.strand_count() / kWeighedRoots);
    for (std::size_t s = 0; s < groom.strand_count(); s += step) {
        roots.push_back({groom.points(s).front(), polyline_length(groom.points(s))});
    }
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < samples.size(); ++i) {
        for (const Ball& root : roots) {
            const double distance = (samples[i].position - root.centre).norm();
            samples[i].weight += std::max(0.0, 1 - distance / root.radius);
        }
    }
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
    std::vector<Sample> surface = sample_surface(mesh, all, kSurfaceSamples);
    weigh_by_reach(groom, surface);
    Eigen::AlignedBox3d body;
    for (const Sample& sample : surface) {
        if (sample.weight > 0) body.extend(sample.position);
    }
    if (body.isEmpty()) return out;
    const double smallest = body.sizes().minCoeff();
    const double bulge = std::min(kLargestBulge, kBulgeShare * smallest);
    const double gap = kGapShare * bulge;
    const double probe = std::min(kLargestProbe, kProbeShare * smallest);

    // The outer skin: triangles on which the probe can lie. Holes that are too narrow for it
    // (mouth, nostrils) and what is inside another part (teeth, the back of an eye) count as
    // filled.
    std::vector<Vec3> points;
    for (const Sample& s : surface) points.push_back(s.position);
    const PointTree all_points(points);
    std::vector<std::uint8_t> outer(all.size(), 0);
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t i = 0; i < all.size(); ++i) {
        const auto& c = mesh.triangle[all[i]];
        const Sample centre{(mesh.position[c[0]] + mesh.position[c[1]] + mesh.position[c[2]]) / 3,
                            triangle_normal(mesh, all[i]), all[i], 0};
        outer[i] = exposed(centre, points, all_points, probe) &&
                   !tree.inside(centre.position + bulge * centre.normal);
    }
    std::vector<std::uint32_t> skin;
    std::vector<std::uint8_t> in_skin(mesh.triangle.size(), 0);
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (!outer[i]) continue;
        skin.push_back(all[i]);
        in_skin[all[i]] = 1;
    }
    if (skin.empty()) return out;
    const MeshTree skin_tree(mesh, skin);
    std::vector<Sample> wanted;
    std::vector<Vec3> skin_points;
    for (const Sample& sample : surface) {
        if (!in_skin[sample.triangle]) continue;
        skin_points.push_back(sample.position);
        if (sample.weight > 0) wanted.push_back(sample);
    }
    if (wanted.empty()) return out;

    std::vector<Ball> balls;
    {
        const PointTree point_tree(skin_points);
        std::vector<std::uint32_t> from(wanted.size());
        std::iota(from.begin(), from.end(), 0u);
        balls.resize(std::min(kMedialBalls, from.size()));
        Random(1).choose_first(std::span(from), balls.size());
        const double largest = body.diagonal().norm();
#pragma omp parallel for schedule(dynamic, 32)
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const Vec3 centre = medial_centre(wanted[from[i]], skin_points, point_tree, largest);
            balls[i] = {centre, bulge + skin_tree.nearest(centre).at.distance};
        }
    }
    std::vector<Capsule> candidates = join_balls(balls, skin_tree, bulge);
    for (const Ball& ball : balls) candidates.push_back({ball.centre, ball.centre, ball.radius});
    const std::vector<Capsule> chosen = greedy_cover(candidates, wanted, gap);
    if (chosen.empty()) return out;

    std::vector<double> outside;
    for (const Capsule& capsule : chosen) {
        AssetCollider collider;
        for (int k = 0; k < 3; ++k) {
            collider.a[static_cast<std::size_t>(k)] = static_cast<float>(capsule.a[k]);
            collider.b[static_cast<std::size_t>(k)] = static_cast<float>(capsule.b[k]);
        }
        collider.radius = static_cast<float>(capsule.radius);
        collider.bone = bone_at(0.5 * (capsule.a + capsule.b), mesh, tree, groom, carriers);
        out.colliders.push_back(collider);
        const Vec3 axis = capsule.b - capsule.a;
        for (std::size_t i = 0; i < kSurfacePoints; ++i) {
            // A point of the sphere goes to the end of the core on its side, or along the core.
            const Vec3 direction = sphere_point(i, kSurfacePoints);
            const double t = static_cast<double>(i % kCorePoints) / (kCorePoints - 1.0);
            const Vec3 core = capsule.a + t * axis;
            const Vec3 p = core + capsule.radius * direction;
            if (outside_capsules(p, chosen) < -kOnSurface) continue;
            // Inside the body, or in a hole that counts as filled.
            const NearestTriangle near = tree.nearest(p);
            const bool within = !in_skin[near.triangle] || tree.inside(p);
            outside.push_back(within ? 0 : near.at.distance);
        }
    }
    out.measured.count = chosen.size();
    out.measured.outside = spread_of(std::move(outside));
    out.measured.gap = weighted_gap(wanted, chosen);
    if (out.measured.gap.p95 > kNoticedGap) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "the mesh sticks out of the colliders by more than %.1f mm on 5 %% of the "
                      "surface that hair reaches, by %.1f mm at most",
                      1000 * out.measured.gap.p95, 1000 * out.measured.gap.max);
        findings.push_back({Rule::collider_gap, mesh.file, text, {}});
    }
    return out;
}

}  // namespace keratin
