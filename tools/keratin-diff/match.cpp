#include "tools/keratin-diff/match.h"

#include "schema/file_hash.h"

#include <nanoflann.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <span>
#include <tuple>

namespace keratin::diff {

namespace {

// Strands that may be another one's counterpart, looked at in step 4.
constexpr std::size_t kNearestRoots = 8;
// Places along a strand at which two shapes are compared.
constexpr std::size_t kShapeSamples = 8;
// A strand that moved further than this share of its own length is another strand.
constexpr double kSameStrand = 0.5;

using Point = std::array<double, 3>;

double distance(const Point& a, const Point& b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return std::sqrt(x * x + y * y + z * z);
}

// Items in the order of their keys, so that equal keys of two assets meet in a merge.
template <class Key>
struct Keyed {
    Key key;
    std::uint32_t item;
    bool operator<(const Keyed& other) const {
        return std::tie(key, item) < std::tie(other.key, other.item);
    }
};

template <class Key>
using KeyedList = std::vector<Keyed<Key>>;

enum class SharedKeys { pair_in_order, leave_out };

// Joins items with equal keys; returns how many.
template <class Key>
std::size_t join_equal(KeyedList<Key>& a, KeyedList<Key>& b, SharedKeys shared, Match& match) {
    std::sort(a.begin(), a.end());
    std::sort(b.begin(), b.end());
    std::size_t joined = 0;
    for (auto at_a = a.begin(), at_b = b.begin(); at_a != a.end() && at_b != b.end();) {
        if (at_a->key < at_b->key) {
            ++at_a;
        } else if (at_b->key < at_a->key) {
            ++at_b;
        } else {
            const auto other = [&key = at_a->key](const auto& entry) { return key < entry.key; };
            const auto end_a = std::find_if(at_a, a.end(), other);
            const auto end_b = std::find_if(at_b, b.end(), other);
            const auto pairs = std::min(end_a - at_a, end_b - at_b);
            if (shared == SharedKeys::pair_in_order || (end_a - at_a == 1 && end_b - at_b == 1))
                for (std::ptrdiff_t i = 0; i < pairs; ++i, ++joined)
                    match.join(at_a[i].item, at_b[i].item);
            at_a = end_a;
            at_b = end_b;
        }
    }
    return joined;
}

using HashKey = std::array<std::uint64_t, 2>;

HashKey hash_key(std::span<const float> values) {
    const Hash128 hash = hash_bytes(std::as_bytes(values));
    return {hash.high, hash.low};
}

struct Strands {
    const AssetFields& fields;

    std::uint32_t count() const { return static_cast<std::uint32_t>(fields.strand_id.size()); }
    std::span<const float> points(std::uint32_t s) const {
        const auto& first = fields.strand_first_point;
        return fields.strand_position.subspan(std::size_t{3} * first[s],
                                              std::size_t{3} * (first[s + 1] - first[s]));
    }
    Point point(std::uint32_t s, std::size_t p) const {
        const float* x = points(s).data() + 3 * p;
        return {x[0], x[1], x[2]};
    }
    // Linear between the points; fraction 0..1 counts points, not length.
    Point at(std::uint32_t s, double fraction) const {
        const std::size_t last = points(s).size() / 3 - 1;
        const double place = fraction * double(last);
        const std::size_t p = std::min(std::size_t(place), last - 1);
        const Point x = point(s, p), y = point(s, p + 1);
        const double t = place - double(p);
        return {x[0] + t * (y[0] - x[0]), x[1] + t * (y[1] - x[1]), x[2] + t * (y[2] - x[2])};
    }
    double length(std::uint32_t s) const {
        double sum = 0;
        for (std::size_t p = 1; p < points(s).size() / 3; ++p)
            sum += distance(point(s, p - 1), point(s, p));
        return sum;
    }
};

// A strand as kShapeSamples points after the root, relative to it, and its length in m.
struct Shape {
    std::array<Point, kShapeSamples> point;
    double length = 0;

