#include "tools/keratin-diff/compare_fields.h"

#include "tools/keratin-diff/number_text.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace keratin::diff {

namespace {

// An index field and the numbers that belong to its entries.
enum class Companionship {
    slots,   // several (index, weight) pairs an item whose order means nothing
    surface  // a triangle and the barycentrics on it
};
struct Companions {
    std::string_view index, numbers;
    Companionship kind;
};
constexpr Companions kCompanions[] = {
    {"guide_bone", "guide_bone_weight", Companionship::slots},
    {"guide_triangle", "guide_barycentric", Companionship::surface},
    {"strand_guide", "strand_weight", Companionship::slots},
    {"strand_bone", "strand_bone_weight", Companionship::slots},
    {"strand_triangle", "strand_barycentric", Companionship::surface},
};
const Companions* companions_of(std::string_view name) {
    for (const Companions& c : kCompanions)
        if (name == c.index || name == c.numbers) return &c;
    return nullptr;
}

constexpr std::size_t kMostSlots = 4;

// A field by its name; empty when the asset does not have it.
template <class Element>
std::span<const Element> find_field(const AssetFields& fields, std::string_view name) {
    std::span<const Element> found;
    for_each_field(fields,
                   [&]<class Other>(const FieldDescription& field, std::span<const Other> values) {
                       if constexpr (std::is_same_v<Other, Element>)
                           if (field.name == name) found = values;
                   });
    return found;
}

// The values are reordered.
Spread spread_of(std::vector<float>& values) {
    Spread spread;
    if (values.empty()) return spread;
    double squares = 0;
    for (const float value : values) {
        squares += double(value) * value;
        spread.max = std::max<double>(spread.max, value);
    }
    spread.rms = std::sqrt(squares / double(values.size()));
    // Nearest rank: the smallest value that 99 of 100 do not exceed.
    const std::size_t rank = (values.size() * 99 + 99) / 100 - 1;
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(rank), values.end());
    spread.p99 = values[rank];
    return spread;
}

class FieldComparer {
  public:
    FieldComparer(const AssetView& a, const AssetView& b, const Counterparts& pairs)
        : a_(a), b_(b), pairs_(pairs) {}

    template <class Element>
    FieldDifference difference(const FieldDescription& field, std::span<const Element> a,
                               std::span<const Element> b);

  private:
    std::array<double, 3> surface_point(const AssetView& asset, std::uint32_t triangle, float u,
                                        float v, bool& stored) const;
    template <class ValueA, class ValueB, class Keep>
    void compare_numbers(const FieldDescription& field, ValueA&& value_a, ValueB&& value_b,
                         Keep&& keep, FieldDifference& out);
    template <class ValueA, class ValueB>
    void compare_integers(const FieldDescription& field, ValueA&& value_a, ValueB&& value_b,
                          FieldDifference& out);
    void find_shift(const FieldDescription& field, std::span<const float> a,
                    std::span<const float> b, FieldDifference& out) const;
    void compare_slot_indices(const FieldDescription& field, const Companions& companions,
                              FieldDifference& out);
    void compare_slot_weights(const FieldDescription& field, const Companions& companions,
                              FieldDifference& out);
    void compare_triangles(const FieldDescription& field, const Companions& companions,
                           FieldDifference& out);
    void compare_tiles(FieldDifference& out) const;
    void compare_point_counts(FieldDifference& out) const;
    double curve_distance(std::uint32_t in_a, std::uint32_t in_b) const;

    const AssetView &a_, &b_;
    const Counterparts& pairs_;
    std::vector<float> distances_;  // scratch of one field
};

