#include "schema/asset_view.h"

#include "asset_generated.h"
#include "schema/asset_check.h"
#include "schema/file_hash.h"
#include "schema/mapped_file.h"
#include "schema/packed_positions.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>

namespace keratin {

static_assert(std::endian::native == std::endian::little,
              "bulk fields are read in place, in little-endian byte order");

namespace {

constexpr std::size_t kFieldAlignment = 32;
// A FlatBuffer has 32-bit signed offsets.
constexpr std::size_t kLargestFile = std::numeric_limits<std::int32_t>::max();
// One root table with tables for groups, inputs, colliders: far above what any bake writes, far
// below what would take noticeable time to verify.
constexpr std::uint32_t kVerifierDepth = 8, kVerifierTables = 1u << 20;

// The major revision of a file of any revision: field 0 of the root table, read by hand with every
// offset checked, because the verifier knows only this revision's required fields.
std::optional<std::uint16_t> major_revision(std::span<const std::byte> bytes) {
    const auto fits = [&](std::uint64_t at, std::uint64_t size) {
        return at + size <= bytes.size();
    };
    std::uint32_t root = 0;
    std::int32_t to_vtable = 0;
    if (!fits(0, 8)) return {};
    std::memcpy(&root, bytes.data(), sizeof root);
    if (!fits(root, sizeof to_vtable)) return {};
    std::memcpy(&to_vtable, bytes.data() + root, sizeof to_vtable);
    const std::int64_t vtable = std::int64_t{root} - to_vtable;
    std::uint16_t vtable_size = 0, field = 0, major = 0;
    if (vtable < 0 || !fits(static_cast<std::uint64_t>(vtable), 6)) return {};
    std::memcpy(&vtable_size, bytes.data() + vtable, sizeof vtable_size);
    if (vtable_size < 6) return {};
    std::memcpy(&field, bytes.data() + vtable + 4, sizeof field);
    if (field == 0 || !fits(std::uint64_t{root} + field, sizeof major)) return {};
    std::memcpy(&major, bytes.data() + root + field, sizeof major);
    return major;
}

template <class Element>
std::span<const Element> span_of(const flatbuffers::Vector<Element>* vector) {
    if (!vector) return {};
    return {reinterpret_cast<const Element*>(vector->Data()), vector->size()};
}

template <class Element>
bool is_aligned(std::span<const Element> span) {
    return span.empty() || reinterpret_cast<std::uintptr_t>(span.data()) % kFieldAlignment == 0;
}

Hash128 to_hash(const fb::Hash128& hash) { return {hash.low(), hash.high()}; }
std::array<float, 3> to_array(const fb::Float3& v) { return {v.x(), v.y(), v.z()}; }
Ramp to_ramp(const flatbuffers::Vector<float>& values) { return {values.begin(), values.end()}; }

GroupInfo to_group(const fb::Group& group) {
    return {group.name()->str(),
            {group.radius(), group.radius2(), group.density(), group.youngs_modulus(),
             group.poisson_ratio(), group.viscosity()},
            {to_ramp(*group.damping()), to_ramp(*group.friction()), to_ramp(*group.volume()),
             group.iterations(), group.global_length(), group.length_damping(),
             to_ramp(*group.wind_response())}};
}

AssetInfo to_info(const fb::Asset& asset) {
    AssetInfo info;
    info.format_major = asset.format_major();
    info.format_minor = asset.format_minor();
    info.tool_version = asset.tool_version()->str();
    info.file_hash = to_hash(*asset.file_hash());
    info.file_size = asset.file_size();
    info.recipe_hash = to_hash(*asset.recipe_hash());
    for (const fb::Input* input : *asset.inputs())
        info.inputs.push_back(
            {input->role()->str(), input->name()->str(), to_hash(*input->hash())});
    info.attach = static_cast<Attach>(asset.attach());
    for (const fb::Group* group : *asset.groups()) info.groups.push_back(to_group(*group));
    for (const flatbuffers::String* bone : *asset.bones()) info.bones.push_back(bone->str());
    for (const fb::Collider* collider : *asset.colliders())
        info.colliders.push_back({to_array(*collider->a()), to_array(*collider->b()),
                                  collider->radius(), collider->bone()});
    if (const fb::DistanceGrid* grid = asset.distance_grid())
        info.distance_grid = {to_array(*grid->origin()),
                              grid->spacing(),
                              {grid->bricks_x(), grid->bricks_y(), grid->bricks_z()},
                              grid->stored_bricks(),
                              grid->bone(),
                              grid->max_error()};
    info.packed = asset.packed_position() != nullptr;
    info.packed_max_error = asset.packed_max_error();
    if (asset.levels())
        for (const fb::Level* level : *asset.levels())
            info.levels.push_back({level->strand_count(), level->width_scale()});
    if (const fb::GuideError* error = asset.guide_error())
        info.guide_error = {error->method()->str(), error->mean(), error->p95(), error->max()};
    info.tile_count = asset.tile_count();
    info.row_count = asset.row_count();
    info.guide_count = asset.guide_count();
    info.strand_count = asset.strand_count();
    info.point_count = asset.point_count();
    info.vertex_count = asset.vertex_count();
    info.triangle_count = asset.triangle_count();
    info.mesh_vertex_count = asset.mesh_vertex_count();
    info.mesh_triangle_count = asset.mesh_triangle_count();
    info.mesh_topology_hash = to_hash(*asset.mesh_topology_hash());
    info.bounds_min = to_array(*asset.bounds_min());
    info.bounds_max = to_array(*asset.bounds_max());
    return info;
}

}  // namespace

struct AssetView::Mapping {
    MappedFile file;
};

AssetView::AssetView() = default;
AssetView::AssetView(AssetView&&) noexcept = default;
AssetView& AssetView::operator=(AssetView&&) noexcept = default;
AssetView::~AssetView() = default;

std::span<const std::byte> AssetView::bytes() const { return bytes_; }

Result<AssetView> AssetView::open(const std::string& path, Verify verify) {
    auto file = MappedFile::open(path);
    if (!file) return file.error();
    AssetView view;
    view.mapping_ = std::make_unique<Mapping>(Mapping{std::move(*file)});
    if (auto ok = view.read(view.mapping_->file.bytes(), path, verify); !ok) return ok.error();
    return view;
}

Result<AssetView> AssetView::from_memory(std::span<const std::byte> bytes, const std::string& name,
                                         Verify verify) {
    AssetView view;
    if (auto ok = view.read(bytes, name, verify); !ok) return ok.error();
    return view;
}

// The floats that strand_position stands for. Nothing is allocated before it is known to fit the
// file: unpacked points take twice the room of packed ones.
Result<void> AssetView::unpack(std::span<const std::uint32_t> packed, std::span<const float> root,
                               std::span<const float> step, const std::string& name) {
    const auto refuse = [&](const std::string& field, std::uint64_t size, std::uint64_t expected) {
        return Error{ErrorCode::input, name,
                     field + " has " + std::to_string(size) + " elements instead of " +
                         std::to_string(expected)};
    };
    const std::uint64_t strands = info_.strand_count, points = info_.point_count;
    if (!fields_.strand_position.empty())
        return refuse("strand_position, beside packed_position,", fields_.strand_position.size(),
                      0);
    if (packed.size() != packed_words(points))
        return refuse("packed_position", packed.size(), packed_words(points));
    if (root.size() != 3 * strands) return refuse("packed_root", root.size(), 3 * strands);
    if (step.size() != strands) return refuse("packed_step", step.size(), strands);
    const auto& first = fields_.strand_first_point;
    if (first.size() != strands + 1)
        return refuse("strand_first_point", first.size(), strands + 1);
    if (first.front() != 0 || first.back() != points ||
        !std::is_sorted(first.begin(), first.end()))
        return Error{ErrorCode::input, name,
                     "strand_first_point does not ascend from 0 to " + std::to_string(points)};
    unpacked_.resize((3 * points + kBlockFloats - 1) / kBlockFloats);
    const std::span<float> position(unpacked_.data()->values, 3 * points);
    unpack_positions(first, packed, root, step, position);
    fields_.strand_position = position;
    return {};
}

Result<void> AssetView::read(std::span<const std::byte> bytes, const std::string& name,
                             Verify verify) {
    const auto refuse = [&](std::string message) {
        return Error{ErrorCode::input, name, std::move(message)};
    };
    if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kFieldAlignment != 0)
        return Error{ErrorCode::usage, name, "the bytes must start at a multiple of 32"};
    if (bytes.size() < 8 || std::memcmp(bytes.data() + 4, fb::AssetIdentifier(), 4) != 0)
        return refuse("not a keratin asset: it should start with the identifier \"" +
                      std::string(fb::AssetIdentifier()) + "\" at byte 4");
    if (bytes.size() > kLargestFile) return refuse("larger than 2 GiB");

