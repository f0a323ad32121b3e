#include "bake/read/bytes.h"
#include "bake/read/chains.h"
#include "bake/read/channels.h"
#include "bake/read/formats.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace keratin {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kNoIndex = ~std::size_t{0};

// A member that may be absent; what has the wrong type counts as absent.
const Json* member(const Json& object, const char* name) {
    if (!object.is_object()) return nullptr;
    const auto found = object.find(name);
    return found == object.end() ? nullptr : &*found;
}

std::size_t number_of(const Json& object, const char* name, std::size_t otherwise) {
    const Json* value = member(object, name);
    return value && value->is_number_unsigned() ? value->get<std::size_t>() : otherwise;
}

std::string text_of(const Json& object, const char* name) {
    const Json* value = member(object, name);
    return value && value->is_string() ? value->get<std::string>() : std::string();
}

// Element of a list by index, or null.
const Json* element(const Json& root, const char* list, std::size_t index) {
    const Json* values = member(root, list);
    return values && values->is_array() && index < values->size() ? &(*values)[index] : nullptr;
}

std::optional<std::string> decode_base64(std::string_view text) {
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3);
    std::uint32_t bits = 0;
    int bit_count = 0;
    for (char c : text) {
        std::uint32_t digit = 0;
        if (c >= 'A' && c <= 'Z')
            digit = static_cast<std::uint32_t>(c - 'A');
        else if (c >= 'a' && c <= 'z')
            digit = static_cast<std::uint32_t>(c - 'a' + 26);
        else if (c >= '0' && c <= '9')
            digit = static_cast<std::uint32_t>(c - '0' + 52);
        else if (c == '+')
            digit = 62;
        else if (c == '/')
            digit = 63;
        else if (c == '=')
            break;
        else
            return {};
        bits = bits << 6 | digit;
        bit_count += 6;
        if (bit_count < 8) continue;
        bit_count -= 8;
        bytes += static_cast<char>(bits >> bit_count & 0xff);
    }
    return bytes;
}

struct Container {
    Json json;
    std::string_view binary;  // of a .glb
};

// The JSON and the binary chunk of a .glb, or the JSON alone.
Result<Container> open_container(std::string_view bytes, const std::string& file) {
    const auto damaged = [&](const std::string& what) {
        return Error{ErrorCode::input, file, what};
    };
    Container container;
    std::string_view text = bytes;
    if (bytes.starts_with("glTF")) {
        constexpr std::size_t kHeaderSize = 12, kChunkHeaderSize = 8;
        constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
        if (bytes.size() < kHeaderSize + kChunkHeaderSize)
            return damaged("the file ends inside its header; it is cut");
        if (load<std::uint32_t>(bytes, 4) != 2) return damaged("only glTF 2 is read");
        const auto json_size = load<std::uint32_t>(bytes, kHeaderSize);
        std::size_t at = kHeaderSize + kChunkHeaderSize;
        if (load<std::uint32_t>(bytes, kHeaderSize + 4) != kJsonChunk ||
            !holds(bytes, at, json_size, 1))
            return damaged("the JSON lies beyond the end of the file; it is cut");
        text = bytes.substr(at, json_size);
        at += json_size;
        if (holds(bytes, at, kChunkHeaderSize, 1) &&
            load<std::uint32_t>(bytes, at + 4) == kBinaryChunk) {
            const auto size = load<std::uint32_t>(bytes, at);
            if (!holds(bytes, at + kChunkHeaderSize, size, 1))
                return damaged("the binary chunk lies beyond the end of the file; it is cut");
            container.binary = bytes.substr(at + kChunkHeaderSize, size);
        }
    }
    container.json = Json::parse(text, nullptr, false);
    if (!container.json.is_object())
        return damaged("this is not a glTF file: its JSON cannot be read");
    return container;
}

// A list of numbers in a buffer.
struct Accessor {
    std::string_view bytes;
    std::size_t count = 0, stride = 0, components = 0;
    std::size_t component_type = 0;

    double number(std::size_t i, std::size_t component) const {
        const std::size_t at = i * stride;
        switch (component_type) {
            case 5126:
                return load<float>(bytes, at + 4 * component);
            case 5125:
                return load<std::uint32_t>(bytes, at + 4 * component);
            case 5123:
                return load<std::uint16_t>(bytes, at + 2 * component);
            default:
                return load<std::uint8_t>(bytes, at + component);
        }
    }
};

class Reading {
  public:
    Reading(Container container, std::string_view bytes, const std::string& file,
            const OpenBuffer& open_buffer)
        : json_(std::move(container.json)),
          binary_(container.binary),
          file_(file),
          open_buffer_(open_buffer),
          point_budget_(bytes.size()) {}