std::array<double, 3> FieldComparer::surface_point(const AssetView& asset, std::uint32_t triangle,
                                                   float u, float v, bool& stored) const {
    const AssetFields& fields = asset.fields();
    std::size_t at = triangle;
    if (!fields.mesh_triangle_source.empty()) {
        const auto& sources = fields.mesh_triangle_source;
        const auto found = std::lower_bound(sources.begin(), sources.end(), triangle);
        stored = stored && found != sources.end() && *found == triangle;
        at = std::size_t(found - sources.begin());
    }
    stored = stored && at < fields.mesh_triangle.size() / 3;
    if (!stored) return {};
    double corner[3][3];
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
            corner[k][axis] = fields.mesh_position[3 * fields.mesh_triangle[3 * at + k] + axis];
    std::array<double, 3> point{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        point[axis] = (1.0 - u - v) * corner[0][axis] + u * corner[1][axis] + v * corner[2][axis];
    return point;
}

template <class ValueA, class ValueB, class Keep>
void FieldComparer::compare_numbers(const FieldDescription& field, ValueA&& value_a,
                                    ValueB&& value_b, Keep&& keep, FieldDifference& out) {
    const std::size_t components = field.components;
    const bool is_vector = field.unit == "m" && components == 3;
    distances_.clear();
    double worst = 0;
    Pair worst_pair{};
    pairs_.for_each_pair(field.domain, [&](const Pair& pair) {
        if (!keep(pair)) return;
        double sum = 0, largest = 0;
        for (std::size_t c = 0; c < components; ++c) {
            const double d = double(value_b(pair, c)) - double(value_a(pair, c));
            sum += d * d;
            largest = std::max(largest, std::abs(d));
        }
        const double distance = is_vector ? std::sqrt(sum) : largest;
        out.differing += largest > 0;
        if (distance > worst) {
            worst = distance;
            worst_pair = pair;
        }
        distances_.push_back(static_cast<float>(distance));
    });
    out.compared = distances_.size();
    if (out.differing == 0) return;
    out.spread = spread_of(distances_);
    out.spread.max = worst;
    Worst& entry = out.worst.emplace();
    entry.item = pairs_.item_name(field.domain, worst_pair.owner_a);
    if (worst_pair.point != kNoMatch) entry.point = worst_pair.point;
    for (std::size_t c = 0; c < components; ++c) {
        entry.a.push_back(value_a(worst_pair, c));
        entry.b.push_back(value_b(worst_pair, c));
    }
}

template <class ValueA, class ValueB>
void FieldComparer::compare_integers(const FieldDescription& field, ValueA&& value_a,
                                     ValueB&& value_b, FieldDifference& out) {
    pairs_.for_each_pair(field.domain, [&](const Pair& pair) {
        ++out.compared;
        bool same = true;
        for (std::size_t c = 0; c < field.components; ++c)
            same = same && pairs_.counterpart(field.target, value_a(pair, c)) == value_b(pair, c);
        if (same) return;
        if (++out.differing > 1) return;
        Worst& entry = out.worst.emplace();
        entry.item = pairs_.item_name(field.domain, pair.owner_a);
        if (pair.point != kNoMatch) entry.point = pair.point;
        for (std::size_t c = 0; c < field.components; ++c) {
            pairs_.describe_index(a_, field.target, value_a(pair, c), entry.a, entry.a_names);
            pairs_.describe_index(b_, field.target, value_b(pair, c), entry.b, entry.b_names);
        }
    });
}

void FieldComparer::find_shift(const FieldDescription& field, std::span<const float> a,
                               std::span<const float> b, FieldDifference& out) const {
    const auto delta = [&](const Pair& pair, std::size_t axis) {
        return double(b[element_index(field.domain, pair.b, 3, axis)]) -
               double(a[element_index(field.domain, pair.a, 3, axis)]);
    };
    std::array<double, 3> mean{};
    double largest = 0;
    pairs_.for_each_pair(field.domain, [&](const Pair& pair) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            mean[axis] += delta(pair, axis) / double(out.compared);
            const std::size_t at = element_index(field.domain, pair.b, 3, axis);
            largest = std::max<double>(largest, std::abs(b[at]));
        }
    });
    // Coordinates before and after the shift are each rounded to float.
    const double rounding = 4 * std::numeric_limits<float>::epsilon() *
                            (largest + std::hypot(mean[0], mean[1], mean[2]));
    bool explains = true;
    pairs_.for_each_pair(field.domain, [&](const Pair& pair) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            explains = explains && std::abs(delta(pair, axis) - mean[axis]) <= rounding;
    });
    if (explains) out.shift = mean;
}

// The (index, number) entries of an item in an order that does not depend on the file's.
template <class Index>
struct SlotList {
    std::array<std::pair<Index, float>, kMostSlots> slot{};
    std::size_t count = 0;
    void add(Index index, float number) { slot[count++] = {index, number}; }
    void sort() { std::sort(slot.begin(), slot.begin() + std::ptrdiff_t(count)); }
};

