// The reader of cached runs on arbitrary bytes, with every hash put right, as if an attacker had.
#include "schema/cache.h"
#include "schema/file_hash.h"
#include "tests/fuzz/demand.h"
#include "tests/fuzz/readers.h"

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

namespace keratin::fuzz {

namespace {

constexpr std::size_t kBlock = 32;

std::uint64_t number_at(const std::string& bytes, std::size_t at) {
    std::uint64_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

// The size at the end and the hash of each block, schema/cache.h.
void correct(std::string& bytes) {
    if (bytes.size() < 2 * kBlock) return;
    const std::size_t last = bytes.size() - kBlock;
    const std::uint64_t index = number_at(bytes, last), count = number_at(bytes, last + 8);
    const std::uint64_t size = bytes.size();
    std::memcpy(bytes.data() + last + 16, &size, sizeof size);
    if (index > last || count > (last - index) / 8) return;
    std::vector<std::uint64_t> places(count);
    if (count > 0) std::memcpy(places.data(), bytes.data() + index, 8 * count);
    for (const std::uint64_t place : places) {
        if (place > last || last - place < kBlock) continue;
        const std::uint64_t length = number_at(bytes, place);
        if (length > last - place - kBlock) continue;
        const Hash128 hash = hash_bytes(
            std::as_bytes(std::span(bytes.data() + place + kBlock, std::size_t(length))));
        std::memcpy(bytes.data() + place + 16, &hash.low, 8);
        std::memcpy(bytes.data() + place + 24, &hash.high, 8);
    }
}

}  // namespace

void run_cache(std::string_view input) {
    std::string bytes(input);
    correct(bytes);
    const int file = memfd_create("cache", 0);
    demand(file >= 0, "memory can be had as a file");
    demand(write(file, bytes.data(), bytes.size()) == ssize_t(bytes.size()), "it can be filled");
    {
        const auto reader = CacheReader::open("/proc/self/fd/" + std::to_string(file));
        if (reader) {
            const CacheHead& head = reader->head();
            demand(head.guide_first_point.size() == head.guide_lane.size() + 1,
                   "guides have points");
            // A few: many may be the same block.
            for (std::size_t i = 0; i < std::min<std::size_t>(reader->frame_count(), 8); ++i) {
                const auto frame = reader->frame(i);
                if (!frame) continue;
                demand(frame->guide_position.size() == 3 * head.guide_first_point.back(),
                       "a frame has every guide point");
                demand(frame->strand_position.size() == 3 * head.strand_first_point.back(),
                       "a frame has every render point");
                demand(frame->bodies.size() == head.assets.size(), "a frame has every body");
            }
        }
    }
    close(file);
}

}  // namespace keratin::fuzz
