// The insides of a Simulation: its inputs, its buffers and the functions that make up a step.
// Shared by the files of the runtime, not by its users.
#pragma once

#include "runtime/buffers.h"
#include "runtime/cpu/kernels.h"
#include "runtime/root_transform.h"
#include "runtime/simulation.h"

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <vector>

namespace keratin {

// Memory aligned for any vector, zeroed, the host's where it lends some; never grows. Throws
// std::bad_alloc.
template <class T>
class Block64 {
  public:
    void allocate(std::size_t count, const Host& host) {
        count_ = count;
        if (count == 0) return;
        const std::size_t bytes = count * sizeof(T);
        void* memory = host.allocate ? host.allocate(host.user, bytes, kAlignment)
                                     : ::operator new (bytes, std::align_val_t{kAlignment});
        if (!memory) throw std::bad_alloc();
        data_ = std::unique_ptr<T, Free>(static_cast<T*>(memory), Free{host, bytes});
        std::memset(memory, 0, bytes);
    }
    T* data() { return data_.get(); }
    const T* data() const { return data_.get(); }
    std::size_t size() const { return count_; }
    std::span<T> span() { return {data_.get(), count_}; }
    std::span<const T> span() const { return {data_.get(), count_}; }
    T& operator[](std::size_t i) { return data_.get()[i]; }
    const T& operator[](std::size_t i) const { return data_.get()[i]; }

  private:
    static constexpr std::size_t kAlignment = 64;
    struct Free {
        Host host;
        std::size_t bytes = 0;
        void operator()(T* p) const {
            if (host.release)
                host.release(host.user, p, bytes, kAlignment);
            else
                ::operator delete (p, std::align_val_t{kAlignment});
        }
    };
    std::unique_ptr<T, Free> data_;
    std::size_t count_ = 0;
};

struct QuadState {
    float bounds_min[3], bounds_max[3];
    float fastest;  // m, per small step
    float quiet;    // s, that every point has been slow
    std::uint32_t group_class;
    std::uint32_t asleep;
    std::uint32_t guides;  // lanes with points
    std::uint32_t padding[5];
};
static_assert(sizeof(QuadState) == 64);

// A root transform as the passes read it, per lane: quaternion, translation.
inline constexpr std::size_t kRootFloats = 7;

struct Simulation::State {
    AssetInfo info;
    AssetFields fields;
    Settings settings;
    SolverPlan plan;
    RunShape shape;
    const KernelTable* kernels = nullptr;
    int threads = 1;

    // Inputs: at the end of the last step, and at the end of the next.
    RigidTransform motion_now, motion_next;
    std::vector<RigidTransform> bones_now, bones_next;
    Block64<float> mesh_next;                  // asset space
    std::vector<std::uint32_t> vertex_source;  // only where the asset stores a part of the mesh
    std::vector<RigidTransform> collider_now, collider_next;
    std::vector<RigidTransform> bone_world;  // bones (or the motion) at the end of the step
    std::uint32_t strand_count = 0;          // of the level of detail
    double time = 0, previous_step = 0;
    bool first_step = true;
    bool disturbed = false;  // gravity or wind was changed: nothing sleeps on

    // Buffers.
    Block64<float> position, previous, rest_edge, filling_rest, root_begin, root_end, strand_root, line;
    Block64<float> strand_position, strand_tangent, strand_previous;
    Block64<std::uint16_t> strand_half, strand_half_previous;
    std::array<float, 3> half_center_previous{};
    std::uint32_t written_count = 0;  // render strands that the last step wrote
    Block64<std::uint32_t> guide_triangle_slot, strand_triangle_slot;
    Block64<std::int64_t> grid_momentum, grid_filling;
    Block64<float> grid_field;
    Block64<std::uint8_t> grid_touched, grid_live;
    std::vector<GridSums> grid_sums;  // one a thread
    float inverse_mean_length = 0;    // 1/m: points carry this length in the mean
    float mean_density = 1;           // kg/m^3 of the groom
    Block64<ColliderShapeData> solids;
    Block64<ColliderPose> poses;
    Block64<QuadClass> classes;
    Block64<QuadState> quads;
    Block64<float> scratch;
    std::size_t scratch_stride = 0;  // floats a thread
    Block64<std::uint32_t> near;     // colliders that reach a block, one list a thread
    std::array<float, 3> half_center{};

    struct ClassKey {
        std::uint32_t group, rows;
    };
    std::vector<ClassKey> class_keys;

    // What the wind does, fixed by the seed.
    double gust_phase[3] = {};
    struct Wave {
        double k[3], direction[3], phase;
    };
    Wave waves[kWindWaves] = {};

    HealthCounters health;
    struct alignas(64) ThreadTimes {
        std::uint64_t ticks[kPassCount];
    };
    std::vector<ThreadTimes> times;
    double pass_seconds[kPassCount] = {};
    double step_seconds = 0;

    std::size_t tile_row(std::size_t tile) const { return fields.tile_first_row[tile]; }
    std::uint32_t quad_rows(std::size_t quad) const {
        return fields.tile_first_row[quad * kQuadTiles + 1] -
               fields.tile_first_row[quad * kQuadTiles];
    }
    bool simulated() const { return plan.has(PassId::integrate); }
};

// roots.cpp: the pass `skin`. Root transforms at the end of the step from the next inputs; those
// that are not finite keep their last value.
void pose_bones(Simulation::State& s);
void skin_guides(Simulation::State& s);
void skin_strands(Simulation::State& s);
// Carries strands whose root jumps, and all of them when `all`; returns how many.
std::uint64_t carry_jumps(Simulation::State& s, bool all, Velocity velocity);
// By how much the velocity of the root that changes it most differs from the last small step's (m/s).
double root_kick(const Simulation::State& s, double h);
// Puts one strand to its rest pose on its root at the end of the step, at rest.
void put_to_rest(Simulation::State& s, std::size_t tile, std::size_t lane);

// solids.cpp: collider shapes once, poses for some small steps.
void make_solids(Simulation::State& s);
// World bounds of a collider over the whole step; returns how far its bounds move.
double sweep(const Simulation::State& s, std::size_t collider, float low[3], float high[3]);
// Small steps that this step needs so that no collider that can reach the hair moves by more than
// its own thickness in one: hair cannot be on its far side then. `way`: how far the fastest of these
// colliders goes in the step (m).
struct SolidSteps {
    std::uint32_t count = 1;
    double way = 0;
};
SolidSteps steps_for_solids(const Simulation::State& s);
void pose_solids(Simulation::State& s, std::uint32_t first, std::uint32_t count,
                 std::uint32_t steps);

// wind.cpp
void make_wind(Simulation::State& s);
void wind_at(const Simulation::State& s, double time, SmallStep& step);

// advance.cpp
Result<void> advance(Simulation::State& s, double h);
void write_strands(Simulation::State& s);
void measure_quads(Simulation::State& s);
// Fills filling_rest from the guides as they are now: at rest, where their roots have not moved.
void measure_filling(Simulation::State& s);

}  // namespace keratin
