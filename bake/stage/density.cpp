#include "bake/stage/density.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace keratin {
namespace {

// The solver's default grid has 48 voxels along one and a half times the groom's longest side.
constexpr double kVoxelsAlong = 32;
constexpr double kSmallestSide = 1e-3;  // m
// Rows that are carried by the root and not simulated.
constexpr std::size_t kCarriedRows = 2;

struct Lattice {
    double spacing;
    std::array<long, 3> first;  // of the lowest voxel
    std::array<std::size_t, 3> count;

    // Visits the eight voxels about a point with their trilinear shares.
    template <class Visit>
    void around(const std::array<double, 3>& p, Visit&& visit) const {
        std::array<std::size_t, 3> cell;
        std::array<double, 3> share;
        for (std::size_t k = 0; k < 3; ++k) {
            const double s = p[k] / spacing;
            cell[k] = static_cast<std::size_t>(static_cast<long>(std::floor(s)) - first[k]);
            share[k] = s - std::floor(s);
        }
        for (std::size_t corner = 0; corner < 8; ++corner) {
            double weight = 1;
            std::array<std::size_t, 3> at;
            for (std::size_t k = 0; k < 3; ++k) {
                const bool upper = (corner >> k) & 1;
                at[k] = cell[k] + upper;
                weight *= upper ? share[k] : 1 - share[k];
            }
            visit((at[2] * count[1] + at[1]) * count[0] + at[0], weight);
        }
    }
};

}  // namespace

void store_density(const AssetInfo& info, AssetArrays& out) {
    const bool wanted = std::any_of(info.groups.begin(), info.groups.end(), [](const auto& group) {
        return *std::max_element(group.strand.volume.begin(), group.strand.volume.end()) > 0;
    });
    if (!wanted || info.guide_count == 0) return;
    double side = kSmallestSide;
    for (std::size_t k = 0; k < 3; ++k) {
        side = std::max(side, double{info.bounds_max[k]} - info.bounds_min[k]);
    }
    Lattice lattice;
    lattice.spacing = side / kVoxelsAlong;
    std::size_t voxels = 1;
    for (std::size_t k = 0; k < 3; ++k) {
        lattice.first[k] = static_cast<long>(std::floor(info.bounds_min[k] / lattice.spacing));
        const long last = static_cast<long>(std::floor(info.bounds_max[k] / lattice.spacing)) + 1;
        lattice.count[k] = static_cast<std::size_t>(last - lattice.first[k] + 1);
        voxels *= lattice.count[k];
    }
    const auto position = [&](std::size_t row, std::size_t lane) {
        std::array<double, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = out.guide_position[vector_index(row, 3, k, lane)];
        }
        return p;
    };
    const double per_guide = double{static_cast<double>(info.strand_count)} / info.guide_count;
    const double volume = std::pow(lattice.spacing, 3);
    std::vector<double> density(voxels, 0.0);
    for (std::size_t i = 0; i < out.guide_point_count.size(); ++i) {
        const std::size_t tile = i / kTileLanes, lane = i % kTileLanes;
        const std::size_t first = out.tile_first_row[tile];
        const Material& m = info.groups[out.guide_group[i]].material;
        const double line = double{m.density} * std::numbers::pi * m.radius * m.radius2;
        const std::size_t points = out.guide_point_count[i];
        for (std::size_t p = kCarriedRows; p < points; ++p) {
            double length = out.guide_length[scalar_index(first + p, lane)];
            if (p + 1 < points) length += out.guide_length[scalar_index(first + p + 1, lane)];
            const double mass = 0.5 * length * line * per_guide;
            lattice.around(position(first + p, lane), [&](std::size_t voxel, double weight) {
                density[voxel] += weight * mass / volume;
            });
        }
    }
    out.guide_density.resize(std::size_t{info.row_count} * kTileLanes);
    for (std::size_t row = 0; row < info.row_count; ++row) {
        for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
            double here = 0;
            lattice.around(position(row, lane), [&](std::size_t voxel, double weight) {
                here += weight * density[voxel];
            });
            out.guide_density[scalar_index(row, lane)] = static_cast<float>(here);
        }
    }
}

}  // namespace keratin
