#include "tools/keratin-diff/summary.h"

#include "schema/file_hash.h"
#include "tools/keratin-diff/number_text.h"

#include <algorithm>

namespace keratin::diff {

namespace {

class Lines {
  public:
    template <class... Parts>
    void add(const std::string& name, const Parts&... parts) {
        text_ += name + ":";
        ((text_ += " " + part_text(parts)), ...);
        text_ += "\n";
    }
    std::string take() { return std::move(text_); }

  private:
    static std::string part_text(const char* text) { return text; }
    template <class Part>
    static std::string part_text(const Part& part) {
        return value_text(part);
    }
    std::string text_;
};

void add_group(const GroupInfo& group, Lines& lines) {
    const Material& m = group.material;
    const StrandParameters& s = group.strand;
    lines.add("group " + group.name);
    lines.add("  material", "radius", m.radius, "radius2", m.radius2, "density", m.density,
              "youngs_modulus", m.youngs_modulus, "poisson_ratio", m.poisson_ratio, "viscosity",
              m.viscosity);
    lines.add("  strand", "damping", s.damping, "friction", s.friction, "volume", s.volume,
              "iterations", s.iterations, "global_length", s.global_length, "length_damping",
              s.length_damping, "wind_response", s.wind_response);
}

// Each on its own line where there are few, else their number and a hash over them all.
void add_colliders(const std::vector<AssetCollider>& colliders, Lines& lines) {
    constexpr std::size_t kListed = 8;
    if (colliders.size() > kListed) {
        std::vector<float> values;
        for (const AssetCollider& collider : colliders) {
            values.insert(values.end(), collider.a.begin(), collider.a.end());
            values.insert(values.end(), collider.b.begin(), collider.b.end());
            values.push_back(collider.radius);
            values.push_back(static_cast<float>(collider.bone));
        }
        lines.add("colliders", static_cast<std::uint32_t>(colliders.size()),
                  hash_bytes(std::as_bytes(std::span(values))));
        return;
    }
    for (const AssetCollider& collider : colliders)
        lines.add("collider", collider.a, collider.b, "radius", collider.radius, "bone",
                  collider.bone);
}

}  // namespace

std::string summary_text(const AssetView& asset) {
    const AssetInfo& info = asset.info();
    Lines lines;
    lines.add("keratin asset, format",
              std::to_string(info.format_major) + "." + std::to_string(info.format_minor));
    lines.add("tool_version", info.tool_version);
    lines.add("recipe", info.recipe_hash);
    for (const InputRecord& input : info.inputs)
        lines.add("input " + input.role, input.name, input.hash);
    lines.add("attach", value_text(info.attach));
    lines.add("strands", info.strand_count, "with", info.point_count, "points");
    lines.add("guides", info.guide_count, "in", info.tile_count, "tiles of", info.row_count,
              "rows");
    lines.add("mesh", info.mesh_vertex_count, "vertices", info.mesh_triangle_count, "triangles",
              info.mesh_topology_hash, "stored", info.vertex_count, info.triangle_count);
    lines.add("bounds", info.bounds_min, info.bounds_max);
    for (const GroupInfo& group : info.groups) add_group(group, lines);
    for (const std::string& bone : info.bones) lines.add("bone", bone);
    add_colliders(info.colliders, lines);
    if (const GuideError& error = info.guide_error; !error.method.empty())
        lines.add("guide_error", error.method, "mean", error.mean, "p95", error.p95, "max",
                  error.max);
    if (info.packed) lines.add("strand_position in 16 bits, error", info.packed_max_error);
    for (const LevelOfDetail& level : info.levels)
        lines.add("level", level.strand_count, "strands, width", level.width_scale);
    for_each_field(asset.fields(), [&](const FieldDescription& field, auto values) {
        const std::string name = "field " + std::string(field.name);
        if (values.empty()) return lines.add(name, "none");
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        lines.add(name, static_cast<std::uint32_t>(values.size()), "from", *low, "to", *high,
                  hash_bytes(std::as_bytes(values)));
    });
    return lines.take();
}

}  // namespace keratin::diff
