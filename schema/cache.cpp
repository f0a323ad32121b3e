#include "schema/cache.h"

#include "cache_generated.h"
#include "schema/file_hash.h"
#include "schema/files/write_file.h"
#include "schema/mapped_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

namespace keratin {

static_assert(std::endian::native == std::endian::little,
              "numbers are written in little-endian byte order");

namespace {

namespace fb = cache_fb;

constexpr char kMagic[8] = {'K', 'C', 'A', 'C', 'H', 'E', 0, 0};
constexpr char kHeadIdentifier[] = "KCHD";
constexpr std::size_t kBlock = 32;
// A FlatBuffer has 32-bit signed offsets.
constexpr std::size_t kLargestBuffer = 0x7fffffff;
constexpr std::uint32_t kVerifierDepth = 8, kVerifierTables = 1u << 20;

struct FirstBytes {
    char magic[8];
    std::uint32_t major, minor;
    std::uint64_t zero[2];
};
struct BlockHead {
    std::uint64_t size, zero, hash_low, hash_high;
};
struct LastBytes {
    std::uint64_t index_place, block_count, file_size;
    char magic[8];
};
static_assert(sizeof(FirstBytes) == kBlock && sizeof(BlockHead) == kBlock &&
              sizeof(LastBytes) == kBlock);

std::size_t padded(std::size_t size) { return (size + kBlock - 1) / kBlock * kBlock; }

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

fb::Float3 to_fb(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }
fb::Transform to_fb(const CacheTransform& t) {
    return {t.translation[0], t.translation[1], t.translation[2], t.rotation[0],
            t.rotation[1],    t.rotation[2],    t.rotation[3]};
}
std::array<float, 3> from_fb(const fb::Float3& v) { return {v.x(), v.y(), v.z()}; }
CacheTransform from_fb(const fb::Transform& t) {
    return {{t.tx(), t.ty(), t.tz()}, {t.qx(), t.qy(), t.qz(), t.qw()}};
}

template <class T>
std::vector<T> to_vector(const flatbuffers::Vector<T>* in) {
    if (!in) return {};
    return {in->begin(), in->end()};
}

void build_head(flatbuffers::FlatBufferBuilder& builder, const CacheHead& head) {
    std::vector<flatbuffers::Offset<fb::Asset>> assets;
    for (const CacheAsset& asset : head.assets) {
        const fb::Hash128 hash(asset.hash.low, asset.hash.high);
        assets.push_back(fb::CreateAssetDirect(builder, asset.file.c_str(), &hash,
                                               asset.first_guide, asset.guide_count,
                                               asset.first_strand, asset.strand_count));
    }
    builder.Finish(
        fb::CreateHeadDirect(builder, head.tool_version.c_str(), head.solver.c_str(),
                             head.scene.c_str(), head.frame, &assets, &head.guide_first_point,
                             &head.guide_lane, &head.strand_first_point, &head.strand_radius),
        kHeadIdentifier);
}

flatbuffers::Offset<fb::Body> build_body(flatbuffers::FlatBufferBuilder& builder,
                                         const CacheBody& body) {
    std::vector<fb::Transform> bones;
    for (const CacheTransform& bone : body.bones) bones.push_back(to_fb(bone));
    const fb::Transform motion = to_fb(body.motion);
    return fb::CreateBodyDirect(builder, &motion, &bones, &body.mesh_position);
}

void build_frame(flatbuffers::FlatBufferBuilder& builder, const CacheFrame& frame) {
    std::vector<flatbuffers::Offset<fb::Body>> bodies;
    for (const CacheBody& body : frame.bodies) bodies.push_back(build_body(builder, body));
    std::vector<flatbuffers::Offset<fb::Collider>> colliders;
    for (const CacheCollider& collider : frame.colliders) {
        const fb::Float3 a = to_fb(collider.a), b = to_fb(collider.b);
        const auto& q = collider.rotation;
        const fb::Float4 rotation(q[0], q[1], q[2], q[3]);
        colliders.push_back(fb::CreateCollider(builder, static_cast<fb::Shape>(collider.shape), &a,
                                               &b, collider.radius, &rotation));
    }
    const auto optional = [](const std::vector<float>& v) { return v.empty() ? nullptr : &v; };
    builder.Finish(fb::CreateFrameDirect(builder, frame.number, frame.time, &frame.guide_position,
                                         &frame.strand_position, optional(frame.strand_velocity),
                                         optional(frame.strand_density), &bodies, &colliders),
                   fb::FrameIdentifier());
}

std::size_t point_count(const std::vector<std::uint32_t>& first_point) {
    return first_point.empty() ? 0 : first_point.back();
}

// Whether a frame has the sizes that its head announces.
bool fits(const CacheHead& head, const CacheFrame& frame) {
    const std::size_t guide_points = point_count(head.guide_first_point);
    const std::size_t points = point_count(head.strand_first_point);
    return frame.guide_position.size() == 3 * guide_points &&
           frame.strand_position.size() == 3 * points &&
           (frame.strand_velocity.empty() || frame.strand_velocity.size() == 3 * points) &&
           (frame.strand_density.empty() || frame.strand_density.size() == points) &&
           frame.bodies.size() == head.assets.size();
}

bool rises_from_zero(const std::vector<std::uint32_t>& offsets) {
    return !offsets.empty() && offsets.front() == 0 &&
           std::is_sorted(offsets.begin(), offsets.end());
}

// Whether the head's own numbers agree with each other.
bool is_consistent(const CacheHead& head) {
    const std::uint64_t guides = head.guide_lane.size(), strands = head.strand_radius.size();
    bool ok = rises_from_zero(head.guide_first_point) && rises_from_zero(head.strand_first_point) &&
              head.guide_first_point.size() == guides + 1 &&
              head.strand_first_point.size() == strands + 1;
    for (const CacheAsset& asset : head.assets)
        ok = ok && std::uint64_t{asset.first_guide} + asset.guide_count <= guides &&
             std::uint64_t{asset.first_strand} + asset.strand_count <= strands;
    return ok;
}

CacheHead to_head(const fb::Head& in) {
    CacheHead head{in.tool_version()->str(),
                   in.solver()->str(),
                   in.scene()->str(),
                   in.frame(),
                   {},
                   to_vector(in.guide_first_point()),
                   to_vector(in.guide_lane()),
                   to_vector(in.strand_first_point()),
                   to_vector(in.strand_radius())};
    for (const fb::Asset* asset : *in.assets())
        head.assets.push_back({asset->file()->str(),
                               {asset->hash()->low(), asset->hash()->high()},
                               asset->first_guide(),
                               asset->guide_count(),
                               asset->first_strand(),
                               asset->strand_count()});
    return head;
}

CacheFrame to_frame(const fb::Frame& in) {
    CacheFrame frame{in.number(),
                     in.time(),
                     to_vector(in.guide_position()),
                     to_vector(in.strand_position()),
                     to_vector(in.strand_velocity()),
                     to_vector(in.strand_density()),
                     {},
                     {}};
    for (const fb::Body* body : *in.bodies()) {
        CacheBody out;
        out.motion = from_fb(*body->motion());
        if (body->bones())
            for (const fb::Transform* bone : *body->bones()) out.bones.push_back(from_fb(*bone));
        out.mesh_position = to_vector(body->mesh_position());
        frame.bodies.push_back(std::move(out));
    }
    for (const fb::Collider* collider : *in.colliders()) {
        const fb::Float4& q = *collider->rotation();
        frame.colliders.push_back({static_cast<CacheShape>(collider->shape()),
                                   from_fb(*collider->a()),
                                   from_fb(*collider->b()),
                                   collider->radius(),
                                   {q.x(), q.y(), q.z(), q.w()}});
    }
    return frame;
}

}  // namespace

struct CacheWriter::State {
    PendingFile file;
    CacheHead head;
    std::uint64_t written = 0;
    std::vector<std::uint64_t> places;
    flatbuffers::FlatBufferBuilder builder{1 << 16};

