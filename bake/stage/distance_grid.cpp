#include "bake/stage/distance_grid.h"

#include "bake/stage/mesh_tree.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace keratin {
namespace {

constexpr double kDefaultCells = 128;  // along the longest side of the reachable body
// Bricks whose middle is farther from the surface than this many half diagonals do not meet it.
constexpr double kDeep = 1.25;
constexpr std::uint32_t kMostBricks = 1u << 24;
constexpr std::uint32_t kNodesPerSide = kBrickCells + 1;
static_assert(kNodesPerSide * kNodesPerSide * kNodesPerSide == kBrickNodes);

// The mesh near the hair: its box cut by the box of all places that a strand can reach.
Eigen::AlignedBox3d reachable_box(const RawMesh& mesh, const Groom& groom) {
    Eigen::AlignedBox3d body, reach;
    for (const auto& triangle : mesh.triangle)
        for (const std::uint32_t v : triangle) body.extend(mesh.position[v]);
    for (std::size_t s = 0; s < groom.strand_count(); ++s) {
        const auto points = groom.points(s);
        const Vec3 length = Vec3::Constant(polyline_length(points));
        reach.extend(points.front() - length);
        reach.extend(points.front() + length);
    }
    return body.intersection(reach);
}

std::uint32_t main_bone(const Carriers& carriers) {
    std::vector<double> weight(std::max<std::size_t>(1, carriers.bones.size()), 0.0);
    for (std::size_t s = 0; s < carriers.bone.size(); ++s)
        for (std::size_t k = 0; k < 4; ++k) weight[carriers.bone[s][k]] += carriers.weight[s][k];
    return static_cast<std::uint32_t>(std::max_element(weight.begin(), weight.end()) -
                                      weight.begin());
}

struct Lattice {
    Vec3 origin;
    double spacing;
    std::array<std::uint32_t, 3> bricks;

    std::size_t brick_count() const { return std::size_t{bricks[0]} * bricks[1] * bricks[2]; }
    Vec3 corner(std::size_t brick) const {
        const Vec3 at(static_cast<double>(brick % bricks[0]),
                      static_cast<double>(brick / bricks[0] % bricks[1]),
                      static_cast<double>(brick / bricks[0] / bricks[1]));
        return origin + spacing * kBrickCells * at;
    }
    Vec3 node(std::size_t brick, std::uint32_t i) const {
        return corner(brick) + spacing * Vec3(i % kNodesPerSide, i / kNodesPerSide % kNodesPerSide,
                                              i / (kNodesPerSide * kNodesPerSide));
    }
};

// 1 for the bricks that some strand can reach: those that meet the ball of its length about its
// root.
std::vector<std::uint8_t> reachable_bricks(const Lattice& lattice, const Groom& groom) {
    std::vector<std::uint8_t> out(lattice.brick_count());
    const double side = lattice.spacing * kBrickCells, half_diagonal = 0.5 * std::sqrt(3.0) * side;
    for (std::size_t s = 0; s < groom.strand_count(); ++s) {
        const auto points = groom.points(s);
        const double reach = polyline_length(points) + half_diagonal;
        const Vec3 root = (points.front() - lattice.origin) / side;
        std::array<std::ptrdiff_t, 3> first, last;
        for (int axis = 0; axis < 3; ++axis) {
            const auto count = static_cast<double>(lattice.bricks[axis]);
            first[axis] = static_cast<std::ptrdiff_t>(
                std::clamp(std::floor(root[axis] - reach / side), 0.0, count));
            last[axis] = static_cast<std::ptrdiff_t>(
                std::clamp(std::ceil(root[axis] + reach / side), 0.0, count));
        }
        for (std::ptrdiff_t z = first[2]; z < last[2]; ++z)
            for (std::ptrdiff_t y = first[1]; y < last[1]; ++y)
                for (std::ptrdiff_t x = first[0]; x < last[0]; ++x) {
                    const Vec3 middle(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5,
                                      static_cast<double>(z) + 0.5);
                    if ((middle - root).norm() * side > reach) continue;
                    out[static_cast<std::size_t>((z * lattice.bricks[1] + y) * lattice.bricks[0] +
                                                 x)] = 1;
                }
    }
    return out;
}

// Distance errors at the middle of the cells that the surface crosses.
void measure_cells(const Lattice& lattice, std::size_t brick, const float* nodes,
                   const MeshTree& tree, std::vector<double>& errors) {
    const double diagonal = std::sqrt(3.0) * lattice.spacing;
    for (std::uint32_t z = 0; z < kBrickCells; ++z)
        for (std::uint32_t y = 0; y < kBrickCells; ++y)
            for (std::uint32_t x = 0; x < kBrickCells; ++x) {
                const Vec3 middle(x + 0.5, y + 0.5, z + 0.5);
                const double found = interpolate_brick(nodes, middle);
                if (std::abs(found) > 0.5 * diagonal) continue;
                const double exact =
                    tree.signed_distance(lattice.corner(brick) + lattice.spacing * middle);
                errors.push_back(std::abs(found - exact));
            }
}

// Nodes of a cell in its brick, from the cell's first, and their shares at f (0..1 on each axis).
struct Stencil {
    std::array<std::uint32_t, 8> node;
    std::array<double, 8> weight;

