#include "bake/read/alembic_objects.h"

#include <Eigen/Geometry>

#include <array>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

namespace keratin::alembic {
namespace {

using Eigen::Vector3d;
using ogawa::Archive;
using ogawa::Property;
using ogawa::Sample;

constexpr std::string_view kCurveSchema = "schema=AbcGeom_Curve_";
constexpr std::string_view kXformSchema = "schema=AbcGeom_Xform_";
constexpr std::string_view kInstance = "isInstance=1";

const Property* find(const std::vector<Property>& properties, std::string_view name) {
    for (const Property& property : properties)
        if (property.name == name) return &property;
    return nullptr;
}

const Property* find_compound(const std::vector<Property>& properties, std::string_view name) {
    const Property* property = find(properties, name);
    return property && property->kind == ogawa::Kind::compound ? property : nullptr;
}

// A byte's worth of a number that the file may have written in any type; -1 if it is none.
int small_number(double value) { return value >= 0 && value < 256 ? static_cast<int>(value) : -1; }

// The transform of an object that is one, or the identity. The operations are those of AbcGeom's
// XformOp: the last one acts on a point first.
Result<Eigen::Matrix4d> read_transform(Archive& archive, const std::vector<Property>& parts,
                                       double time, bool& inherits) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    const auto sample_of = [&](std::string_view name) -> Result<std::optional<Sample>> {
        const Property* property = find(parts, name);
        if (!property || property->kind == ogawa::Kind::compound) return std::optional<Sample>();
        return archive.sample(*property, time);
    };
    const auto inherit = sample_of(".inherits"), ops = sample_of(".ops"), vals = sample_of(".vals");
    if (!inherit) return inherit.error();
    if (!ops) return ops.error();
    if (!vals) return vals.error();
    if (*inherit && (*inherit)->count() > 0) inherits = (*inherit)->number(0) != 0;
    if (!*ops || !*vals) return matrix;
    const std::size_t op_count = (*ops)->count() * (*ops)->extent();
    const std::size_t value_count = (*vals)->count() * (*vals)->extent();
    const auto value = [&](std::size_t i) {
        return (*vals)->number(i / (*vals)->extent(), i % (*vals)->extent());
    };
    std::size_t at = 0;
    for (std::size_t i = 0; i < op_count; ++i) {
        const int code = small_number((*ops)->number(i / (*ops)->extent(), i % (*ops)->extent()));
        const int type = code >> 4;
        enum { scale, translate, rotate, whole, rotate_x, rotate_y, rotate_z };
        constexpr std::array<std::size_t, 7> kChannels = {3, 3, 4, 16, 1, 1, 1};
        if (type < 0 || type > rotate_z) return archive.damaged("a transform is damaged");
        const std::size_t channels = kChannels[static_cast<std::size_t>(type)];
        if (channels > value_count - at) return archive.damaged("a transform is cut");
        Eigen::Affine3d op = Eigen::Affine3d::Identity();
        const auto radians = [&](std::size_t k) { return value(at + k) * std::numbers::pi / 180; };
        if (type == scale) {
            op.scale(Vector3d(value(at), value(at + 1), value(at + 2)));
        } else if (type == translate) {
            op.translate(Vector3d(value(at), value(at + 1), value(at + 2)));
        } else if (type == rotate) {
            const Vector3d axis(value(at), value(at + 1), value(at + 2));
            if (axis.norm() > 0) op.rotate(Eigen::AngleAxisd(radians(3), axis.normalized()));
        } else if (type == whole) {
            // Rows in the file, for points that stand left of the matrix.
            for (std::size_t k = 0; k < 16; ++k)
                op.matrix()(static_cast<Eigen::Index>(k % 4), static_cast<Eigen::Index>(k / 4)) =
                    value(at + k);
        } else {
            op.rotate(Eigen::AngleAxisd(radians(0), Vector3d::Unit(type - rotate_x)));
        }
        matrix = matrix * op.matrix();
        at += channels;
    }
    return matrix;
}

bool is_text(const Property& property) {
    return property.pod == ogawa::Pod::string || property.pod == ogawa::Pod::wstring;
}

// The property that holds an attribute's values: itself or, with `indices` beside it, a part of it.
Result<const Property*> find_values(Archive& archive, const std::vector<Property>& properties,
                                    std::string_view name, std::vector<Property>& parts,
                                    const Property*& indices) {
    const Property* values = find(properties, name);
    indices = nullptr;
    if (!values || values->kind != ogawa::Kind::compound) return values;
    auto read = archive.properties(values->group);
    if (!read) return read.error();
    parts = std::move(*read);
    indices = find(parts, ".indices");
    if (indices && (indices->kind == ogawa::Kind::compound || is_text(*indices))) indices = nullptr;
    values = find(parts, ".vals");
    return values && values->kind != ogawa::Kind::compound ? values : nullptr;
}

Result<void> read_indices(Archive& archive, const Property* indices, double time, Sample& out,
                          bool& is_indexed) {
    if (!indices) return {};
    const auto sample = archive.sample(*indices, time);
    if (!sample) return sample.error();
    if (!*sample || (*sample)->extent() != 1) return {};
    out = **sample;
    is_indexed = true;
    return {};
}

// A list of values with `extent` numbers each, or more, of which the first count: texture
// coordinates also come as three numbers and guides as the four of a colour. Empty if there is
// none.
Result<Attribute> read_attribute(Archive& archive, const std::vector<Property>& properties,
                                 std::string_view name, std::size_t extent, double time) {
    Attribute out;
    std::vector<Property> parts;
    const Property* indices = nullptr;
    const auto values = find_values(archive, properties, name, parts, indices);
    if (!values) return values.error();
    if (!*values || is_text(**values)) return out;
    const auto sample = archive.sample(**values, time);
    if (!sample) return sample.error();
    if (!*sample) return out;
    out.values = **sample;
    if (out.values.extent() < extent) {
        // Some exporters write vectors as plain numbers, one after the other.
        if (out.values.extent() != 1 || out.values.count() % extent != 0) return Attribute();
        out.values = Sample(out.values.bytes(), (*values)->pod, static_cast<std::uint8_t>(extent));
    }
    if (auto read = read_indices(archive, indices, time, out.indices, out.is_indexed); !read)
        return read.error();
    return out;
}

Result<TextAttribute> read_text(Archive& archive, const std::vector<Property>& properties,
                                std::string_view name, double time) {
    TextAttribute out;
    std::vector<Property> parts;
    const Property* indices = nullptr;
    const auto values = find_values(archive, properties, name, parts, indices);
    if (!values) return values.error();
    if (!*values || (*values)->pod != ogawa::Pod::string) return out;
    const auto sample = archive.sample(**values, time);
    if (!sample) return sample.error();
    if (!*sample) return out;
    out.bytes = (*sample)->bytes();
    if (auto read = read_indices(archive, indices, time, out.indices, out.is_indexed); !read)
        return read.error();
    return out;
}

// Adds what a list of properties says to what is known already. Returns whether it said anything.
Result<bool> read_groom(Archive& archive, const std::vector<Property>& properties, double time,
                        GroomAttributes& out) {
    bool any = false;
    const auto take = [&](std::string_view name, std::size_t extent,
                          Attribute& attribute) -> Result<void> {
        auto read = read_attribute(archive, properties, name, extent, time);
        if (!read) return read.error();
        if (read->count() == 0) return {};
        attribute = *read;
        any = true;
        return {};
    };
    if (out.width.count() == 0)
        if (auto read = take("width", 1, out.width); !read) return read.error();
    for (auto&& read :
         {take("groom_width", 1, out.width), take("groom_root_uv", 2, out.root_uv),
          take("groom_id", 1, out.id), take("groom_group_id", 1, out.group_id),
          take("groom_guide", 1, out.guide), take("groom_closest_guides", 3, out.closest_guides),
          take("groom_guide_weights", 3, out.guide_weights)})
        if (!read) return read.error();
    const auto name = read_text(archive, properties, "groom_group_name", time);
    if (!name) return name.error();
    if (!name->bytes.empty()) {
        out.group_name = *name;
        any = true;
    }
    return any;
}

// Attributes of a geometry or a transform are in one of two lists of it.
Result<bool> read_groom_lists(Archive& archive, const std::vector<Property>& properties,
                              double time, GroomAttributes& out) {
    bool any = false;
    for (const std::string_view name : {".userProperties", ".arbGeomParams"}) {
        const Property* list = find_compound(properties, name);
        if (!list) continue;
        const auto entries = archive.properties(list->group);
        if (!entries) return entries.error();
        const auto read = read_groom(archive, *entries, time, out);
        if (!read) return read.error();
        any = any || *read;
    }
    return any;
}

// What holds for all that is below an object: single values.
void keep_constants(GroomAttributes& groom) {
    for (Attribute* attribute : {&groom.width, &groom.root_uv, &groom.id, &groom.group_id,
                                 &groom.guide, &groom.closest_guides, &groom.guide_weights})
        if (attribute->count() != 1) *attribute = {};
    if (groom.group_name.is_indexed) groom.group_name = {};
}

Result<void> check_counts(const Archive& archive, const CurvesObject& object) {
    if (object.curve_count > object.point_count)
        return archive.damaged("an object has more curves than points");
    std::int64_t sum = 0;
    for (std::size_t c = 0; c < object.curve_count; ++c) {
        const std::int64_t count = object.vertex_count.integer(c);
        if (count < 0 || count > static_cast<std::int64_t>(object.point_count) - sum)
            return archive.damaged("the curves of an object have more points than it holds (" +
                                   std::to_string(object.point_count) + ")");
        sum += count;
    }
    if (sum != static_cast<std::int64_t>(object.point_count))
        return archive.damaged("the curves of an object have " + std::to_string(sum) +
                               " points together, but it holds " +
                               std::to_string(object.point_count));
    return {};
}

// `inherited`: what the parents say of their children's strands.
Result<std::optional<CurvesObject>> read_object(Archive& archive,
                                                const std::vector<Property>& properties,
                                                const GroomAttributes& inherited, double time) {
    const Property* compound = find_compound(properties, ".geom");
    if (!compound) return std::optional<CurvesObject>();
    const auto geometry = archive.properties(compound->group);
    if (!geometry) return geometry.error();
    CurvesObject object;
    object.groom = inherited;
    const auto take = [&](std::string_view name, std::size_t extent,
                          Attribute& out) -> Result<void> {
        auto read = read_attribute(archive, *geometry, name, extent, time);
        if (!read) return read.error();
        if (read->count() > 0) out = *read;
        return {};
    };
    Attribute kinds;
    for (auto&& read : {take("P", 3, object.position), take("nVertices", 1, object.vertex_count),
                        take("curveBasisAndType", 4, kinds), take("w", 1, object.weights),
                        take(".orders", 1, object.orders), take(".knots", 1, object.knots),
                        take("width", 1, object.groom.width), take("uv", 2, object.groom.root_uv)})
        if (!read) return read.error();
    object.curve_count = object.vertex_count.count();
    object.point_count = object.position.count();
    if (object.curve_count == 0) return std::optional<CurvesObject>();
    if (kinds.count() == 0) return archive.damaged("curves without a curve type");
    object.type = small_number(kinds.number(0, 0));
    object.wrap = small_number(kinds.number(0, 1));
    object.basis = small_number(kinds.number(0, 2));
    if (auto checked = check_counts(archive, object); !checked) return checked.error();
    if (auto read = read_groom_lists(archive, *geometry, time, object.groom); !read)
        return read.error();
    return std::optional(std::move(object));
}

// An object below its parents, and what these say.
struct Visit {
    ogawa::Object object;
    std::string_view parent_name;
    std::size_t world, inherited;  // numbers in the walk's lists
    bool is_hidden = false;
};

class Walk {
  public:
    Walk(Archive& archive, double time, std::size_t memory)
        : archive_(archive), time_(time), memory_left_(memory) {}
    Result<std::deque<CurvesObject>> run();

