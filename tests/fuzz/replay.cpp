// Runs the readers over their corpora and over damaged copies of them, always the same ones: a
// short look with any compiler at what the fuzzers search at length.
//   replay READER FOLDER...
#include "tests/fuzz/readers.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace keratin::fuzz;

struct Reader {
    const char* name;
    void (*run)(std::string_view);
};

// clang-format off
constexpr Reader kReaders[] = {
    {"alembic", run_alembic},
    {"cache", run_cache},
    {"gltf", run_gltf},
    {"hair", run_hair},
    {"obj_curves", run_obj_curves},
    {"obj_mesh", run_obj_mesh},
    {"open_asset", run_open_asset},
    {"poses", run_poses},
    {"recipe", run_recipe},
#ifdef KERATIN_FUZZ_SAVED_RUNS
    {"rod_asset", run_rod_asset},
    {"saved_run", run_saved_run},
#endif
    {"scene", run_scene},
    {"step_asset", run_step_asset},
    {"tfx", run_tfx},
    {"tfxbone", run_tfxbone},
    {"tfxskin", run_tfxskin},
    {"usc_data", run_usc_data},
};
// clang-format on

constexpr int kDamagedCopies = 3000;
constexpr std::size_t kMaxSize = 40000;

std::string damaged(const std::string& seed, std::mt19937& random) {
    std::string bytes = seed;
    const auto below = [&](std::size_t count) {
        return random() % std::max<std::size_t>(count, 1);
    };
    for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
        const std::size_t at = below(bytes.size());
        switch (below(5)) {
            case 0:
                if (!bytes.empty()) bytes[at] = static_cast<char>(bytes[at] ^ 1 << below(8));
                break;
            case 1:
                bytes.resize(at);
                break;
            case 2:
                bytes.insert(at, bytes.substr(below(bytes.size()), below(64)));
                break;
            case 3:
                bytes.erase(at, below(16));
                break;
            default: {
                // Numbers at which sizes and indices overflow.
                constexpr unsigned char kNumbers[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
                const auto number = static_cast<char>(kNumbers[below(std::size(kNumbers))]);
                for (std::size_t i = at; i < std::min(at + 4, bytes.size()); ++i) bytes[i] = number;
            }
        }
    }
    return bytes;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) {
        std::fprintf(stderr, "usage: replay READER FOLDER...\n");
        return 2;
    }
    const std::string name = argv[1];
    const auto reader = std::find_if(std::begin(kReaders), std::end(kReaders),
                                     [&](const Reader& entry) { return entry.name == name; });
    if (reader == std::end(kReaders)) {
        std::fprintf(stderr, "replay: there is no reader %s\n", argv[1]);
        return 2;
    }
    std::vector<std::filesystem::path> files;
    for (int i = 2; i < argc; ++i)
        for (const auto& entry : std::filesystem::directory_iterator(argv[i]))
            if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::size_t runs = 0;
    std::mt19937 random(1);
    for (const auto& file : files) {
        std::ifstream stream(file, std::ios::binary);
        const std::string seed{std::istreambuf_iterator<char>(stream), {}};
        reader->run(seed);
        ++runs;
        if (seed.size() > kMaxSize) continue;
        for (int i = 0; i < kDamagedCopies; ++i, ++runs) reader->run(damaged(seed, random));
    }
    std::printf("%s: %zu runs from %zu files\n", argv[1], runs, files.size());
    return files.empty() ? 1 : 0;
}
