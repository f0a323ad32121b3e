#include "bake/read/ogawa.h"

#include "bake/read/bytes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace keratin::ogawa {
namespace {

constexpr std::uint64_t kDataBit = std::uint64_t{1} << 63;
constexpr std::size_t kKeySize = 16, kHashesSize = 32;
constexpr std::uint8_t kInlineMetadata = 0xff;
constexpr std::array<std::uint8_t, 14> kPodSize = {1, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8, 1, 4};
constexpr std::size_t kWorkPerByte = 32;
// The least that visiting a group costs.
constexpr std::size_t kVisitCost = 64;
// Time samplings whose period is no time at all list every time themselves.
constexpr double kAcyclic = 1e300;

double half_to_double(std::uint16_t half) {
    const int exponent = half >> 10 & 0x1f;
    const double mantissa = half & 0x3ff;
    const double sign = half & 0x8000 ? -1 : 1;
    if (exponent == 0x1f)
        return mantissa == 0 ? sign * std::numeric_limits<double>::infinity()
                             : std::numeric_limits<double>::quiet_NaN();
    if (exponent == 0) return sign * std::ldexp(mantissa, -24);
    return sign * std::ldexp(1024 + mantissa, exponent - 25);
}

// Reads fields of headers front to back.
class Cursor {
  public:
    explicit Cursor(std::string_view bytes) : bytes_(bytes) {}
    bool at_end() const { return at_ == bytes_.size(); }
    template <class T>
    bool read(T& value) {
        if (!holds(bytes_, at_, 1, sizeof(T))) return false;
        value = load<T>(bytes_, at_);
        at_ += sizeof(T);
        return true;
    }
    // A count whose width the header gives as 0, 1, 2 for one, two or four bytes.
    bool read_count(std::uint32_t width, std::uint32_t& value) {
        std::uint8_t one = 0;
        std::uint16_t two = 0;
        switch (width) {
            case 0:
                if (!read(one)) return false;
                value = one;
                return true;
            case 1:
                if (!read(two)) return false;
                value = two;
                return true;
            case 2:
                return read(value);
            default:
                return false;
        }
    }
    bool read_text(std::size_t size, std::string_view& text) {
        if (!holds(bytes_, at_, size, 1)) return false;
        text = bytes_.substr(at_, size);
        at_ += size;
        return true;
    }

  private:
    std::string_view bytes_;
    std::size_t at_ = 0;
};

}  // namespace

Sample::Sample(std::string_view bytes, Pod pod, std::uint8_t extent)
    : bytes_(bytes),
      pod_(pod),
      extent_(extent),
      count_(bytes.size() / (std::size_t{kPodSize[static_cast<std::size_t>(pod)]} * extent)) {}

double Sample::number(std::size_t element, std::size_t component) const {
    const std::size_t size = kPodSize[static_cast<std::size_t>(pod_)];
    const std::size_t at = (element * extent_ + component) * size;
    switch (pod_) {
        case Pod::float16:
            return half_to_double(load<std::uint16_t>(bytes_, at));
        case Pod::float32:
            return load<float>(bytes_, at);
        case Pod::float64:
            return load<double>(bytes_, at);
        case Pod::int8:
            return load<std::int8_t>(bytes_, at);
        case Pod::uint16:
            return load<std::uint16_t>(bytes_, at);
        case Pod::int16:
            return load<std::int16_t>(bytes_, at);
        case Pod::uint32:
            return load<std::uint32_t>(bytes_, at);
        case Pod::int32:
            return load<std::int32_t>(bytes_, at);
        case Pod::uint64:
            return static_cast<double>(load<std::uint64_t>(bytes_, at));
        case Pod::int64:
            return static_cast<double>(load<std::int64_t>(bytes_, at));
        default:
            return load<std::uint8_t>(bytes_, at);
    }
}

std::int64_t Sample::integer(std::size_t element) const {
    const double value = number(element);
    constexpr double kLimit = 9e18;
    if (!(value >= -kLimit)) return std::numeric_limits<std::int64_t>::min();
    if (value > kLimit) return std::numeric_limits<std::int64_t>::max();
    return static_cast<std::int64_t>(value);
}

Archive::Archive(std::string_view bytes, std::string file)
    : bytes_(bytes), file_(std::move(file)), work_left_(kWorkPerByte * (bytes.size() + 4096)) {}

Result<Archive> Archive::open(std::string_view bytes, const std::string& file) {
    Archive archive(bytes, file);
    constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n";
    if (bytes.starts_with(kHdf5))
        return Error{
            ErrorCode::unsupported, file,
            "this Alembic file has HDF5 inside, the format before 2013, which is not read; "
            "export it again as Ogawa"};
    constexpr std::size_t kHeaderSize = 16;
    if (!bytes.starts_with("Ogawa") || bytes.size() < kHeaderSize)
        return archive.damaged("this is not an Alembic file");
    if (static_cast<std::uint8_t>(bytes[5]) != 0xff)
        return archive.damaged("the file was not finished by the program that wrote it");
    if (auto read = archive.read_root(); !read) return read.error();
    return archive;
}

