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

    OgawaFile() : bytes_("Ogawa\xff\x00\x01", 8) { append(bytes_, std::uint64_t{0}); }

    std::uint64_t data(const std::string& content) {
        if (content.empty()) return kData;
        const std::uint64_t at = bytes_.size();
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
        const std::uint64_t at = bytes_.size();
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
};

enum : std::uint32_t { kCompound = 0, kScalar = 1, kArray = 2 };
enum : std::uint32_t { kU8 = 1, kI32 = 6, kF32 = 10, kF64 = 11, kText = 12 };

// Properties of a compound, gathered and then written.
class Compound {
  public:
    explicit Compound(OgawaFile& file) : file_(file) {}

    // A property with one sample, or with several that all differ (time sampling 1).
    Compound& add(const std::string& name, std::uint32_t kind, std::uint32_t pod,
                  std::uint32_t extent, const std::vector<std::uint64_t>& samples) {
        std::vector<std::uint64_t> places;
        for (std::uint64_t sample : samples) {
            places.push_back(sample);
            if (kind == kArray) places.push_back(OgawaFile::kData);
        }
        children_.push_back(file_.group(places));
        const bool moves = samples.size() > 1;
        append(headers_, kind | 2u << 2 | pod << 4 | extent << 12 | (moves ? 0x100u : 0x800u));
        append(headers_, static_cast<std::uint32_t>(samples.size()));
        if (moves) append(headers_, std::uint32_t{1});
        add_name(name);
        return *this;
    }
    Compound& add(const std::string& name, std::uint64_t compound) {
        children_.push_back(compound);
        append(headers_, std::uint32_t{kCompound | 2u << 2});
        add_name(name);
        return *this;
    }
    std::uint64_t write() {
        children_.push_back(file_.data(headers_));
        return file_.group(children_);
    }

  private:
    void add_name(const std::string& name) {
        append(headers_, static_cast<std::uint32_t>(name.size()));
        headers_ += name;
    }

    OgawaFile& file_;
    std::vector<std::uint64_t> children_;
    std::string headers_;
};

// Metadata of objects in files ended by OgawaFile::finish.
enum : std::uint8_t { kPlainObject = 0, kCurvesObject = 1, kXformObject = 2 };

struct ChildObject {
    std::string name;
    std::uint8_t metadata;
    std::uint64_t object;
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
    }
    headers.resize(headers.size() + 32, 'h');
    places.push_back(file.data(headers));
    return file.group(places);
}

}  // namespace keratin::test
