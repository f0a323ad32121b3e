#include "tools/keratin-diff/compare.h"

#include "tools/keratin-diff/match.h"
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

bool is_tiled(Domain domain) { return domain == Domain::lane || domain == Domain::row; }

// An item of a and its counterpart in b.
struct Pair {
    std::uint32_t owner_a, owner_b;  // strand, guide (lane index), vertex, triangle or brick
    std::size_t a, b;                // item within its domain: schema/layout.h's scalar index
    std::uint32_t point = kNoMatch;  // of point and row domains
};

bool same_lattice(const DistanceGridInfo& a, const DistanceGridInfo& b) {
    return a.origin == b.origin && a.spacing == b.spacing && a.bricks == b.bricks;
}

std::size_t element_index(Domain domain, std::size_t item, std::size_t components, std::size_t c) {
    return is_tiled(domain) ? vector_index(item / kTileLanes, components, c, item % kTileLanes)
                            : item * components + c;
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

class Comparer {
  public:
    Comparer(const AssetView& a, const AssetView& b)
        : a_(a),
          b_(b),
          strands_(match_strands(a, b)),
          guides_(match_guides(a, b, strands_)),
          vertices_(match_vertices(a, b)),
          triangles_(match_triangles(a, b, vertices_)),
          groups_(match_names(group_names(a), group_names(b))),
          bones_(match_names(a.info().bones, b.info().bones)) {}

    Report run();

  private:
    static std::vector<std::string> group_names(const AssetView& asset) {
        std::vector<std::string> names;
        for (const GroupInfo& group : asset.info().groups) names.push_back(group.name);
        return names;
    }

    const AssetView &a_, &b_;
    Match strands_, guides_, vertices_, triangles_, groups_, bones_;
    std::vector<float> distances_;  // scratch of one field

    std::uint32_t point_count(const AssetView& asset, std::uint32_t strand) const {
        const auto& first = asset.fields().strand_first_point;
        return first[strand + 1] - first[strand];
    }
    bool same_topology() const {
        return a_.info().mesh_topology_hash == b_.info().mesh_topology_hash;
    }

    template <class Visit>
    void for_each_pair(Domain domain, Visit&& visit) const;
    std::size_t pairs_left_out(Domain domain) const;

    // Names for people: ids and source numbers instead of places in the file.
    std::uint32_t guide_id(const AssetView& asset, std::uint32_t guide) const {
        const std::uint32_t strand = asset.fields().guide_strand[guide];
        return strand == kNoStrand ? kNoStrand : asset.fields().strand_id[strand];
    }
    static std::uint32_t source(std::span<const std::uint32_t> sources, std::uint32_t i) {
        return sources.empty() ? i : sources[i];
    }
    std::string item_name(Domain domain, std::uint32_t owner) const;

    const Match* match_of(Domain target) const;
    // The counterpart in b of what an entry of a points to; kNoMatch: there is none.
    std::uint32_t counterpart(Domain target, std::uint32_t index) const {
        const Match* match = match_of(target);
        if (!match || index == kNoStrand) return index;
        return match->to_b[index];
    }
    void describe_index(const AssetView& asset, Domain target, std::uint32_t index,
                        std::vector<double>& numbers, std::vector<std::string>& names) const;

    std::array<double, 3> surface_point(const AssetView& asset, std::uint32_t triangle, float u,
                                        float v, bool& stored) const;

    ListChange list_change(const Match& match, Domain domain, bool ordered) const;

    template <class Element>
    FieldDifference difference(const FieldDescription& field, std::span<const Element> a,
                               std::span<const Element> b);
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

    void compare_groups(std::vector<ValueChange>& out) const;
    void compare_colliders(std::vector<ValueChange>& out) const;
    void compare_info(Report& report) const;
};

template <class Visit>
void Comparer::for_each_pair(Domain domain, Visit&& visit) const {
    const auto each = [&](const Match& match, auto&& inner) {
        for (std::uint32_t i = 0; i < match.to_b.size(); ++i)
            if (match.to_b[i] != kNoMatch) inner(i, match.to_b[i]);
    };
    const auto itself = [&](std::uint32_t i, std::uint32_t j) { visit(Pair{i, j, i, j}); };
    switch (domain) {
        case Domain::strand:
            return each(strands_, itself);
        case Domain::lane:
            return each(guides_, itself);
        case Domain::vertex:
            return each(vertices_, itself);
        case Domain::triangle:
            return each(triangles_, itself);
        case Domain::point:
            return each(strands_, [&](std::uint32_t i, std::uint32_t j) {
                const std::uint32_t count = point_count(a_, i);
                if (count != point_count(b_, j)) return;
                const std::size_t first_a = a_.fields().strand_first_point[i];
                const std::size_t first_b = b_.fields().strand_first_point[j];
                for (std::uint32_t p = 0; p < count; ++p)
                    visit(Pair{i, j, first_a + p, first_b + p, p});
            });
        case Domain::row:
            return each(guides_, [&](std::uint32_t i, std::uint32_t j) {
                const AssetFields &fa = a_.fields(), &fb = b_.fields();
                const std::uint32_t count = fa.guide_point_count[i];
                if (count != fb.guide_point_count[j]) return;
                const std::size_t row_a = fa.tile_first_row[i / kTileLanes];
                const std::size_t row_b = fb.tile_first_row[j / kTileLanes];
                for (std::uint32_t p = 0; p < count; ++p)
                    visit(Pair{i, j, scalar_index(row_a + p, i % kTileLanes),
                               scalar_index(row_b + p, j % kTileLanes), p});
            });
        case Domain::brick:
        case Domain::brick_node: {
            // Bricks answer to each other when both grids have the same lattice.
            const AssetFields &fa = a_.fields(), &fb = b_.fields();
            if (!same_lattice(a_.info().distance_grid, b_.info().distance_grid)) return;
            for (std::uint32_t i = 0; i < fa.grid_brick.size(); ++i) {
                if (domain == Domain::brick) {
                    itself(i, i);
                } else if (fa.grid_brick[i] != kNoBrick && fb.grid_brick[i] != kNoBrick) {
                    for (std::size_t n = 0; n < kBrickNodes; ++n)
                        visit(Pair{i, i, std::size_t{fa.grid_brick[i]} * kBrickNodes + n,
                                   std::size_t{fb.grid_brick[i]} * kBrickNodes + n});
                }
            }
            return;
        }
        default:
            return;
    }
}

std::size_t Comparer::pairs_left_out(Domain domain) const {
    std::size_t count = 0;
    if (domain == Domain::point)
        for_each_pair(Domain::strand, [&](const Pair& pair) {
            count += point_count(a_, pair.owner_a) != point_count(b_, pair.owner_b);
        });
    if (domain == Domain::row)
        for_each_pair(Domain::lane, [&](const Pair& pair) {
            count += a_.fields().guide_point_count[pair.a] != b_.fields().guide_point_count[pair.b];
        });
    return count;
}

std::string Comparer::item_name(Domain domain, std::uint32_t owner) const {
    const AssetFields& fields = a_.fields();
    switch (domain) {
        case Domain::lane:
        case Domain::row:
            return "guide of strand " + std::to_string(guide_id(a_, owner));
        case Domain::vertex:
            return "vertex " + std::to_string(source(fields.mesh_vertex_source, owner));
        case Domain::triangle:
            return "triangle " + std::to_string(source(fields.mesh_triangle_source, owner));
        case Domain::brick:
        case Domain::brick_node:
            return "brick " + std::to_string(owner) + " of the distance grid";
        default:
            return "strand " + std::to_string(fields.strand_id[owner]);
    }
}

const Match* Comparer::match_of(Domain target) const {
    switch (target) {
        case Domain::strand:
            return &strands_;
        case Domain::lane:
            return &guides_;
        case Domain::vertex:
            return &vertices_;
        case Domain::triangle:
            return &triangles_;
        case Domain::group:
            return &groups_;
        case Domain::bone:
            return &bones_;
        default:
            return nullptr;
    }
}

void Comparer::describe_index(const AssetView& asset, Domain target, std::uint32_t index,
                              std::vector<double>& numbers, std::vector<std::string>& names) const {
    const AssetFields& fields = asset.fields();
    switch (target) {
        case Domain::group:
            return names.push_back(asset.info().groups[index].name);
        case Domain::bone:
            return names.push_back(asset.info().bones[index]);
        case Domain::strand:
            return numbers.push_back(index == kNoStrand ? index : fields.strand_id[index]);
        case Domain::lane:
            return numbers.push_back(guide_id(asset, index));
        case Domain::vertex:
            return numbers.push_back(source(fields.mesh_vertex_source, index));
        case Domain::triangle:
            return numbers.push_back(source(fields.mesh_triangle_source, index));
        case Domain::stored_brick:  // where it is stored does not matter, only whether
            return numbers.push_back(index == kNoBrick ? 0 : 1);
        default:
            return numbers.push_back(index);
    }
}

std::array<double, 3> Comparer::surface_point(const AssetView& asset, std::uint32_t triangle,
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

ListChange Comparer::list_change(const Match& match, Domain domain, bool ordered) const {
    ListChange change;
    const auto id = [&](const AssetView& asset, std::uint32_t item) -> std::uint32_t {
        switch (domain) {
            case Domain::lane:
                return guide_id(asset, item);
            case Domain::vertex:
                return source(asset.fields().mesh_vertex_source, item);
            case Domain::triangle:
                return source(asset.fields().mesh_triangle_source, item);
            default:
                return asset.fields().strand_id[item];
        }
    };
    const auto exists = [&](const AssetView& asset, std::uint32_t item) {
        return domain != Domain::lane || asset.fields().guide_point_count[item] > 0;
    };
    for (std::uint32_t i = 0; i < match.to_b.size(); ++i) {
        if (!exists(a_, i)) continue;
        ++change.a_count;
        if (match.to_b[i] != kNoMatch) {
            ++change.matched;
        } else if (++change.removed_count <= kNamedItems) {
            change.removed.push_back(id(a_, i));
        }
    }
    for (std::uint32_t i = 0; i < match.to_a.size(); ++i) {
        if (!exists(b_, i)) continue;
        ++change.b_count;
        if (match.to_a[i] == kNoMatch && ++change.added_count <= kNamedItems)
            change.added.push_back(id(b_, i));
    }
    if (ordered) {
        const Reordered reordered = count_reordered(match);
        change.reordered_count = reordered.count;
        if (reordered.count > 0)
            change.reordered_example = ListChange::Place{
                id(a_, reordered.example), reordered.example, match.to_b[reordered.example]};
    }
    return change;
}

template <class ValueA, class ValueB, class Keep>
void Comparer::compare_numbers(const FieldDescription& field, ValueA&& value_a, ValueB&& value_b,
                               Keep&& keep, FieldDifference& out) {
    const std::size_t components = field.components;
    const bool is_vector = field.unit == "m" && components == 3;
    distances_.clear();
    double worst = 0;
    Pair worst_pair{};
    for_each_pair(field.domain, [&](const Pair& pair) {
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
    entry.item = item_name(field.domain, worst_pair.owner_a);
    if (worst_pair.point != kNoMatch) entry.point = worst_pair.point;
    for (std::size_t c = 0; c < components; ++c) {
        entry.a.push_back(value_a(worst_pair, c));
        entry.b.push_back(value_b(worst_pair, c));
    }
}

template <class ValueA, class ValueB>
void Comparer::compare_integers(const FieldDescription& field, ValueA&& value_a, ValueB&& value_b,
                                FieldDifference& out) {
    for_each_pair(field.domain, [&](const Pair& pair) {
        ++out.compared;
        bool same = true;
        for (std::size_t c = 0; c < field.components; ++c)
            same = same && counterpart(field.target, value_a(pair, c)) == value_b(pair, c);
        if (same) return;
        if (++out.differing > 1) return;
        Worst& entry = out.worst.emplace();
        entry.item = item_name(field.domain, pair.owner_a);
        if (pair.point != kNoMatch) entry.point = pair.point;
        for (std::size_t c = 0; c < field.components; ++c) {
            describe_index(a_, field.target, value_a(pair, c), entry.a, entry.a_names);
            describe_index(b_, field.target, value_b(pair, c), entry.b, entry.b_names);
        }
    });
}

void Comparer::find_shift(const FieldDescription& field, std::span<const float> a,
                          std::span<const float> b, FieldDifference& out) const {
    const auto delta = [&](const Pair& pair, std::size_t axis) {
        return double(b[element_index(field.domain, pair.b, 3, axis)]) -
               double(a[element_index(field.domain, pair.a, 3, axis)]);
    };
    std::array<double, 3> mean{};
    double largest = 0;
    for_each_pair(field.domain, [&](const Pair& pair) {
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
    for_each_pair(field.domain, [&](const Pair& pair) {
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

void Comparer::compare_slot_indices(const FieldDescription& field, const Companions& companions,
                                    FieldDifference& out) {
    const auto index_a = find_field<std::uint32_t>(a_.fields(), companions.index);
    const auto index_b = find_field<std::uint32_t>(b_.fields(), companions.index);
    const auto number_a = find_field<float>(a_.fields(), companions.numbers);
    const auto number_b = find_field<float>(b_.fields(), companions.numbers);
    float worst = -1;  // the largest weight on an entry that has no counterpart
    for_each_pair(field.domain, [&](const Pair& pair) {
        ++out.compared;
        const SlotPair slots = slot_pair(
            pair, field.domain, field.components,
            [&](std::uint32_t i) { return counterpart(field.target, i); }, index_a, number_a,
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
        entry.item = item_name(field.domain, pair.owner_a);
        for (std::size_t c = 0; c < field.components; ++c) {
            describe_index(a_, field.target,
                           index_a[element_index(field.domain, pair.a, field.components, c)],
                           entry.a, entry.a_names);
            describe_index(b_, field.target,
                           index_b[element_index(field.domain, pair.b, field.components, c)],
                           entry.b, entry.b_names);
        }
    });
}

void Comparer::compare_slot_weights(const FieldDescription& field, const Companions& companions,
                                    FieldDifference& out) {
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
            [&](std::uint32_t i) { return counterpart(target, i); }, index_a, number_a, index_b,
            number_b);
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

void Comparer::compare_triangles(const FieldDescription& field, const Companions& companions,
                                 FieldDifference& out) {
    if (!same_topology()) {
        for_each_pair(field.domain, [&](const Pair&) { ++out.not_compared; });
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
    for_each_pair(field.domain, [&](const Pair& pair) {
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
        entry.item = item_name(field.domain, pair.owner_a);
        entry.a = {double(triangle_a[pair.a])};
        entry.b = {double(triangle_b[pair.b])};
        entry.moved = moved;
    });
    if (out.differing == 0) return;
    out.moved = spread_of(distances_);
    if (!all_stored)
        out.note = "the mesh is not stored everywhere: there, the roots themselves are measured";
}

void Comparer::compare_tiles(FieldDifference& out) const {
    // Tiles follow from the guides and their point counts; where these changed, so must the tiles.
    bool guides_same = true;
    for (std::uint32_t i = 0; i < guides_.to_b.size(); ++i)
        guides_same =
            guides_same &&
            (a_.fields().guide_point_count[i] == 0 ||
             (guides_.to_b[i] != kNoMatch &&
              a_.fields().guide_point_count[i] == b_.fields().guide_point_count[guides_.to_b[i]]));
    for (std::uint32_t i = 0; i < guides_.to_a.size(); ++i)
        guides_same =
            guides_same && (b_.fields().guide_point_count[i] == 0 || guides_.to_a[i] != kNoMatch);
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
double Comparer::curve_distance(std::uint32_t in_a, std::uint32_t in_b) const {
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

void Comparer::compare_point_counts(FieldDifference& out) const {
    double apart = 0;
    std::int64_t worst = 0;
    for_each_pair(Domain::strand, [&](const Pair& pair) {
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
        entry.item = "points of " + item_name(Domain::strand, pair.owner_a);
        entry.a = {double(count_a)};
        entry.b = {double(count_b)};
    });
    if (out.differing > 0)
        out.note = "these curves are at most " + length_text(apart) +
                   " apart at equal shares of their lengths";
}

template <class Element>
FieldDifference Comparer::difference(const FieldDescription& field, std::span<const Element> a,
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
    if (const std::size_t left_out = pairs_left_out(field.domain); left_out > 0) {
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
            const bool same = same_topology();
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

template <class Value>
void compare_value(const std::string& path, const Value& a, const Value& b,
                   std::vector<ValueChange>& out) {
    if (!(a == b)) out.push_back({path, value_text(a), value_text(b)});
}

void Comparer::compare_groups(std::vector<ValueChange>& out) const {
    const auto &list_a = a_.info().groups, &list_b = b_.info().groups;
    for (std::uint32_t i = 0; i < list_a.size(); ++i) {
        const GroupInfo& a = list_a[i];
        const std::string path = "groups[" + a.name + "]";
        if (groups_.to_b[i] == kNoMatch) {
            out.push_back({path, "there", ""});
            continue;
        }
        const GroupInfo& b = list_b[groups_.to_b[i]];
        const auto change = [&](const char* name, const auto& value_a, const auto& value_b) {
            compare_value(path + "." + name, value_a, value_b, out);
        };
        change("name", a.name, b.name);
        change("material.radius", a.material.radius, b.material.radius);
        change("material.radius2", a.material.radius2, b.material.radius2);
        change("material.density", a.material.density, b.material.density);
        change("material.youngs_modulus", a.material.youngs_modulus, b.material.youngs_modulus);
        change("material.poisson_ratio", a.material.poisson_ratio, b.material.poisson_ratio);
        change("material.viscosity", a.material.viscosity, b.material.viscosity);
        change("strand.damping", a.strand.damping, b.strand.damping);
        change("strand.friction", a.strand.friction, b.strand.friction);
        change("strand.volume", a.strand.volume, b.strand.volume);
        change("strand.iterations", a.strand.iterations, b.strand.iterations);
        change("strand.global_length", a.strand.global_length, b.strand.global_length);
        change("strand.length_damping", a.strand.length_damping, b.strand.length_damping);
        change("strand.wind_response", a.strand.wind_response, b.strand.wind_response);
    }
    for (std::uint32_t i = 0; i < list_b.size(); ++i)
        if (groups_.to_a[i] == kNoMatch)
            out.push_back({"groups[" + list_b[i].name + "]", "", "there"});
}

void Comparer::compare_colliders(std::vector<ValueChange>& out) const {
    const auto &list_a = a_.info().colliders, &list_b = b_.info().colliders;
    const auto bone = [](const AssetInfo& info, std::uint32_t i) {
        return i < info.bones.size() ? info.bones[i] : std::string("none");
    };
    for (std::size_t i = 0; i < std::max(list_a.size(), list_b.size()); ++i) {
        const std::string path = "colliders[" + std::to_string(i) + "]";
        if (i >= list_b.size()) {
            out.push_back({path, "there", ""});
        } else if (i >= list_a.size()) {
            out.push_back({path, "", "there"});
        } else {
            compare_value(path + ".a", list_a[i].a, list_b[i].a, out);
            compare_value(path + ".b", list_a[i].b, list_b[i].b, out);
            compare_value(path + ".radius", list_a[i].radius, list_b[i].radius, out);
            compare_value(path + ".bone", bone(a_.info(), list_a[i].bone),
                          bone(b_.info(), list_b[i].bone), out);
        }
    }
}

void Comparer::compare_info(Report& report) const {
    const AssetInfo &a = a_.info(), &b = b_.info();
    compare_value("vertices", a.mesh_vertex_count, b.mesh_vertex_count, report.mesh);
    compare_value("triangles", a.mesh_triangle_count, b.mesh_triangle_count, report.mesh);
    compare_value("topology", a.mesh_topology_hash, b.mesh_topology_hash, report.mesh);

    const auto differs = [&](std::string_view name) {
        return std::any_of(report.fields.begin(), report.fields.end(),
                           [&](const auto& f) { return f.name == name && f.differs(); });
    };
    if (report.strands.added_count + report.strands.removed_count == 0 &&
        !differs("strand_position") && !differs("strand_first_point")) {
        compare_value("min", a.bounds_min, b.bounds_min, report.bounds);
        compare_value("max", a.bounds_max, b.bounds_max, report.bounds);
    }

    const auto attach_name = [](Attach attach) -> std::string {
        switch (attach) {
            case Attach::bone:
                return "bone";
            case Attach::all:
                return "all";
            case Attach::triangle:
                return "triangle";
        }
        return "";
    };
    compare_value("attach", attach_name(a.attach), attach_name(b.attach), report.settings);
    compare_groups(report.settings);
    if (a.bones != b.bones) {
        for (std::size_t i = 0; i < a.bones.size(); ++i)
            if (bones_.to_b[i] == kNoMatch)
                report.settings.push_back({"bones[" + a.bones[i] + "]", "there", ""});
            else
                compare_value("bones[" + a.bones[i] + "]", a.bones[i], b.bones[bones_.to_b[i]],
                              report.settings);
        for (std::size_t i = 0; i < b.bones.size(); ++i)
            if (bones_.to_a[i] == kNoMatch)
                report.settings.push_back({"bones[" + b.bones[i] + "]", "", "there"});
        if (count_reordered(bones_).count > 0)
            report.settings.push_back({"bones", "in one order", "in another"});
    }
    compare_colliders(report.settings);
    if (!a_.fields().grid_brick.empty() && !b_.fields().grid_brick.empty()) {
        compare_value("distance_grid.origin", a.distance_grid.origin, b.distance_grid.origin,
                      report.settings);
        compare_value("distance_grid.spacing", a.distance_grid.spacing, b.distance_grid.spacing,
                      report.settings);
        const auto counts = [](const std::array<std::uint32_t, 3>& n) {
            return std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " +
                   std::to_string(n[2]);
        };
        compare_value("distance_grid.bricks", counts(a.distance_grid.bricks),
                      counts(b.distance_grid.bricks), report.settings);
        compare_value("distance_grid.bone", a.distance_grid.bone, b.distance_grid.bone,
                      report.settings);
    }

    const auto storage = [](const AssetInfo& info) -> std::string {
        return info.packed ? "16 bits" : "floats";
    };
    compare_value("strand_position stored as", storage(a), storage(b), report.settings);
    // What follows from the fields says nothing new where they differ; revision 1.0 has neither.
    const bool same_data =
        report.strands.added_count + report.strands.removed_count == 0 &&
        std::none_of(report.fields.begin(), report.fields.end(),
                     [](const auto& f) { return f.differs(); });
    if (same_data && !a.levels.empty() && !b.levels.empty()) {
        const auto text = [](const std::vector<LevelOfDetail>& levels) {
            std::string out;
            for (const LevelOfDetail& level : levels)
                out += (out.empty() ? "" : ", ") + std::to_string(level.strand_count) + ": " +
                       value_text(level.width_scale);
            return out;
        };
        compare_value("levels", text(a.levels), text(b.levels), report.settings);
    }
    if (same_data && !a.guide_error.method.empty() && !b.guide_error.method.empty()) {
        compare_value("guide_error.method", a.guide_error.method, b.guide_error.method,
                      report.settings);
        compare_value("guide_error.mean", a.guide_error.mean, b.guide_error.mean, report.settings);
        compare_value("guide_error.p95", a.guide_error.p95, b.guide_error.p95, report.settings);
        compare_value("guide_error.max", a.guide_error.max, b.guide_error.max, report.settings);
    }

    compare_value("recipe", a.recipe_hash, b.recipe_hash, report.recipe);
    const auto label = [](const InputRecord& input) { return input.role + " " + input.name; };
    const auto labels = [&](const std::vector<InputRecord>& inputs) {
        std::vector<std::string> names;
        for (const InputRecord& input : inputs) names.push_back(label(input));
        return names;
    };
    const Match inputs = match_names(labels(a.inputs), labels(b.inputs));
    for (std::uint32_t i = 0; i < a.inputs.size(); ++i) {
        const std::string path = "inputs[" + label(a.inputs[i]) + "]";
        if (inputs.to_b[i] == kNoMatch) {
            report.inputs.push_back({path, "there", ""});
            continue;
        }
        const InputRecord& other = b.inputs[inputs.to_b[i]];
        compare_value(path + ".name", label(a.inputs[i]), label(other), report.inputs);
        compare_value(path + ".content", a.inputs[i].hash, other.hash, report.inputs);
    }
    for (std::uint32_t i = 0; i < b.inputs.size(); ++i)
        if (inputs.to_a[i] == kNoMatch)
            report.inputs.push_back({"inputs[" + label(b.inputs[i]) + "]", "", "there"});

    compare_value("tool_version", a.tool_version, b.tool_version, report.tool_version);
    const auto revision = [](const AssetInfo& info) {
        return std::to_string(info.format_major) + "." + std::to_string(info.format_minor);
    };
    compare_value("format", revision(a), revision(b), report.tool_version);
}

Report Comparer::run() {
    Report report;
    const AssetInfo& info = a_.info();
    report.diagonal = std::hypot(double(info.bounds_max[0]) - info.bounds_min[0],
                                 double(info.bounds_max[1]) - info.bounds_min[1],
                                 double(info.bounds_max[2]) - info.bounds_min[2]);
    report.strands = list_change(strands_, Domain::strand, true);
    report.guides = list_change(guides_, Domain::lane, true);
    report.vertices = list_change(vertices_, Domain::vertex, false);
    report.triangles = list_change(triangles_, Domain::triangle, false);
    std::size_t i = 0;
#define X(name, element, domain, components, presence, target, unit, meaning) \
    report.fields.push_back(                                                  \
        difference<element>(kAssetFields[i++], a_.fields().name, b_.fields().name));
    KERATIN_ASSET_FIELDS(X)
#undef X
    compare_info(report);
    return report;
}

}  // namespace

double FieldDifference::value() const {
    if (only_in_a || only_in_b) return std::numeric_limits<double>::infinity();
    return is_float ? spread.max : double(differing);
}

Report compare(const AssetView& a, const AssetView& b) {
    Report report = Comparer(a, b).run();
    const auto bytes_a = a.bytes(), bytes_b = b.bytes();
    report.same_bytes = std::equal(bytes_a.begin(), bytes_a.end(), bytes_b.begin(), bytes_b.end());
    return report;
}

}  // namespace keratin::diff
