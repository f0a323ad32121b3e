// The objects of curves in an Alembic archive (AbcGeom ICurves), as views into the file: what each
// says of its points and, by Unreal's groom attributes, of its strands, and where its parents put
// it. Sizes are checked; the values are not yet.
#pragma once

#include "bake/read/ogawa.h"

#include <Eigen/Core>

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

namespace keratin::alembic {

// Values of an attribute, plain or through indices into a shorter list.
struct Attribute {
    ogawa::Sample values, indices;
    bool is_indexed = false;

    std::size_t count() const { return is_indexed ? indices.count() : values.count(); }
    // What an index outside the list points to is no number.
    double number(std::size_t element, std::size_t component = 0) const;
    std::int64_t integer(std::size_t element) const;
};

// Texts of an attribute, each ended by a zero byte.
struct TextAttribute {
    std::string_view bytes;
    ogawa::Sample indices;
    bool is_indexed = false;
};

// What a groom says of its strands besides their points. Each has one value in all, one a curve,
// one a piece's end or one a point; empty if absent. Names: FORMATS §1.2, Unreal groom attributes.
struct GroomAttributes {
    Attribute width, root_uv, id, group_id, guide, closest_guides, guide_weights;
    TextAttribute group_name;
};

enum CurveType : int { cubic = 0, linear = 1, variable = 2 };
enum Basis : int { no_basis = 0, bezier = 1, bspline = 2, catmull_rom = 3 };

struct CurvesObject {
    std::string name, parent_name;
    Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
    int type = 0, wrap = 0, basis = 0;
    Attribute position, vertex_count, orders, knots, weights;
    std::size_t curve_count = 0, point_count = 0;
    GroomAttributes groom;
    bool is_hidden = false;

    // Points of a curve; their sum is point_count.
    std::size_t points_of(std::size_t curve) const {
        return static_cast<std::size_t>(vertex_count.integer(curve));
    }
};

// In the order of the file (a list that grows without moving what it holds), at the samples nearest
// to `time` (s); instances of other objects stand for those. `memory` bounds what the walk may take
// up beyond views into the file, in bytes. Errors (input): damage; a file whose objects contain
// each other, or would take more.
Result<std::deque<CurvesObject>> find_curves(ogawa::Archive& archive, double time,
                                             std::size_t memory);

}  // namespace keratin::alembic