Result<void> Archive::read_root() {
    const auto root = group_at(load<std::uint64_t>(bytes_, 8));
    if (!root || root->count < 6) return damaged("the file has no root; it is cut or damaged");
    const auto version = data_at(place(*root, 0)), library = data_at(place(*root, 1));
    const auto top = group_at(place(*root, 2));
    const auto times = data_at(place(*root, 4)), indexed = data_at(place(*root, 5));
    if (!version || version->size() != 4 || !library || !top || !times || !indexed)
        return damaged("the file's root is damaged");
    if (const auto number = load<std::uint32_t>(*version, 0); number != 0)
        return Error{ErrorCode::unsupported, file_,
                     "Alembic file version " + std::to_string(number) + " is not known, 0 is"};
    top_ = *top;
    for (Cursor cursor(*times); !cursor.at_end();) {
        std::uint32_t most = 0, count = 0;
        TimeSampling sampling;
        if (!cursor.read(most) || !cursor.read(sampling.per_cycle) || !cursor.read(count) ||
            !cursor.read_text(std::size_t{count} * sizeof(double), sampling.times))
            return damaged("the time samplings are damaged");
        time_samplings_.push_back(sampling);
    }
    metadata_.push_back({});
    for (Cursor cursor(*indexed); !cursor.at_end();) {
        std::uint8_t size = 0;
        std::string_view text;
        if (!cursor.read(size) || !cursor.read_text(size, text))
            return damaged("the list of metadata is damaged");
        // An index has eight bits, of which one number means something else.
        if (metadata_.size() < kInlineMetadata) metadata_.push_back(text);
    }
    return {};
}

std::optional<Group> Archive::group_at(std::uint64_t place) const {
    if (place & kDataBit) return {};
    if (place == 0) return Group{};
    if (!holds(bytes_, place, 1, 8)) return {};
    const auto count = load<std::uint64_t>(bytes_, place);
    if (!holds(bytes_, place + 8, count, 8)) return {};
    return Group{place + 8, count};
}

std::optional<std::string_view> Archive::data_at(std::uint64_t place) const {
    if (!(place & kDataBit)) return {};
    place &= ~kDataBit;
    if (place == 0) return std::string_view();
    if (!holds(bytes_, place, 1, 8)) return {};
    const auto size = load<std::uint64_t>(bytes_, place);
    if (!holds(bytes_, place + 8, size, 1)) return {};
    return bytes_.substr(place + 8, size);
}

std::uint64_t Archive::place(const Group& group, std::uint64_t child) const {
    return load<std::uint64_t>(bytes_, group.at + 8 * child);
}

Result<void> Archive::work(std::size_t bytes) {
    if (bytes + kVisitCost > work_left_)
        return damaged("the objects of the file contain each other without end");
    work_left_ -= bytes + kVisitCost;
    return {};
}

std::optional<std::string_view> Archive::metadata(std::size_t index) const {
    if (index >= metadata_.size()) return {};
    return metadata_[index];
}

Result<std::vector<Object>> Archive::children(const Group& object) {
    std::vector<Object> out;
    if (object.count < 2) return out;
    const auto headers = data_at(place(object, object.count - 1));
    if (!headers) return damaged("an object has no headers");
    if (auto worked = work(headers->size()); !worked) return worked.error();
    if (headers->size() <= kHashesSize) return out;
    constexpr std::uint64_t kLeastHeader = 5;
    out.reserve(std::min(object.count - 2, headers->size() / kLeastHeader));
    std::uint64_t child = 1;
    for (Cursor cursor(headers->substr(0, headers->size() - kHashesSize)); !cursor.at_end();
         ++child) {
        Object header;
        std::uint32_t size = 0;
        std::uint8_t index = 0;
        bool sound = cursor.read(size) && cursor.read_text(size, header.name) && cursor.read(index);
        if (sound && index == kInlineMetadata) {
            sound = cursor.read(size) && cursor.read_text(size, header.metadata);
        } else if (sound) {
            const auto text = metadata(index);
            sound = text.has_value();
            header.metadata = text.value_or("");
        }
        if (!sound || child + 1 >= object.count)
            return damaged("the headers of an object's children are damaged");
        const auto group = group_at(place(object, child));
        if (!group)
            return damaged("object \"" + std::string(header.name) + "\" lies outside the file");
        header.group = *group;
        out.push_back(header);
    }
    return out;
}

Result<std::vector<Property>> Archive::object_properties(const Group& object) {
    if (object.count == 0) return std::vector<Property>();
    const auto compound = group_at(place(object, 0));
    if (!compound) return damaged("the properties of an object lie outside the file");
    return properties(*compound);
}

