#include "tools/measure/crowd.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace keratin::measure {

namespace {

using Cell = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

std::int64_t cell_of(double x, double spacing) {
    return static_cast<std::int64_t>(std::floor(x / spacing));
}

}  // namespace

std::vector<std::array<std::uint32_t, 2>> neighbours(const Strands& strands, double radius) {
    std::vector<std::uint32_t> strand_of(strands.position.size());
    for (std::size_t s = 0; s < strands.count(); ++s)
        for (std::uint32_t p = strands.first_point[s]; p < strands.first_point[s + 1]; ++p)
            strand_of[p] = static_cast<std::uint32_t>(s);

    std::map<Cell, std::vector<std::uint32_t>> cells;
    std::vector<std::array<std::uint32_t, 2>> pairs;
    for (std::uint32_t p = 0; p < strands.position.size(); ++p) {
        const Point x = strands.position[p];
        const std::int64_t i = cell_of(x.x, radius), j = cell_of(x.y, radius),
                           k = cell_of(x.z, radius);
        for (std::int64_t di = -1; di <= 1; ++di)
            for (std::int64_t dj = -1; dj <= 1; ++dj)
                for (std::int64_t dk = -1; dk <= 1; ++dk) {
                    const auto cell = cells.find({i + di, j + dj, k + dk});
                    if (cell == cells.end()) continue;
                    for (const std::uint32_t q : cell->second)
                        if (strand_of[q] != strand_of[p] &&
                            distance(strands.position[q], x) <= radius)
                            pairs.push_back({q, p});
                }
        cells[{i, j, k}].push_back(p);
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

double relative_speed(std::span<const std::array<std::uint32_t, 2>> pairs,
                      std::span<const Point> velocity) {
    double sum = 0;
    for (const auto& [a, b] : pairs) sum += distance(velocity[a], velocity[b]);
    return pairs.empty() ? 0 : sum / static_cast<double>(pairs.size());
}

double density_percentile(std::span<const Point> position, std::span<const double> mass,
                          double spacing, double percentile) {
    std::map<Cell, double> nodes;
    for (std::size_t p = 0; p < position.size(); ++p) {
        const Point x = position[p] * (1 / spacing);
        const double i = std::floor(x.x), j = std::floor(x.y), k = std::floor(x.z);
        for (int corner = 0; corner < 8; ++corner) {
            const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
            const double weight = (a ? x.x - i : 1 - x.x + i) * (b ? x.y - j : 1 - x.y + j) *
                                  (c ? x.z - k : 1 - x.z + k);
            nodes[{static_cast<std::int64_t>(i) + a, static_cast<std::int64_t>(j) + b,
                   static_cast<std::int64_t>(k) + c}] += weight * mass[p];
        }
    }
    std::vector<double> density;
    for (const auto& [cell, m] : nodes)
        if (m > 0) density.push_back(m / (spacing * spacing * spacing));
    if (density.empty()) return 0;
    std::sort(density.begin(), density.end());
    const double at =
        std::clamp(percentile, 0.0, 100.0) / 100 * static_cast<double>(density.size() - 1);
    const auto low = static_cast<std::size_t>(at);
    const std::size_t high = std::min(low + 1, density.size() - 1);
    return density[low] + (density[high] - density[low]) * (at - static_cast<double>(low));
}

}  // namespace keratin::measure