struct SlotPair {
    SlotList<std::uint32_t> a, b;  // indices as those of b, sorted
    bool same_indices = true;
};

SlotPair slot_pair(const Pair& pair, Domain domain, std::size_t components, auto&& to_b,
                   std::span<const std::uint32_t> index_a, std::span<const float> number_a,
                   std::span<const std::uint32_t> index_b, std::span<const float> number_b) {
    SlotPair slots;
    for (std::size_t c = 0; c < components; ++c) {
        const std::size_t at_a = element_index(domain, pair.a, components, c);
        const std::size_t at_b = element_index(domain, pair.b, components, c);
        slots.a.add(to_b(index_a[at_a]), number_a[at_a]);
        slots.b.add(index_b[at_b], number_b[at_b]);
    }
    slots.a.sort();
    slots.b.sort();
    for (std::size_t c = 0; c < components; ++c)
        slots.same_indices = slots.same_indices && slots.a.slot[c].first == slots.b.slot[c].first;
    return slots;
}

void FieldComparer::compare_slot_indices(const FieldDescription& field,
                                         const Companions& companions, FieldDifference& out) {
    const auto index_a = find_field<std::uint32_t>(a_.fields(), companions.index);
    const auto index_b = find_field<std::uint32_t>(b_.fields(), companions.index);
    const auto number_a = find_field<float>(a_.fields(), companions.numbers);
    const auto number_b = find_field<float>(b_.fields(), companions.numbers);
    float worst = -1;  // the largest weight on an entry that has no counterpart
    pairs_.for_each_pair(field.domain, [&](const Pair& pair) {
        ++out.compared;
        const SlotPair slots = slot_pair(
            pair, field.domain, field.components,
            [&](std::uint32_t i) { return pairs_.counterpart(field.target, i); }, index_a, number_a,
            index_b, number_b);
        if (slots.same_indices) return;
        ++out.differing;
        float weight = 0;
        for (std::size_t c = 0; c < field.components; ++c) {
            const std::uint32_t index = slots.a.slot[c].first;
            const auto is_it = [&](const auto& slot) { return slot.first == index; };
            const auto* end = slots.b.slot.data() + field.components;
            if (std::find_if(slots.b.slot.data(), end, is_it) == end)
                weight = std::max(weight, slots.a.slot[c].second);
        }
        if (weight <= worst) return;
        worst = weight;
        Worst& entry = out.worst.emplace();
        entry.item = pairs_.item_name(field.domain, pair.owner_a);
        for (std::size_t c = 0; c < field.components; ++c) {
            pairs_.describe_index(a_, field.target,
                                  index_a[element_index(field.domain, pair.a, field.components, c)],
                                  entry.a, entry.a_names);
            pairs_.describe_index(b_, field.target,
                                  index_b[element_index(field.domain, pair.b, field.components, c)],
                                  entry.b, entry.b_names);
        }
    });
}

void FieldComparer::compare_slot_weights(const FieldDescription& field,
                                         const Companions& companions, FieldDifference& out) {
    const auto index_a = find_field<std::uint32_t>(a_.fields(), companions.index);
    const auto index_b = find_field<std::uint32_t>(b_.fields(), companions.index);
    const auto number_a = find_field<float>(a_.fields(), companions.numbers);
    const auto number_b = find_field<float>(b_.fields(), companions.numbers);
    Domain target = Domain::none;
    for (const FieldDescription& other : kAssetFields)
        if (other.name == companions.index) target = other.target;

    // Weights belong to what they weigh. Where that changed, only the weights themselves are
    // compared, largest first.
    const auto slots_of = [&](const Pair& pair) {
        SlotPair slots = slot_pair(
            pair, field.domain, field.components,
            [&](std::uint32_t i) { return pairs_.counterpart(target, i); }, index_a, number_a,
            index_b, number_b);
        if (!slots.same_indices)
            for (auto* list : {&slots.a, &slots.b}) {
                for (auto& slot : list->slot) slot.first = 0;
                list->sort();
            }
        return slots;
    };
    // Sorted once an item: the numbers of a pair are asked for component by component.
    std::size_t last = std::numeric_limits<std::size_t>::max();
    SlotPair slots;
    const auto refresh = [&](const Pair& pair) {
        if (pair.a == last) return;
        slots = slots_of(pair);
        last = pair.a;
    };
    const auto value_a = [&](const Pair& pair, std::size_t c) {
        refresh(pair);
        return slots.a.slot[c].second;
    };
    const auto value_b = [&](const Pair& pair, std::size_t c) {
        refresh(pair);
        return slots.b.slot[c].second;
    };
    compare_numbers(
        field, value_a, value_b, [](const Pair&) { return true; }, out);
}

