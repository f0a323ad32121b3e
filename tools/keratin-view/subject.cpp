#include "tools/keratin-view/subject.h"

#include "schema/formula/quaternion.h"
#include "schema/layout.h"

#include <algorithm>
#include <filesystem>

namespace keratin::view {
namespace {

bool ends_with(const std::string& text, const std::string& end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), end.size(), end) == 0;
}

void append_strand(SubjectStrands& to, std::uint32_t points, float radius, std::uint32_t id) {
    to.first_point.push_back(to.first_point.back() + points);
    to.radius.push_back(radius);
    to.id.push_back(id);
}

float radius_of(const AssetView& asset, std::uint32_t strand) {
    const AssetFields& f = asset.fields();
    return f.strand_radius.empty() ? asset.info().groups[f.strand_group[strand]].material.radius
                                   : f.strand_radius[strand];
}

// Everything of the strands but where they are: counts, radii, ids, texture coordinates.
void describe_hair(const AssetView& asset, std::uint32_t count, SubjectStrands& hair) {
    const AssetFields& f = asset.fields();
    for (std::uint32_t s = 0; s < count; ++s)
        append_strand(hair, f.strand_first_point[s + 1] - f.strand_first_point[s],
                      radius_of(asset, s), f.strand_id[s]);
    if (!f.strand_uv.empty())
        hair.uv.insert(hair.uv.end(), f.strand_uv.begin(), f.strand_uv.begin() + 2 * count);
}

void rest_guides(const AssetView& asset, SubjectStrands& guides) {
    const AssetFields& f = asset.fields();
    for (std::size_t t = 0; t < asset.info().tile_count; ++t)
        for (std::size_t lane = 0; lane < kTileLanes; ++lane) {
            const std::size_t g = t * kTileLanes + lane;
            const std::uint32_t points = f.guide_point_count[g], strand = f.guide_strand[g];
            if (points == 0) continue;
            for (std::uint32_t p = 0; p < points; ++p)
                for (std::size_t c = 0; c < 3; ++c)
                    guides.position.push_back(
                        f.guide_position[vector_index(f.tile_first_row[t] + p, 3, c, lane)]);
            append_strand(guides, points, radius_of(asset, strand), f.strand_id[strand]);
        }
}

BodyMesh stored_body(const AssetView& asset) {
    const AssetFields& f = asset.fields();
    return {{f.mesh_position.begin(), f.mesh_position.end()},
            {f.mesh_triangle.begin(), f.mesh_triangle.end()}};
}

void move(const CacheTransform& motion, std::vector<float>& position) {
    const auto& q = motion.rotation;
    const auto& t = motion.translation;
    for (std::size_t i = 0; i + 2 < position.size(); i += 3) {
        const Vec3<double> x = rotate(Vec4<double>(q[0], q[1], q[2], q[3]),
                                      Vec3<double>(position[i], position[i + 1], position[i + 2]));
        position[i] = float(x.x + t[0]);
        position[i + 1] = float(x.y + t[1]);
        position[i + 2] = float(x.z + t[2]);
    }
}

Result<AssetView> open_asset_of(const CacheAsset& wanted, const std::string& cache) {
    std::string path = wanted.file;
    if (!std::filesystem::exists(path)) {
        const auto beside =
            std::filesystem::path(cache).parent_path() / std::filesystem::path(path).filename();
        if (std::filesystem::exists(beside)) path = beside.string();
    }
    return AssetView::open(path, Verify::structure);
}

}  // namespace

Result<Source> open_source(const std::string& file, const std::string& cache) {
    Source source;
    source.name = file;
    const bool is_cache = ends_with(file, ".kcache");
    if (is_cache && !cache.empty())
        return Error{ErrorCode::usage, "--cache",
                     file + " is a cached run already; give the asset first, or leave --cache out"};
    if (!is_cache) {
        auto asset = AssetView::open(file, Verify::structure);
        if (!asset) return asset.error();
        source.assets.push_back(std::move(*asset));
    }
    const std::string run = is_cache ? file : cache;
    if (run.empty()) return source;
    auto reader = CacheReader::open(run);
    if (!reader) return reader.error();
    const CacheHead& head = reader->head();
    if (!is_cache && head.assets.size() != 1)
        return Error{ErrorCode::input, run,
                     "is a run of " + std::to_string(head.assets.size()) +
                         " assets; draw it by itself: keratin-view " + run};
    if (is_cache)
        for (const CacheAsset& wanted : head.assets) {
            auto asset = open_asset_of(wanted, run);
            if (!asset) return asset.error();
            source.assets.push_back(std::move(*asset));
        }
    for (std::size_t a = 0; a < head.assets.size(); ++a) {
        const AssetInfo& info = source.assets[a].info();
        if (!(info.file_hash == head.assets[a].hash) ||
            head.assets[a].strand_count > info.strand_count)
            return Error{ErrorCode::input, run,
                         "was made with another " + head.assets[a].file +
                             " than the one there now; run keratin-run again"};
    }
    source.cache = std::move(*reader);
    return source;
}