  private:
    bool take(std::size_t bytes) {
        if (bytes > memory_left_) return false;
        memory_left_ -= bytes;
        return true;
    }
    Error too_much() const {
        return archive_.damaged("the objects of the file contain each other without end");
    }
    Result<void> enter_transform(const std::vector<Property>& properties, Visit& visit);
    Result<void> add_curves(const std::vector<Property>& properties, const Visit& visit);
    Result<std::optional<ogawa::Object>> source_of(const ogawa::Object& instance);
    Result<std::optional<ogawa::Object>> object_at(std::string_view path);

    Archive& archive_;
    double time_;
    std::size_t memory_left_;
    std::deque<CurvesObject> found_;
    std::vector<Eigen::Matrix4d> worlds_ = {Eigen::Matrix4d::Identity()};
    std::vector<GroomAttributes> inherited_ = {{}};
    std::map<std::string_view, std::optional<ogawa::Object>> sources_;  // of instances, by path
};

Result<void> Walk::enter_transform(const std::vector<Property>& properties, Visit& visit) {
    const Property* compound = find_compound(properties, ".xform");
    if (!compound) return {};
    const auto parts = archive_.properties(compound->group);
    if (!parts) return parts.error();
    bool inherits = true;
    const auto transform = read_transform(archive_, *parts, time_, inherits);
    if (!transform) return transform.error();
    // Twice: the list grows by doubling.
    if (!take(2 * sizeof(Eigen::Matrix4d))) return too_much();
    worlds_.push_back(inherits ? Eigen::Matrix4d(worlds_[visit.world] * *transform) : *transform);
    visit.world = worlds_.size() - 1;
    GroomAttributes groom = inherited_[visit.inherited];
    const auto read = read_groom_lists(archive_, *parts, time_, groom);
    if (!read) return read.error();
    if (!*read) return {};
    keep_constants(groom);
    if (!take(2 * sizeof groom)) return too_much();
    inherited_.push_back(groom);
    visit.inherited = inherited_.size() - 1;
    return {};
}

Result<void> Walk::add_curves(const std::vector<Property>& properties, const Visit& visit) {
    auto object = read_object(archive_, properties, inherited_[visit.inherited], time_);
    if (!object) return object.error();
    if (!*object) return {};
    constexpr std::size_t kNode = 32;  // of the list
    if (!take(kNode + sizeof(CurvesObject) + visit.object.name.size() + visit.parent_name.size()))
        return archive_.damaged("the file names more objects of curves than it can hold");
    (*object)->name = visit.object.name;
    (*object)->parent_name = visit.parent_name;
    (*object)->world = worlds_[visit.world];
    (*object)->is_hidden = visit.is_hidden;
    found_.push_back(std::move(**object));
    return {};
}

// The object at a path "/a/b" from the top; nothing if there is none.
Result<std::optional<ogawa::Object>> Walk::object_at(std::string_view path) {
    std::optional<ogawa::Object> found = ogawa::Object{"", "", archive_.top()};
    while (!path.empty() && found) {
        path.remove_prefix(path.front() == '/');
        const std::string_view name = path.substr(0, path.find('/'));
        path.remove_prefix(name.size());
        const auto children = archive_.children(found->group);
        if (!children) return children.error();
        found.reset();
        for (const ogawa::Object& child : *children)
            if (child.name == name) found = child;
    }
    return found;
}

// What an instance stands for, under the instance's name.
Result<std::optional<ogawa::Object>> Walk::source_of(const ogawa::Object& instance) {
    const auto properties = archive_.object_properties(instance.group);
    if (!properties) return properties.error();
    const auto text = read_text(archive_, *properties, ".instanceSource", time_);
    if (!text) return text.error();
    const std::string_view path = text->bytes.substr(0, text->bytes.find('\0'));
    auto known = sources_.find(path);
    if (known == sources_.end()) {
        constexpr std::size_t kMapNode = 64;
        auto source = object_at(path);
        if (!source) return source.error();
        if (!*source)
            return archive_.damaged("object \"" + std::string(instance.name) +
                                    "\" is an instance of \"" + std::string(path) +
                                    "\", which the file does not hold");
        if (!take(kMapNode + sizeof(std::pair<std::string_view, std::optional<ogawa::Object>>)))
            return too_much();
        known = sources_.emplace(path, *source).first;
    }
    auto object = known->second;
    if (object) object->name = instance.name;
    return object;
}

Result<std::deque<CurvesObject>> Walk::run() {
    // A stack instead of recursion: the depth is the file's to choose.
    std::deque<Visit> open = {{{"", "", archive_.top()}, "", 0, 0}};
    while (!open.empty()) {
        Visit visit = open.back();
        open.pop_back();
        memory_left_ += sizeof(Visit);
        if (visit.object.metadata.find(kInstance) != std::string_view::npos) {
            const auto source = source_of(visit.object);
            if (!source) return source.error();
            visit.object = **source;
        }
        const bool is_curves = visit.object.metadata.find(kCurveSchema) != std::string_view::npos;
        const bool is_xform = visit.object.metadata.find(kXformSchema) != std::string_view::npos;
        if (is_curves || is_xform) {
            const auto properties = archive_.object_properties(visit.object.group);
            if (!properties) return properties.error();
            // -1: as the parents, 0: hidden, 1: shown unless a parent is hidden.
            const auto visible = read_attribute(archive_, *properties, "visible", 1, time_);
            if (!visible) return visible.error();
            if (visible->count() > 0 && visible->number(0) == 0) visit.is_hidden = true;
            if (auto done =
                    is_xform ? enter_transform(*properties, visit) : add_curves(*properties, visit);
                !done)
                return done.error();
        }
        const auto children = archive_.children(visit.object.group);
        if (!children) return children.error();
        for (auto child = children->rbegin(); child != children->rend(); ++child) {
            if (!take(sizeof(Visit))) return too_much();
            open.push_back(
                {*child, visit.object.name, visit.world, visit.inherited, visit.is_hidden});
        }
    }
    return std::move(found_);
}

}  // namespace

double Attribute::number(std::size_t element, std::size_t component) const {
    if (!is_indexed) return values.number(element, component);
    const std::int64_t index = indices.integer(element);
    // The curve is left out for it.
    if (index < 0 || static_cast<std::size_t>(index) >= values.count())
        return std::numeric_limits<double>::quiet_NaN();
    return values.number(static_cast<std::size_t>(index), component);
}

std::int64_t Attribute::integer(std::size_t element) const {
    const double value = number(element);
    return value > -1e15 && value < 1e15 ? static_cast<std::int64_t>(value) : 0;
}

Result<std::deque<CurvesObject>> find_curves(Archive& archive, double time, std::size_t memory) {
    return Walk(archive, time, memory).run();
}

}  // namespace keratin::alembic
