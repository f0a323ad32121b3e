// Saved runs of both solvers on arbitrary bytes, bound to the scene and with their hash put right,
// as if an attacker had: they are refused with a message, or the run goes on without harm.
#include "runtime/run/solver_run.h"
#include "runtime/run/state_file.h"
#include "schema/file_hash.h"
#include "schema/files/write_file.h"
#include "tests/data_dir.h"
#include "tests/fuzz/demand.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

#include <cstring>
#include <filesystem>
#include <string>
#include <unistd.h>
#include <vector>

namespace keratin::fuzz {

namespace {

constexpr double kStep = 1.0 / 240;

constexpr char kStrandScene[] = R"({
    "assets": [ { "file": "asset-1.1.kera" } ],
    "duration": 1
})";

// Two strands across each other on a plane.
constexpr char kRodScene[] = R"({
    "solver": "rod", "duration": 1,
    "strands": [
        { "points": [[0,0,0],[0.01,0,0],[0.02,0,0],[0.03,0,0]], "radius": 1e-3 },
        { "points": [[0.015,0.002,-0.01],[0.015,0.002,0],[0.015,0.002,0.01]], "radius": 1e-3 }
    ],
    "colliders": [ { "plane": { "point": [0,-0.002,0], "normal": [0,1,0] } } ]
})";

// A run as `--resume` finds it, and the head of a file that it saved.
struct Resumed {
    std::unique_ptr<SolverRun> run;
    std::string head;

    Resumed(const std::string& text, Result<std::unique_ptr<SolverRun>> (*make)(const Scene&,
                                                                                const RunOptions&)) {
        const auto scene = parse_scene(text, "scene", KERATIN_DATA_DIR "/revision");
        if (!scene) std::fprintf(stderr, "%s\n", to_string(scene.error()).c_str());
        demand(bool(scene), "the scene is read");
        RunOptions options;
        options.threads = 1;
        auto made = make(*scene, options);
        if (!made) std::fprintf(stderr, "%s\n", to_string(made.error()).c_str());
        demand(bool(made), "the run is made");
        run = *std::move(made);
        const std::string path = (std::filesystem::temp_directory_path() /
             ("keratin_fuzz_" + std::to_string(getpid())))
                .string();
        demand(bool(save_run(path, {1, 1, kStep, *run->save()}, run->layout())),
               "the run is saved");
        const auto saved = read_file(path);
        unlink(path.c_str());
        demand(bool(saved), "it is read back");
        head.assign(reinterpret_cast<const char*>(saved->data()), kHeadBytes);
    }

    void resume(std::string bytes) const {
        if (bytes.size() > kHeadBytes) {
            std::memcpy(bytes.data(), head.data(), kHeadBytes);
            const Hash128 hash = hash_bytes(std::as_bytes(std::span(bytes)).subspan(kHeadBytes));
            std::memcpy(bytes.data() + 8, &hash, sizeof hash);
        }
        const MemoryFile file;
        file.fill(bytes);
        const auto saved = load_run(file.path(), run->layout());
        if (!saved) return demand(!saved.error().message.empty(), "an error says something");
        if (auto ok = run->load(saved->state, kStep); !ok)
            return demand(!ok.error().message.empty(), "an error says something");
        if (auto ok = run->step(kStep, 2 * kStep); !ok)
            return demand(!ok.error().message.empty(), "an error says something");
        RunState state;
        run->look(state);
        demand(state.position.size() == run->layout().rest.size(), "every point is there");
    }

    // runtime/run/state_file.cpp: magic, hash of the rest, hash of the scene.
    static constexpr std::size_t kHeadBytes = 40;
};

}  // namespace

void run_saved_run(std::string_view bytes) {
    static const Resumed strand(kStrandScene, make_strand_run), rod(kRodScene, make_rod_run);
    strand.resume(std::string(bytes));
    rod.resume(std::string(bytes));
}

}  // namespace keratin::fuzz
