#include "bake/stage/mesh_tree.h"

#include <Eigen/Geometry>
#include <unsupported/Eigen/BVH>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace keratin {
namespace {

using Box = Eigen::AlignedBox3d;

// A triangle with its corners at hand: a search visits few triangles, far apart in memory.
struct Corners {
    Vec3 a, b, c;
    std::uint32_t triangle;

    Vec3 centroid() const { return (a + b + c) / 3; }
};

using Tree = Eigen::KdBVH<double, 3, Corners>;

// Share of the mesh's diagonal below which two distances are equal: some 4000 roundings of double.
constexpr double kTieScale = 1e-12;
// Triangles of a leaf of the winding tree, summed one by one.
constexpr std::size_t kLeafTriangles = 4;
// The skin over a hole is not near where the winding number is nearer than this share of a half to
// that of a closed mesh, 0 or 1.
constexpr double kSkinNear = 0.95;
// Where it may be, within this margin, its place matters and not only the side: clusters count as
// dipoles from six times as far.
constexpr double kSkinMargin = 1.2, kSkinFar = 36;
// A cluster counts as a dipole from this many of its radii away (Barill et al. 2018).
constexpr double kFarRadii = 2;

// Sum of the solid angles of triangles seen from a point (Van Oosterom and Strackee 1983): each is
// twice the angle of a complex number, and angles below a right angle are added by multiplication,
// which saves most of the arc tangents.
class SolidAngles {
  public:
    void add(const Vec3& a, const Vec3& b, const Vec3& c) {
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        const double y = a.dot(b.cross(c));
        const double x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        if (!(x > 0 && x_ > 0)) flush();
        const double product = x_ * x - y_ * y;
        y_ = x_ * y + y_ * x;
        x_ = product;
        // Products of lengths cubed would run out of range.
        const double size = std::abs(x_) + std::abs(y_);
        if (size > 0) {
            x_ /= size;
            y_ /= size;
        }
    }
    double sum() {
        flush();
        return 2 * sum_;
    }

  private:
    void flush() {
        sum_ += std::atan2(y_, x_);
        x_ = 1;
        y_ = 0;
    }
    double x_ = 1, y_ = 0, sum_ = 0;
};

// A cluster of triangles: their area vectors summed, placed at their centre.
struct Cluster {
    Vec3 centre = Vec3::Zero();
    Vec3 area = Vec3::Zero();  // sum of the area vectors
    double squared_far = 0;    // beyond this squared distance the cluster counts as a dipole
    std::uint32_t first = 0, count = 0;  // in the sorted triangles
    std::int32_t child = -1;             // first of two neighbouring children, -1: leaf
};

}  // namespace

struct MeshTree::State {
    const RawMesh* mesh = nullptr;
    Tree tree;
    Box box;
    double tie = 0;
    std::vector<Corners> sorted;  // as the clusters hold them
    std::vector<Cluster> clusters;

    void build_cluster(std::size_t node, std::uint32_t first, std::uint32_t count);
    // `far` scales the squared distance from which a cluster counts as a dipole.
    double solid_angle(std::size_t node, const Vec3& p, double far = 1) const;
    Vec3 solid_angle_gradient(std::size_t node, const Vec3& p) const;
};

void MeshTree::State::build_cluster(std::size_t node, std::uint32_t first, std::uint32_t count) {
    Cluster c;
    c.first = first;
    c.count = count;
    Box centroids;
    double weight = 0;
    for (std::uint32_t i = first; i < first + count; ++i) {
        const Corners& t = sorted[i];
        const Vec3 area = 0.5 * (t.b - t.a).cross(t.c - t.a);
        const double size = area.norm();
        c.area += area;
        c.centre += size * t.centroid();
        weight += size;
        centroids.extend(t.centroid());
    }
    c.centre = weight > 0 ? Vec3(c.centre / weight) : centroids.center();
    double squared = 0;
    for (std::uint32_t i = first; i < first + count; ++i) {
        for (const Vec3& p : {sorted[i].a, sorted[i].b, sorted[i].c}) {
            squared = std::max(squared, (p - c.centre).squaredNorm());
        }
    }
    c.squared_far = kFarRadii * kFarRadii * squared;
    if (count > kLeafTriangles) {
        int axis = 0;
        centroids.sizes().maxCoeff(&axis);
        const auto begin = sorted.begin() + first;
        const std::uint32_t half = count / 2;
        std::nth_element(begin, begin + half, begin + count,
                         [&](const Corners& a, const Corners& b) {
                             const double ca = a.centroid()[axis], cb = b.centroid()[axis];
                             return ca < cb || (ca == cb && a.triangle < b.triangle);
                         });
        c.child = static_cast<std::int32_t>(clusters.size());
        clusters.resize(clusters.size() + 2);
        build_cluster(static_cast<std::size_t>(c.child), first, half);
        build_cluster(static_cast<std::size_t>(c.child) + 1, first + half, count - half);
    }
    clusters[node] = c;
}

