/* The C interface of the strand runtime: open an asset, create instances, move them, step, read back.
 *
 *     char message[256];
 *     keratin_asset* asset = keratin_asset_open("head.kera", message, sizeof message);
 *     keratin_settings settings = keratin_default_settings();
 *     keratin_simulation* hair = keratin_create(asset, &settings, message, sizeof message);
 *     for (;;) {
 *         keratin_set_motion(hair, &head);
 *         keratin_step(hair, 1.0 / 60);
 *         keratin_strands strands;
 *         keratin_get_strands(hair, &strands);    // no copy: draw strands.position
 *     }
 *     keratin_destroy(hair);
 *     keratin_asset_close(asset);
 *
 * SI units, y up, right-handed, quaternions (x, y, z, w). Several simulations may share an asset, which
 * must outlive them. There is no global state.
 *
 * Threads: an asset may be read by any number of threads at once. A simulation is used by one thread at
 * a time; different ones, of the same asset too, at the same time by different threads. Inside of a
 * step the work is shared among keratin_settings.threads threads, OpenMP's or the host's; results do
 * not depend on them.
 * Memory: only keratin_create and keratin_asset_open allocate. The buffers of a simulation, which
 * keratin_stats.bytes counts, are the host's where it lends memory; a few kB of names and lists are not.
 * ABI: structs only grow at their ends, and KERATIN_ABI_VERSION rises when they do.
 *
 * runtime/example/example.c is a complete program.
 */
#ifndef KERATIN_H
#define KERATIN_H

#include <stddef.h>
#include <stdint.h>

#define KERATIN_ABI_VERSION 2