// A header: u32 of bits 0-1 kind, 2-3 width of counts, 4-7 type, 8 has a time sampling, 9 first and
// last changed sample follow, 11 all samples are the same, 12-19 extent, 20-27 index of metadata.
Result<std::vector<Property>> Archive::properties(const Group& compound) {
    std::vector<Property> out;
    if (compound.count == 0) return out;
    const auto headers = data_at(place(compound, compound.count - 1));
    if (!headers) return damaged("a list of properties has no headers");
    if (auto worked = work(headers->size()); !worked) return worked.error();
    constexpr std::uint64_t kLeastHeader = 5;
    out.reserve(std::min(compound.count - 1, headers->size() / kLeastHeader));
    std::uint64_t child = 0;
    for (Cursor cursor(*headers); !cursor.at_end(); ++child) {
        Property header;
        std::uint32_t info = 0, size = 0;
        bool sound = cursor.read(info);
        const std::uint32_t kind = info & 3, width = info >> 2 & 3, pod = info >> 4 & 15;
        const std::uint32_t metadata_index = info >> 20 & 0xff;
        header.kind = kind == 0 ? Kind::compound : kind == 1 ? Kind::scalar : Kind::array;
        if (sound && header.kind != Kind::compound) {
            header.extent = static_cast<std::uint8_t>(info >> 12 & 0xff);
            sound = pod < kPodSize.size() && header.extent > 0 &&
                    cursor.read_count(width, header.sample_count);
            header.pod = static_cast<Pod>(pod);
            if (sound && info & 0x200) {
                sound = cursor.read_count(width, header.first_changed) &&
                        cursor.read_count(width, header.last_changed);
            } else if (!(info & 0x800)) {
                header.first_changed = 1;
                header.last_changed = header.sample_count > 0 ? header.sample_count - 1 : 0;
            }
            if (sound && info & 0x100) sound = cursor.read_count(width, header.time_sampling);
        }
        sound = sound && cursor.read_count(width, size) && cursor.read_text(size, header.name);
        if (sound && metadata_index == kInlineMetadata) {
            sound = cursor.read_count(width, size) && cursor.read_text(size, header.metadata);
        } else if (sound) {
            const auto text = metadata(metadata_index);
            sound = text.has_value();
            header.metadata = text.value_or("");
        }
        if (!sound || child + 1 >= compound.count)
            return damaged("the headers of a list of properties are damaged");
        const auto group = group_at(place(compound, child));
        if (!group)
            return damaged("property \"" + std::string(header.name) + "\" lies outside the file");
        header.group = *group;
        out.push_back(header);
    }
    return out;
}

// Which sample is nearest to a time; not yet which stored one that is.
std::uint64_t Archive::sample_index(const Property& property, double time) const {
    if (property.time_sampling >= time_samplings_.size() || property.sample_count == 0) return 0;
    const TimeSampling& sampling = time_samplings_[property.time_sampling];
    const std::size_t stored = sampling.times.size() / sizeof(double);
    if (stored == 0) return 0;
    const auto time_of = [&](std::uint64_t i) {
        const double base = load<double>(sampling.times, i % stored * sizeof(double));
        if (sampling.per_cycle > kAcyclic) return base;
        return base + static_cast<double>(i / stored) * sampling.per_cycle;
    };
    std::uint64_t count = property.sample_count;
    if (sampling.per_cycle > kAcyclic) count = std::min<std::uint64_t>(count, stored);
    // Times rise with the index: halve to the first at or after the wanted time.
    std::uint64_t low = 0, high = count;
    while (low < high) {
        const std::uint64_t middle = low + (high - low) / 2;
        if (time_of(middle) < time)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == count) return count - 1;
    if (low > 0 && time - time_of(low - 1) <= time_of(low) - time) return low - 1;
    return low;
}

Result<std::optional<Sample>> Archive::sample(const Property& property, double time) {
    if (property.sample_count == 0 || property.group.count == 0) return std::optional<Sample>();
    const std::uint64_t index = sample_index(property, time);
    std::uint64_t stored = 0;
    if (index >= property.first_changed && property.last_changed >= property.first_changed &&
        property.last_changed > 0 && index > 0)
        stored = std::min<std::uint64_t>(index, property.last_changed) - property.first_changed + 1;
    const std::uint64_t child = property.kind == Kind::array ? 2 * stored : stored;
    const auto data =
        child < property.group.count ? data_at(place(property.group, child)) : std::nullopt;
    if (!data)
        return damaged("sample " + std::to_string(stored) + " of property \"" +
                       std::string(property.name) + "\" lies outside the file");
    if (data->empty()) return std::optional(Sample({}, property.pod, property.extent));
    if (data->size() < kKeySize)
        return damaged("a sample of property \"" + std::string(property.name) + "\" is cut");
    return std::optional(Sample(data->substr(kKeySize), property.pod, property.extent));
}

}  // namespace keratin::ogawa
