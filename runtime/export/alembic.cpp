// Alembic, Ogawa container: one ICurves object /strands with linear, non-periodic curves and the
// groom attributes that Unreal reads.
//
// The file is a tree of groups and data blocks, each at a 64-bit offset (top bit set: data):
//   "Ogawa" 0xff u16 version u64 root    root = [version, library version, top object, metadata,
//                                               time samplings, indexed metadata]
//   group   u64 count, count offsets     data   u64 size, bytes
//   object  [properties, child objects ..., child headers]
//   compound property [properties ..., property headers]
//   array property    [sample, dimensions] a sample; 0 dimensions: given by the sample's size
//   scalar property   [sample] a sample
// A sample is a 16-byte key of its content followed by the content. Children are written before
// their groups, so a frame goes straight to the file and only offsets are kept.

#include "runtime/export/strand_export.h"
#include "schema/file_hash.h"
#include "schema/files/write_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace keratin {

namespace {

constexpr std::uint64_t kDataBit = 1ull << 63;
constexpr std::uint32_t kFileVersion = 0, kLibraryVersion = 10801;

// Property header: kind in bits 0-1, size of counts in 2-3, element type in 4-7, then flags, extent
// in 12-19, index of the metadata in 20-27.
enum Kind : std::uint32_t { kCompound = 0, kScalar = 1, kArray = 2 };
enum Pod : std::uint32_t { kUint8 = 1, kInt16 = 4, kInt32 = 6, kFloat32 = 10, kFloat64 = 11 };
constexpr std::uint32_t kWideCounts = 2u << 2;  // counts and sizes as u32
constexpr std::uint32_t kHasTimeSampling = 0x100, kHomogenous = 0x400, kConstant = 0x800;

// Indexed metadata, counted from 1; 0 is none.
enum Metadata : std::uint32_t {
    kNone,
    kBox,
    kPoint,
    kWidth,
    kUv,
    kPerCurveInt,
    kPerCurveByte,
    kCurves,
    kCurvesObject
};
constexpr std::array<const char*, 8> kMetadata = {
    "interpretation=box",
    "geoScope=vtx;interpretation=point",
    "arrayExtent=1;geoScope=uni;isGeomParam=true;podExtent=1;podName=float32_t",
    "arrayExtent=1;geoScope=uni;interpretation=vector;isGeomParam=true;podExtent=2;podName=float32_"
    "t",
    "arrayExtent=1;geoScope=uni;isGeomParam=true;podExtent=1;podName=int32_t",
    "arrayExtent=1;geoScope=uni;isGeomParam=true;podExtent=1;podName=uint8_t",
    "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1",
    "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1;schemaObjTitle=AbcGeom_Curve_v2:."
    "geom",
};

class Bytes {
  public:
    template <class T>
    Bytes& add(const T& value) {
        const auto* begin = reinterpret_cast<const std::byte*>(&value);
        bytes_.insert(bytes_.end(), begin, begin + sizeof value);
        return *this;
    }
    Bytes& text(std::string_view value) {
        const auto span = std::as_bytes(std::span(value.data(), value.size()));
        bytes_.insert(bytes_.end(), span.begin(), span.end());
        return *this;
    }
    std::span<const std::byte> span() const { return bytes_; }

  private:
    std::vector<std::byte> bytes_;
};

struct Property {
    std::string name;
    Kind kind;
    std::uint32_t pod, extent, flags, metadata;
    std::uint32_t time_sampling = 0;
    std::vector<std::uint64_t> samples;  // offsets of data blocks
    std::uint64_t group = 0;             // of a compound
};

class AlembicExporter final : public StrandExporter {
  public:
    AlembicExporter(PendingFile file, ExportStrands strands, double frame_seconds)
        : file_(std::move(file)), strands_(std::move(strands)), frame_seconds_(frame_seconds) {}

    Result<void> begin();
    Result<void> add(std::span<const float> position) override;
    Result<void> finish() override;

  private:
    Result<std::uint64_t> append(std::span<const std::byte> head, std::span<const std::byte> tail);
    Result<std::uint64_t> data(std::span<const std::byte> bytes);
    Result<std::uint64_t> sample(std::span<const std::byte> content);
    Result<std::uint64_t> group(const std::vector<std::uint64_t>& children);
    Result<std::uint64_t> compound(std::vector<Property> properties);
    Result<std::uint64_t> object(std::uint64_t properties,
                                 const std::vector<std::uint64_t>& children,
                                 const Bytes& child_headers);
    // A per-curve property with one constant sample.
    Result<void> add_constant(std::vector<Property>& list, Property property,
                              std::span<const std::byte> content);

