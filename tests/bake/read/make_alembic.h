// Small Ogawa files put together by hand in a test.
#pragma once

#include "tests/bake/read/make_bytes.h"

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace keratin::test {

class OgawaFile {
  public:
    static constexpr std::uint64_t kData = std::uint64_t{1} << 63;

    // With a hole, all places are so many bytes further on than where bytes() has them, as if it
    // came after the first 16 bytes.
    explicit OgawaFile(std::uint64_t hole = 0) : bytes_("Ogawa\xff\x00\x01", 8), hole_(hole) {
        append(bytes_, std::uint64_t{0});
    }

    std::uint64_t data(const std::string& content) {
        if (content.empty()) return kData;
        const std::uint64_t at = bytes_.size() + hole_;
        append(bytes_, std::uint64_t{content.size()});
        bytes_ += content;
        return at | kData;
    }
    template <class T>
    std::uint64_t sample(const std::vector<T>& values) {
        std::string content(16, 'k');
        for (const T& value : values) append(content, value);
        return data(content);
    }
    std::uint64_t group(const std::vector<std::uint64_t>& children) {
        if (children.empty()) return 0;
        const std::uint64_t at = bytes_.size() + hole_;
        append(bytes_, std::uint64_t{children.size()});
        for (std::uint64_t child : children) append(bytes_, child);
        return at;
    }
    // Ends the file: the top object and the time samplings' data.
    std::string finish(std::uint64_t top, const std::string& times) {
        const std::string version(4, '\0');
        std::string metadata;
        for (const char* text : {"schema=AbcGeom_Curve_v2", "schema=AbcGeom_Xform_v3"}) {
            append(metadata, static_cast<std::uint8_t>(std::string_view(text).size()));
            metadata += text;
        }
        const std::vector<std::uint64_t> children = {data(version), data(version), top,
                                                     data("_ai"),   data(times),   data(metadata)};
        const std::uint64_t root = group(children);
        overwrite(bytes_, 8, root);
        return bytes_;
    }
    const std::string& bytes() const { return bytes_; }

  private:
    std::string bytes_;
    std::uint64_t hole_;
};

enum : std::uint32_t { kCompound = 0, kScalar = 1, kArray = 2 };
enum : std::uint32_t {
    kBool = 0,
    kU8 = 1,
    kI8 = 2,
    kU16 = 3,
    kI16 = 4,
    kU32 = 5,
    kI32 = 6,
    kU64 = 7,
    kI64 = 8,
    kF16 = 9,
    kF32 = 10,
    kF64 = 11,
    kText = 12
};

// How a property's header is written: the bytes of each count in it (1, 2 or 4), and metadata
// beside it instead of by index.
struct HeaderStyle {
    std::uint32_t count_bytes = 4;
    std::string metadata = "";
    std::uint32_t time_sampling = 1;  // of properties with several samples
};

// Properties of a compound, gathered and then written.
class Compound {
  public:
    explicit Compound(OgawaFile& file) : file_(file) {}

    // A property with one sample, or with several that all differ.
    Compound& add(const std::string& name, std::uint32_t kind, std::uint32_t pod,
                  std::uint32_t extent, const std::vector<std::uint64_t>& samples,
                  const HeaderStyle& style = {}) {
        std::vector<std::uint64_t> places;
        for (std::uint64_t sample : samples) {
            places.push_back(sample);
            if (kind == kArray) places.push_back(OgawaFile::kData);
        }
        children_.push_back(file_.group(places));
        const bool moves = samples.size() > 1;
        info(style, kind | pod << 4 | extent << 12 | (moves ? 0x100u : 0x800u));
        count(style, samples.size());
        if (moves) count(style, style.time_sampling);
        add_name(name, style);
        return *this;
    }
    // The same of `sample_count` samples of which only those from `first` to `last` differ from the
    // one before them.
    Compound& add_changing(const std::string& name, std::uint32_t pod, std::uint32_t extent,
                           std::size_t sample_count, std::size_t first, std::size_t last,
                           const std::vector<std::uint64_t>& samples,
                           const HeaderStyle& style = {}) {
        std::vector<std::uint64_t> places;
        for (std::uint64_t sample : samples) {
            places.push_back(sample);
            places.push_back(OgawaFile::kData);
        }
        children_.push_back(file_.group(places));
        info(style, kArray | pod << 4 | extent << 12 | 0x300u);
        count(style, sample_count);
        count(style, first);
        count(style, last);
        count(style, style.time_sampling);
        add_name(name, style);
        return *this;
    }
    Compound& add(const std::string& name, std::uint64_t compound, const HeaderStyle& style = {}) {
        children_.push_back(compound);
        info(style, kCompound);
        add_name(name, style);
        return *this;
    }
    std::uint64_t write() {
        children_.push_back(file_.data(headers_));
        return file_.group(children_);
    }

  private:
    void info(const HeaderStyle& style, std::uint32_t word) {
        word |= (style.count_bytes == 4 ? 2u : style.count_bytes - 1) << 2;
        if (!style.metadata.empty()) word |= 0xffu << 20;
        append(headers_, word);
    }
    void count(const HeaderStyle& style, std::size_t value) {
        for (std::uint32_t i = 0; i < style.count_bytes; ++i)
            headers_ += static_cast<char>(value >> 8 * i & 0xff);
    }
    void add_name(const std::string& name, const HeaderStyle& style) {
        count(style, name.size());
        headers_ += name;
        if (style.metadata.empty()) return;
        count(style, style.metadata.size());
        headers_ += style.metadata;
    }

    OgawaFile& file_;
    std::vector<std::uint64_t> children_;
    std::string headers_;
};

// Metadata of objects in files ended by OgawaFile::finish.
enum : std::uint8_t {
    kPlainObject = 0,
    kCurvesObject = 1,
    kXformObject = 2,
    kInlineMetadata = 0xff
};

struct ChildObject {
    std::string name;
    std::uint8_t metadata;
    std::uint64_t object;
    std::string metadata_text = "";  // beside the name, where `metadata` is kInlineMetadata
};

inline std::uint64_t write_object(OgawaFile& file, std::uint64_t properties,
                                  const std::vector<ChildObject>& children) {
    std::vector<std::uint64_t> places = {properties};
    std::string headers;
    for (const ChildObject& child : children) {
        places.push_back(child.object);
        append(headers, static_cast<std::uint32_t>(child.name.size()));
        headers += child.name;
        append(headers, child.metadata);
        if (child.metadata != kInlineMetadata) continue;
        append(headers, static_cast<std::uint32_t>(child.metadata_text.size()));
        headers += child.metadata_text;
    }
    headers.resize(headers.size() + 32, 'h');
    places.push_back(file.data(headers));
    return file.group(places);
}

// Curves of one object.
struct CurveFile {
    int type = 1, wrap = 0, basis = 0;
    std::vector<std::int32_t> counts;
    std::vector<float> x;  // the points stand at (x, 0, 0)
    std::vector<std::uint8_t> orders;
    std::vector<float> knots, weights, width;
};

inline std::vector<float> on_x_axis(const std::vector<float>& x) {
    std::vector<float> out;
    for (float value : x) out.insert(out.end(), {value, 0, 0});
    return out;
}

inline std::uint64_t write_geometry(OgawaFile& file, const CurveFile& curves,
                                    std::uint64_t attributes = 0) {
    Compound geometry(file);
    geometry.add("P", kArray, kF32, 3, {file.sample(on_x_axis(curves.x))})
        .add("nVertices", kArray, kI32, 1, {file.sample(curves.counts)})
        .add("curveBasisAndType", kScalar, kU8, 4,
             {file.sample(std::vector<std::uint8_t>{static_cast<std::uint8_t>(curves.type),
                                                    static_cast<std::uint8_t>(curves.wrap),
                                                    static_cast<std::uint8_t>(curves.basis),
                                                    static_cast<std::uint8_t>(curves.basis)})});
    if (!curves.orders.empty())
        geometry.add(".orders", kArray, kU8, 1, {file.sample(curves.orders)});
    if (!curves.knots.empty()) geometry.add(".knots", kArray, kF32, 1, {file.sample(curves.knots)});
    if (!curves.weights.empty()) geometry.add("w", kArray, kF32, 1, {file.sample(curves.weights)});
    if (!curves.width.empty()) geometry.add("width", kArray, kF32, 1, {file.sample(curves.width)});
    if (attributes != 0) geometry.add(".arbGeomParams", attributes);
    return Compound(file).add(".geom", geometry.write()).write();
}

// One object of curves below the top.
inline std::string write_curves(const CurveFile& curves) {
    OgawaFile file;
    const std::uint64_t object = write_object(file, write_geometry(file, curves), {});
    return file.finish(write_object(file, 0, {{"hair", kCurvesObject, object}}), "");
}

}  // namespace keratin::test
