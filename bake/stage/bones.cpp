#include "bake/stage/bones.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace keratin {
namespace {

// Sums of weights nearer to one than this need no mention.
constexpr double kSumTolerance = 1e-5;

struct Influence {
    std::uint32_t bone;
    double weight;
};

// The four heaviest, normalised; equal weights by bone number. False when there is no weight.
bool keep_heaviest(std::vector<Influence>& influences, std::array<std::uint32_t, 4>& bone,
                   std::array<double, 4>& weight) {
    std::sort(influences.begin(), influences.end(),
              [](const Influence& a, const Influence& b) { return a.bone < b.bone; });
    std::vector<Influence> merged;
    for (const Influence& i : influences) {
        if (!(i.weight > 0)) continue;
        if (!merged.empty() && merged.back().bone == i.bone) {
            merged.back().weight += i.weight;
        } else {
            merged.push_back(i);
        }
    }
    if (merged.empty()) return false;
    std::stable_sort(merged.begin(), merged.end(),
                     [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
    if (merged.size() > 4) merged.resize(4);
    double sum = 0;
    for (const Influence& i : merged) sum += i.weight;
    bone.fill(merged.front().bone);
    weight.fill(0);
    for (std::size_t k = 0; k < merged.size(); ++k) {
        bone[k] = merged[k].bone;
        weight[k] = merged[k].weight / sum;
    }
    return true;
}

class BoneNames {
  public:
    explicit BoneNames(std::vector<std::string>& names) : names_(names) {}
    // Numbers in the merged list of a file's own list.
    std::vector<std::uint32_t> merge(const std::vector<std::string>& list) {
        std::vector<std::uint32_t> out;
        for (const std::string& name : list) {
            const auto [at, is_new] =
                number_.try_emplace(name, static_cast<std::uint32_t>(names_.size()));
            if (is_new) names_.push_back(name);
            out.push_back(at->second);
        }
        return out;
    }

  private:
    std::vector<std::string>& names_;
    std::map<std::string, std::uint32_t> number_;
};

}  // namespace

Result<Carriers> carry_roots(const Groom& groom, std::span<const std::optional<RawSkin>> skins,
                             const RawMesh* mesh, const Roots& roots, const Recipe& recipe,
                             std::span<const std::size_t> curve_counts, Findings& findings) {
    Carriers out;
    const std::size_t files = recipe.curves.size();
    const std::size_t n = groom.strand_count();
    BoneNames names(out.bones);
    std::vector<std::vector<std::uint32_t>> numbers(files);
    for (std::size_t f = 0; f < files; ++f) {
        if (!skins[f]) continue;
        const std::string& file = recipe.curves[f].bones;
        if (skins[f]->bone.size() != curve_counts[f]) {
            return Error{ErrorCode::input, file,
                         "holds bones of " + std::to_string(skins[f]->bone.size()) +
                             " strands, but " + recipe.curves[f].file + " has " +
                             std::to_string(curve_counts[f])};
        }
        for (std::size_t c = 0; c < skins[f]->bone.size(); ++c) {
            for (std::size_t k = 0; k < 4; ++k) {
                if (skins[f]->bone[c][k] < skins[f]->bones.size() &&
                    std::isfinite(skins[f]->weight[c][k])) {
                    continue;
                }
                return Error{ErrorCode::input, file + ": strand " + std::to_string(c),
                             "names bone " + std::to_string(skins[f]->bone[c][k]) + " of " +
                                 std::to_string(skins[f]->bones.size()) +
                                 ", or its weight is not a finite number"};
            }
        }
        numbers[f] = names.merge(skins[f]->bones);
    }
    std::vector<std::uint32_t> mesh_numbers;
    if (mesh != nullptr && mesh->skin) mesh_numbers = names.merge(mesh->skin->bones);
    if (out.bones.empty()) {
        findings.push_back(
            {Rule::no_bones, "", "no bones: one rigid motion carries every root", {}});
        return out;
    }

    out.bone.assign(n, {0, 0, 0, 0});
    out.weight.assign(n, {1, 0, 0, 0});
    std::vector<std::vector<std::uint32_t>> rescaled(files), missing(files);
    std::vector<Influence> influences;
    for (std::size_t s = 0; s < n; ++s) {
        const std::uint32_t f = groom.source[s];
        influences.clear();
        double sum = 0;
        const auto add = [&](const RawSkin& skin, const std::vector<std::uint32_t>& number,
                             std::size_t item, double factor) {
            for (std::size_t k = 0; k < 4; ++k) {
                const double weight = factor * std::max(0.0, skin.weight[item][k]);
                sum += weight;
                influences.push_back({number[skin.bone[item][k]], weight});
            }
        };
        if (skins[f]) {
            add(*skins[f], numbers[f], groom.curve[s], 1);
            if (std::abs(sum - 1) > kSumTolerance) rescaled[f].push_back(groom.curve[s]);
        } else if (mesh != nullptr && mesh->skin) {
            const auto& corner = mesh->triangle[roots.triangle[s]];
            const Vec2& at = roots.barycentric[s];
            add(*mesh->skin, mesh_numbers, corner[0], 1 - at.x() - at.y());
            add(*mesh->skin, mesh_numbers, corner[1], at.x());
            add(*mesh->skin, mesh_numbers, corner[2], at.y());
        }
        if (!keep_heaviest(influences, out.bone[s], out.weight[s])) {
            missing[f].push_back(groom.curve[s]);
        }
    }
    for (std::size_t f = 0; f < files; ++f) {
        if (!rescaled[f].empty()) {
            std::sort(rescaled[f].begin(), rescaled[f].end());
            findings.push_back({Rule::bone_weights, recipe.curves[f].bones,
                                "the bone weights of " + std::to_string(rescaled[f].size()) +
                                    " strands did not sum to 1 and were normalised",
                                to_ranges(rescaled[f])});
        }
        if (!missing[f].empty()) {
            std::sort(missing[f].begin(), missing[f].end());
            findings.push_back({Rule::bones_missing, recipe.curves[f].file,
                                std::to_string(missing[f].size()) +
                                    " strands have no bones and follow the first one, " +
                                    out.bones.front(),
                                to_ranges(missing[f])});
        }
    }
    return out;
}

}  // namespace keratin
