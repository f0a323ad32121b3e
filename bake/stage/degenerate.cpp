#include "bake/stage/degenerate.h"

#include <algorithm>

namespace keratin {
namespace {

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

Result<Groom> drop_degenerate(Groom groom, const Recipe& recipe, Strictness strictness,
                              Findings& findings) {
    const std::size_t files = recipe.curves.size();
    const std::size_t n = groom.strand_count();
    const std::vector<double> length = strand_lengths(groom);
    std::vector<std::vector<double>> positive(files);
    for (std::size_t s = 0; s < n; ++s) {
        if (length[s] > 0) positive[groom.source[s]].push_back(length[s]);
    }
    std::vector<double> shortest(files);
    for (std::size_t f = 0; f < files; ++f) {
        shortest[f] = kDegenerateShare * median(std::move(positive[f]));
    }

    std::vector<std::uint32_t> keep;
    keep.reserve(n);
    std::vector<std::vector<std::uint32_t>> dropped(files);
    std::vector<std::size_t> kept(files);
    for (std::size_t s = 0; s < n; ++s) {
        const std::uint32_t f = groom.source[s];
        if (length[s] > 0 && length[s] >= shortest[f]) {
            keep.push_back(static_cast<std::uint32_t>(s));
            ++kept[f];
        } else {
            dropped[f].push_back(groom.curve[s]);
        }
    }
    for (std::size_t f = 0; f < files; ++f) {
        if (dropped[f].empty()) continue;
        const auto ranges = to_ranges(dropped[f]);
        const std::string& file = recipe.curves[f].file;
        if (kept[f] == 0) {
            return Error{ErrorCode::input, file,
                         "every strand is degenerate: fewer than two distinct points"};
        }
        const std::string count = std::to_string(dropped[f].size());
        if (strictness == Strictness::strict) {
            return Error{ErrorCode::input, file + ": strands " + to_text(ranges, 8),
                         count +
                             " degenerate strands (fewer than two distinct points, or "
                             "shorter than a thousandth of the median), which --strict refuses"};
        }
        findings.push_back(
            {Rule::degenerate_strand, file, count + " degenerate strands are left out", ranges});
    }
    if (keep.size() == n) return groom;
    return select(groom, keep);
}

}  // namespace keratin