void FieldComparer::compare_triangles(const FieldDescription& field, const Companions& companions,
                                      FieldDifference& out) {
    if (!pairs_.same_topology()) {
        pairs_.for_each_pair(field.domain, [&](const Pair&) { ++out.not_compared; });
        out.note = "not compared: triangle numbers of meshes with different topology mean nothing";
        return;
    }
    const AssetFields &fa = a_.fields(), &fb = b_.fields();
    const auto triangle_a = find_field<std::uint32_t>(fa, companions.index);
    const auto triangle_b = find_field<std::uint32_t>(fb, companions.index);
    const auto uv_a = find_field<float>(fa, companions.numbers);
    const auto uv_b = find_field<float>(fb, companions.numbers);
    // Where a root is without the mesh: the first point.
    const auto root = [&](const AssetFields& fields, std::uint32_t owner, std::size_t axis) {
        return field.domain == Domain::lane
                   ? fields.guide_position[vector_index(fields.tile_first_row[owner / kTileLanes],
                                                        3, axis, owner % kTileLanes)]
                   : fields.strand_position[3 * fields.strand_first_point[owner] + axis];
    };
    bool all_stored = true;
    double worst = -1;
    distances_.clear();
    pairs_.for_each_pair(field.domain, [&](const Pair& pair) {
        ++out.compared;
        if (triangle_a[pair.a] == triangle_b[pair.b]) return;
        ++out.differing;
        const auto uv = [&](std::span<const float> values, std::size_t item, std::size_t c) {
            return values[element_index(field.domain, item, 2, c)];
        };
        bool stored = !uv_a.empty() && !uv_b.empty();
        std::array<double, 3> from{}, to{};
        if (stored) {
            from = surface_point(a_, triangle_a[pair.a], uv(uv_a, pair.a, 0), uv(uv_a, pair.a, 1),
                                 stored);
            to = surface_point(b_, triangle_b[pair.b], uv(uv_b, pair.b, 0), uv(uv_b, pair.b, 1),
                               stored);
        }
        if (!stored)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                from[axis] = root(fa, pair.owner_a, axis);
                to[axis] = root(fb, pair.owner_b, axis);
            }
        all_stored = all_stored && stored;
        const double moved = std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        distances_.push_back(static_cast<float>(moved));
        if (moved <= worst) return;
        worst = moved;
        Worst& entry = out.worst.emplace();
        entry.item = pairs_.item_name(field.domain, pair.owner_a);
        entry.a = {double(triangle_a[pair.a])};
        entry.b = {double(triangle_b[pair.b])};
        entry.moved = moved;
    });
    if (out.differing == 0) return;
    out.moved = spread_of(distances_);
    if (!all_stored)
        out.note = "the mesh is not stored everywhere: there, the roots themselves are measured";
}

void FieldComparer::compare_tiles(FieldDifference& out) const {
    // Tiles follow from the guides and their point counts; where these changed, so must the tiles.
    bool guides_same = true;
    for (std::uint32_t i = 0; i < pairs_.guides().to_b.size(); ++i)
        guides_same = guides_same && (a_.fields().guide_point_count[i] == 0 ||
                                      (pairs_.guides().to_b[i] != kNoMatch &&
                                       a_.fields().guide_point_count[i] ==
                                           b_.fields().guide_point_count[pairs_.guides().to_b[i]]));
    for (std::uint32_t i = 0; i < pairs_.guides().to_a.size(); ++i)
        guides_same = guides_same && (b_.fields().guide_point_count[i] == 0 ||
                                      pairs_.guides().to_a[i] != kNoMatch);
    const auto &first_a = a_.fields().tile_first_row, &first_b = b_.fields().tile_first_row;
    const std::size_t tiles = std::max(first_a.size(), first_b.size()) - 1;
    if (!guides_same) {
        out.not_compared = tiles;
        out.note = "not compared: tiles follow from the guides, which changed";
        return;
    }
    const auto rows = [](std::span<const std::uint32_t> first, std::size_t t) {
        return t + 1 < first.size() ? first[t + 1] - first[t] : 0;
    };
    out.compared = tiles;
    for (std::size_t t = 0; t < tiles; ++t) {
        if (rows(first_a, t) == rows(first_b, t)) continue;
        if (++out.differing > 1) continue;
        Worst& entry = out.worst.emplace();
        entry.item = "rows of tile " + std::to_string(t);
        entry.a = {double(rows(first_a, t))};
        entry.b = {double(rows(first_b, t))};
    }
}