    Result<RawGroom> read();

  private:
    Error damaged(const std::string& what) const { return {ErrorCode::input, file_, what}; }
    Result<std::string_view> buffer(std::size_t index);
    Result<Accessor> accessor(std::size_t index, std::string_view what);
    Result<void> add_node(std::size_t index, const Eigen::Matrix4d& parent);
    Result<void> add_primitive(const Json& primitive, const std::string& place,
                               const Eigen::Matrix4d& world, std::uint32_t group);

    Json json_;
    std::string_view binary_;
    const std::string& file_;
    const OpenBuffer& open_buffer_;
    // Points that may still be made: instances of meshes and shared accessors must not blow up a
    // small file. Each byte of the file and its buffers gives room for one.
    std::size_t point_budget_;
    std::map<std::size_t, std::string> buffers_;  // opened ones, by index
    std::vector<bool> visited_;                   // nodes
    RawGroom groom_;
    std::vector<StrandChannels> channels_;
    std::size_t next_curve_ = 0;
};

Result<std::string_view> Reading::buffer(std::size_t index) {
    const Json* described = element(json_, "buffers", index);
    if (!described) return damaged("buffer " + std::to_string(index) + " does not exist");
    const std::string uri = text_of(*described, "uri");
    if (uri.empty()) {
        if (index != 0 || binary_.empty())
            return damaged("buffer " + std::to_string(index) + " has no \"uri\"");
        return binary_;
    }
    if (const auto found = buffers_.find(index); found != buffers_.end())
        return std::string_view(found->second);
    std::string bytes;
    if (uri.starts_with("data:")) {
        const std::size_t comma = uri.find(";base64,");
        const auto decoded = comma == std::string::npos
                                 ? std::nullopt
                                 : decode_base64(std::string_view(uri).substr(comma + 8));
        if (!decoded)
            return damaged("the data of buffer " + std::to_string(index) + " is not base64");
        bytes = *decoded;
    } else {
        auto opened = open_buffer_(uri);
        if (!opened) return opened.error();
        bytes = std::move(*opened);
        point_budget_ += bytes.size();
    }
    return std::string_view(buffers_.emplace(index, std::move(bytes)).first->second);
}

Result<Accessor> Reading::accessor(std::size_t index, std::string_view what) {
    const std::string place = std::string(what) + " (accessor " + std::to_string(index) + ")";
    const Json* described = element(json_, "accessors", index);
    if (!described) return damaged(place + " does not exist");
    if (member(*described, "sparse"))
        return Error{ErrorCode::unsupported, file_, place + " is sparse, which is not read"};
    Accessor out;
    out.component_type = number_of(*described, "componentType", 0);
    const std::size_t size = out.component_type == 5126 || out.component_type == 5125 ? 4
                             : out.component_type == 5123                             ? 2
                             : out.component_type == 5121                             ? 1
                                                                                      : 0;
    const std::string type = text_of(*described, "type");
    out.components = type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : 0;
    if (size == 0 || out.components == 0) return damaged(place + " has a type that does not fit");
    out.count = number_of(*described, "count", 0);
    const std::size_t view_index = number_of(*described, "bufferView", kNoIndex);
    const Json* view = element(json_, "bufferViews", view_index);
    if (!view) return damaged(place + " has no buffer view");
    const auto whole = buffer(number_of(*view, "buffer", kNoIndex));
    if (!whole) return whole.error();
    const std::size_t offset = number_of(*view, "byteOffset", 0);
    const std::size_t length = number_of(*view, "byteLength", 0);
    if (!holds(*whole, offset, length, 1)) return damaged(place + " lies outside of its buffer");
    const std::string_view bytes = whole->substr(offset, length);
    const std::size_t begin = number_of(*described, "byteOffset", 0);
    out.stride = number_of(*view, "byteStride", out.components * size);
    // The last element need not be padded to the stride.
    if (out.stride < out.components * size || out.count == 0 || begin > bytes.size() ||
        bytes.size() - begin < out.components * size ||
        (bytes.size() - begin - out.components * size) / out.stride < out.count - 1)
        return damaged(place + ": its " + std::to_string(out.count) +
                       " elements do not fit into its buffer view");
    out.bytes = bytes.substr(begin);
    return out;
}

