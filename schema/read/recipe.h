// A groom recipe: what keratin-bake is asked to make. Read from JSON with comments, defined by
// schema/groom.fbs; every field but `curves` has a default that works.
#pragma once

#include "schema/asset.h"
#include "schema/read/up_axis.h"
#include "schema/result.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace keratin {

enum class Handedness { right, left };
enum class RootEnd { automatic, first, last };  // automatic: the end nearer to the mesh
enum class GuideMethod { random, kmeans, authored, motion };
enum class MeshKeep { automatic, none, bound, all };  // automatic: bound when attach is triangle
enum class ColliderMethod { none, fit };

struct CurveSource {
    std::string file;                     // resolved against the recipe's folder
    std::vector<std::string> mesh_nodes;  // parts of the mesh it grows on, `*` allowed; empty: all
    std::string group;                    // empty: "default", or the file's own groups
    std::string bones;                    // .tfxbone of this file, resolved; empty: none
    double scale = 1;                     // on top of the recipe's
    RootEnd root_end = RootEnd::automatic;
    double time = 0;             // s; of a file that moves, the sample nearest to it is baked
};

struct GroupRecipe {
    std::string name;
    Material material;  // already filled with the recipe's own where not given
    StrandParameters strand;
    bool sag_free = false, rod_sag_free = false;
};

struct Recipe {
    std::string file;  // as given on the command line
    std::string text;  // its bytes, for the recipe hash
    std::vector<CurveSource> curves;
    std::string mesh;  // resolved; empty: none
    MeshKeep mesh_keep = MeshKeep::automatic;
    double scale = 1;  // m per file unit
    UpAxis up_axis = UpAxis::y;
    Handedness handedness = Handedness::right;  // of the files' axes
    std::optional<std::uint32_t>
        points_per_strand;            // 2..1024; default 16 when max_error is absent too
    std::optional<double> max_error;  // m
    double guide_fraction = 0.1;      // (0, 1]
    GuideMethod guide_method = GuideMethod::kmeans;
    std::uint64_t guide_seed = 1;
    std::optional<bool> guide_measure;  // measure the guides' error in motion; absent: small grooms
    Attach attach = Attach::bone;
    Material material;
    StrandParameters strand;
    bool sag_free = false;  // rest shapes with which the groomed pose bears its weight
    bool rod_sag_free = false;  // the same for the rod solver
    std::vector<GroupRecipe> groups;
    ColliderMethod colliders = ColliderMethod::none;
    bool push_out = false;
    bool distance_grid = false;                   // store signed distances to the mesh
    std::optional<double> distance_grid_spacing;  // m; absent: from the size of the body
    double distance_grid_margin = 0;              // m, by which hair is kept off the mesh
    bool quantise = false;                        // store strand_position in 16 bits a coordinate
    double quantise_max_error = 5e-5;             // m, a point may move by no more
    // Fields that the recipe left to their default, as paths, for --explain.
    std::vector<std::string> defaulted;
};

// Reads and checks a recipe. Errors (input): what does not parse, with line and column; unknown
// fields; wrong types; values out of range or not finite, with the path ("strand.damping").
Result<Recipe> read_recipe(const std::string& path);
// The same from text; relative paths in it are resolved against `folder`.
Result<Recipe> parse_recipe(const std::string& text, const std::string& name,
                            const std::string& folder);

}  // namespace keratin
