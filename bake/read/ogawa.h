// The Alembic archive inside an Ogawa file: objects, properties, samples. Everything is a view into
// the file's bytes; nothing is believed before it is checked. Layout:
//   "Ogawa" 0xff u16 version u64 root
//   group    u64 count, count x u64 place; a place with the top bit set is data, 0 is empty
//   data     u64 size, bytes
//   root     [file version, library version, top object, metadata, time samplings, indexed
//   metadata] object   [compound property, child objects ..., headers of the children + 32 bytes of
//   hashes] compound [properties ..., their headers];  array property [data, dimensions, data,
//   ...]; scalar property [data, data, ...];  a sample's data starts with a 16-byte key.
#pragma once

#include "schema/result.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace keratin::ogawa {

struct Group {
    std::uint64_t at = 0;     // of its list of places in the file
    std::uint64_t count = 0;  // of children; they lie inside the file
};

enum class Kind : std::uint8_t { compound, scalar, array };

// Plain old data types by their number in the file.
enum class Pod : std::uint8_t {
    boolean,
    uint8,
    int8,
    uint16,
    int16,
    uint32,
    int32,
    uint64,
    int64,
    float16,
    float32,
    float64,
    string,
    wstring
};

struct Property {
    std::string_view name, metadata;
    Kind kind = Kind::compound;
    Pod pod = Pod::boolean;
    std::uint8_t extent = 1;  // numbers an element
    // Samples that count, and those of them that are stored: `first` .. `last` differ from the one
    // before, all others repeat.
    std::uint32_t sample_count = 0, first_changed = 0, last_changed = 0;
    std::uint32_t time_sampling = 0;
    Group group;  // its samples, or its properties if it is a compound
};

struct Object {
    std::string_view name, metadata;
    Group group;
};

// The numbers of one sample.
class Sample {
  public:
    Sample() = default;
    Sample(std::string_view bytes, Pod pod, std::uint8_t extent);
    // Elements, of `extent` numbers each.
    std::size_t count() const { return count_; }
    std::uint8_t extent() const { return extent_; }
    double number(std::size_t element, std::size_t component = 0) const;
    // The element's first number as an integer; saturated.
    std::int64_t integer(std::size_t element) const;
    std::string_view bytes() const { return bytes_; }

  private:
    std::string_view bytes_;
    Pod pod_ = Pod::uint8;
    std::uint8_t extent_ = 1;
    std::size_t count_ = 0;
};

class Archive {
  public:
    // Errors (input): not Ogawa, unfinished, damaged; (unsupported) HDF5 inside, another version.
    static Result<Archive> open(std::string_view bytes, const std::string& file);

    Group top() const { return top_; }
    // Errors (input): damage, or a file that makes its reader walk in circles.
    Result<std::vector<Object>> children(const Group& object);
    Result<std::vector<Property>> properties(const Group& compound);
    // The compound of an object's own properties.
    Result<std::vector<Property>> object_properties(const Group& object);
    // The sample nearest to `time` (s); nothing if the property has none.
    Result<std::optional<Sample>> sample(const Property& property, double time);

    Error damaged(const std::string& what) const { return {ErrorCode::input, file_, what}; }

  private:
    Archive(std::string_view bytes, std::string file);
    std::optional<Group> group_at(std::uint64_t place) const;
    std::optional<std::string_view> data_at(std::uint64_t place) const;
    std::uint64_t place(const Group& group, std::uint64_t child) const;
    Result<void> read_root();
    Result<void> work(std::size_t bytes);
    std::optional<std::string_view> metadata(std::size_t index) const;
    std::uint64_t sample_index(const Property& property, double time) const;

    struct TimeSampling {
        double per_cycle = 1;
        std::string_view times;  // f64 each
    };

    std::string_view bytes_;
    std::string file_;
    Group top_;
    std::vector<TimeSampling> time_samplings_;
    std::vector<std::string_view> metadata_;
    // Bytes of headers that may still be read: shared groups must not make a small file a long
    // walk.
    std::size_t work_left_;
};

}  // namespace keratin::ogawa