// The node's own matrix, from `matrix` or from translation, rotation and scale.
std::optional<Eigen::Matrix4d> node_matrix(const Json& node) {
    const auto numbers = [&](const char* name, std::size_t count, double* out) {
        const Json* list = member(node, name);
        if (!list) return true;
        if (!list->is_array() || list->size() != count) return false;
        for (std::size_t i = 0; i < count; ++i) {
            if (!(*list)[i].is_number()) return false;
            out[i] = (*list)[i].get<double>();
            if (!std::isfinite(out[i])) return false;
        }
        return true;
    };
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (member(node, "matrix"))
        return numbers("matrix", 16, matrix.data()) ? std::optional(matrix) : std::nullopt;
    Vec3 translation = Vec3::Zero(), scale = Vec3::Ones();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    if (!numbers("translation", 3, translation.data()) ||
        !numbers("rotation", 4, rotation.coeffs().data()) || !numbers("scale", 3, scale.data()) ||
        !(rotation.norm() > 0))
        return {};
    matrix.topLeftCorner<3, 3>() = rotation.normalized().toRotationMatrix() * scale.asDiagonal();
    matrix.topRightCorner<3, 1>() = translation;
    return matrix;
}

Result<void> Reading::add_primitive(const Json& primitive, const std::string& place,
                                    const Eigen::Matrix4d& world, std::uint32_t group) {
    enum : std::size_t { lines = 1, line_loop = 2, line_strip = 3, triangles = 4 };
    const std::size_t mode = number_of(primitive, "mode", triangles);
    if (mode < lines || mode > line_strip) return {};
    const Json* attributes = member(primitive, "attributes");
    const std::size_t position_index =
        attributes ? number_of(*attributes, "POSITION", kNoIndex) : kNoIndex;
    const auto position = accessor(position_index, place + ": POSITION");
    if (!position) return position.error();
    if (position->components != 3 || position->component_type != 5126)
        return damaged(place + ": POSITION must be three floats");
    // Attributes that a strand can use, if they have one value a point.
    const auto optional_attribute = [&](const char* name,
                                        std::size_t components) -> Result<Accessor> {
        const std::size_t index = number_of(*attributes, name, kNoIndex);
        if (index == kNoIndex) return Accessor{};
        auto values = accessor(index, place + ": " + name);
        if (!values) return values;
        if (values->components != components || values->component_type != 5126 ||
            values->count != position->count)
            return damaged(place + ": " + name + " must have " + std::to_string(components) +
                           (components == 1 ? " float" : " floats") + " for each position");
        return values;
    };
    const auto width = optional_attribute("_WIDTH", 1);
    if (!width) return width.error();
    const auto radius = optional_attribute("_RADIUS", 1);
    if (!radius) return radius.error();
    const auto uv = optional_attribute("TEXCOORD_0", 2);
    if (!uv) return uv.error();

    std::vector<std::uint32_t> index;
    const std::size_t indices_index = number_of(primitive, "indices", kNoIndex);
    std::size_t index_count = position->count;
    Accessor indices;
    if (indices_index != kNoIndex) {
        auto read = accessor(indices_index, place + ": indices");
        if (!read) return read.error();
        indices = *read;
        if (indices.components != 1 || indices.component_type == 5126)
            return damaged(place + ": the indices must be whole numbers");
        index_count = indices.count;
    }
    if (std::max(index_count, position->count) > point_budget_)
        return damaged(place + ": the file asks for far more points than it holds");
    point_budget_ -= std::max(index_count, position->count);
    for (std::size_t i = 0; i < index_count; ++i) {
        index.push_back(static_cast<std::uint32_t>(
            indices_index == kNoIndex ? static_cast<double>(i) : indices.number(i, 0)));
        if (index.back() >= position->count)
            return damaged(place + ": index " + std::to_string(index.back()) +
                           " is out of range (" + std::to_string(position->count) + " points)");
    }

    std::vector<Chain> chains;
    if (mode == lines) {
        std::vector<Edge> edges;
        for (std::size_t i = 0; i + 1 < index.size(); i += 2)
            edges.push_back({index[i], index[i + 1]});
        chains = build_chains(edges, position->count);
    } else {
        Chain chain;
        if (mode == line_loop) chain.fault = ChainFault::loop;
        if (mode == line_strip && index.size() < 2) {
            chain.fault = ChainFault::one_point;
            chain.vertex = index.empty() ? 0 : index[0];
        }
        chain.vertices = std::move(index);
        chains.push_back(std::move(chain));
    }
    for (const Chain& chain : chains) {
        RawCurve curve;
        curve.index = next_curve_++;
        curve.name = place;
        std::string fault;
        switch (chain.fault) {
            case ChainFault::none:
                break;
            case ChainFault::fork:
                fault = "the lines fork at point " + std::to_string(chain.vertex) +
                        "; a strand has two ends";
                break;
            case ChainFault::loop:
                fault = "the lines close to a loop; a strand has two ends";
                break;
            case ChainFault::one_point:
                fault = "it has one point";
                break;
        }
        StrandChannels channels;
        for (std::uint32_t v : chain.vertices) {
            const Eigen::Vector4d local(position->number(v, 0), position->number(v, 1),
                                        position->number(v, 2), 1);
            curve.points.push_back((world * local).head<3>());
            if (!is_usable(curve.points.back()) && fault.empty())
                fault = "point " + std::to_string(v) + " is not finite or is immensely far away";
            if (width->count == 0 && radius->count == 0) continue;
            const double value =
                radius->count > 0 ? radius->number(v, 0) : 0.5 * width->number(v, 0);
            if (!(std::isfinite(value) && value >= 0) && fault.empty())
                fault = "the width of point " + std::to_string(v) + " is negative or not finite";
            channels.point_radius.push_back(value);
        }
        if (uv->count > 0 && !chain.vertices.empty())
            channels.root_uv =
                Vec2(uv->number(chain.vertices[0], 0), uv->number(chain.vertices[0], 1));
        if (channels.root_uv && !channels.root_uv->allFinite() && fault.empty())
            fault = "its texture coordinate is not finite";
        if (!fault.empty()) {
            groom_.problems.push_back({curve.index, 0, place + ": " + fault});
            continue;
        }
        groom_.curves.push_back(std::move(curve));
        groom_.group.push_back(group);
        channels_.push_back(std::move(channels));
    }
    return {};
}