    Result<void> put(std::span<const std::byte> bytes) {
        if (auto ok = file.write(bytes); !ok) return ok;
        const std::byte zeros[kBlock] = {};
        const std::size_t rest = padded(bytes.size()) - bytes.size();
        written += padded(bytes.size());
        return rest ? file.write(std::span(zeros, rest)) : Result<void>();
    }

    Result<void> put_block() {
        const std::span buffer(reinterpret_cast<const std::byte*>(builder.GetBufferPointer()),
                               builder.GetSize());
        const Hash128 hash = hash_bytes(buffer);
        places.push_back(written);
        if (auto ok = put(bytes_of(BlockHead{buffer.size(), 0, hash.low, hash.high})); !ok)
            return ok;
        return put(buffer);
    }
};

CacheWriter::CacheWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
CacheWriter::CacheWriter(CacheWriter&&) noexcept = default;
CacheWriter& CacheWriter::operator=(CacheWriter&&) noexcept = default;
CacheWriter::~CacheWriter() = default;

Result<CacheWriter> CacheWriter::create(const std::string& path, const CacheHead& head) {
    if (!is_consistent(head))
        return Error{ErrorCode::internal, path, "the cache's head contradicts itself"};
    auto file = PendingFile::create(path);
    if (!file) return file.error();
    CacheWriter writer(std::make_unique<State>(State{std::move(*file), head, 0, {}}));
    FirstBytes first{};
    std::memcpy(first.magic, kMagic, sizeof kMagic);
    first.major = kCacheMajor;
    first.minor = kCacheMinor;
    if (auto ok = writer.state_->put(bytes_of(first)); !ok) return ok.error();
    build_head(writer.state_->builder, head);
    if (auto ok = writer.state_->put_block(); !ok) return ok.error();
    return writer;
}

Result<void> CacheWriter::write(const CacheFrame& frame) {
    const std::size_t numbers = frame.guide_position.size() + frame.strand_position.size() +
                                frame.strand_velocity.size() + frame.strand_density.size();
    if (!fits(state_->head, frame) || numbers > kLargestBuffer / 8)
        return Error{ErrorCode::internal, "", "a frame does not fit the head of its cache"};
    state_->builder.Clear();
    build_frame(state_->builder, frame);
    return state_->put_block();
}

Result<void> CacheWriter::finish() {
    LastBytes last{state_->written, state_->places.size(), 0, {}};
    if (auto ok = state_->put(std::as_bytes(std::span(state_->places))); !ok) return ok;
    last.file_size = state_->written + sizeof last;
    std::memcpy(last.magic, kMagic, sizeof kMagic);
    if (auto ok = state_->put(bytes_of(last)); !ok) return ok;
    return state_->file.commit();
}

struct CacheReader::State {
    std::string name;
    MappedFile file;
    CacheHead head;
    std::vector<std::uint64_t> places;  // of all blocks