    explicit Stencil(const Vec3& f) {
        for (std::uint32_t corner = 0; corner < 8; ++corner) {
            const std::uint32_t x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
            node[corner] = (z * kNodesPerSide + y) * kNodesPerSide + x;
            weight[corner] = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
        }
    }
    double of(const float* first) const {
        double sum = 0;
        for (std::size_t corner = 0; corner < 8; ++corner)
            sum += weight[corner] * first[node[corner]];
        return sum;
    }
};

// Lowers nodes until the interpolation is nowhere above zero on the mesh: rims and sheets thinner
// than a cell would else stand out of their grid, and hair would enter them. Lowering never lifts
// the distance anywhere, so one pass over samples of the triangles is enough; each spreads what it
// lacks over the nodes of its cell by their weights.
class Enclose {
  public:
    Enclose(const Lattice& lattice, const std::vector<std::uint32_t>& brick,
            std::vector<float>& distance)
        : lattice_(lattice), brick_(brick), distance_(distance) {}

    void triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
        const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        const int n = std::max(1, static_cast<int>(std::ceil(longest / lattice_.spacing * 4)));
        for (int i = 0; i <= n; ++i)
            for (int j = 0; i + j <= n; ++j)
                sample(a + (b - a) * (static_cast<double>(i) / n) +
                       (c - a) * (static_cast<double>(j) / n));
    }

  private:
    const Lattice& lattice_;
    const std::vector<std::uint32_t>& brick_;
    std::vector<float>& distance_;

    // The stored node of a brick, null outside of what is stored; `in` is within the brick.
    float* node(const std::array<std::int64_t, 3>& b, const std::array<std::int64_t, 3>& in) {
        for (int axis = 0; axis < 3; ++axis)
            if (b[axis] < 0 || b[axis] >= lattice_.bricks[axis]) return nullptr;
        const std::uint32_t index = brick_[static_cast<std::size_t>(
            (b[2] * lattice_.bricks[1] + b[1]) * lattice_.bricks[0] + b[0])];
        if (index == kNoBrick) return nullptr;
        return distance_.data() + std::size_t{index} * kBrickNodes +
               (in[2] * kNodesPerSide + in[1]) * kNodesPerSide + in[0];
    }

    // Neighbouring bricks hold copies of the nodes that they share.
    void lower(const std::array<std::int64_t, 3>& at, float by) {
        for (int copy = 0; copy < 8; ++copy) {
            std::array<std::int64_t, 3> b, in;
            bool held = true;
            for (int axis = 0; axis < 3; ++axis) {
                b[axis] = at[axis] / kBrickCells;
                in[axis] = at[axis] % kBrickCells;
                if (!(copy >> axis & 1)) continue;
                held = held && in[axis] == 0;
                --b[axis];
                in[axis] = kBrickCells;
            }
            if (float* value = held ? node(b, in) : nullptr) *value -= by;
        }
    }