// m: the largest distance between the two curves at equal shares of their lengths.
double FieldComparer::curve_distance(std::uint32_t in_a, std::uint32_t in_b) const {
    struct Curve {
        std::vector<std::array<double, 3>> point;
        std::vector<double> share;  // of the length, 0..1
        Curve(const AssetView& asset, std::uint32_t strand) {
            const AssetFields& fields = asset.fields();
            const std::size_t first = fields.strand_first_point[strand];
            const std::size_t last = fields.strand_first_point[strand + 1];
            for (std::size_t p = first; p < last; ++p) {
                const float* x = fields.strand_position.data() + 3 * p;
                point.push_back({x[0], x[1], x[2]});
                const auto& here = point.back();
                const auto& before = point[point.size() < 2 ? 0 : point.size() - 2];
                share.push_back(
                    (share.empty() ? 0 : share.back()) +
                    std::hypot(here[0] - before[0], here[1] - before[1], here[2] - before[2]));
            }
            const double length = share.back();
            if (length > 0)
                for (double& s : share) s /= length;
        }
        std::array<double, 3> at(double s) const {
            const auto after = std::lower_bound(share.begin() + 1, share.end() - 1, s);
            const std::size_t p = std::size_t(after - share.begin());
            const double span = share[p] - share[p - 1];
            const double t = span > 0 ? (s - share[p - 1]) / span : 0;
            std::array<double, 3> x{};
            for (std::size_t axis = 0; axis < 3; ++axis)
                x[axis] = point[p - 1][axis] + t * (point[p][axis] - point[p - 1][axis]);
            return x;
        }
    };
    const Curve a(a_, in_a), b(b_, in_b);
    double largest = 0;
    for (const auto& [from, to] : {std::pair{&a, &b}, std::pair{&b, &a}})
        for (std::size_t p = 0; p < from->point.size(); ++p) {
            const auto x = from->point[p], y = to->at(from->share[p]);
            largest = std::max(largest, std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]));
        }
    return largest;
}

void FieldComparer::compare_point_counts(FieldDifference& out) const {
    double apart = 0;
    std::int64_t worst = 0;
    pairs_.for_each_pair(Domain::strand, [&](const Pair& pair) {
        ++out.compared;
        const std::uint32_t count_a = point_count(a_, pair.owner_a);
        const std::uint32_t count_b = point_count(b_, pair.owner_b);
        if (count_a == count_b) return;
        ++out.differing;
        apart = std::max(apart, curve_distance(pair.owner_a, pair.owner_b));
        const std::int64_t change = std::abs(std::int64_t{count_a} - count_b);
        if (change <= worst) return;
        worst = change;
        Worst& entry = out.worst.emplace();
        entry.item = "points of " + pairs_.item_name(Domain::strand, pair.owner_a);
        entry.a = {double(count_a)};
        entry.b = {double(count_b)};
    });
    if (out.differing > 0)
        out.note = "these curves are at most " + length_text(apart) +
                   " apart at equal shares of their lengths";
}

