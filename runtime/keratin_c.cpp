// The C interface on top of Simulation.
#include "runtime/keratin.h"
#include "runtime/simulation.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <new>

using namespace keratin;

struct keratin_asset {
    AssetView view;
};
struct keratin_simulation {
    std::unique_ptr<keratin_host> host;  // outlives what was allocated with it
    Simulation simulation;
};

namespace {

keratin_result code_of(const Error& error) {
    switch (error.code) {
        case ErrorCode::usage:
        case ErrorCode::input:
            return KERATIN_INPUT;
        case ErrorCode::io:
            return KERATIN_IO;
        case ErrorCode::unsupported:
            return KERATIN_UNSUPPORTED;
        case ErrorCode::internal:
            return KERATIN_INTERNAL;
    }
    return KERATIN_INTERNAL;
}

keratin_result code_of(const Result<void>& result) {
    return result ? KERATIN_OK : code_of(result.error());
}

void tell(const std::string& text, char* message, std::size_t size) {
    if (!message || size == 0) return;
    const std::size_t n = std::min(size - 1, text.size());
    std::memcpy(message, text.data(), n);
    message[n] = 0;
}

RigidTransform from_c(const keratin_transform& t) {
    RigidTransform r;
    std::copy(t.translation, t.translation + 3, r.translation.begin());
    std::copy(t.rotation, t.rotation + 4, r.rotation.begin());
    return r;
}

std::array<float, 3> three(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

ColliderShape shape_from_c(const keratin_collider& c) {
    switch (c.shape) {
        case KERATIN_SPHERE:
            return SphereCollider{three(c.a), c.radius};
        case KERATIN_CAPSULE:
            return CapsuleCollider{three(c.a), three(c.b), c.radius};
        case KERATIN_BOX:
            return BoxCollider{three(c.a), three(c.b)};
        case KERATIN_PLANE:
            return PlaneCollider{three(c.a), three(c.b)};
        case KERATIN_GRID:
            break;
    }
    auto grid = std::make_shared<DistanceGrid>();
    grid->origin = three(c.a);
    grid->spacing = c.spacing;
    std::size_t count = c.distance ? 1 : 0;
    for (std::size_t k = 0; k < 3; ++k) {
        grid->nodes[k] = c.nodes[k];
        count *= c.nodes[k];
    }
    grid->distance.assign(c.distance, c.distance + count);
    return DistanceGridCollider{grid};
}

Host host_from_c(keratin_host& kept) {
    Host host;
    host.user = &kept;
    if (kept.allocate)
        host.allocate = [](void* user, std::size_t bytes, std::size_t alignment) {
            const auto& own = *static_cast<const keratin_host*>(user);
            return own.allocate(own.user, bytes, alignment);
        };
    if (kept.release)
        host.release = [](void* user, void* memory, std::size_t bytes, std::size_t alignment) {
            const auto& own = *static_cast<const keratin_host*>(user);
            own.release(own.user, memory, bytes, alignment);
        };
    if (kept.log)
        host.log = [](void* user, LogLevel level, const char* line) {
            const auto& own = *static_cast<const keratin_host*>(user);
            own.log(own.user, level == LogLevel::warning ? KERATIN_WARNING : KERATIN_NOTE, line);
        };
    if (kept.parallel)
        host.parallel = [](void* user, std::uint32_t count, void (*task)(void*, std::uint32_t),
                           void* context) {
            const auto& own = *static_cast<const keratin_host*>(user);
            own.parallel(own.user, count, task, context);
        };
    return host;
}

keratin_asset* keep(Result<AssetView> view, char* message, std::size_t size) {
    if (view) return new keratin_asset{std::move(*view)};
    tell(to_string(view.error()), message, size);
    return nullptr;
}

template <class T>
const T* pointer(std::span<const T> s) {
    return s.empty() ? nullptr : s.data();
}

}  // namespace

extern "C" {

uint32_t keratin_abi_version(void) { return KERATIN_ABI_VERSION; }

keratin_settings keratin_default_settings(void) {
    keratin_settings s{};
    s.gravity[1] = -9.81f;
    s.seed = 1;
    s.lod = 1;
    s.asset_colliders = 1;
    s.teleport_distance = Settings().teleport_distance;
    return s;
}

keratin_asset* keratin_asset_open(const char* path, char* message, size_t size) {
    return keep(AssetView::open(path), message, size);
}
keratin_asset* keratin_asset_from_memory(const void* bytes, size_t count, char* message,
                                         size_t size) {
    return keep(AssetView::from_memory({static_cast<const std::byte*>(bytes), count}, "memory"),
                message, size);
}
void keratin_asset_close(keratin_asset* asset) { delete asset; }

keratin_simulation* keratin_create(const keratin_asset* asset, const keratin_settings* in,
                                   char* message, size_t size) {
    Settings s;
    std::copy(in->gravity, in->gravity + 3, s.gravity.begin());
    std::copy(in->wind, in->wind + 3, s.wind.velocity.begin());
    s.wind.gust = in->gust;
    s.wind.turbulence = in->turbulence;
    s.seed = in->seed;
    s.iterations = in->iterations;
    s.threads = in->threads;
    s.lod = in->lod;
    s.output = in->half_output ? OutputPrecision::float16 : OutputPrecision::float32;
    s.tangents = in->tangents != 0;
    s.asset_colliders = in->asset_colliders != 0;
    for (uint32_t i = 0; i < in->capsule_count; ++i) {
        const keratin_capsule& c = in->capsules[i];
        CapsuleCollider shape;
        std::copy(c.a, c.a + 3, shape.a.begin());
        std::copy(c.b, c.b + 3, shape.b.begin());
        shape.radius = c.radius;
        s.colliders.push_back({shape, c.friction, c.contact_distance});
    }
    for (uint32_t i = 0; i < in->collider_count; ++i)
        s.colliders.push_back(
            {shape_from_c(in->colliders[i]), in->colliders[i].friction, in->colliders[i].contact_distance});
    s.previous = in->previous != 0;
    s.teleport_distance = in->teleport_distance;
    s.sleep_speed = in->sleep_speed;
    // A function of one enum is not one of the other: the host's own travels along.
    auto kept = std::make_unique<keratin_host>(in->host);
    s.host = host_from_c(*kept);
    auto made = Simulation::create(asset->view, s);
    if (made) return new keratin_simulation{std::move(kept), std::move(*made)};
    tell(to_string(made.error()), message, size);
    return nullptr;
}
void keratin_destroy(keratin_simulation* s) { delete s; }

keratin_result keratin_set_motion(keratin_simulation* s, const keratin_transform* motion) {
    return code_of(s->simulation.set_motion(from_c(*motion)));
}
keratin_result keratin_set_bones(keratin_simulation* s, const keratin_transform* bones,
                                 uint32_t count) {
    // The same bytes: both are seven doubles, translation first.
    static_assert(sizeof(keratin_transform) == sizeof(RigidTransform));
    return code_of(
        s->simulation.set_bones({reinterpret_cast<const RigidTransform*>(bones), count}));
}
keratin_result keratin_set_mesh(keratin_simulation* s, const float* positions, uint32_t count) {
    return code_of(s->simulation.set_mesh({positions, std::size_t{count} * 3}));
}
keratin_result keratin_set_capsule(keratin_simulation* s, uint32_t index,
                                   const keratin_transform* motion) {
    return code_of(s->simulation.set_collider(index, from_c(*motion)));
}
keratin_result keratin_set_collider(keratin_simulation* s, uint32_t index,
                                    const keratin_transform* motion) {
    return code_of(s->simulation.set_collider(index, from_c(*motion)));
}
keratin_result keratin_set_gravity(keratin_simulation* s, const float gravity[3]) {
    return code_of(s->simulation.set_gravity({gravity[0], gravity[1], gravity[2]}));
}
keratin_result keratin_set_wind(keratin_simulation* s, const float velocity[3], float gust,
                                float turbulence) {
    return code_of(s->simulation.set_wind({{velocity[0], velocity[1], velocity[2]}, gust, turbulence}));
}
void keratin_set_origin(keratin_simulation* s, const double origin[3]) {
    s->simulation.set_origin({origin[0], origin[1], origin[2]});
}
keratin_result keratin_set_lod(keratin_simulation* s, float share) {
    return code_of(s->simulation.set_lod(share));
}
keratin_result keratin_step(keratin_simulation* s, double h) {
    return code_of(s->simulation.step(h));
}
void keratin_reset(keratin_simulation* s) { s->simulation.reset(); }
void keratin_teleport(keratin_simulation* s, int32_t keep_velocity) {
    s->simulation.teleport(keep_velocity ? Velocity::keep : Velocity::zero);
}

void keratin_get_strands(const keratin_simulation* s, keratin_strands* out) {
    const StrandView v = s->simulation.strands();
    out->strand_count = v.strand_count;
    out->first_point = pointer(v.first_point);
    out->position = pointer(v.position);
    out->position_half = pointer(v.position_half);
    out->tangent = pointer(v.tangent);
    out->radius = pointer(v.radius);
    out->uv = pointer(v.uv);
    out->id = pointer(v.id);
    std::copy(v.half_center.begin(), v.half_center.end(), out->half_center);
    out->width_scale = v.width_scale;
    std::copy(v.bounds_min.begin(), v.bounds_min.end(), out->bounds_min);
    std::copy(v.bounds_max.begin(), v.bounds_max.end(), out->bounds_max);
    out->previous = pointer(v.previous);
    out->previous_half = pointer(v.previous_half);
    std::copy(v.half_center_previous.begin(), v.half_center_previous.end(), out->half_center_previous);
}

void keratin_get_guides(const keratin_simulation* s, keratin_guides* out) {
    const GuideView v = s->simulation.guides();
    const AssetFields& fields = s->simulation.fields();
    out->tile_count = v.position.empty() ? 0 : s->simulation.info().tile_count;
    out->tile_first_row = pointer(fields.tile_first_row);
    out->point_count = pointer(fields.guide_point_count);
    out->strand = pointer(fields.guide_strand);
    out->position = pointer(v.position);
    out->previous = pointer(v.previous);
    out->previous_step = v.previous_step;
}

void keratin_get_stats(const keratin_simulation* s, keratin_stats* out) {
    const Stats stats = s->simulation.stats();
    out->step_seconds = stats.step_seconds;
    out->steps = stats.health.steps;
    out->strands_reset = stats.health.strands_reset;
    out->strands_teleported = stats.health.strands_teleported;
    out->roots_refused = stats.health.roots_refused;
    out->strands_asleep = stats.health.strands_asleep;
    out->bytes = stats.bytes;
}

}  // extern "C"
