// Assets on arbitrary bytes as the rod solver runs them, with size and hash put right as if an
// attacker had: they are refused with a message, or their guides are rods that can be stepped.
#include "runtime/run/solver_run.h"
#include "tests/fuzz/asset_input.h"
#include "tests/fuzz/demand.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace keratin::fuzz {

void run_rod_asset(std::string_view bytes) {
    AssetInput input(bytes);
    input.correct_hash();
    const MemoryFile file;
    file.fill({reinterpret_cast<const char*>(input.bytes().data()), input.bytes().size()});
    Scene scene;
    scene.file = "scene";
    scene.solver = SolverKind::rod;
    scene.settings.contact = "none";
    scene.settings.iterations = 5;
    scene.assets.emplace_back();
    scene.assets[0].file = file.path();
    scene.assets[0].motion = {{0, {0, 0, 0}, {0, 0, 0, 1}}, {1, {0.1, 0, 0}, {0, 0, 0, 1}}};
    RunOptions options;
    options.threads = 1;
    const auto made = make_rod_run(scene, options);
    if (!made) return demand(!made.error().message.empty(), "an error says something");
    SolverRun& run = **made;
    for (int k = 0; k < 2; ++k)
        if (const auto ok = run.step(k / 240.0, (k + 1) / 240.0); !ok)
            return demand(!ok.error().message.empty(), "an error says something");
    RunState state;
    run.look(state);
    demand(state.position.size() == run.layout().rest.size(), "every point is there");
}

}  // namespace keratin::fuzz