template <class Element>
FieldDifference FieldComparer::difference(const FieldDescription& field, std::span<const Element> a,
                                          std::span<const Element> b) {
    FieldDifference out;
    out.name = field.name;
    out.unit = field.unit;
    out.is_float = field.is_float;

    if (field.name == "tile_first_row") {
        compare_tiles(out);
        return out;
    }
    if (field.name == "strand_first_point") {
        compare_point_counts(out);
        return out;
    }

    const std::size_t components = field.components;
    const auto stored = [&](std::span<const Element> values, std::size_t item, std::size_t c) {
        return values[element_index(field.domain, item, components, c)];
    };
    // What an absent field stands for, where fields.h says it.
    const auto default_value = [&](const AssetView& asset, std::uint32_t owner, std::size_t item,
                                   std::uint32_t point) -> std::optional<Element> {
        if constexpr (std::is_same_v<Element, float>) {
            if (field.name == "strand_fraction")
                return float(point) / float(point_count(asset, owner) - 1);
            if (field.name == "strand_radius")
                return asset.info().groups[asset.fields().strand_group[owner]].material.radius;
        } else {
            if (field.name == "mesh_vertex_source" || field.name == "mesh_triangle_source")
                return static_cast<std::uint32_t>(item);
        }
        return {};
    };
    const bool has_default = field.name == "strand_fraction" || field.name == "strand_radius" ||
                             field.name == "mesh_vertex_source" ||
                             field.name == "mesh_triangle_source";
    if (field.presence == Presence::optional) {
        if (a.empty() && b.empty()) return out;
        if (a.empty() != b.empty() && !has_default) {
            out.only_in_a = b.empty();
            out.only_in_b = a.empty();
            return out;
        }
    }
    if (const std::size_t left_out = pairs_.pairs_left_out(field.domain); left_out > 0) {
        out.not_compared = left_out;
        out.note = std::string("not compared on ") + std::to_string(left_out) +
                   (is_tiled(field.domain) ? " guides" : " strands") +
                   " whose number of points changed";
    }

    const auto value_a = [&](const Pair& pair, std::size_t c) {
        return a.empty() ? *default_value(a_, pair.owner_a, pair.a, pair.point)
                         : stored(a, pair.a, c);
    };
    const auto value_b = [&](const Pair& pair, std::size_t c) {
        return b.empty() ? *default_value(b_, pair.owner_b, pair.b, pair.point)
                         : stored(b, pair.b, c);
    };
    const Companions* companions = companions_of(field.name);
    // With its companion missing on one side an index stands for itself.
    const auto complete = [&](const Companions& c) {
        return !find_field<std::uint32_t>(a_.fields(), c.index).empty() &&
               !find_field<std::uint32_t>(b_.fields(), c.index).empty() &&
               !find_field<float>(a_.fields(), c.numbers).empty() &&
               !find_field<float>(b_.fields(), c.numbers).empty();
    };
    if constexpr (std::is_same_v<Element, float>) {
        if (companions && companions->kind == Companionship::slots && complete(*companions)) {
            compare_slot_weights(field, *companions, out);
        } else if (companions && companions->kind == Companionship::surface &&
                   complete(*companions)) {
            const auto triangle_a = find_field<std::uint32_t>(a_.fields(), companions->index);
            const auto triangle_b = find_field<std::uint32_t>(b_.fields(), companions->index);
            const bool same = pairs_.same_topology();
            compare_numbers(
                field, value_a, value_b,
                [&](const Pair& p) {
                    const bool keep = same && triangle_a[p.a] == triangle_b[p.b];
                    out.not_compared += !keep;
                    return keep;
                },
                out);
            if (out.not_compared > 0) out.note = "not compared for roots on other triangles";
        } else {
            compare_numbers(
                field, value_a, value_b, [](const Pair&) { return true; }, out);
        }
        const bool is_position = field.unit == "m" && field.name.ends_with("_position");
        if (is_position && out.differing > 1 && out.differing == out.compared)
            find_shift(field, a, b, out);
    } else {
        if (companions && companions->kind == Companionship::slots && complete(*companions))
            compare_slot_indices(field, *companions, out);
        else if (companions && companions->kind == Companionship::surface)
            compare_triangles(field, *companions, out);
        else
            compare_integers(field, value_a, value_b, out);
    }
    return out;
}

}  // namespace

std::vector<FieldDifference> compare_fields(const AssetView& a, const AssetView& b,
                                            const Counterparts& counterparts) {
    FieldComparer comparer(a, b, counterparts);
    std::vector<FieldDifference> fields;
    std::size_t i = 0;
#define X(name, element, domain, components, presence, target, unit, meaning) \
    fields.push_back(                                                         \
        comparer.difference<element>(kAssetFields[i++], a.fields().name, b.fields().name));
    KERATIN_ASSET_FIELDS(X)
#undef X
    return fields;
}

double FieldDifference::value() const {
    if (only_in_a || only_in_b) return std::numeric_limits<double>::infinity();
    return is_float ? spread.max : double(differing);
}

}  // namespace keratin::diff
