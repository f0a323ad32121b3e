#include "runtime/run/state_file.h"

#include "schema/file_hash.h"
#include "schema/files/write_file.h"

#include <cstring>

namespace keratin {

namespace {

constexpr char kMagic[8] = {'K', 'S', 'T', 'A', 'T', 'E', 0, 1};

struct Head {
    char magic[8];
    std::uint64_t hash_low, hash_high;    // of everything after this head
    std::uint64_t scene_low, scene_high;  // of what the run consists of
};

struct Numbers {
    std::uint64_t steps, steps_per_frame;
    double frame;
};

// Solver, strands and assets: a state of other ones cannot go on.
Hash128 identity(const RunLayout& layout) {
    std::vector<std::byte> bytes;
    const auto add = [&](std::span<const std::byte> more) {
        bytes.insert(bytes.end(), more.begin(), more.end());
    };
    add(std::as_bytes(std::span(layout.head.solver)));
    add(std::as_bytes(std::span(layout.head.guide_first_point)));
    add(std::as_bytes(std::span(layout.rest)));
    for (const CacheAsset& asset : layout.head.assets)
        add(std::as_bytes(std::span(&asset.hash, 1)));
    return hash_bytes(bytes);
}

}  // namespace

Result<void> save_run(const std::string& path, const SavedRun& saved, const RunLayout& layout) {
    std::vector<std::byte> bytes(sizeof(Head) + sizeof(Numbers) + saved.state.size());
    const Numbers numbers{saved.steps, saved.steps_per_frame, saved.frame};
    std::memcpy(bytes.data() + sizeof(Head), &numbers, sizeof numbers);
    if (!saved.state.empty())
        std::memcpy(bytes.data() + sizeof(Head) + sizeof numbers, saved.state.data(),
                    saved.state.size());
    const Hash128 hash = hash_bytes(std::span(bytes).subspan(sizeof(Head)));
    const Hash128 scene = identity(layout);
    Head head{{}, hash.low, hash.high, scene.low, scene.high};
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    std::memcpy(bytes.data(), &head, sizeof head);
    return write_file(path, bytes);
}

Result<SavedRun> load_run(const std::string& path, const RunLayout& layout) {
    auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    Head head{};
    Numbers numbers{};
    if (bytes->size() >= sizeof head) std::memcpy(&head, bytes->data(), sizeof head);
    if (std::memcmp(head.magic, kMagic, sizeof kMagic) != 0)
        return Error{ErrorCode::input, path, "not a saved run; write one with keratin-run --save"};
    const auto content = std::span(*bytes).subspan(sizeof head);
    if (content.size() < sizeof numbers ||
        hash_bytes(content) != Hash128{head.hash_low, head.hash_high})
        return Error{ErrorCode::input, path,
                     "the saved run is damaged: it does not match its hash"};
    if (identity(layout) != Hash128{head.scene_low, head.scene_high})
        return Error{ErrorCode::input, path,
                     "the saved run is of another scene: its solver, strands or assets differ"};
    std::memcpy(&numbers, content.data(), sizeof numbers);
    const auto state = content.subspan(sizeof numbers);
    return SavedRun{
        numbers.steps, numbers.steps_per_frame, numbers.frame, {state.begin(), state.end()}};
}

}  // namespace keratin