double MeshTree::State::solid_angle(std::size_t node, const Vec3& p, double far) const {
    const Cluster& c = clusters[node];
    const Vec3 d = c.centre - p;
    const double squared = d.squaredNorm();
    if (squared > far * c.squared_far) return d.dot(c.area) / (squared * std::sqrt(squared));
    if (c.child >= 0) {
        const auto child = static_cast<std::size_t>(c.child);
        return solid_angle(child, p, far) + solid_angle(child + 1, p, far);
    }
    SolidAngles angles;
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i) {
        angles.add(sorted[i].a - p, sorted[i].b - p, sorted[i].c - p);
    }
    return angles.sum();
}

// The gradient of solid_angle: of a dipole, and of a triangle as that of the loop of its edges (the
// field of a current in it, Biot and Savart).
Vec3 MeshTree::State::solid_angle_gradient(std::size_t node, const Vec3& p) const {
    const Cluster& c = clusters[node];
    const Vec3 d = c.centre - p;
    const double squared = d.squaredNorm();
    if (squared > c.squared_far) {
        const double cubed = squared * std::sqrt(squared);
        return (3 * d.dot(c.area) / squared * d - c.area) / cubed;
    }
    if (c.child >= 0) {
        const auto child = static_cast<std::size_t>(c.child);
        return solid_angle_gradient(child, p) + solid_angle_gradient(child + 1, p);
    }
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i) {
        const std::array<Vec3, 3> corner{sorted[i].a - p, sorted[i].b - p, sorted[i].c - p};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 &a = corner[k], &b = corner[(k + 1) % 3];
            const double la = a.norm(), lb = b.norm(), size = la * lb * (la * lb + a.dot(b));
            if (size > 0) sum += (la + lb) / size * a.cross(b);
        }
    }
    return sum;
}

MeshTree::MeshTree(const RawMesh& mesh, std::span<const std::uint32_t> triangles)
    : state_(std::make_unique<State>()) {
    state_->mesh = &mesh;
    std::vector<Box> boxes;
    boxes.reserve(triangles.size());
    state_->sorted.reserve(triangles.size());
    for (std::uint32_t t : triangles) {
        const auto& corner = mesh.triangle[t];
        const Corners& c = state_->sorted.emplace_back(Corners{
            mesh.position[corner[0]], mesh.position[corner[1]], mesh.position[corner[2]], t});
        Box box(c.a);
        box.extend(c.b);
        box.extend(c.c);
        state_->box.extend(box);
        boxes.push_back(box);
    }
    state_->tree.init(state_->sorted.begin(), state_->sorted.end(), boxes.begin(), boxes.end());
    state_->tie = kTieScale *
                  std::max(state_->box.diagonal().norm(), state_->box.min().cwiseAbs().maxCoeff());
    state_->clusters.resize(1);
    state_->build_cluster(0, 0, static_cast<std::uint32_t>(triangles.size()));
}

MeshTree::~MeshTree() = default;
MeshTree::MeshTree(MeshTree&&) noexcept = default;
MeshTree& MeshTree::operator=(MeshTree&&) noexcept = default;