    const auto major = major_revision(bytes);
    if (major && *major != kAssetMajor)
        return refuse("the asset has format revision " + std::to_string(*major) +
                      ", this program reads revision " + std::to_string(kAssetMajor) +
                      "; bake it again: keratin-bake RECIPE.json -o " + name);

    flatbuffers::Verifier verifier(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                   bytes.size(), kVerifierDepth, kVerifierTables);
    if (!major || !fb::VerifyAssetBuffer(verifier))
        return refuse("the file is damaged: its structure does not verify");
    const fb::Asset& asset = *fb::GetAsset(bytes.data());
    if (asset.file_size() != bytes.size())
        return refuse("the file is damaged: it says it has " + std::to_string(asset.file_size()) +
                      " bytes, it has " + std::to_string(bytes.size()));
    if (verify == Verify::full) {
        const auto hole = static_cast<std::size_t>(
            reinterpret_cast<const std::byte*>(asset.file_hash()) - bytes.data());
        if (hash_with_hole(bytes, hole, sizeof(fb::Hash128)) != to_hash(*asset.file_hash()))
            return refuse("the file is damaged: its content does not match its hash");
    }
    if (asset.attach() > fb::Attach::MAX) return refuse("attach has an unknown value");

    bytes_ = bytes;
    info_ = to_info(asset);
    bool aligned = true;
#define X(field, element, domain, components, presence, target, unit, meaning) \
    fields_.field = span_of(asset.field());                                    \
    aligned = aligned && is_aligned(fields_.field);
    KERATIN_ASSET_FIELDS(X)
#undef X
    if (!aligned) return refuse("the file is damaged: a field does not start at a multiple of 32");
    if (info_.packed) {
        const auto packed = span_of(asset.packed_position());
        const auto root = span_of(asset.packed_root()), step = span_of(asset.packed_step());
        if (auto ok = unpack(packed, root, step, name); !ok) return ok;
    }
    return check_asset(info_, fields_, name);
}

}  // namespace keratin
