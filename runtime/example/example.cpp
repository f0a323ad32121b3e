// A complete program on the C++ interface: opens an asset from memory, lends the simulation its own
// memory, shakes it for a second and says where the tips went. Usage: example head.kera
#include "runtime/simulation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <new>

namespace {

// What an engine would do with its own heap: here it counts.
struct Heap {
    std::size_t now = 0, most = 0;
};

void* take(void* user, std::size_t bytes, std::size_t alignment) {
    Heap& heap = *static_cast<Heap*>(user);
    heap.now += bytes;
    heap.most = std::max(heap.most, heap.now);
    return ::operator new (bytes, std::align_val_t{alignment}, std::nothrow);
}
void give_back(void* user, void* memory, std::size_t bytes, std::size_t alignment) {
    static_cast<Heap*>(user)->now -= bytes;
    ::operator delete (memory, std::align_val_t{alignment});
}
void say(void*, keratin::LogLevel level, const char* message) {
    std::fprintf(stderr, "%s: %s\n", level == keratin::LogLevel::warning ? "warning" : "note", message);
}

// A file's bytes where an asset may lie: at a multiple of 32.
struct Bytes {
    std::byte* data = nullptr;
    std::size_t size = 0;
    explicit Bytes(const char* path) {
        std::ifstream file(path, std::ios::binary | std::ios::ate);
        if (!file) return;
        size = static_cast<std::size_t>(file.tellg());
        data = static_cast<std::byte*>(::operator new (size, std::align_val_t{32}));
        file.seekg(0);
        file.read(reinterpret_cast<char*>(data), static_cast<std::streamsize>(size));
    }
    ~Bytes() { ::operator delete (data, std::align_val_t{32}); }
    Bytes(const Bytes&) = delete;
    Bytes& operator=(const Bytes&) = delete;
};

int failed(const keratin::Error& error) {
    std::fprintf(stderr, "example: %s\n", to_string(error).c_str());
    return 2;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: example ASSET.kera\n");
        return 2;
    }
    const Bytes bytes(argv[1]);
    const auto asset = keratin::AssetView::from_memory({bytes.data, bytes.size}, argv[1]);
    if (!asset) return failed(asset.error());

    Heap heap;
    keratin::Settings settings;
    settings.host = {&heap, take, give_back, say, nullptr};
    settings.previous = true;  // for motion vectors
    {
        auto hair = keratin::Simulation::create(*asset, settings);
        if (!hair) return failed(hair.error());
        for (int frame = 1; frame <= 60; ++frame) {
            keratin::RigidTransform head;
            head.translation[0] = 0.1 * std::sin(6.283185307 * frame / 60);
            if (auto ok = hair->set_motion(head); !ok) return failed(ok.error());
            if (auto ok = hair->step(1.0 / 60); !ok) return failed(ok.error());
        }
        const keratin::StrandView strands = hair->strands();
        float lowest = 1e30f, fastest = 0;
        for (std::uint32_t s = 0; s < strands.strand_count; ++s) {
            const std::size_t tip = std::size_t{strands.first_point[s + 1] - 1} * 3;
            const auto moved = [&](std::size_t c) { return strands.position[tip + c] - strands.previous[tip + c]; };
            lowest = std::min(lowest, strands.position[tip + 1]);
            fastest = std::max(fastest, 60 * std::hypot(moved(0), moved(1), moved(2)));
        }
        std::printf("%u strands, lowest tip at y = %.3f m, fastest tip %.3f m/s, %zu bytes lent\n",
                    strands.strand_count, static_cast<double>(lowest), static_cast<double>(fastest), heap.most);
    }
    return heap.now == 0 ? 0 : 3;  // everything came back
}
