// The loop that one would write first: strand by strand, point by point, positions as x, y, z, with
// the same maths and the same small steps as the solver. The speed of the passes is given as a
// ratio to it.
#pragma once

#include "schema/formula/vec3.h"
#include "tools/scenes/groom.h"

#include <vector>

namespace keratin::bench {

// Float operations of one point in one small step, without collisions: integration 18, bending 150,
// stretch 75, final length 30 (adds, multiplications, divisions and roots counted one each).
inline constexpr double kOperationsPerPoint = 273;

class NaiveStrands {
  public:
    NaiveStrands(const scenes::Groom& groom, std::uint32_t iterations);
    // One step of h with the roots at rest, against four capsules.
    void step(double h);
    const std::vector<Vec3<float>>& position() const { return x_; }

  private:
    using V = Vec3<float>;
    void small_step(float h, std::size_t first, std::size_t count);

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
