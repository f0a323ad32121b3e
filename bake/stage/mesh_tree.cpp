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
using Tree = Eigen::KdBVH<double, 3, std::uint32_t>;

// Share of the mesh's diagonal below which two distances are equal: some 4000 roundings of double.
constexpr double kTieScale = 1e-12;
// Triangles of a leaf of the winding tree, summed one by one.
constexpr std::size_t kLeafTriangles = 8;
// A cluster counts as a dipole from this many of its radii away (Barill et al. 2018 use 2).
constexpr double kFarRadii = 2.5;

// Solid angle of a triangle seen from the origin (Van Oosterom and Strackee 1983).
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double numerator = a.dot(b.cross(c));
    const double denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    return 2 * std::atan2(numerator, denominator);
}

// A cluster of triangles: their area vectors summed, placed at their centre.
struct Cluster {
    Vec3 centre = Vec3::Zero();
    Vec3 area = Vec3::Zero();  // sum of the area vectors
    double radius = 0;
    std::uint32_t first = 0, count = 0;  // in the sorted triangles
    std::int32_t child = -1;             // first of two neighbouring children, -1: leaf
};

}  // namespace

struct MeshTree::State {
    const RawMesh* mesh = nullptr;
    Tree tree;
    double tie = 0;
    std::vector<std::uint32_t> sorted;
    std::vector<Cluster> clusters;

    const Vec3& corner(std::uint32_t triangle, int k) const {
        return mesh->position[mesh->triangle[triangle][static_cast<std::size_t>(k)]];
    }
    Vec3 centroid(std::uint32_t triangle) const {
        return (corner(triangle, 0) + corner(triangle, 1) + corner(triangle, 2)) / 3;
    }
    void build_cluster(std::size_t node, std::uint32_t first, std::uint32_t count);
    double winding(std::size_t node, const Vec3& p) const;
};

void MeshTree::State::build_cluster(std::size_t node, std::uint32_t first, std::uint32_t count) {
    Cluster c;
    c.first = first;
    c.count = count;
    Box box;
    double weight = 0;
    for (std::uint32_t i = first; i < first + count; ++i) {
        const std::uint32_t t = sorted[i];
        const Vec3 area = 0.5 * (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
        const double size = area.norm();
        c.area += area;
        c.centre += size * centroid(t);
        weight += size;
        box.extend(centroid(t));
    }
    c.centre = weight > 0 ? Vec3(c.centre / weight) : box.center();
    for (std::uint32_t i = first; i < first + count; ++i) {
        for (int k = 0; k < 3; ++k) {
            c.radius = std::max(c.radius, (corner(sorted[i], k) - c.centre).norm());
        }
    }
    if (count > kLeafTriangles) {
        int axis = 0;
        box.sizes().maxCoeff(&axis);
        const auto begin = sorted.begin() + first;
        const std::uint32_t half = count / 2;
        std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
            const double ca = centroid(a)[axis], cb = centroid(b)[axis];
            return ca < cb || (ca == cb && a < b);
        });
        c.child = static_cast<std::int32_t>(clusters.size());
        clusters.resize(clusters.size() + 2);
        build_cluster(static_cast<std::size_t>(c.child), first, half);
        build_cluster(static_cast<std::size_t>(c.child) + 1, first + half, count - half);
    }
    clusters[node] = c;
}

double MeshTree::State::winding(std::size_t node, const Vec3& p) const {
    const Cluster& c = clusters[node];
    const Vec3 d = c.centre - p;
    const double distance = d.norm();
    if (distance > kFarRadii * c.radius) {
        return d.dot(c.area) / (4 * std::numbers::pi * distance * distance * distance);
    }
    if (c.child >= 0) {
        const auto child = static_cast<std::size_t>(c.child);
        return winding(child, p) + winding(child + 1, p);
    }
    double sum = 0;
    for (std::uint32_t i = c.first; i < c.first + c.count; ++i) {
        const std::uint32_t t = sorted[i];
        sum += solid_angle(corner(t, 0) - p, corner(t, 1) - p, corner(t, 2) - p);
    }
    return sum / (4 * std::numbers::pi);
}

MeshTree::MeshTree(const RawMesh& mesh, std::span<const std::uint32_t> triangles)
    : state_(std::make_unique<State>()) {
    state_->mesh = &mesh;
    std::vector<Box> boxes;
    boxes.reserve(triangles.size());
    Box all;
    for (std::uint32_t t : triangles) {
        Box box;
        for (int k = 0; k < 3; ++k) box.extend(state_->corner(t, k));
        all.extend(box);
        boxes.push_back(box);
    }
    state_->tree.init(triangles.begin(), triangles.end(), boxes.begin(), boxes.end());
    state_->tie = kTieScale * std::max(all.diagonal().norm(), all.min().cwiseAbs().maxCoeff());
    state_->sorted.assign(triangles.begin(), triangles.end());
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
    const auto visit = [&](std::uint32_t t) {
        const NearestTriangle found{
            t, nearest_on_triangle(point, state_->corner(t, 0), state_->corner(t, 1),
                                   state_->corner(t, 2))};
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

bool MeshTree::inside(const Vec3& point) const { return state_->winding(0, point) > 0.5; }

double MeshTree::signed_distance(const Vec3& point) const {
    const double distance = nearest(point).at.distance;
    return inside(point) ? -distance : distance;
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
