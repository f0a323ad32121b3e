#include "bake/write.h"

#include "asset_generated.h"
#include "schema/asset_check.h"
#include "schema/file_hash.h"
#include "schema/packed_positions.h"

#include <limits>

namespace keratin {

namespace {

// Room for the tables, strings and padding beside the bulk fields; more is grown when needed.
constexpr std::size_t kTableBytes = 64 * 1024;
constexpr std::size_t kFieldAlignment = 32;

fb::Hash128 to_fb(const Hash128& hash) { return {hash.low, hash.high}; }
fb::Float3 to_fb(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

template <class Element>
flatbuffers::Offset<flatbuffers::Vector<Element>> add(flatbuffers::FlatBufferBuilder& builder,
                                                      std::span<const Element> values,
                                                      Presence presence) {
    if (values.empty() && presence == Presence::optional) return 0;
    builder.ForceVectorAlignment(values.size(), sizeof(Element), kFieldAlignment);
    return builder.CreateVector(values.data(), values.size());
}

flatbuffers::Offset<fb::Group> add(flatbuffers::FlatBufferBuilder& builder,
                                   const GroupInfo& group) {
    const Material& material = group.material;
    const StrandParameters& strand = group.strand;
    return fb::CreateGroupDirect(builder, group.name.c_str(), material.radius, material.radius2,
                                 material.density, material.youngs_modulus, material.poisson_ratio,
                                 material.viscosity, &strand.damping, &strand.friction,
                                 &strand.volume, strand.iterations, strand.global_length,
                                 strand.length_damping, &strand.wind_response);
}

}  // namespace

Result<std::vector<std::byte>> serialise_asset(const AssetInfo& info, const AssetFields& all,
                                               const std::string& name) {
    if (auto ok = check_asset(info, all, name); !ok) return ok.error();
    AssetFields fields = all;
    PackedPositions packed;
    if (info.packed) {
        packed = pack_positions(all.strand_first_point, all.strand_position);
        fields.strand_position = {};
    }
    std::size_t bulk = 0;
    for_each_field(fields, [&](const FieldDescription&, auto values) {
        bulk += values.size_bytes() + 2 * kFieldAlignment;
    });
    bulk += sizeof(float) * (packed.packed.size() + packed.root.size() + packed.step.size());
    if (bulk + kTableBytes > std::numeric_limits<std::int32_t>::max())
        return Error{ErrorCode::input, name,
                     "the asset would have " + std::to_string(bulk) +
                         " bytes, an asset holds 2 GiB at most; use fewer strands or points"};

    // Bulk fields are created in the order of the list, which decides the bytes.
    flatbuffers::FlatBufferBuilder builder(bulk + kTableBytes);
#define X(field, element, domain, components, presence, target, unit, meaning) \
    const auto field = add<element>(builder, fields.field, Presence::presence);
    KERATIN_ASSET_FIELDS(X)
#undef X

    const auto packed_position =
        add<std::uint32_t>(builder, packed.packed, Presence::optional);
    const auto packed_root = add<float>(builder, packed.root, Presence::optional);
    const auto packed_step = add<float>(builder, packed.step, Presence::optional);

    std::vector<flatbuffers::Offset<fb::Group>> groups;
    for (const GroupInfo& group : info.groups) groups.push_back(add(builder, group));
    std::vector<flatbuffers::Offset<fb::Input>> inputs;
    for (const InputRecord& input : info.inputs) {
        const fb::Hash128 hash = to_fb(input.hash);
        inputs.push_back(
            fb::CreateInputDirect(builder, input.role.c_str(), input.name.c_str(), &hash));
    }
    std::vector<flatbuffers::Offset<fb::Collider>> colliders;
    for (const AssetCollider& collider : info.colliders) {
        const fb::Float3 a = to_fb(collider.a), b = to_fb(collider.b);
        colliders.push_back(fb::CreateCollider(builder, &a, &b, collider.radius, collider.bone));
    }
    flatbuffers::Offset<fb::DistanceGrid> distance_grid;
    if (const DistanceGridInfo& grid = info.distance_grid; grid.stored_bricks > 0) {
        const fb::Float3 origin = to_fb(grid.origin);
        distance_grid =
            fb::CreateDistanceGrid(builder, &origin, grid.spacing, grid.bricks[0], grid.bricks[1],
                                   grid.bricks[2], grid.stored_bricks, grid.bone, grid.max_error);
    }
    std::vector<flatbuffers::Offset<fb::Level>> levels;
    for (const LevelOfDetail& level : info.levels) {
        levels.push_back(fb::CreateLevel(builder, level.strand_count, level.width_scale));
    }
    flatbuffers::Offset<fb::GuideError> guide_error;
    if (const GuideError& error = info.guide_error; !error.method.empty()) {
        guide_error = fb::CreateGuideErrorDirect(builder, error.method.c_str(), error.mean,
                                                 error.p95, error.max);
    }
    const auto levels_at = levels.empty() ? 0 : builder.CreateVector(levels);
    const auto tool_version = builder.CreateString(info.tool_version);
    const auto inputs_at = builder.CreateVector(inputs);
    const auto groups_at = builder.CreateVector(groups);
    const auto bones_at = builder.CreateVectorOfStrings(info.bones);
    const auto colliders_at = builder.CreateVector(colliders);

    const fb::Hash128 no_hash, recipe_hash = to_fb(info.recipe_hash),
                               topology = to_fb(info.mesh_topology_hash);
    const fb::Float3 bounds_min = to_fb(info.bounds_min), bounds_max = to_fb(info.bounds_max);
    fb::AssetBuilder asset(builder);
    asset.add_format_major(kAssetMajor);
    asset.add_format_minor(kAssetMinor);
    asset.add_file_hash(&no_hash);
    asset.add_file_size(std::numeric_limits<std::uint64_t>::max());  // set below
    asset.add_tool_version(tool_version);
    asset.add_recipe_hash(&recipe_hash);
    asset.add_inputs(inputs_at);
    asset.add_attach(static_cast<fb::Attach>(info.attach));
    asset.add_groups(groups_at);
    asset.add_bones(bones_at);
    asset.add_colliders(colliders_at);
    asset.add_tile_count(info.tile_count);
    asset.add_row_count(info.row_count);
    asset.add_guide_count(info.guide_count);
    asset.add_strand_count(info.strand_count);
    asset.add_point_count(info.point_count);
    asset.add_vertex_count(info.vertex_count);
    asset.add_triangle_count(info.triangle_count);
    asset.add_mesh_vertex_count(info.mesh_vertex_count);
    asset.add_mesh_triangle_count(info.mesh_triangle_count);
    asset.add_mesh_topology_hash(&topology);
    asset.add_distance_grid(distance_grid);
    asset.add_packed_position(packed_position);
    asset.add_packed_root(packed_root);
    asset.add_packed_step(packed_step);
    if (info.packed) asset.add_packed_max_error(info.packed_max_error);
    asset.add_levels(levels_at);
    asset.add_guide_error(guide_error);
    asset.add_bounds_min(&bounds_min);
    asset.add_bounds_max(&bounds_max);
#define X(field, element, domain, components, presence, target, unit, meaning) \
    asset.add_##field(field);
    KERATIN_ASSET_FIELDS(X)
#undef X
    fb::FinishAssetBuffer(builder, asset.Finish());

    const auto* begin = reinterpret_cast<const std::byte*>(builder.GetBufferPointer());
    std::vector<std::byte> bytes(begin, begin + builder.GetSize());
    auto* written = flatbuffers::GetMutableRoot<fb::Asset>(bytes.data());
    // file_size is not a default value, so the field has a place in the buffer.
    auto* table = reinterpret_cast<flatbuffers::Table*>(written);
    table->SetField<std::uint64_t>(fb::Asset::VT_FILE_SIZE, bytes.size(), 0);
    const auto hole = static_cast<std::size_t>(
        reinterpret_cast<const std::byte*>(written->file_hash()) - bytes.data());
    const fb::Hash128 hash = to_fb(hash_with_hole(bytes, hole, sizeof(fb::Hash128)));
    std::memcpy(bytes.data() + hole, &hash, sizeof hash);
    return bytes;
}

}  // namespace keratin
