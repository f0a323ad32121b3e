/* A complete program on the C interface: opens an asset, shakes it for a second, says where the tips
 * went. Usage: example head.kera */
#include <math.h>
#include <stdio.h>

#include "runtime/keratin.h"

int main(int argc, char** argv) {
    char message[256] = "";
    if (argc != 2) {
        fprintf(stderr, "usage: example ASSET.kera\n");
        return 2;
    }
    if (keratin_abi_version() != KERATIN_ABI_VERSION) {
        fprintf(stderr, "example: built for another version of the library\n");
        return 2;
    }
    keratin_asset* asset = keratin_asset_open(argv[1], message, sizeof message);
    if (!asset) {
        fprintf(stderr, "example: %s\n", message);
        return 2;
    }
    keratin_settings settings = keratin_default_settings();
    keratin_simulation* hair = keratin_create(asset, &settings, message, sizeof message);
    if (!hair) {
        fprintf(stderr, "example: %s\n", message);
        keratin_asset_close(asset);
        return 2;
    }
    for (int frame = 1; frame <= 60; ++frame) {
        const double t = frame / 60.0;
        keratin_transform head = {{0.1 * sin(6.283185307 * t), 0, 0}, {0, 0, 0, 1}};
        if (keratin_set_motion(hair, &head) != KERATIN_OK) return 3;
        if (keratin_step(hair, 1.0 / 60) != KERATIN_OK) return 3;
    }
    keratin_strands strands;
    keratin_stats stats;
    keratin_get_strands(hair, &strands);
    keratin_get_stats(hair, &stats);
    double lowest = 1e30;
    for (uint32_t s = 0; s < strands.strand_count; ++s) {
        const float* tip = strands.position + 3 * (size_t)(strands.first_point[s + 1] - 1);
        if (tip[1] < lowest) lowest = tip[1];
    }
    printf("%u strands, %llu steps, %llu reset, lowest tip at y = %.3f m\n", strands.strand_count,
           (unsigned long long)stats.steps, (unsigned long long)stats.strands_reset, lowest);
    keratin_destroy(hair);
    keratin_asset_close(asset);
    return 0;
}
