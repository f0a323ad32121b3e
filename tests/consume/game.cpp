// Opens an asset and simulates it for a second: what a game does with keratin.
#include <cmath>
#include <cstdio>
#include <runtime/simulation.h>

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    const auto asset = keratin::AssetView::open(argv[1]);
    if (!asset) {
        std::fprintf(stderr, "%s\n", to_string(asset.error()).c_str());
        return 1;
    }
    auto simulation = keratin::Simulation::create(*asset, keratin::Settings());
    if (!simulation) {
        std::fprintf(stderr, "%s\n", to_string(simulation.error()).c_str());
        return 1;
    }
    for (int frame = 0; frame < 60; ++frame) {
        keratin::RigidTransform head;
        head.translation[0] = 0.1 * std::sin(0.1 * frame);
        if (!simulation->set_motion(head) || !simulation->step(1.0 / 60)) return 1;
    }
    const keratin::StrandView strands = simulation->strands();
    for (const float x : strands.position)
        if (!std::isfinite(x)) return 1;
    std::printf("%u strands after %g s\n", strands.strand_count, simulation->time());
    return 0;
}
