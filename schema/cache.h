// A cached run (*.kcache): what keratin-run saw at the end of each frame, so that pictures and
// comparisons need no second simulation. Positions are in m, world, float; one FlatBuffer a frame
// (schema/cache.fbs), so a frame is read without the others.
//
//   first 32 bytes  "KCACHE\0\0", u32 major, u32 minor, zeros
//   blocks          u64 size, u64 zero, XXH3-128 of the FlatBuffer, the FlatBuffer, zeros up to a
//                   multiple of 32; the first is the head, each further one a frame
//   index           u64 place of each block, zeros up to a multiple of 32
//   last 32 bytes   u64 place of the index, u64 number of blocks, u64 size of the file,
//   "KCACHE\0\0"
#pragma once

#include "schema/asset.h"
#include "schema/result.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace keratin {

// The revision of the cache that this code writes, apart from the asset's. A reader refuses another
// major revision; a minor revision only adds fields.
inline constexpr std::uint32_t kCacheMajor = 1;
inline constexpr std::uint32_t kCacheMinor = 0;

// Maps x to R x + T; rotation is a unit quaternion (x, y, z, w).
struct CacheTransform {
    std::array<double, 3> translation{0, 0, 0};
    std::array<double, 4> rotation{0, 0, 0, 1};
};

// An asset of the scene and its share of the strands. Render strand s of the share is render strand
// s of the asset; guide g of the share is the asset's guide in its lane guide_lane[first_guide +
// g].
struct CacheAsset {
    std::string file;  // as the run opened it
    Hash128 hash;      // AssetInfo::file_hash
    std::uint32_t first_guide = 0, guide_count = 0;
    std::uint32_t first_strand = 0, strand_count = 0;
};

// What does not change during a run. Explicit strands of a scene come after those of the assets, as
// guides and as render strands alike.
struct CacheHead {
    std::string tool_version;
    std::string solver;  // "strand", "rod", ...
    std::string scene;   // file of the scene or asset as given
    double frame = 0;    // s between frames
    std::vector<CacheAsset> assets;
    std::vector<std::uint32_t> guide_first_point;   // [guides + 1], offsets into guide points
    std::vector<std::uint32_t> guide_lane;          // [guides], of the asset; kNoStrand if explicit
    std::vector<std::uint32_t> strand_first_point;  // [strands + 1], offsets into render points
    std::vector<float> strand_radius;               // [strands], m, at the root
};

enum class CacheShape : std::uint8_t { plane, sphere, capsule, box };

// A collider where it stood at the frame's end, in the world.
struct CacheCollider {
    CacheShape shape = CacheShape::sphere;
    std::array<float, 3> a{};  // plane: point; sphere, box: centre; capsule: one end
    std::array<float, 3> b{};  // plane: normal; capsule: other end; box: half size
    float radius = 0;          // sphere, capsule
    std::array<float, 4> rotation{0, 0, 0, 1};  // of a box's axes
};

// Where the body of an asset was.
struct CacheBody {
    CacheTransform motion;              // of the asset as a whole
    std::vector<CacheTransform> bones;  // one a bone of the asset, after `motion`; or empty
    std::vector<float> mesh_position;   // [stored vertices * 3] when the mesh deforms; or empty
};

struct CacheFrame {
    std::uint32_t number = 0;            // 0: the initial state
    double time = 0;                     // s
    std::vector<float> guide_position;   // [guide points * 3]
    std::vector<float> strand_position;  // [render points * 3]
    std::vector<float> strand_velocity;  // [render points * 3], m/s; or empty
    std::vector<float> strand_density;   // [render points], share of the rest density; or empty
    std::vector<CacheBody> bodies;       // one an asset
    std::vector<CacheCollider> colliders;
};

// Fills a cache piece by piece; the file takes its place when finish() succeeds, and a run that
// fails leaves nothing behind.
class CacheWriter {
  public:
    static Result<CacheWriter> create(const std::string& path, const CacheHead& head);
    CacheWriter(CacheWriter&&) noexcept;
    CacheWriter& operator=(CacheWriter&&) noexcept;
    ~CacheWriter();

    // Errors: io; internal when the sizes do not fit the head or a frame takes over 2 GiB.
    Result<void> write(const CacheFrame& frame);
    Result<void> finish();

  private:
    struct State;
    explicit CacheWriter(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

class CacheReader {
  public:
    // Maps the file. Errors: io; input when it is no cache, of another major revision, or damaged.
    static Result<CacheReader> open(const std::string& path);
    CacheReader(CacheReader&&) noexcept;
    CacheReader& operator=(CacheReader&&) noexcept;
    ~CacheReader();

    const CacheHead& head() const;
    std::size_t frame_count() const;
    // A copy of frame i < frame_count(). Error input when it is damaged or does not fit the head.
    Result<CacheFrame> frame(std::size_t i) const;

  private:
    struct State;
    explicit CacheReader(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace keratin