#ifdef __cplusplus
extern "C" {
#endif

/* KERATIN_ABI_VERSION of the library that is linked; structs only fit when both are equal. */
uint32_t keratin_abi_version(void);

typedef enum keratin_result {
    KERATIN_OK = 0,
    KERATIN_INPUT = 1,       /* an argument holds something that cannot be used; nothing was changed */
    KERATIN_IO = 2,          /* the system refused to read */
    KERATIN_UNSUPPORTED = 3, /* right, but not for this solver or processor */
    KERATIN_INTERNAL = 4
} keratin_result;

typedef struct keratin_asset keratin_asset;
typedef struct keratin_simulation keratin_simulation;

typedef struct keratin_transform {
    double translation[3]; /* m */
    double rotation[4];    /* unit quaternion */
} keratin_transform;

typedef struct keratin_capsule {
    float a[3], b[3];        /* m, a == b: a sphere */
    float radius;            /* m, > 0 */
    float friction;          /* >= 0 */
    float contact_distance;  /* m; 0: the strand's radius */
} keratin_capsule;

typedef enum keratin_shape {
    KERATIN_SPHERE = 0,  /* a: centre; radius */
    KERATIN_CAPSULE = 1, /* a, b: ends of the core; radius */
    KERATIN_BOX = 2,     /* a: centre; b: half size */
    KERATIN_PLANE = 3,   /* a: a point; b: unit normal, out of the solid side */
    KERATIN_GRID = 4     /* a: node (0, 0, 0); spacing, nodes, distance */
} keratin_shape;

/* A solid that moves by keratin_set_collider. */
typedef struct keratin_collider {
    keratin_shape shape;
    float a[3], b[3];        /* m */
    float radius;            /* m, > 0 */
    float friction;          /* Coulomb, >= 0 */
    float contact_distance;  /* m; 0: the strand's radius */
    float spacing;           /* m between nodes, > 0 */
    uint32_t nodes[3];       /* >= 2 each */
    const float* distance;   /* [nodes x * y * z] m, x fastest, negative inside; copied */
} keratin_collider;

typedef enum keratin_log_level { KERATIN_NOTE = 0, KERATIN_WARNING = 1 } keratin_log_level;

/* What the host lends: each function is called with `user`; NULL: done the ordinary way. runtime/host.h
 * says when they are called. allocate and release are given together. */
typedef struct keratin_host {
    void* user;
    void* (*allocate)(void* user, size_t bytes, size_t alignment); /* NULL: there are none */
    void (*release)(void* user, void* memory, size_t bytes, size_t alignment);
    void (*log)(void* user, keratin_log_level level, const char* message);
    /* task(context, k) for each k = 0 .. count - 1, in any order on any threads; returns when all have. */
    void (*parallel)(void* user, uint32_t count, void (*task)(void* context, uint32_t k), void* context);
} keratin_host;

typedef struct keratin_settings {
    float gravity[3];                 /* m/s^2 */
    float wind[3];                    /* m/s */
    float gust, turbulence;           /* 0..1 */
    uint64_t seed;
    uint32_t iterations;              /* per 1/60 s, 1..64; 0: the asset's */
    int32_t threads;                  /* 0: as many as OpenMP would take */
    float lod;                        /* 0..1, share of the render strands */
    int32_t half_output, tangents;    /* 0 or 1 */
    int32_t asset_colliders;          /* 0 or 1 */
    const keratin_capsule* capsules;  /* copied */
    uint32_t capsule_count;
    /* since ABI 2 */
    const keratin_collider* colliders; /* copied; their indices follow those of the capsules */
    uint32_t collider_count;
    int32_t previous;                  /* 0 or 1: keep the strands of the step before */
    float teleport_distance;           /* m in a step; <= 0: never */
    float sleep_speed;                 /* m/s; <= 0: never */
    keratin_host host;
} keratin_settings;

/* Earth's gravity, no wind, everything drawn, float output. */
keratin_settings keratin_default_settings(void);

/* NULL on failure; the reason, shortened to message_size - 1 characters, goes to message (may be NULL).
 * keratin_asset_from_memory: bytes start at a multiple of 32, stay unchanged and outlive the asset. */
keratin_asset* keratin_asset_open(const char* path, char* message, size_t message_size);
keratin_asset* keratin_asset_from_memory(const void* bytes, size_t size, char* message,
                                         size_t message_size);
void keratin_asset_close(keratin_asset* asset);

keratin_simulation* keratin_create(const keratin_asset* asset, const keratin_settings* settings,
                                   char* message, size_t message_size);
void keratin_destroy(keratin_simulation* simulation);

/* Where things are at the end of the next step. Bones: rest pose to present, in the asset's order.
 * Mesh: positions of all source vertices, x y z each, in the asset's space. */
keratin_result keratin_set_motion(keratin_simulation*, const keratin_transform* motion);
keratin_result keratin_set_bones(keratin_simulation*, const keratin_transform* bones, uint32_t count);
keratin_result keratin_set_mesh(keratin_simulation*, const float* positions, uint32_t vertex_count);
keratin_result keratin_set_capsule(keratin_simulation*, uint32_t index, const keratin_transform* motion);
/* The same, for capsules and colliders alike. */
keratin_result keratin_set_collider(keratin_simulation*, uint32_t index, const keratin_transform* motion);
keratin_result keratin_set_lod(keratin_simulation*, float share);
keratin_result keratin_set_gravity(keratin_simulation*, const float gravity[3]);
keratin_result keratin_set_wind(keratin_simulation*, const float velocity[3], float gust, float turbulence);
/* The point of the world that all positions count from; keeps precision far from the world's origin. */
void keratin_set_origin(keratin_simulation*, const double origin[3]);

/* Advances by h seconds, 1e-5 .. 0.25. */
keratin_result keratin_step(keratin_simulation*, double h);
/* Back to the groomed pose, at rest. */
void keratin_reset(keratin_simulation*);
/* Jumps to what was set since the last step; strands keep their shape. */
void keratin_teleport(keratin_simulation*, int32_t keep_velocity);

/* Render strands; pointers stay valid until keratin_destroy, their content until the next step.
 * Strand s has the points first_point[s] .. first_point[s + 1] - 1. */
typedef struct keratin_strands {
    uint32_t strand_count;
    const uint32_t* first_point;   /* [strand_count + 1] */
    const float* position;         /* [points * 3] m, NULL with half output */
    const uint16_t* position_half; /* [points * 3] IEEE half, relative to half_center; NULL otherwise */
    const float* tangent;          /* [points * 3], NULL unless asked for */
    const float* radius;           /* [strand_count] m, NULL: the same for a group */
    const float* uv;               /* [strand_count * 2], NULL without */
    const uint32_t* id;            /* [strand_count] */
    float half_center[3];
    float width_scale;             /* multiply widths by this at a lower level of detail */
    float bounds_min[3], bounds_max[3];
    /* Since ABI 2: the same points before the last step, for motion vectors; NULL unless asked for. With
     * them a step swaps the buffers: get the strands anew after each. */
    const float* previous;
    const uint16_t* previous_half; /* relative to half_center_previous */
    float half_center_previous[3];
} keratin_strands;
void keratin_get_strands(const keratin_simulation*, keratin_strands* out);

/* The simulated guides, side by side in tiles of 16 lanes: component c of point p of lane l in tile t is
 * position[((tile_first_row[t] + p) * 3 + c) * 16 + l]. Lanes with point_count 0 are empty. */
typedef struct keratin_guides {
    uint32_t tile_count;
    const uint32_t* tile_first_row; /* [tile_count + 1] */
    const uint32_t* point_count;    /* [tile_count * 16] */
    const uint32_t* strand;         /* [tile_count * 16] render strand that the guide is */
    const float* position;          /* m */
    const float* previous;          /* m, previous_step before */
    double previous_step;           /* s */
} keratin_guides;
void keratin_get_guides(const keratin_simulation*, keratin_guides* out);

typedef struct keratin_stats {
    double step_seconds;       /* wall time in keratin_step since creation */
    uint64_t steps, strands_reset, strands_teleported, roots_refused;
    uint32_t strands_asleep;
    uint64_t bytes;            /* allocated by the instance */
} keratin_stats;
void keratin_get_stats(const keratin_simulation*, keratin_stats* out);

#ifdef __cplusplus
}
#endif
#endif
