// What a picture is of: an asset at rest, or a frame of a cached run, as plain arrays in world
// space.
#pragma once

#include "schema/asset_view.h"
#include "schema/cache.h"
#include "schema/result.h"
#include "tools/keratin-view/mesh_file.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace keratin::view {

struct SubjectStrands {
    std::vector<std::uint32_t> first_point{0};  // [strands + 1]
    std::vector<float> position;                // [points * 3] m
    std::vector<float> radius;                  // [strands] m, at the root
    std::vector<std::uint32_t> id;              // [strands]
    std::vector<float> uv;                      // [strands * 2]; empty without
    std::vector<float> velocity;                // [points * 3] m/s; empty unless the run stored it
    std::vector<float> density;                 // [points]; empty unless the run stored it
};

struct Subject {
    SubjectStrands hair, guides;
    std::vector<BodyMesh> bodies;
    std::vector<CacheCollider> colliders;
    std::uint32_t frame = 0;
    double time = 0;           // s
    std::string density_unit;  // "of the groom at rest" (stored by a run) or "of the space"
};

// An asset in the pose it was baked in.
Subject rest_subject(const AssetView& asset);

// Open files. The subject of the asset alone is its rest pose.
struct Source {
    std::string name;  // of what was asked for, for messages
    std::vector<AssetView> assets;
    std::optional<CacheReader> cache;
    std::optional<BodyMesh> body;  // from --mesh, carried by the first asset's motion
};

// `file` is an asset or a cached run; `cache` a cached run of that asset, or empty. A cached run
// names its assets; they are looked for there, then beside the run. Errors: those of
// AssetView::open and CacheReader::open; input when the run was made with another asset than the
// one found.
Result<Source> open_source(const std::string& file, const std::string& cache);

// Frames that can be drawn; 1 (the rest pose) for an asset alone.
std::size_t frame_count(const Source& source);

// Frame i < frame_count. A body with bones is carried by the asset's motion only: a mesh whose skin
// bends is drawn stiff unless the run stored its vertices. Errors: those of CacheReader::frame.
Result<Subject> subject_at(const Source& source, std::size_t i);

}  // namespace keratin::view
