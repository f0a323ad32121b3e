// Compares two assets and says what changed, as plain values: the strands and guides that were
// added, removed or put into another order; every field of schema/fields.h, item by item between
// counterparts (match.h); and apart from these data, the settings and where the asset came from.
// Nothing is judged here; tolerances are in judge.h.
#pragma once

#include "schema/asset_view.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace keratin::diff {

// Items of a list that came, went or changed places. `what` names them in texts.
struct ListChange {
    std::size_t a_count = 0, b_count = 0, matched = 0;
    std::vector<std::uint32_t> added, removed;  // ids or source numbers, the first kNamedItems
    std::size_t added_count = 0, removed_count = 0;
    // Relative to the other matched items; not counted for the mesh, where order means nothing.
    std::size_t reordered_count = 0;
    struct Place {
        std::uint32_t id = 0, a = 0, b = 0;
    };
    std::optional<Place> reordered_example;
};
inline constexpr std::size_t kNamedItems = 8;

// The item that differs most, with both values: one a component, in the field's unit. An index is
// given as the id (of a strand, or of the strand that is the guide), source number (of the mesh) or
// name (of a group or bone) of what it points to.
struct Worst {
    std::string item;  // "strand 17", "guide of strand 17", "vertex 4": ids and source numbers
    std::optional<std::uint32_t> point;  // along the strand, root = 0
    std::vector<double> a, b;
    std::vector<std::string> a_names, b_names;  // groups and bones, instead of numbers
    std::optional<double> moved;                // m: of roots on another triangle
};

// Of distances or differences.
struct Spread {
    double max = 0, p99 = 0, rms = 0;
};

// Number fields: differences between counterparts, of vectors in m their length, else the largest
// of the components. Index fields: the two items point to things that are not counterparts.
struct FieldDifference {
    std::string_view name, unit;
    bool is_float = false;
    std::size_t compared = 0, differing = 0;  // items (a point, a strand, a vertex, ...)
    bool only_in_a = false, only_in_b = false;
    Spread spread;  // floats only, in the field's unit, over all compared items
    // Roots on other triangles: how far they moved over the stored mesh, or in space where it is
    // not stored; m, over the items that differ.
    std::optional<Spread> moved;
    // Positions only: the same shift of every item, when that explains all of it.
    std::optional<std::array<double, 3>> shift;
    std::optional<Worst> worst;
    // Items left out because their counterparts cannot be laid side by side; why is in `note`.
    std::size_t not_compared = 0;
    std::string note;

    bool differs() const { return differing > 0 || only_in_a || only_in_b; }
    // What tolerances are compared with: max of a float field, items that differ of any other;
    // infinite when the field is there on one side only.
    double value() const;
};

// A value outside the bulk fields: "groups[fringe].strand.damping", "0.05", "0.1".
struct ValueChange {
    std::string path, a, b;  // empty text: not there
};

struct Report {
    double diagonal = 0;                              // m, of the box around the strands of a
    ListChange strands, guides, vertices, triangles;  // the last two: of the stored mesh
    std::vector<FieldDifference> fields;              // all of schema/fields.h, in that order
    std::vector<ValueChange> mesh;                    // counts and topology of the source mesh
    std::vector<ValueChange> bounds;                  // only when no strand explains them
    std::vector<ValueChange> settings;  // attach, groups with materials, bones, colliders
    std::vector<ValueChange> recipe, inputs, tool_version;  // where the asset came from
    bool same_bytes = false;
};

Report compare(const AssetView& a, const AssetView& b);

}  // namespace keratin::diff
