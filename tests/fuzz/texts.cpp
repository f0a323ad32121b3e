// The readers of recipes, scenes and pose files on arbitrary text: they refuse it with a message,
// or hand out numbers that the programs can use without looking again.
#include "schema/read/recipe.h"
#include "schema/read/scene.h"
#include "tests/fuzz/demand.h"
#include "tests/fuzz/readers.h"

#include <cmath>

namespace keratin::fuzz {

namespace {

template <class T>
bool accepted(const Result<T>& result) {
    if (!result) demand(!result.error().message.empty(), "an error says something");
    return static_cast<bool>(result);
}

void check(const Motion& motion) {
    double last = -std::numeric_limits<double>::infinity();
    for (const Keyframe& key : motion) {
        demand(key.time > last && std::isfinite(key.time), "times of a motion rise");
        last = key.time;
        for (const double x : key.translation) demand(std::isfinite(x), "translations are finite");
        double length = 0;
        for (const double x : key.rotation) length += x * x;
        demand(std::abs(length - 1) < 1e-6, "rotations are unit quaternions");
    }
}

bool is_positive(double x) { return x > 0 && std::isfinite(x); }

}  // namespace

void run_recipe(std::string_view text) {
    const auto recipe = parse_recipe(std::string(text), "fuzz", "");
    if (!accepted(recipe)) return;
    demand(!recipe->curves.empty(), "a recipe has curves");
    demand(is_positive(recipe->scale), "a recipe has a scale");
    demand(recipe->guide_fraction > 0 && recipe->guide_fraction <= 1, "a share of guides");
    demand(!recipe->points_per_strand ||
               (*recipe->points_per_strand >= 2 && *recipe->points_per_strand <= 1024),
           "2 to 1024 points a strand");
    demand(!recipe->max_error || is_positive(*recipe->max_error), "an error is positive");
    demand(is_positive(recipe->material.radius) && is_positive(recipe->material.density),
           "a material has mass");
}

void run_scene(std::string_view text) {
    const auto scene = parse_scene(std::string(text), "fuzz", "/nowhere");
    if (!accepted(scene)) return;
    demand(is_positive(scene->frame), "a frame takes time");
    demand(!scene->step || is_positive(*scene->step), "a step takes time");
    demand(!scene->duration || is_positive(*scene->duration), "a run takes time");
    for (const SceneAsset& asset : scene->assets) check(asset.motion);
    for (const SceneCollider& collider : scene->colliders) check(collider.motion);
    for (const SceneStrand& strand : scene->strands) {
        check(strand.motion);
        demand(strand.points.size() >= 2, "a strand has two points");
    }
}

void run_poses(std::string_view text) {
    const auto poses = parse_poses(std::string(text), "fuzz");
    if (!accepted(poses)) return;
    for (const BoneMotion& bone : *poses) check(bone.motion);
}

}  // namespace keratin::fuzz
