#include "tools/keratin-diff/counterparts.h"

namespace keratin::diff {

namespace {

std::vector<std::string> group_names(const AssetView& asset) {
    std::vector<std::string> names;
    for (const GroupInfo& group : asset.info().groups) names.push_back(group.name);
    return names;
}

std::uint32_t guide_id(const AssetView& asset, std::uint32_t guide) {
    const std::uint32_t strand = asset.fields().guide_strand[guide];
    return strand == kNoStrand ? kNoStrand : asset.fields().strand_id[strand];
}

std::uint32_t source(std::span<const std::uint32_t> sources, std::uint32_t i) {
    return sources.empty() ? i : sources[i];
}

}  // namespace

Counterparts::Counterparts(const AssetView& a, const AssetView& b)
    : a_(a),
      b_(b),
      strands_(match_strands(a, b)),
      guides_(match_guides(a, b, strands_)),
      vertices_(match_vertices(a, b)),
      triangles_(match_triangles(a, b, vertices_)),
      groups_(match_names(group_names(a), group_names(b))),
      bones_(match_names(a.info().bones, b.info().bones)) {}

bool Counterparts::same_topology() const {
    return a_.info().mesh_topology_hash == b_.info().mesh_topology_hash;
}

std::size_t Counterparts::pairs_left_out(Domain domain) const {
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

std::string Counterparts::item_name(Domain domain, std::uint32_t owner) const {
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

const Match* Counterparts::match_of(Domain target) const {
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

void Counterparts::describe_index(const AssetView& asset, Domain target, std::uint32_t index,
                                  std::vector<double>& numbers,
                                  std::vector<std::string>& names) const {
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

ListChange Counterparts::list_change(const Match& match, Domain domain, bool ordered) const {
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

}  // namespace keratin::diff
