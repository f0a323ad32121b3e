#include "bake/stage/quantise.h"

#include "schema/packed_positions.h"

#include <cmath>
#include <cstdio>

namespace keratin {

Result<void> quantise_positions(const Groom& groom, const AssetOrder& order, const Recipe& recipe,
                                AssetInfo& info, AssetArrays& arrays, BakeReport& report) {
    if (!recipe.quantise) return {};
    const PackedPositions packed =
        pack_positions(arrays.strand_first_point, arrays.strand_position);
    unpack_positions(arrays.strand_first_point, packed.packed, packed.root, packed.step,
                     arrays.strand_position);
    std::vector<double> moved(groom.position.size());
    double most = 0;
    std::uint32_t worst = 0;  // strand, as the groom counts
    for (std::size_t i = 0; i < order.strand.size(); ++i) {
        const std::uint32_t s = order.strand[i];
        const auto points = groom.points(s);
        for (std::size_t p = 0; p < points.size(); ++p) {
            const std::size_t at = std::size_t{arrays.strand_first_point[i]} + p;
            const float* x = arrays.strand_position.data() + 3 * at;
            moved[at] = (Vec3(x[0], x[1], x[2]) - points[p]).norm();
            if (moved[at] > most) {
                most = moved[at];
                worst = s;
            }
        }
    }
    // Rounded up, so that what is stored bounds what was measured.
    const float stored = std::nextafter(static_cast<float>(most), 1.0f);
    if (stored > recipe.quantise_max_error) {
        char text[200];
        std::snprintf(text, sizeof text,
                      "strand %u would be stored %.3g m off its place, more than the %.3g m "
                      "allowed; allow at least %.3g or leave quantise out",
                      groom.curve[worst], most, recipe.quantise_max_error, 1.1 * most);
        return Error{ErrorCode::input, recipe.file + ": quantise.max_error",
                     recipe.curves[groom.source[worst]].file + ": " + text};
    }
    info.packed = true;
    info.packed_max_error = stored;
    report.quantised = BakeReport::Quantised{};
    BakeReport::Quantised& out = *report.quantised;
    out.bytes = sizeof(float) * (packed.packed.size() + packed.root.size() + packed.step.size());
    out.bytes_before = sizeof(float) * arrays.strand_position.size();
    out.error = spread_of(std::move(moved));
    return {};
}

}  // namespace keratin