    void sample(const Vec3& p) {
        const Vec3 at = (p - lattice_.origin) / lattice_.spacing;
        std::array<std::int64_t, 3> cell, b, in;
        Vec3 f;
        for (int axis = 0; axis < 3; ++axis) {
            if (!(at[axis] >= 0)) return;
            cell[axis] = static_cast<std::int64_t>(at[axis]);
            f[axis] = at[axis] - static_cast<double>(cell[axis]);
            b[axis] = cell[axis] / kBrickCells;
            in[axis] = cell[axis] % kBrickCells;
        }
        const float* first = node(b, in);
        if (!first) return;
        const Stencil stencil(f);
        const double found = stencil.of(first);
        if (!(found > 0)) return;
        double squares = 0;
        for (const double w : stencil.weight) squares += w * w;
        for (std::uint32_t k = 0; k < 8; ++k)
            lower({cell[0] + (k & 1), cell[1] + (k >> 1 & 1), cell[2] + (k >> 2)},
                  static_cast<float>(found * stencil.weight[k] / squares));
    }
};

}  // namespace

double interpolate_brick(const float* nodes, const Vec3& at) {
    std::array<std::uint32_t, 3> cell;
    Vec3 f;
    for (int axis = 0; axis < 3; ++axis) {
        cell[axis] = std::min(static_cast<std::uint32_t>(at[axis]), kBrickCells - 1);
        f[axis] = at[axis] - cell[axis];
    }
    return Stencil(f).of(nodes + (cell[2] * kNodesPerSide + cell[1]) * kNodesPerSide + cell[0]);
}

Result<BakedDistanceGrid> make_distance_grid(const RawMesh& mesh, const Groom& groom,
                                             const Carriers& carriers, const Recipe& recipe) {
    BakedDistanceGrid out;
    const Eigen::AlignedBox3d box = reachable_box(mesh, groom);
    if (box.isEmpty()) return out;
    const double longest = box.sizes().maxCoeff();
    const double spacing =
        static_cast<float>(recipe.distance_grid_spacing.value_or(longest / kDefaultCells));

    const double around = spacing + recipe.distance_grid_margin;
    // One cell more, so that the surface of the box's sides is covered too.
    Lattice lattice{(box.min() - Vec3::Constant(around)).cast<float>().cast<double>(), spacing, {}};
    double bricks = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double count = std::ceil((box.sizes()[axis] + 2 * around) / (spacing * kBrickCells));
        lattice.bricks[axis] =
            static_cast<std::uint32_t>(std::min<double>(std::max(count, 1.0), kMostBricks));
        bricks *= std::max(count, 1.0);
    }
    if (bricks > kMostBricks)
        return Error{ErrorCode::input, recipe.file,
                     "distance_grid.spacing: " + std::to_string(spacing) + " m makes " +
                         std::to_string(bricks) + " bricks for a body of " +
                         std::to_string(longest) + " m; write at least " +
                         std::to_string(spacing * std::cbrt(bricks / kMostBricks) * 1.01)};

    std::vector<std::uint32_t> all(mesh.triangle.size());
    std::iota(all.begin(), all.end(), 0u);
    const MeshTree tree(mesh, all);
    const auto brick_count = static_cast<std::ptrdiff_t>(lattice.brick_count());
    const double half = 0.5 * kBrickCells * spacing, half_diagonal = std::sqrt(3.0) * half,
                 band = std::sqrt(3.0) * spacing + recipe.distance_grid_margin;
    std::vector<std::uint8_t> needed = reachable_bricks(lattice, groom);
    std::vector<double> middle(lattice.brick_count());
