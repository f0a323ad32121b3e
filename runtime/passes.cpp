#include "runtime/passes.h"

#include "runtime/pass/carry.bind.h"
#include "runtime/pass/collide.bind.h"
#include "runtime/pass/final_length.bind.h"
#include "runtime/pass/grid_gather.bind.h"
#include "runtime/pass/grid_resolve.bind.h"
#include "runtime/pass/grid_scatter.bind.h"
#include "runtime/pass/integrate.bind.h"
#include "runtime/pass/interpolate.bind.h"
#include "runtime/pass/local_shape.bind.h"
#include "runtime/pass/skin.bind.h"
#include "runtime/pass/stretch.bind.h"

#include <array>

namespace keratin {

namespace {

#define KERATIN_BUFFER(buffer, element, access) BufferId::buffer,
constexpr BufferId kSkin[] = {KERATIN_BIND_SKIN(KERATIN_BUFFER)};
constexpr BufferId kScatter[] = {KERATIN_BIND_GRID_SCATTER(KERATIN_BUFFER)};
constexpr BufferId kResolve[] = {KERATIN_BIND_GRID_RESOLVE(KERATIN_BUFFER)};
constexpr BufferId kGather[] = {KERATIN_BIND_GRID_GATHER(KERATIN_BUFFER)};
constexpr BufferId kIntegrate[] = {KERATIN_BIND_INTEGRATE(KERATIN_BUFFER)};
constexpr BufferId kLocalShape[] = {KERATIN_BIND_LOCAL_SHAPE(KERATIN_BUFFER)};
constexpr BufferId kStretch[] = {KERATIN_BIND_STRETCH(KERATIN_BUFFER)};
constexpr BufferId kCollide[] = {KERATIN_BIND_COLLIDE(KERATIN_BUFFER)};
constexpr BufferId kFinalLength[] = {KERATIN_BIND_FINAL_LENGTH(KERATIN_BUFFER)};
constexpr BufferId kCarry[] = {KERATIN_BIND_CARRY(KERATIN_BUFFER)};
constexpr BufferId kInterpolate[] = {KERATIN_BIND_INTERPOLATE(KERATIN_BUFFER)};
#undef KERATIN_BUFFER

constexpr std::array<PassEntry, kPassCount> kPasses{{
    {PassId::skin, "skin", kSkin},
    {PassId::grid_scatter, "grid_scatter", kScatter},
    {PassId::grid_resolve, "grid_resolve", kResolve},
    {PassId::grid_gather, "grid_gather", kGather},
    {PassId::integrate, "integrate", kIntegrate},
    {PassId::local_shape, "local_shape", kLocalShape},
    {PassId::stretch, "stretch", kStretch},
    {PassId::collide, "collide", kCollide},
    {PassId::final_length, "final_length", kFinalLength},
    {PassId::carry, "carry", kCarry},
    {PassId::interpolate, "interpolate", kInterpolate},
}};

constexpr std::array<std::string_view, kBufferCount> kBufferNames{
    "position",       "previous",        "rest_edge",     "filling_rest", "root",
    "bone_pose",      "mesh_position",   "triangle_slot", "grid_sum",     "grid_field",
    "grid_brick",     "collider",        "strand_root",   "guide_line",   "strand_position",
    "strand_tangent", "strand_previous", "quad_state",    "scratch"};

}  // namespace

std::span<const PassEntry> pass_table() { return kPasses; }
std::string_view name_of(PassId pass) { return kPasses[std::size_t(pass)].name; }
std::string_view name_of(BufferId buffer) { return kBufferNames[std::size_t(buffer)]; }

}  // namespace keratin