    Shape(const Strands& strands, std::uint32_t s) : length(strands.length(s)) {
        const Point root = strands.point(s, 0);
        for (std::size_t k = 0; k < kShapeSamples; ++k) {
            point[k] = strands.at(s, double(k + 1) / kShapeSamples);
            for (std::size_t axis = 0; axis < 3; ++axis) point[k][axis] -= root[axis];
        }
    }
};

// m, on average over the strand, both roots in one place.
double unlikeness(const Shape& a, const Shape& b) {
    double sum = 0;
    for (std::size_t k = 0; k < kShapeSamples; ++k) sum += distance(a.point[k], b.point[k]);
    return sum / kShapeSamples;
}

struct RootCloud {
    std::vector<std::array<float, 3>> roots;
    std::size_t kdtree_get_point_count() const { return roots.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const { return roots[i][axis]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
};

void join_nearest(const Strands& a, const std::vector<std::uint32_t>& left_a, const Strands& b,
                  const std::vector<std::uint32_t>& left_b, Match& match) {
    if (left_a.empty() || left_b.empty()) return;
    RootCloud cloud;
    for (const std::uint32_t s : left_b)
        cloud.roots.push_back({b.points(s)[0], b.points(s)[1], b.points(s)[2]});
    using Tree =
        nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, RootCloud, double>,
                                            RootCloud, 3>;
    Tree tree(3, cloud);
    tree.buildIndex();
    std::vector<Shape> shapes;
    for (const std::uint32_t s : left_b) shapes.emplace_back(b, s);
    std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> pairs;
    for (const std::uint32_t s : left_a) {
        std::array<std::uint32_t, kNearestRoots> near{};
        std::array<double, kNearestRoots> squared{};
        const std::size_t found =
            tree.knnSearch(a.points(s).data(), kNearestRoots, near.data(), squared.data());
        const Shape shape(a, s);
        for (std::size_t k = 0; k < found; ++k) {
            const Shape& other = shapes[near[k]];
            const double limit = kSameStrand * std::max(shape.length, other.length);
            const double root = std::sqrt(squared[k]);
            if (root >= limit) continue;
            const double cost = root + unlikeness(shape, other);
            if (cost < limit) pairs.emplace_back(cost, s, left_b[near[k]]);
        }
    }
    std::sort(pairs.begin(), pairs.end());
    for (const auto& [cost, in_a, in_b] : pairs)
        if (match.to_b[in_a] == kNoMatch && match.to_a[in_b] == kNoMatch) match.join(in_a, in_b);
}

std::vector<std::uint32_t> left_over(const std::vector<std::uint32_t>& matched) {
    std::vector<std::uint32_t> left;
    for (std::uint32_t i = 0; i < matched.size(); ++i)
        if (matched[i] == kNoMatch) left.push_back(i);
    return left;
}

// Keys of the items that have no counterpart yet. key_of(item, key) says whether it has a key.
template <class Key, class KeyOf>
KeyedList<Key> keys_left(const std::vector<std::uint32_t>& matched, KeyOf&& key_of) {
    KeyedList<Key> list;
    for (std::uint32_t i = 0; i < matched.size(); ++i) {
        Key key{};
        if (matched[i] == kNoMatch && key_of(i, key)) list.push_back({key, i});
    }
    return list;
}

// Ids that only one strand has.
std::vector<bool> own_ids(std::span<const std::uint32_t> ids) {
    std::vector<std::uint32_t> order(ids.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](auto x, auto y) { return ids[x] < ids[y]; });
    std::vector<bool> own(ids.size(), true);
    for (std::size_t i = 1; i < order.size(); ++i)
        if (ids[order[i]] == ids[order[i - 1]]) own[order[i]] = own[order[i - 1]] = false;
    return own;
}

}  // namespace

Match match_strands(const AssetView& a, const AssetView& b) {
    const Strands in_a{a.fields()}, in_b{b.fields()};
    Match match(in_a.count(), in_b.count());

    std::vector<HashKey> hash_a(in_a.count()), hash_b(in_b.count());
    for (std::uint32_t s = 0; s < in_a.count(); ++s) hash_a[s] = hash_key(in_a.points(s));
    for (std::uint32_t s = 0; s < in_b.count(); ++s) hash_b[s] = hash_key(in_b.points(s));

    using IdAndShape = std::tuple<std::uint32_t, HashKey>;
    const auto id_and_shape = [](const Strands& strands, const std::vector<HashKey>& hash) {
        return [&](std::uint32_t s, IdAndShape& key) {
            key = {strands.fields.strand_id[s], hash[s]};
            return true;
        };
    };
    auto exact_a = keys_left<IdAndShape>(match.to_b, id_and_shape(in_a, hash_a));
    auto exact_b = keys_left<IdAndShape>(match.to_a, id_and_shape(in_b, hash_b));
    const std::size_t same_id = join_equal(exact_a, exact_b, SharedKeys::pair_in_order, match);

    const auto shape = [](const std::vector<HashKey>& hash) {
        return [&](std::uint32_t s, HashKey& key) {
            key = hash[s];
            return true;
        };
    };
    auto shape_a = keys_left<HashKey>(match.to_b, shape(hash_a));
    auto shape_b = keys_left<HashKey>(match.to_a, shape(hash_b));
    const std::size_t other_id = join_equal(shape_a, shape_b, SharedKeys::pair_in_order, match);

    std::vector<std::uint32_t> left_a = left_over(match.to_b), left_b = left_over(match.to_a);
    if (left_a.empty() || left_b.empty()) return match;
    if (other_id <= same_id) {
        const auto own_a = own_ids(a.fields().strand_id), own_b = own_ids(b.fields().strand_id);
        const auto own_id = [](const Strands& strands, const std::vector<bool>& own) {
            return [&](std::uint32_t s, std::uint32_t& key) {
                key = strands.fields.strand_id[s];
                return bool(own[s]);
            };
        };
        auto ids_a = keys_left<std::uint32_t>(match.to_b, own_id(in_a, own_a));
        auto ids_b = keys_left<std::uint32_t>(match.to_a, own_id(in_b, own_b));
        join_equal(ids_a, ids_b, SharedKeys::leave_out, match);
        left_a = left_over(match.to_b);
        left_b = left_over(match.to_a);
        std::erase_if(left_a, [&](std::uint32_t s) { return own_a[s]; });
        std::erase_if(left_b, [&](std::uint32_t s) { return own_b[s]; });
    }
    join_nearest(in_a, left_a, in_b, left_b, match);
    return match;
}

Match match_guides(const AssetView& a, const AssetView& b, const Match& strands) {
    const std::size_t lanes_a = a.fields().guide_strand.size();
    const std::size_t lanes_b = b.fields().guide_strand.size();
    Match match(lanes_a, lanes_b);

    std::vector<HashKey> hash_a(lanes_a), hash_b(lanes_b);
    const auto hash_guides = [](const AssetFields& fields, std::vector<HashKey>& hash) {
        std::vector<float> points;
        for (std::size_t guide = 0; guide < hash.size(); ++guide) {
            const std::size_t tile = guide / kTileLanes, lane = guide % kTileLanes;
            points.clear();
            for (std::size_t p = 0; p < fields.guide_point_count[guide]; ++p)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    points.push_back(fields.guide_position[vector_index(
                        fields.tile_first_row[tile] + p, 3, axis, lane)]);
            hash[guide] = hash_key(points);
        }
    };
    hash_guides(a.fields(), hash_a);
    hash_guides(b.fields(), hash_b);

    // The render strand of a guide as a strand of b.
    const auto strand_in_b = [&](std::uint32_t guide) {
        const std::uint32_t strand = a.fields().guide_strand[guide];
        return strand == kNoStrand ? kNoMatch : strands.to_b[strand];
    };
    using StrandAndShape = std::tuple<std::uint32_t, HashKey>;
    auto exact_a = keys_left<StrandAndShape>(match.to_b, [&](std::uint32_t i, auto& key) {
        key = {strand_in_b(i), hash_a[i]};
        return strand_in_b(i) != kNoMatch;
    });
    auto exact_b = keys_left<StrandAndShape>(match.to_a, [&](std::uint32_t i, auto& key) {
        key = {b.fields().guide_strand[i], hash_b[i]};
        return b.fields().guide_point_count[i] > 0;
    });
    join_equal(exact_a, exact_b, SharedKeys::pair_in_order, match);

    auto shape_a = keys_left<HashKey>(match.to_b, [&](std::uint32_t i, HashKey& key) {
        key = hash_a[i];
        return a.fields().guide_point_count[i] > 0;
    });
    auto shape_b = keys_left<HashKey>(match.to_a, [&](std::uint32_t i, HashKey& key) {
        key = hash_b[i];
        return b.fields().guide_point_count[i] > 0;
    });
    join_equal(shape_a, shape_b, SharedKeys::pair_in_order, match);

    auto strand_a = keys_left<std::uint32_t>(match.to_b, [&](std::uint32_t i, std::uint32_t& key) {
        key = strand_in_b(i);
        return key != kNoMatch;
    });
    auto strand_b = keys_left<std::uint32_t>(match.to_a, [&](std::uint32_t i, std::uint32_t& key) {
        key = b.fields().guide_strand[i];
        return b.fields().guide_point_count[i] > 0;
    });
    join_equal(strand_a, strand_b, SharedKeys::pair_in_order, match);
    return match;
}

Match match_vertices(const AssetView& a, const AssetView& b) {
    Match match(a.fields().mesh_position.size() / 3, b.fields().mesh_position.size() / 3);
    const bool same_topology = a.info().mesh_topology_hash == b.info().mesh_topology_hash;
    const auto source = [&](const AssetFields& fields) {
        return [&, same_topology](std::uint32_t i, std::uint32_t& key) {
            key = fields.mesh_vertex_source.empty() ? i : fields.mesh_vertex_source[i];
            return same_topology;
        };
    };
    auto source_a = keys_left<std::uint32_t>(match.to_b, source(a.fields()));
    auto source_b = keys_left<std::uint32_t>(match.to_a, source(b.fields()));
    join_equal(source_a, source_b, SharedKeys::pair_in_order, match);

    using Position = std::array<float, 3>;
    const auto position = [](const AssetFields& fields) {
        return [&](std::uint32_t i, Position& key) {
            std::copy_n(fields.mesh_position.begin() + std::ptrdiff_t(3 * i), 3, key.begin());
            return true;
        };
    };
    auto position_a = keys_left<Position>(match.to_b, position(a.fields()));
    auto position_b = keys_left<Position>(match.to_a, position(b.fields()));
    join_equal(position_a, position_b, SharedKeys::pair_in_order, match);
    return match;
}

Match match_triangles(const AssetView& a, const AssetView& b, const Match& vertices) {
    Match match(a.fields().mesh_triangle.size() / 3, b.fields().mesh_triangle.size() / 3);
    const bool same_topology = a.info().mesh_topology_hash == b.info().mesh_topology_hash;
    const auto source = [&](const AssetFields& fields) {
        return [&, same_topology](std::uint32_t i, std::uint32_t& key) {
            key = fields.mesh_triangle_source.empty() ? i : fields.mesh_triangle_source[i];
            return same_topology;
        };
    };
    auto source_a = keys_left<std::uint32_t>(match.to_b, source(a.fields()));
    auto source_b = keys_left<std::uint32_t>(match.to_a, source(b.fields()));
    join_equal(source_a, source_b, SharedKeys::pair_in_order, match);

    using Corners = std::array<std::uint32_t, 3>;
    auto corners_a = keys_left<Corners>(match.to_b, [&](std::uint32_t i, Corners& key) {
        for (std::size_t k = 0; k < 3; ++k)
            key[k] = vertices.to_b[a.fields().mesh_triangle[3 * i + k]];
        return true;
    });
    auto corners_b = keys_left<Corners>(match.to_a, [&](std::uint32_t i, Corners& key) {
        std::copy_n(b.fields().mesh_triangle.begin() + std::ptrdiff_t(3 * i), 3, key.begin());
        return true;
    });
    join_equal(corners_a, corners_b, SharedKeys::pair_in_order, match);
    return match;
}

Match match_names(const std::vector<std::string>& a, const std::vector<std::string>& b) {
    Match match(a.size(), b.size());
    const auto name = [](const std::vector<std::string>& names) {
        return [&](std::uint32_t i, std::string& key) {
            key = names[i];
            return true;
        };
    };
    auto names_a = keys_left<std::string>(match.to_b, name(a));
    auto names_b = keys_left<std::string>(match.to_a, name(b));
    join_equal(names_a, names_b, SharedKeys::pair_in_order, match);
    for (std::uint32_t i = 0; i < std::min(a.size(), b.size()); ++i)
        if (match.to_b[i] == kNoMatch && match.to_a[i] == kNoMatch) match.join(i, i);
    return match;
}

Reordered count_reordered(const Match& match) {
    // What keeps its order is a longest increasing subsequence of the counterparts, found with
    // tails[k]: the item of a that ends the best subsequence of length k + 1.
    std::vector<std::uint32_t> tails;
    std::vector<std::uint32_t> before(match.to_b.size(), kNoMatch);
    std::size_t matched = 0;
    for (std::uint32_t i = 0; i < match.to_b.size(); ++i) {
        if (match.to_b[i] == kNoMatch) continue;
        ++matched;
        const auto place =
            std::lower_bound(tails.begin(), tails.end(), match.to_b[i],
                             [&](std::uint32_t t, std::uint32_t b) { return match.to_b[t] < b; });
        if (place != tails.begin()) before[i] = *(place - 1);
        if (place == tails.end())
            tails.push_back(i);
        else
            *place = i;
    }
    if (tails.size() == matched) return {};
    std::vector<bool> keeps(match.to_b.size(), false);
    for (std::uint32_t i = tails.back(); i != kNoMatch; i = before[i]) keeps[i] = true;
    Reordered reordered{matched - tails.size(), kNoMatch};
    for (std::uint32_t i = 0; i < match.to_b.size() && reordered.example == kNoMatch; ++i)
        if (match.to_b[i] != kNoMatch && !keeps[i]) reordered.example = i;
    return reordered;
}

}  // namespace keratin::diff
