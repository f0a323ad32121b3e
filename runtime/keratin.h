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
 * must outlive them. A simulation is used by one thread at a time; different ones at the same time by
 * different threads. Only keratin_create and keratin_asset_open allocate. There is no global state.
 * Not handled yet: a host's own allocator and thread pool (threads come from OpenMP).
 */
#ifndef KERATIN_H
#define KERATIN_H

#include <stddef.h>
#include <stdint.h>

#define KERATIN_ABI_VERSION 1

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
keratin_result keratin_set_lod(keratin_simulation*, float share);

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
} keratin_strands;
void keratin_get_strands(const keratin_simulation*, keratin_strands* out);

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