    PendingFile file_;
    ExportStrands strands_;
    double frame_seconds_;
    std::uint64_t size_ = 0;
    std::vector<std::uint64_t> position_samples_, bound_samples_;
};

Result<std::uint64_t> AlembicExporter::append(std::span<const std::byte> head,
                                              std::span<const std::byte> tail) {
    const std::uint64_t at = size_;
    if (auto ok = file_.write(head); !ok) return ok.error();
    if (auto ok = file_.write(tail); !ok) return ok.error();
    size_ += head.size() + tail.size();
    return at;
}

Result<std::uint64_t> AlembicExporter::data(std::span<const std::byte> bytes) {
    if (bytes.empty()) return kDataBit;
    const std::uint64_t size = bytes.size();
    auto at = append(std::as_bytes(std::span(&size, 1)), bytes);
    if (!at) return at;
    return *at | kDataBit;
}

Result<std::uint64_t> AlembicExporter::sample(std::span<const std::byte> content) {
    Bytes head;
    const Hash128 key = hash_bytes(content);
    head.add(std::uint64_t{content.size() + sizeof key}).add(key.low).add(key.high);
    auto at = append(head.span(), content);
    if (!at) return at;
    return *at | kDataBit;
}

Result<std::uint64_t> AlembicExporter::group(const std::vector<std::uint64_t>& children) {
    if (children.empty()) return std::uint64_t{0};
    Bytes bytes;
    bytes.add(std::uint64_t{children.size()});
    for (const std::uint64_t child : children) bytes.add(child);
    return append(bytes.span(), {});
}

Result<std::uint64_t> AlembicExporter::compound(std::vector<Property> properties) {
    std::vector<std::uint64_t> children;
    Bytes headers;
    for (const Property& property : properties) {
        std::uint32_t info = property.kind | kWideCounts | property.flags | property.metadata << 20;
        if (property.kind == kCompound) {
            children.push_back(property.group);
            headers.add(info);
        } else {
            std::vector<std::uint64_t> blocks;
            for (const std::uint64_t at : property.samples) {
                blocks.push_back(at);
                if (property.kind == kArray) blocks.push_back(kDataBit);
            }
            auto at = group(blocks);
            if (!at) return at;
            children.push_back(*at);
            info |= property.pod << 4 | property.extent << 12;
            if (property.samples.size() == 1) info |= kConstant;
            if (property.time_sampling != 0) info |= kHasTimeSampling;
            headers.add(info).add(static_cast<std::uint32_t>(property.samples.size()));
            if (property.time_sampling != 0) headers.add(property.time_sampling);
        }
        headers.add(static_cast<std::uint32_t>(property.name.size())).text(property.name);
    }
    auto at = data(headers.span());
    if (!at) return at;
    children.push_back(*at);
    return group(children);
}

Result<std::uint64_t> AlembicExporter::object(std::uint64_t properties,
                                              const std::vector<std::uint64_t>& children,
                                              const Bytes& child_headers) {
    std::vector<std::uint64_t> all{properties};
    all.insert(all.end(), children.begin(), children.end());
    // Two hashes close the headers: of the properties and of the children. Readers use them to
    // recognise equal objects.
    Bytes headers = child_headers;
    const Hash128 own = hash_bytes(std::as_bytes(std::span(&properties, 1)));
    const Hash128 below = hash_bytes(std::as_bytes(std::span(children.data(), children.size())));
    headers.add(own.low).add(own.high).add(below.low).add(below.high);
    auto at = data(headers.span());
    if (!at) return at;
    all.push_back(*at);
    return group(all);
}

Result<void> AlembicExporter::begin() {
    Bytes header;
    header.text("Ogawa");
    // 0 until the file is complete, then 0xff; the root's offset is filled in at the end.
    header.add(std::uint8_t{0}).add(std::uint8_t{0}).add(std::uint8_t{1}).add(std::uint64_t{0});
    auto at = append(header.span(), {});
    if (!at) return at.error();
    return {};
}

Result<void> AlembicExporter::add(std::span<const float> position) {
    std::array<double, 6> bounds{INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};
    for (std::size_t i = 0; i < position.size(); ++i) {
        bounds[i % 3] = std::min(bounds[i % 3], double{position[i]});
        bounds[3 + i % 3] = std::max(bounds[3 + i % 3], double{position[i]});
    }
    auto at = sample(std::as_bytes(position));
    if (!at) return at.error();
    position_samples_.push_back(*at);
    at = sample(std::as_bytes(std::span(bounds)));
    if (!at) return at.error();
    bound_samples_.push_back(*at);
    return {};
}

Result<void> AlembicExporter::add_constant(std::vector<Property>& list, Property property,
                                           std::span<const std::byte> content) {
    auto at = sample(content);
    if (!at) return at.error();
    property.samples = {*at};
    list.push_back(std::move(property));
    return {};
}

Result<void> AlembicExporter::finish() {
    const std::size_t count = strands_.first_point.size() - 1;
    std::vector<std::int32_t> vertices(count);
    for (std::size_t s = 0; s < count; ++s)
        vertices[s] =
            static_cast<std::int32_t>(strands_.first_point[s + 1] - strands_.first_point[s]);
    // linear, non-periodic, no basis (its default number), linear again
    constexpr std::array<std::uint8_t, 4> kBasisAndType{1, 0, 0, 0};

    const std::uint32_t moving = position_samples_.size() > 1 ? 1 : 0;
    std::vector<Property> geometry;
    geometry.push_back(
        {".selfBnds", kScalar, kFloat64, 6, kHomogenous, kBox, moving, bound_samples_});
    geometry.push_back({"P", kArray, kFloat32, 3, kHomogenous, kPoint, moving, position_samples_});
    const auto constant = [&](std::vector<Property>& list, const char* name, Kind kind, Pod pod,
                              std::uint32_t extent, Metadata metadata,
                              std::span<const std::byte> content) {
        return add_constant(list, {name, kind, pod, extent, kHomogenous, metadata, 0, {}}, content);
    };
    if (auto ok = constant(geometry, "nVertices", kArray, kInt32, 1, kNone,
                           std::as_bytes(std::span(vertices)));
        !ok)
        return ok;
    if (auto ok = constant(geometry, "curveBasisAndType", kScalar, kUint8, 4, kNone,
                           std::as_bytes(std::span(kBasisAndType)));
        !ok)
        return ok;
    if (!strands_.radius.empty()) {
        std::vector<float> width(strands_.radius);
        for (float& value : width) value *= 2;
        if (auto ok = constant(geometry, "width", kArray, kFloat32, 1, kWidth,
                               std::as_bytes(std::span(width)));
            !ok)
            return ok;
    }
    std::vector<Property> attributes;
    if (!strands_.uv.empty())
        if (auto ok = constant(attributes, "groom_root_uv", kArray, kFloat32, 2, kUv,
                               std::as_bytes(std::span(strands_.uv)));
            !ok)
            return ok;
    if (!strands_.id.empty())
        if (auto ok = constant(attributes, "groom_id", kArray, kInt32, 1, kPerCurveInt,
                               std::as_bytes(std::span(strands_.id)));
            !ok)
            return ok;
    if (!strands_.is_guide.empty())
        if (auto ok = constant(attributes, "groom_guide", kArray, kUint8, 1, kPerCurveByte,
                               std::as_bytes(std::span(strands_.is_guide)));
            !ok)
            return ok;
    if (!attributes.empty()) {
        auto at = compound(std::move(attributes));
        if (!at) return at.error();
        geometry.push_back({".arbGeomParams", kCompound, 0, 0, 0, kNone, 0, {}, *at});
    }
    auto geometry_at = compound(std::move(geometry));
    if (!geometry_at) return geometry_at.error();
    auto properties = compound({{".geom", kCompound, 0, 0, 0, kCurves, 0, {}, *geometry_at}});
    if (!properties) return properties.error();
    auto strands = object(*properties, {}, {});
    if (!strands) return strands.error();

    constexpr std::string_view kName = "strands";
    Bytes child;
    child.add(static_cast<std::uint32_t>(kName.size()))
        .text(kName)
        .add(static_cast<std::uint8_t>(kCurvesObject));
    auto top = object(0, {*strands}, child);
    if (!top) return top.error();

    Bytes times, metadata;
    const auto add_sampling = [&](double seconds) {
        times.add(static_cast<std::uint32_t>(position_samples_.size()))
            .add(seconds)
            .add(std::uint32_t{1})
            .add(0.0);
    };
    add_sampling(1);
    if (moving) add_sampling(frame_seconds_);
    for (const char* entry : kMetadata)
        metadata.add(static_cast<std::uint8_t>(std::strlen(entry))).text(entry);

    std::vector<std::uint64_t> root;
    for (const std::uint32_t version : {kFileVersion, kLibraryVersion}) {
        auto at = data(std::as_bytes(std::span(&version, 1)));
        if (!at) return at.error();
        root.push_back(*at);
    }
    root.push_back(*top);
    Bytes application;
    application.text("_ai_Application=keratin");
    for (const Bytes* bytes : {&application, &times, &metadata}) {
        auto at = data(bytes->span());
        if (!at) return at.error();
        root.push_back(*at);
    }
    auto root_at = group(root);
    if (!root_at) return root_at.error();
    Bytes header;
    header.add(std::uint8_t{0xff}).add(std::uint8_t{0}).add(std::uint8_t{1}).add(*root_at);
    if (auto ok = file_.overwrite(5, header.span()); !ok) return ok;
    return file_.commit();
}

}  // namespace

Result<std::unique_ptr<StrandExporter>> create_alembic_exporter(const std::string& path,
                                                                ExportStrands strands,
                                                                double frame_seconds) {
    auto file = PendingFile::create(path);
    if (!file) return file.error();
    auto exporter =
        std::make_unique<AlembicExporter>(std::move(*file), std::move(strands), frame_seconds);
    if (auto ok = exporter->begin(); !ok) return ok.error();
    return std::unique_ptr<StrandExporter>(std::move(exporter));
}

}  // namespace keratin