    Error damaged(const std::string& what) const {
        return {ErrorCode::input, name, "the cache is damaged: " + what};
    }

    Result<void> read();
    Result<std::span<const std::byte>> block(std::size_t i) const;
};

Result<std::span<const std::byte>> CacheReader::State::block(std::size_t i) const {
    const auto bytes = file.bytes();
    const std::uint64_t place = places[i];
    BlockHead block_head{};
    if (place % kBlock != 0 || place > bytes.size() - 2 * kBlock)
        return damaged("block " + std::to_string(i) + " is not where the index says");
    std::memcpy(&block_head, bytes.data() + place, sizeof block_head);
    if (block_head.size > bytes.size() - place - kBlock || block_head.size > kLargestBuffer)
        return damaged("block " + std::to_string(i) + " goes beyond the end of the file");
    const auto buffer = bytes.subspan(place + kBlock, block_head.size);
    if (hash_bytes(buffer) != Hash128{block_head.hash_low, block_head.hash_high})
        return damaged("the content of block " + std::to_string(i) + " does not match its hash");
    return buffer;
}

template <class Table>
bool verifies(std::span<const std::byte> buffer, const char* identifier) {
    flatbuffers::Verifier verifier(reinterpret_cast<const std::uint8_t*>(buffer.data()),
                                   buffer.size(), kVerifierDepth, kVerifierTables);
    return verifier.VerifyBuffer<Table>(identifier);
}

Result<void> CacheReader::State::read() {
    const auto bytes = file.bytes();
    FirstBytes first{};
    if (bytes.size() >= sizeof first) std::memcpy(&first, bytes.data(), sizeof first);
    if (std::memcmp(first.magic, kMagic, sizeof kMagic) != 0)
        return Error{
            ErrorCode::input, name,
            "not a cached run: it should start with \"KCACHE\"; write one with keratin-run "
            "--cache"};
    if (first.major != kCacheMajor)
        return Error{ErrorCode::input, name,
                     "the cache has revision " + std::to_string(first.major) +
                         ", this program reads revision " + std::to_string(kCacheMajor) +
                         "; run it again: keratin-run ... --cache " + name};
    LastBytes last{};
    if (bytes.size() >= 2 * kBlock)
        std::memcpy(&last, bytes.data() + bytes.size() - sizeof last, sizeof last);
    if (std::memcmp(last.magic, kMagic, sizeof kMagic) != 0 || last.file_size != bytes.size())
        return damaged("it does not end as a cache ends");
    const std::uint64_t room = bytes.size() - sizeof last;
    if (last.block_count == 0 || last.index_place > room ||
        last.block_count > (room - last.index_place) / sizeof(std::uint64_t))
        return damaged("its index is not where it says");
    places.resize(last.block_count);
    std::memcpy(places.data(), bytes.data() + last.index_place,
                places.size() * sizeof(std::uint64_t));
    auto buffer = block(0);
    if (!buffer) return buffer.error();
    if (!verifies<fb::Head>(*buffer, kHeadIdentifier)) return damaged("its head does not verify");
    head = to_head(*flatbuffers::GetRoot<fb::Head>(buffer->data()));
    if (!is_consistent(head)) return damaged("its head contradicts itself");
    return {};
}

CacheReader::CacheReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
CacheReader::CacheReader(CacheReader&&) noexcept = default;
CacheReader& CacheReader::operator=(CacheReader&&) noexcept = default;
CacheReader::~CacheReader() = default;

Result<CacheReader> CacheReader::open(const std::string& path) {
    auto file = MappedFile::open(path);
    if (!file) return file.error();
    auto state = std::make_unique<State>(State{path, std::move(*file), {}, {}});
    if (auto ok = state->read(); !ok) return ok.error();
    return CacheReader(std::move(state));
}

const CacheHead& CacheReader::head() const { return state_->head; }
std::size_t CacheReader::frame_count() const { return state_->places.size() - 1; }

Result<CacheFrame> CacheReader::frame(std::size_t i) const {
    auto buffer = state_->block(i + 1);
    if (!buffer) return buffer.error();
    if (!verifies<fb::Frame>(*buffer, fb::FrameIdentifier()))
        return state_->damaged("frame " + std::to_string(i) + " does not verify");
    const auto& in = *flatbuffers::GetRoot<fb::Frame>(buffer->data());
    if (std::any_of(in.colliders()->begin(), in.colliders()->end(),
                    [](const fb::Collider* c) { return c->shape() > fb::Shape::MAX; }))
        return state_->damaged("frame " + std::to_string(i) + " has an unknown collider shape");
    CacheFrame frame = to_frame(in);
    if (!fits(state_->head, frame))
        return state_->damaged("frame " + std::to_string(i) + " does not fit the head");
    return frame;
}

}  // namespace keratin