Result<void> Reading::add_node(std::size_t index, const Eigen::Matrix4d& parent) {
    // A stack instead of recursion: the depth is the file's to choose.
    std::vector<std::pair<std::size_t, Eigen::Matrix4d>> open = {{index, parent}};
    while (!open.empty()) {
        const auto [at, above] = open.back();
        open.pop_back();
        const Json* node = element(json_, "nodes", at);
        if (!node) return damaged("node " + std::to_string(at) + " does not exist");
        if (visited_[at])
            return damaged("node " + std::to_string(at) + " stands in the scene twice");
        visited_[at] = true;
        const auto matrix = node_matrix(*node);
        std::string name = text_of(*node, "name");
        if (name.empty()) name = "node " + std::to_string(at);
        if (!matrix)
            return damaged(name + ": its placement is not made of numbers as it should be");
        const Eigen::Matrix4d world = above * *matrix;
        if (const Json* mesh = element(json_, "meshes", number_of(*node, "mesh", kNoIndex))) {
            const Json* primitives = member(*mesh, "primitives");
            const auto group = static_cast<std::uint32_t>(groom_.group_names.size());
            const std::size_t before = groom_.curves.size();
            if (primitives && primitives->is_array())
                for (const Json& primitive : *primitives)
                    if (auto added = add_primitive(primitive, name, world, group); !added)
                        return added;
            if (groom_.curves.size() > before) groom_.group_names.push_back(name);
        }
        const Json* children = member(*node, "children");
        if (!children || !children->is_array()) continue;
        // Last first, so that the first child is taken from the stack next.
        for (auto child = children->rbegin(); child != children->rend(); ++child)
            if (child->is_number_unsigned()) open.emplace_back(child->get<std::size_t>(), world);
    }
    return {};
}

Result<RawGroom> Reading::read() {
    groom_.file = file_;
    const Json* nodes = member(json_, "nodes");
    visited_.assign(nodes && nodes->is_array() ? nodes->size() : 0, false);
    const Json* scene = element(json_, "scenes", number_of(json_, "scene", 0));
    const Json* roots = scene ? member(*scene, "nodes") : nullptr;
    if (!roots || !roots->is_array()) return damaged("the file has no scene");
    for (const Json& root : *roots) {
        if (!root.is_number_unsigned()) return damaged("the scene names a node that is no number");
        auto added = add_node(root.get<std::size_t>(), Eigen::Matrix4d::Identity());
        if (!added) return added.error();
    }
    attach_channels(groom_, channels_);
    return std::move(groom_);
}

}  // namespace

Result<RawGroom> read_gltf_curves(std::string_view bytes, const std::string& file,
                                  const OpenBuffer& open_buffer) {
    auto container = open_container(bytes, file);
    if (!container) return container.error();
    return Reading(std::move(*container), bytes, file, open_buffer).read();
}

std::optional<Error> find_gltf_mesh_fault(std::string_view bytes, const std::string& file) {
    const auto container = open_container(bytes, file);
    if (!container) return container.error();
    const Json* skins = member(container->json, "skins");
    if (!skins || !skins->is_array()) return {};
    for (std::size_t i = 0; i < skins->size(); ++i)
        if (number_of((*skins)[i], "inverseBindMatrices", kNoIndex) == kNoIndex)
            return Error{
                ErrorCode::unsupported, file,
                "skin " + std::to_string(i) + " has no inverse bind matrices; export it with them"};
    return {};
}

}  // namespace keratin
