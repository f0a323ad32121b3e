// The opener of assets on arbitrary bytes: it refuses them, or every index it hands out can be
// followed without a bounds test, also by the solver. The hash is not checked, as if an attacker
// had put it right.
#include "runtime/simulation.h"
#include "schema/asset_view.h"
#include "tests/fuzz/asset_input.h"
#include "tests/fuzz/readers.h"

#include <cstdlib>

namespace keratin::fuzz {

namespace {

// Follows every index of a field into what it points to.
template <class Element>
void follow(const AssetView& asset, const FieldDescription& field,
            std::span<const Element> values) {
    if (values.empty() && field.presence == Presence::optional) return;
    if (values.size() != domain_count(asset.info(), field.domain) * field.components) std::abort();
    if constexpr (std::is_same_v<Element, std::uint32_t>) {
        if (field.target == Domain::none) return;
        const std::uint64_t count = domain_count(asset.info(), field.target);
        for (const std::uint32_t index : values)
            if (index >= count && !(field.name == "guide_strand" && index == kNoStrand))
                std::abort();
    }
}

// Sums what the kernels read, in the way they find it.
double walk(const AssetView& asset) {
    const AssetFields& f = asset.fields();
    double sum = 0;
    for (std::size_t t = 0; t + 1 < f.tile_first_row.size(); ++t)
        for (std::size_t row = f.tile_first_row[t]; row < f.tile_first_row[t + 1]; ++row)
            for (std::size_t lane = 0; lane < kTileLanes; ++lane)
                sum += f.guide_position[vector_index(row, 3, 2, lane)] +
                       f.guide_length[scalar_index(row, lane)] +
                       (f.guide_rod_strain.empty()
                            ? 0
                            : f.guide_rod_strain[vector_index(row, 4, 3, lane)]);
    for (std::size_t s = 0; s + 1 < f.strand_first_point.size(); ++s) {
        for (std::size_t p = f.strand_first_point[s]; p < f.strand_first_point[s + 1]; ++p)
            sum += f.strand_position[3 * p + 2];
        for (std::size_t k = 0; k < 3; ++k)
            sum += f.guide_point_count[f.strand_guide[3 * s + k]] * f.strand_weight[3 * s + k];
        sum += asset.info().groups[f.strand_group[s]].material.radius;
    }
    for (const std::uint32_t vertex : f.mesh_triangle) sum += f.mesh_position[3 * vertex];
    return sum;
}

volatile double kept = 0;

}  // namespace

void run_open_asset(std::string_view bytes) {
    const AssetInput input(bytes);
    const auto asset = AssetView::from_memory(input.bytes(), "fuzz", Verify::structure);
    if (!asset) return;
    for_each_field(asset->fields(), [&](const FieldDescription& field, auto values) {
        follow(*asset, field, values);
    });
    kept = walk(*asset);
}

void run_step_asset(std::string_view bytes) {
    const AssetInput input(bytes);
    const auto asset = AssetView::from_memory(input.bytes(), "fuzz", Verify::structure);
    if (!asset) return;
    Settings settings;
    settings.threads = 1;
    settings.grid_resolution = 8;
    auto simulation = Simulation::create(*asset, settings);
    if (!simulation) return;
    if (!simulation->set_motion({{0.01, 0, 0}, {0, 0, 0, 1}})) std::abort();
    if (!simulation->step(1.0 / 60)) std::abort();
}

}  // namespace keratin::fuzz