#pragma omp parallel for schedule(dynamic, 64)
    for (std::ptrdiff_t b = 0; b < brick_count; ++b) {
        if (!needed[b]) continue;
        middle[b] = tree.signed_distance(lattice.corner(b) + Vec3::Constant(half));
        needed[b] = middle[b] < half_diagonal + band;
    }

    std::vector<std::uint32_t> stored;
    out.brick.assign(lattice.brick_count(), kNoBrick);
    for (std::size_t b = 0; b < needed.size(); ++b) {
        if (!needed[b]) continue;
        out.brick[b] = static_cast<std::uint32_t>(stored.size());
        stored.push_back(static_cast<std::uint32_t>(b));
    }
    out.distance.resize(stored.size() * kBrickNodes);
    const auto stored_count = static_cast<std::ptrdiff_t>(stored.size());
#pragma omp parallel for schedule(dynamic, 16)
    for (std::ptrdiff_t i = 0; i < stored_count; ++i) {
        float* nodes = out.distance.data() + i * kBrickNodes;
        // Deep inside the nearest triangle is the distance: neither the surface nor the skin over
        // a hole is near a brick whose middle is that much farther from them than its corners.
        const double to_middle = middle[stored[i]];
        const bool crossed = std::abs(to_middle) < kDeep * half_diagonal;
        for (std::uint32_t n = 0; n < kBrickNodes; ++n) {
            const Vec3 node = lattice.node(stored[i], n);
            nodes[n] = static_cast<float>(
                crossed ? tree.signed_distance(node)
                        : std::copysign(tree.nearest(node).at.distance, to_middle));
        }
    }
    Enclose enclose(lattice, out.brick, out.distance);
    for (const auto& c : mesh.triangle)
        enclose.triangle(mesh.position[c[0]], mesh.position[c[1]], mesh.position[c[2]]);

    std::vector<std::vector<double>> cell_errors(stored.size());
#pragma omp parallel for schedule(dynamic, 16)
    for (std::ptrdiff_t i = 0; i < stored_count; ++i)
        measure_cells(lattice, stored[i], out.distance.data() + i * kBrickNodes, tree,
                      cell_errors[i]);

    std::vector<double> errors;
    for (const auto& some : cell_errors) errors.insert(errors.end(), some.begin(), some.end());
    for (const Vec3& vertex : mesh.position) {
        const Vec3 at = (vertex - lattice.origin) / (spacing * kBrickCells);
        if ((at.array() < 0).any()) continue;
        const std::array<std::size_t, 3> brick{static_cast<std::size_t>(at[0]),
                                               static_cast<std::size_t>(at[1]),
                                               static_cast<std::size_t>(at[2])};
        if (brick[0] >= lattice.bricks[0] || brick[1] >= lattice.bricks[1] ||
            brick[2] >= lattice.bricks[2])
            continue;
        const std::uint32_t index =
            out.brick[(brick[2] * lattice.bricks[1] + brick[1]) * lattice.bricks[0] + brick[0]];
        if (index == kNoBrick) continue;
        const Vec3 in_brick = (at - at.array().floor().matrix()) * kBrickCells;
        errors.push_back(std::abs(
            interpolate_brick(out.distance.data() + std::size_t{index} * kBrickNodes, in_brick) -
            tree.signed_distance(vertex)));
    }
    out.measured = {spacing, lattice.brick_count(), stored.size(), spread_of(std::move(errors))};
    for (float& distance : out.distance)
        distance -= static_cast<float>(recipe.distance_grid_margin);
    if (stored.empty()) {
        out.brick.clear();
        return out;
    }
    for (int axis = 0; axis < 3; ++axis)
        out.info.origin[axis] = static_cast<float>(lattice.origin[axis]);
    out.info.spacing = static_cast<float>(spacing);
    out.info.bricks = lattice.bricks;
    out.info.stored_bricks = static_cast<std::uint32_t>(stored.size());
    out.info.bone = main_bone(carriers);
    out.info.max_error = static_cast<float>(out.measured.error.max);
    return out;
}

}  // namespace keratin