NearestTriangle MeshTree::nearest(const Vec3& point) const {
    const Tree& tree = state_->tree;
    const double tie = state_->tie;
    double least = std::numeric_limits<double>::infinity();
    // Every triangle within the tolerance of the least distance seen so far; few at any time.
    std::vector<NearestTriangle> near;
    const auto visit = [&](const Corners& t) {
        const NearestTriangle found{t.triangle, nearest_on_triangle(point, t.a, t.b, t.c)};
        if (found.at.distance > least + tie) return;
        if (found.at.distance < least) {
            least = found.at.distance;
            std::erase_if(near, [&](const auto& n) { return n.at.distance > least + tie; });
        }
        near.push_back(found);
    };

    // Depth first, the nearer child first; a box is left out only when even its nearest corner is
    // farther than a tie. The depth of a KdBVH is the logarithm of its size.
    struct Entry {
        double distance;
        int node;
    };
    std::array<Entry, 128> stack;
    std::size_t depth = 0;
    stack[depth++] = {0, tree.getRootIndex()};
    while (depth > 0) {
        const Entry entry = stack[--depth];
        if (entry.distance > least + tie) continue;
        Tree::VolumeIterator box = nullptr, box_end = nullptr;
        Tree::ObjectIterator object = nullptr, object_end = nullptr;
        tree.getChildren(entry.node, box, box_end, object, object_end);
        for (; object != object_end; ++object) visit(*object);
        const std::size_t begin = depth;
        for (; box != box_end; ++box) {
            const double distance = tree.getVolume(*box).exteriorDistance(point);
            if (distance <= least + tie) stack[depth++] = {distance, *box};
        }
        if (depth == begin + 2 && stack[begin].distance < stack[begin + 1].distance) {
            std::swap(stack[begin], stack[begin + 1]);
        }
    }
    return *std::min_element(near.begin(), near.end(),
                             [](const auto& a, const auto& b) { return a.triangle < b.triangle; });
}

bool MeshTree::inside(const Vec3& point) const {
    // From outside the box all triangles lie in a half space and cannot cover more than half a
    // sphere, whether or not they close.
    if (!state_->box.contains(point)) return false;
    return state_->solid_angle(0, point) > 2 * std::numbers::pi;
}

double MeshTree::signed_distance(const Vec3& point) const {
    const double distance = nearest(point).at.distance;
    double beyond = state_->solid_angle(0, point) - 2 * std::numbers::pi;
    double least = distance;
    if (std::abs(beyond) < 2 * std::numbers::pi * kSkinNear) {
        const double slope = state_->solid_angle_gradient(0, point).norm();
        if (std::abs(beyond) < kSkinMargin * slope * distance) {
            beyond = state_->solid_angle(0, point, kSkinFar) - 2 * std::numbers::pi;
            if (std::abs(beyond) < slope * distance) least = std::abs(beyond) / slope;
        }
    }
    return beyond > 0 && state_->box.contains(point) ? -least : least;
}

double MeshTree::tie_tolerance() const { return state_->tie; }
const RawMesh& MeshTree::mesh() const { return *state_->mesh; }

bool matches(std::string_view name, std::string_view pattern) {
    // Greedy: on a mismatch only the last star needs to take one more character.
    std::size_t n = 0, p = 0, star = std::string_view::npos, star_name = 0;
    while (n < name.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++;
            star_name = n;
        } else if (p < pattern.size() && pattern[p] == name[n]) {
            ++p;
            ++n;
        } else if (star != std::string_view::npos) {
            p = star + 1;
            n = ++star_name;
        } else {
            return false;
        }
    }
    while (p < pattern.size() && pattern[p] == '*') ++p;
    return p == pattern.size();
}

std::vector<std::uint32_t> triangles_of_parts(const RawMesh& mesh,
                                              std::span<const std::string> patterns) {
    std::vector<std::uint32_t> out;
    if (patterns.empty()) {
        out.resize(mesh.triangle.size());
        std::iota(out.begin(), out.end(), 0u);
        return out;
    }
    for (const RawMeshPart& part : mesh.parts) {
        const bool wanted = std::any_of(patterns.begin(), patterns.end(), [&](const auto& pattern) {
            return matches(part.name, pattern);
        });
        if (!wanted) continue;
        for (std::uint32_t t = 0; t < part.triangle_count; ++t) {
            out.push_back(part.first_triangle + t);
        }
    }
    return out;
}

Vec3 triangle_normal(const RawMesh& mesh, std::uint32_t triangle) {
    const auto& t = mesh.triangle[triangle];
    const Vec3 area = (mesh.position[t[1]] - mesh.position[t[0]])
                          .cross(mesh.position[t[2]] - mesh.position[t[0]]);
    const double size = area.norm();
    return size > 0 ? Vec3(area / size) : Vec3(Vec3::Zero());
}

}  // namespace keratin