Subject rest_subject(const AssetView& asset) {
    const AssetFields& f = asset.fields();
    Subject subject;
    describe_hair(asset, asset.info().strand_count, subject.hair);
    subject.hair.position.assign(f.strand_position.begin(), f.strand_position.end());
    rest_guides(asset, subject.guides);
    if (!f.mesh_triangle.empty()) subject.bodies.push_back(stored_body(asset));
    for (const AssetCollider& c : asset.info().colliders)
        subject.colliders.push_back({CacheShape::capsule, c.a, c.b, c.radius, {0, 0, 0, 1}});
    return subject;
}

std::size_t frame_count(const Source& source) {
    return source.cache ? source.cache->frame_count() : 1;
}

Result<Subject> subject_at(const Source& source, std::size_t i) {
    if (!source.cache) {
        Subject subject = rest_subject(source.assets[0]);
        if (source.body) subject.bodies = {*source.body};
        return subject;
    }
    const CacheHead& head = source.cache->head();
    auto frame = source.cache->frame(i);
    if (!frame) return frame.error();

    Subject subject;
    subject.frame = frame->number;
    subject.time = frame->time;
    subject.density_unit = "of the groom at rest";
    std::uint32_t strand = 0, guide = 0;
    for (std::size_t a = 0; a < head.assets.size(); ++a) {
        const AssetFields& f = source.assets[a].fields();
        for (std::uint32_t s = 0; s < head.assets[a].strand_count; ++s, ++strand)
            append_strand(subject.hair,
                          head.strand_first_point[strand + 1] - head.strand_first_point[strand],
                          head.strand_radius[strand], f.strand_id[s]);
        if (!f.strand_uv.empty())
            subject.hair.uv.insert(subject.hair.uv.end(), f.strand_uv.begin(),
                                   f.strand_uv.begin() + 2 * head.assets[a].strand_count);
        for (std::uint32_t g = 0; g < head.assets[a].guide_count; ++g, ++guide) {
            const std::uint32_t lane = head.guide_lane[guide];
            const std::uint32_t own = lane < f.guide_strand.size() ? f.guide_strand[lane] : 0;
            append_strand(subject.guides,
                          head.guide_first_point[guide + 1] - head.guide_first_point[guide],
                          radius_of(source.assets[a], own), f.strand_id[own]);
        }
        const CacheBody* body = a < frame->bodies.size() ? &frame->bodies[a] : nullptr;
        if (!f.mesh_triangle.empty() && !(a == 0 && source.body)) {
            BodyMesh mesh = stored_body(source.assets[a]);
            if (body && body->mesh_position.size() == mesh.position.size()) {
                mesh.position = body->mesh_position;
            } else if (body) {
                move(body->motion, mesh.position);
            }
            subject.bodies.push_back(std::move(mesh));
        }
    }
    // The scene's own strands.
    for (; strand + 1 < head.strand_first_point.size(); ++strand)
        append_strand(subject.hair,
                      head.strand_first_point[strand + 1] - head.strand_first_point[strand],
                      head.strand_radius[strand], strand);
    for (; guide + 1 < head.guide_first_point.size(); ++guide)
        append_strand(subject.guides,
                      head.guide_first_point[guide + 1] - head.guide_first_point[guide], 0, guide);
    if (subject.hair.uv.size() != 2 * subject.hair.id.size()) subject.hair.uv.clear();

    subject.hair.position = std::move(frame->strand_position);
    subject.hair.velocity = std::move(frame->strand_velocity);
    subject.hair.density = std::move(frame->strand_density);
    subject.guides.position = std::move(frame->guide_position);
    subject.colliders = std::move(frame->colliders);
    if (source.body) {
        BodyMesh mesh = *source.body;
        if (!frame->bodies.empty()) move(frame->bodies[0].motion, mesh.position);
        subject.bodies.push_back(std::move(mesh));
    }
    return subject;
}

}  // namespace keratin::view
