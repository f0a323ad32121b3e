#include "bake/stage/root_end.h"

#include <algorithm>

namespace keratin {
namespace {

// An end is clearly nearer when the difference of the two distances is this share of the strand.
constexpr double kClearShare = 0.1;
// Strands of a file that are asked first.
constexpr std::size_t kVoters = 2000;
// Share of the clear votes that decides for a whole file.
constexpr double kMajority = 0.8;

}  // namespace

std::vector<RootEnds> orient_strands(const Recipe& recipe, std::span<const MeshTree* const> trees,
                                     Groom& groom, Findings& findings) {
    const std::size_t n = groom.strand_count();
    // > 0: the last point is nearer to the mesh, in m.
    std::vector<double> excess(n, 0.0);
    std::vector<std::uint8_t> clear(n, 0);
    const auto judge = [&](std::size_t s) {
        const MeshTree* tree = trees[groom.source[s]];
        if (tree == nullptr || recipe.curves[groom.source[s]].root_end != RootEnd::automatic)
            return;
        const auto points = groom.points(s);
        excess[s] =
            tree->nearest(points.front()).at.distance - tree->nearest(points.back()).at.distance;
        clear[s] = std::abs(excess[s]) > kClearShare * polyline_length(points);
    };
    const std::size_t files = recipe.curves.size();
    std::vector<std::vector<std::uint32_t>> members(files);
    for (std::size_t s = 0; s < n; ++s) {
        members[groom.source[s]].push_back(static_cast<std::uint32_t>(s));
    }
    // A sample of each file decides; only where it disagrees with itself is every strand asked.
    std::vector<std::uint32_t> voters;
    for (const auto& file : members) {
        const std::size_t step = std::max<std::size_t>(1, file.size() / kVoters);
        for (std::size_t i = 0; i < file.size(); i += step) voters.push_back(file[i]);
    }
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t i = 0; i < voters.size(); ++i) judge(voters[i]);

    std::vector<std::uint64_t> votes_first(files), votes_last(files);
    for (std::uint32_t s : voters) {
        if (clear[s]) ++(excess[s] > 0 ? votes_last : votes_first)[groom.source[s]];
    }

    std::vector<RootEnds> ends(files);
    for (std::size_t f = 0; f < files; ++f) {
        const RootEnd wanted = recipe.curves[f].root_end;
        const std::uint64_t votes = votes_first[f] + votes_last[f];
        const auto decides = [&](std::uint64_t count) {
            return votes > 0 &&
                   static_cast<double>(count) >= kMajority * static_cast<double>(votes);
        };
        if (wanted != RootEnd::automatic) {
            ends[f].end = wanted == RootEnd::first ? "first" : "last";
            ends[f].from = "recipe";
        } else if (trees[f] == nullptr || votes == 0) {
            ends[f].end = "first";
            ends[f].from = "default";
        } else {
            ends[f].from = "mesh";
            ends[f].end = decides(votes_first[f])  ? "first"
                          : decides(votes_last[f]) ? "last"
                                                   : "mixed";
        }
    }

    std::vector<std::uint32_t> undecided;
    for (std::size_t f = 0; f < files; ++f) {
        if (ends[f].end == "mixed") {
            undecided.insert(undecided.end(), members[f].begin(), members[f].end());
        }
    }
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t i = 0; i < undecided.size(); ++i) judge(undecided[i]);

    std::vector<std::vector<std::uint32_t>> turned(files);
    for (std::size_t s = 0; s < n; ++s) {
        RootEnds& file = ends[groom.source[s]];
        const bool majority_last = votes_last[groom.source[s]] > votes_first[groom.source[s]];
        const bool turn = file.end == "last" ||
                          (file.end == "mixed" && (clear[s] ? excess[s] > 0 : majority_last));
        if (!turn) continue;
        const auto points = groom.points(s);
        std::reverse(points.begin(), points.end());
        ++file.reversed;
        turned[groom.source[s]].push_back(groom.curve[s]);
    }
    for (std::size_t f = 0; f < files; ++f) {
        const std::string& file = recipe.curves[f].file;
        if (ends[f].end == "mixed") {
            findings.push_back({Rule::root_end_mixed, file,
                                "the curves run in both directions: " +
                                    std::to_string(ends[f].reversed) + " strands were turned round",
                                to_ranges(turned[f])});
        } else if (ends[f].from != "recipe") {
            const bool by_mesh = ends[f].from == "mesh";
            findings.push_back(
                {Rule::root_end,
                 file,
                 "the root is the " + ends[f].end + " point of the curves" +
                     (by_mesh ? ", the end nearer to the mesh for " +
                                    std::to_string(std::max(votes_first[f], votes_last[f])) +
                                    " of " + std::to_string(votes_first[f] + votes_last[f]) +
                                    " strands with one end clearly nearer"
                              : " by default, as no mesh tells otherwise"),
                 {}});
        }
    }
    return ends;
}

}  // namespace keratin
