#include "tools/keratin-diff/compare_info.h"

#include "tools/keratin-diff/number_text.h"

#include <algorithm>

namespace keratin::diff {

namespace {

template <class Value>
void compare_value(const std::string& path, const Value& a, const Value& b,
                   std::vector<ValueChange>& out) {
    if (!(a == b)) out.push_back({path, value_text(a), value_text(b)});
}

void compare_groups(const AssetInfo& info_a, const AssetInfo& info_b, const Match& groups,
                    std::vector<ValueChange>& out) {
    const auto &list_a = info_a.groups, &list_b = info_b.groups;
    for (std::uint32_t i = 0; i < list_a.size(); ++i) {
        const GroupInfo& a = list_a[i];
        const std::string path = "groups[" + a.name + "]";
        if (groups.to_b[i] == kNoMatch) {
            out.push_back({path, "there", ""});
            continue;
        }
        const GroupInfo& b = list_b[groups.to_b[i]];
        const auto change = [&](const char* name, const auto& value_a, const auto& value_b) {
            compare_value(path + "." + name, value_a, value_b, out);
        };
        change("name", a.name, b.name);
        change("material.radius", a.material.radius, b.material.radius);
        change("material.radius2", a.material.radius2, b.material.radius2);
        change("material.density", a.material.density, b.material.density);
        change("material.youngs_modulus", a.material.youngs_modulus, b.material.youngs_modulus);
        change("material.poisson_ratio", a.material.poisson_ratio, b.material.poisson_ratio);
        change("material.viscosity", a.material.viscosity, b.material.viscosity);
        change("strand.damping", a.strand.damping, b.strand.damping);
        change("strand.friction", a.strand.friction, b.strand.friction);
        change("strand.volume", a.strand.volume, b.strand.volume);
        change("strand.iterations", a.strand.iterations, b.strand.iterations);
        change("strand.global_length", a.strand.global_length, b.strand.global_length);
        change("strand.length_damping", a.strand.length_damping, b.strand.length_damping);
        change("strand.wind_response", a.strand.wind_response, b.strand.wind_response);
    }
    for (std::uint32_t i = 0; i < list_b.size(); ++i)
        if (groups.to_a[i] == kNoMatch)
            out.push_back({"groups[" + list_b[i].name + "]", "", "there"});
}

void compare_colliders(const AssetInfo& info_a, const AssetInfo& info_b,
                       std::vector<ValueChange>& out) {
    const auto &list_a = info_a.colliders, &list_b = info_b.colliders;
    const auto bone = [](const AssetInfo& info, std::uint32_t i) {
        return i < info.bones.size() ? info.bones[i] : std::string("none");
    };
    for (std::size_t i = 0; i < std::max(list_a.size(), list_b.size()); ++i) {
        const std::string path = "colliders[" + std::to_string(i) + "]";
        if (i >= list_b.size()) {
            out.push_back({path, "there", ""});
        } else if (i >= list_a.size()) {
            out.push_back({path, "", "there"});
        } else {
            compare_value(path + ".a", list_a[i].a, list_b[i].a, out);
            compare_value(path + ".b", list_a[i].b, list_b[i].b, out);
            compare_value(path + ".radius", list_a[i].radius, list_b[i].radius, out);
            compare_value(path + ".bone", bone(info_a, list_a[i].bone),
                          bone(info_b, list_b[i].bone), out);
        }
    }
}

}  // namespace

void compare_info(const AssetView& view_a, const AssetView& view_b,
                  const Counterparts& counterparts, Report& report) {
    const AssetInfo &a = view_a.info(), &b = view_b.info();
    compare_value("vertices", a.mesh_vertex_count, b.mesh_vertex_count, report.mesh);
    compare_value("triangles", a.mesh_triangle_count, b.mesh_triangle_count, report.mesh);
    compare_value("topology", a.mesh_topology_hash, b.mesh_topology_hash, report.mesh);

    const auto differs = [&](std::string_view name) {
        return std::any_of(report.fields.begin(), report.fields.end(),
                           [&](const auto& f) { return f.name == name && f.differs(); });
    };
    if (report.strands.added_count + report.strands.removed_count == 0 &&
        !differs("strand_position") && !differs("strand_first_point")) {
        compare_value("min", a.bounds_min, b.bounds_min, report.bounds);
        compare_value("max", a.bounds_max, b.bounds_max, report.bounds);
    }

    compare_value("attach", a.attach, b.attach, report.settings);
    compare_groups(a, b, counterparts.groups(), report.settings);
    const Match& bones = counterparts.bones();
    if (a.bones != b.bones) {
        for (std::size_t i = 0; i < a.bones.size(); ++i)
            if (bones.to_b[i] == kNoMatch)
                report.settings.push_back({"bones[" + a.bones[i] + "]", "there", ""});
            else
                compare_value("bones[" + a.bones[i] + "]", a.bones[i], b.bones[bones.to_b[i]],
                              report.settings);
        for (std::size_t i = 0; i < b.bones.size(); ++i)
            if (bones.to_a[i] == kNoMatch)
                report.settings.push_back({"bones[" + b.bones[i] + "]", "", "there"});
        if (count_reordered(bones).count > 0)
            report.settings.push_back({"bones", "in one order", "in another"});
    }
    compare_colliders(a, b, report.settings);
    if (!view_a.fields().grid_brick.empty() && !view_b.fields().grid_brick.empty()) {
        compare_value("distance_grid.origin", a.distance_grid.origin, b.distance_grid.origin,
                      report.settings);
        compare_value("distance_grid.spacing", a.distance_grid.spacing, b.distance_grid.spacing,
                      report.settings);
        const auto counts = [](const std::array<std::uint32_t, 3>& n) {
            return std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " +
                   std::to_string(n[2]);
        };
        compare_value("distance_grid.bricks", counts(a.distance_grid.bricks),
                      counts(b.distance_grid.bricks), report.settings);
        compare_value("distance_grid.bone", a.distance_grid.bone, b.distance_grid.bone,
                      report.settings);
    }

    const auto storage = [](const AssetInfo& info) -> std::string {
        return info.packed ? "16 bits" : "floats";
    };
    compare_value("strand_position stored as", storage(a), storage(b), report.settings);
    // What follows from the fields says nothing new where they differ; revision 1.0 has neither.
    const bool same_data =
        report.strands.added_count + report.strands.removed_count == 0 &&
        std::none_of(report.fields.begin(), report.fields.end(),
                     [](const auto& f) { return f.differs(); });
    if (same_data && !a.levels.empty() && !b.levels.empty()) {
        const auto text = [](const std::vector<LevelOfDetail>& levels) {
            std::string out;
            for (const LevelOfDetail& level : levels)
                out += (out.empty() ? "" : ", ") + std::to_string(level.strand_count) + ": " +
                       value_text(level.width_scale);
            return out;
        };
        compare_value("levels", text(a.levels), text(b.levels), report.settings);
    }
    if (same_data && !a.guide_error.method.empty() && !b.guide_error.method.empty()) {
        compare_value("guide_error.method", a.guide_error.method, b.guide_error.method,
                      report.settings);
        compare_value("guide_error.mean", a.guide_error.mean, b.guide_error.mean, report.settings);
        compare_value("guide_error.p95", a.guide_error.p95, b.guide_error.p95, report.settings);
        compare_value("guide_error.max", a.guide_error.max, b.guide_error.max, report.settings);
    }

    compare_value("recipe", a.recipe_hash, b.recipe_hash, report.recipe);
    const auto label = [](const InputRecord& input) { return input.role + " " + input.name; };
    const auto labels = [&](const std::vector<InputRecord>& inputs) {
        std::vector<std::string> names;
        for (const InputRecord& input : inputs) names.push_back(label(input));
        return names;
    };
    const Match inputs = match_names(labels(a.inputs), labels(b.inputs));
    for (std::uint32_t i = 0; i < a.inputs.size(); ++i) {
        const std::string path = "inputs[" + label(a.inputs[i]) + "]";
        if (inputs.to_b[i] == kNoMatch) {
            report.inputs.push_back({path, "there", ""});
            continue;
        }
        const InputRecord& other = b.inputs[inputs.to_b[i]];
        compare_value(path + ".name", label(a.inputs[i]), label(other), report.inputs);
        compare_value(path + ".content", a.inputs[i].hash, other.hash, report.inputs);
    }
    for (std::uint32_t i = 0; i < b.inputs.size(); ++i)
        if (inputs.to_a[i] == kNoMatch)
            report.inputs.push_back({"inputs[" + label(b.inputs[i]) + "]", "", "there"});

    compare_value("tool_version", a.tool_version, b.tool_version, report.tool_version);
    const auto revision = [](const AssetInfo& info) {
        return std::to_string(info.format_major) + "." + std::to_string(info.format_minor);
    };
    compare_value("format", revision(a), revision(b), report.tool_version);
}

}  // namespace keratin::diff
