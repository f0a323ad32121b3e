// The loop that one would write first: strand by strand, point by point, positions as x, y, z, with
// the same maths and the same small steps as the solver. The speed of the passes is given as a
// ratio to it.
#pragma once

#include "schema/formula/vec3.h"
#include "tools/scenes/groom.h"

#include <array>
#include <vector>

namespace keratin::bench {

// Float operations of one point of sixteen in one small step, adds, multiplications, comparisons,
// divisions and roots counted one each; selections, collisions, roots' frames and what is done once
// a frame are not counted. A point that moves takes 324: inertia and its limit 21, edge direction
// 14, bending 140, its moves and the stretch elimination 60, tension and what it moves 38, pull 22,
// exact length 20, velocity given back 9. Two of the sixteen follow the root.
inline constexpr double kOperationsPerPoint = 324.0 * 14 / 16;

// Head, neck and shoulders, of which hair on the head touches one or two.
struct BodyCapsule {
    std::array<float, 3> a, b;  // m, ends of the core
    float radius;
};
inline constexpr BodyCapsule kBody[4] = {{{0, -0.001f, 0}, {0, 0.001f, 0}, 0.078f},
                                         {{0, -0.3f, 0}, {0, -0.14f, 0}, 0.05f},
                                         {{-0.2f, -0.35f, 0}, {-0.05f, -0.25f, 0}, 0.06f},
                                         {{0.2f, -0.35f, 0}, {0.05f, -0.25f, 0}, 0.06f}};
inline constexpr float kBodyFriction = 0.3f;

class NaiveStrands {
  public:
    NaiveStrands(const scenes::Groom& groom, std::uint32_t iterations);
    // One step of h with the roots at rest, against the body.
    void step(double h);
    const std::vector<Vec3<float>>& position() const { return x_; }

  private:
    using V = Vec3<float>;
    void small_step(float h, std::size_t first, std::size_t count);
    void solve_bending(V* x, std::size_t n);

    std::uint32_t iterations_;
    float bending_ = 0;  // E I / (density area), m^4/s^2
    float keep_ = 1, pull_ = 0;
    std::vector<std::size_t> first_;
    std::vector<V> x_, previous_, edge_;
    std::vector<float> length_;
    std::vector<V> direction_, load_;
    std::vector<float> stiffness_, pivot_, band1_, band2_, value_, share_;
};

}  // namespace keratin::bench
