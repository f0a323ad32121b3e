// Writes one file of each format at its present revision into a folder: see tools/record-revision.
#include "bake/write.h"
#include "schema/files/write_file.h"
#include "tests/revision/recorded.h"
#include "tests/tools/diff/full_asset.h"

#include <cstdio>

using namespace keratin;

namespace {

Result<void> record_asset(const std::string& path) {
    const test::FullAsset asset = test::full_asset();
    const auto bytes = serialise_asset(asset.info, asset.fields(), path);
    if (!bytes) return bytes.error();
    return write_file(path, *bytes);
}

Result<void> record_cache(const std::string& path) {
    auto cache = CacheWriter::create(path, test::recorded_head());
    if (!cache) return cache.error();
    for (std::uint32_t i = 0; i < test::kRecordedFrames; ++i)
        if (auto ok = cache->write(test::recorded_frame(i)); !ok) return ok;
    return cache->finish();
}

std::string revision(unsigned major, unsigned minor) {
    return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "record_revision FOLDER\n");
        return 2;
    }
    const std::string folder = argv[1];
    const auto asset =
        record_asset(folder + "/asset-" + revision(kAssetMajor, kAssetMinor) + ".kera");
    const auto cache =
        record_cache(folder + "/cache-" + revision(kCacheMajor, kCacheMinor) + ".kcache");
    for (const auto& result : {asset, cache})
        if (!result) {
            std::fprintf(stderr, "%s\n", to_string(result.error()).c_str());
            return exit_code(result.error());
        }
    return 0;
}
