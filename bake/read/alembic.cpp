// Curves of an Alembic file.
#include "bake/nurbs.h"
#include "bake/read/formats.h"
#include "bake/read/ogawa.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <unordered_map>

namespace keratin {
namespace {

using ogawa::Archive;
using ogawa::Property;
using ogawa::Sample;

constexpr std::string_view kCurveSchema = "schema=AbcGeom_Curve_";
constexpr std::string_view kXformSchema = "schema=AbcGeom_Xform_";

enum CurveType : int { cubic = 0, linear = 1, variable = 2 };
enum Basis : int { no_basis = 0, bezier = 1, bspline = 2, catmull_rom = 3 };

// Values of an attribute, plain or through indices into a shorter list.
struct Attribute {
    Sample values, indices;
    bool is_indexed = false;

    std::size_t count() const { return is_indexed ? indices.count() : values.count(); }
    double number(std::size_t element, std::size_t component = 0) const {
        if (!is_indexed) return values.number(element, component);
        const std::int64_t index = indices.integer(element);
        // What lies outside is no number, and the curve is left out for it.
        if (index < 0 || static_cast<std::size_t>(index) >= values.count())
            return std::numeric_limits<double>::quiet_NaN();
        return values.number(static_cast<std::size_t>(index), component);
    }
    std::int64_t integer(std::size_t element) const {
        const double value = number(element);
        return value > -1e15 && value < 1e15 ? static_cast<std::int64_t>(value) : 0;
    }
};

// One object of curves, as views into the file.
struct CurvesObject {
    std::string name, parent_name;
    Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
    int type = 0, wrap = 0, basis = 0;
    Attribute position, vertex_count, orders, knots, weights;
    std::size_t curve_count = 0, point_count = 0;
    bool knots_as_maya = false;  // each curve lacks the first and the last knot
    // Attributes with one value in all, one a curve or one a point; empty if absent.
    Attribute width, root_uv, id, group_id, guide, closest_guides, guide_weights;
    std::string group_name;
};

const Property* find(const std::vector<Property>& properties, std::string_view name) {
    for (const Property& property : properties)
        if (property.name == name) return &property;
    return nullptr;
}

// How many values of an attribute there are for what.
enum class Scope { none, constant, curve, point };

Scope scope_of(const Attribute& sample, const CurvesObject& object) {
    if (sample.count() == 0) return Scope::none;
    if (sample.count() == object.point_count) return Scope::point;
    if (sample.count() == object.curve_count) return Scope::curve;
    if (sample.count() == 1) return Scope::constant;
    return Scope::none;
}

// The transform of an object that is one, or the identity. METHODS has none of this; the operations
// are those of AbcGeom's XformOp: the last one acts on a point first.
Result<Eigen::Matrix4d> read_transform(Archive& archive, const std::vector<Property>& properties,
                                       double time, bool& inherits) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    const Property* compound = find(properties, ".xform");
    if (!compound || compound->kind != ogawa::Kind::compound) return matrix;
    const auto parts = archive.properties(compound->group);
    if (!parts) return parts.error();
    const auto sample_of = [&](std::string_view name) -> Result<std::optional<Sample>> {
        const Property* property = find(*parts, name);
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
        const auto code =
            static_cast<int>((*ops)->number(i / (*ops)->extent(), i % (*ops)->extent()));
        const int type = code >> 4;
        enum { scale, translate, rotate, whole, rotate_x, rotate_y, rotate_z };
        constexpr std::array<std::size_t, 7> kChannels = {3, 3, 4, 16, 1, 1, 1};
        if (type < 0 || type > rotate_z) return archive.damaged("a transform is damaged");
        const std::size_t channels = kChannels[static_cast<std::size_t>(type)];
        if (channels > value_count - at) return archive.damaged("a transform is cut");
        Eigen::Affine3d op = Eigen::Affine3d::Identity();
        const auto radians = [&](std::size_t k) { return value(at + k) * std::numbers::pi / 180; };
        if (type == scale) {
            op.scale(Vec3(value(at), value(at + 1), value(at + 2)));
        } else if (type == translate) {
            op.translate(Vec3(value(at), value(at + 1), value(at + 2)));
        } else if (type == rotate) {
            const Vec3 axis(value(at), value(at + 1), value(at + 2));
            if (axis.norm() > 0) op.rotate(Eigen::AngleAxisd(radians(3), axis.normalized()));
        } else if (type == whole) {
            // Rows in the file, for points that stand left of the matrix.
            for (std::size_t k = 0; k < 16; ++k)
                op.matrix()(static_cast<Eigen::Index>(k % 4), static_cast<Eigen::Index>(k / 4)) =
                    value(at + k);
        } else {
            op.rotate(Eigen::AngleAxisd(radians(0), Vec3::Unit(type - rotate_x)));
        }
        matrix = matrix * op.matrix();
        at += channels;
    }
    return matrix;
}

// A list of values with `extent` numbers each; empty if there is none of that kind.
Result<Attribute> read_attribute(Archive& archive, const std::vector<Property>& properties,
                                 std::string_view name, std::size_t extent, double time) {
    Attribute out;
    const Property* values = find(properties, name);
    if (!values) return out;
    std::vector<Property> parts;
    const Property* indices = nullptr;
    if (values->kind == ogawa::Kind::compound) {
        auto read = archive.properties(values->group);
        if (!read) return read.error();
        parts = std::move(*read);
        values = find(parts, ".vals");
        indices = find(parts, ".indices");
    }
    const auto is_text = [](const Property& property) {
        return property.pod == ogawa::Pod::string || property.pod == ogawa::Pod::wstring;
    };
    if (!values || values->kind == ogawa::Kind::compound || is_text(*values)) return out;
    const auto sample = archive.sample(*values, time);
    if (!sample) return sample.error();
    if (!*sample) return out;
    out.values = **sample;
    if (out.values.extent() != extent) {
        // Some exporters write vectors as plain numbers, one after the other.
        if (out.values.extent() != 1 || out.values.count() % extent != 0) return Attribute();
        out.values = Sample(out.values.bytes(), values->pod, static_cast<std::uint8_t>(extent));
    }
    if (!indices || indices->kind == ogawa::Kind::compound || is_text(*indices)) return out;
    const auto index_sample = archive.sample(*indices, time);
    if (!index_sample) return index_sample.error();
    if (!*index_sample || (*index_sample)->extent() != 1) return out;
    out.indices = **index_sample;
    out.is_indexed = true;
    return out;
}

std::string read_text(Archive& archive, const std::vector<Property>& properties,
                      std::string_view name) {
    const Property* property = find(properties, name);
    if (!property || property->kind == ogawa::Kind::compound || property->pod != ogawa::Pod::string)
        return {};
    const auto sample = archive.sample(*property, 0);
    if (!sample || !*sample) return {};
    const std::string_view bytes = (*sample)->bytes();
    return std::string(bytes.substr(0, bytes.find('\0')));
}

Result<std::optional<CurvesObject>> read_object(Archive& archive,
                                                const std::vector<Property>& properties,
                                                double time) {
    const Property* compound = find(properties, ".geom");
    if (!compound || compound->kind != ogawa::Kind::compound) return std::optional<CurvesObject>();
    const auto geometry = archive.properties(compound->group);
    if (!geometry) return geometry.error();
    CurvesObject object;
    const auto take = [&](std::string_view name, std::size_t extent,
                          Attribute& out) -> Result<void> {
        auto read = read_attribute(archive, *geometry, name, extent, time);
        if (!read) return read.error();
        out = *read;
        return {};
    };
    Attribute kinds;
    for (auto&& read : {take("P", 3, object.position), take("nVertices", 1, object.vertex_count),
                        take("curveBasisAndType", 4, kinds), take("w", 1, object.weights),
                        take(".orders", 1, object.orders), take(".knots", 1, object.knots),
                        take("width", 1, object.width), take("uv", 2, object.root_uv)})
        if (!read) return read.error();
    object.curve_count = object.vertex_count.count();
    object.point_count = object.position.count();
    if (object.curve_count == 0) return std::optional<CurvesObject>();
    if (kinds.count() == 0) return archive.damaged("curves without a curve type");
    object.type = static_cast<int>(kinds.number(0, 0));
    object.wrap = static_cast<int>(kinds.number(0, 1));
    object.basis = static_cast<int>(kinds.number(0, 2));
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
    const Property* attributes = find(*geometry, ".arbGeomParams");
    if (!attributes || attributes->kind != ogawa::Kind::compound) return std::optional(object);
    const auto groom = archive.properties(attributes->group);
    if (!groom) return groom.error();
    const auto take_groom = [&](std::string_view name, std::size_t extent,
                                Attribute& out) -> Result<void> {
        auto read = read_attribute(archive, *groom, name, extent, time);
        if (!read) return read.error();
        if (read->count() > 0) out = *read;
        return {};
    };
    for (auto&& read :
         {take_groom("groom_width", 1, object.width),
          take_groom("groom_root_uv", 2, object.root_uv), take_groom("groom_id", 1, object.id),
          take_groom("groom_group_id", 1, object.group_id),
          take_groom("groom_guide", 1, object.guide),
          take_groom("groom_closest_guides", 3, object.closest_guides),
          take_groom("groom_guide_weights", 3, object.guide_weights)})
        if (!read) return read.error();
    object.group_name = read_text(archive, *groom, "groom_group_name");
    return std::optional(object);
}

// The objects of curves in the order of the file, each with its place in the world.
Result<std::vector<CurvesObject>> find_objects(Archive& archive, double time,
                                               std::size_t memory_left) {
    struct Visit {
        ogawa::Object object;
        std::string_view parent_name;
        std::size_t world;  // index into worlds
    };
    std::vector<CurvesObject> found;
    std::vector<Eigen::Matrix4d> worlds = {Eigen::Matrix4d::Identity()};
    const auto take = [&](std::size_t bytes) {
        if (bytes > memory_left) return false;
        memory_left -= bytes;
        return true;
    };
    // A stack instead of recursion: the depth is the file's to choose. The objects' parents and
    // children are views into the file, so a file of any shape keeps it in proportion.
    std::deque<Visit> open = {{{"", "", archive.top()}, "", 0}};
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        std::size_t world = visit.world;
        const bool is_curves = visit.object.metadata.find(kCurveSchema) != std::string_view::npos;
        const bool is_xform = visit.object.metadata.find(kXformSchema) != std::string_view::npos;
        if (is_curves || is_xform) {
            const auto properties = archive.object_properties(visit.object.group);
            if (!properties) return properties.error();
            if (is_xform) {
                bool inherits = true;
                const auto transform = read_transform(archive, *properties, time, inherits);
                if (!transform) return transform.error();
                if (!take(2 * sizeof(Eigen::Matrix4d)))
                    return archive.damaged("the objects of the file contain each other");
                worlds.push_back(inherits ? Eigen::Matrix4d(worlds[world] * *transform)
                                          : *transform);
                world = worlds.size() - 1;
            } else {
                auto object = read_object(archive, *properties, time);
                if (!object) return object.error();
                if (*object) {
                    // Twice: the list grows by doubling.
                    if (!take(2 * sizeof(CurvesObject) + visit.object.name.size() +
                              visit.parent_name.size() + (*object)->group_name.size()))
                        return archive.damaged(
                            "the file names more objects of curves than it can hold");
                    (*object)->name = visit.object.name;
                    (*object)->parent_name = visit.parent_name;
                    (*object)->world = worlds[world];
                    found.push_back(std::move(**object));
                }
            }
        }
        const auto children = archive.children(visit.object.group);
        if (!children) return children.error();
        for (auto child = children->rbegin(); child != children->rend(); ++child)
            open.push_back({*child, visit.object.name, world});
    }
    return found;
}

// Evenly spaced knots: the curve runs inside its control polygon.
void add_uniform_knots(RawCurve& curve) {
    for (std::size_t i = 0; i < curve.points.size() + 4; ++i)
        curve.knots.push_back(static_cast<double>(i));
}

// Knots of cubic Bezier pieces end to end.
void add_bezier_knots(RawCurve& curve) {
    const std::size_t pieces = (curve.points.size() - 1) / 3;
    for (std::size_t i = 0; i <= pieces; ++i)
        curve.knots.insert(curve.knots.end(), i == 0 || i == pieces ? 4 : 3,
                           static_cast<double>(i));
}

// A Catmull-Rom curve passes from its second point to the last but one; each piece is a Bezier
// cubic whose inner points lie a sixth of the neighbours' distance away.
template <class T>
std::vector<T> catmull_rom_to_bezier(const std::vector<T>& p) {
    std::vector<T> out;
    out.reserve(3 * (p.size() - 3) + 1);
    out.push_back(p[1]);
    for (std::size_t i = 1; i + 2 < p.size(); ++i) {
        out.push_back(T(p[i] + (p[i + 1] - p[i - 1]) / 6));
        out.push_back(T(p[i + 1] - (p[i + 2] - p[i]) / 6));
        out.push_back(p[i + 1]);
    }
    return out;
}

// Of what the result may take up: objects that share their points must not make a small file big.
// Together with what is needed on the way it stays below 16 times the file and a megabyte.
constexpr std::size_t kObjectMemoryPerByte = 4, kCurveMemoryPerByte = 10;
constexpr std::size_t kMemoryFloor = 1 << 18;

class Converter {
  public:
    Converter(Archive& archive, std::size_t file_size, const std::string& file,
              std::vector<CurvesObject> objects)
        : archive_(archive),
          objects_(std::move(objects)),
          memory_left_(kCurveMemoryPerByte * file_size + kMemoryFloor) {
        groom_.file = file;
    }
    Result<RawGroom> convert();

  private:
    // A curve of an object: where its values begin in the object's lists.
    struct Place {
        std::size_t curve = 0, first_point = 0, point_count = 0, first_knot = 0, order = 4;
    };

    bool take(std::size_t bytes) {
        if (bytes > memory_left_) return false;
        memory_left_ -= bytes;
        return true;
    }
    void choose_channels();
    Result<void> add_object(CurvesObject& object);
    Result<void> add_curve(const CurvesObject& object, const Place& place);
    std::string shape(const CurvesObject& object, const Place& place, RawCurve& curve,
                      std::vector<double>& radius) const;
    std::uint32_t group_of(const std::string& name);
    std::uint32_t group_of(const CurvesObject& object, std::size_t curve);

    Archive& archive_;
    std::vector<CurvesObject> objects_;
    std::size_t memory_left_;
    RawGroom groom_;
    std::unordered_map<std::string, std::uint32_t> groups_;
    bool has_radius_ = true, has_point_radius_ = false, has_uv_ = true, has_id_ = true,
         has_guide_ = false, has_closest_ = true;
    std::size_t next_curve_ = 0;
};

// The value of an attribute that has one in all, one a curve or one a point, at a curve's root.
std::size_t element_of(Scope scope, std::size_t curve, std::size_t first_point) {
    return scope == Scope::point ? first_point : scope == Scope::curve ? curve : 0;
}

// A channel is kept if every object has it. Guides are an exception: an object that says nothing
// has none, and a guide needs no guides.
void Converter::choose_channels() {
    for (const CurvesObject& object : objects_) {
        const Scope width = scope_of(object.width, object);
        has_radius_ = has_radius_ && width != Scope::none;
        has_point_radius_ = has_point_radius_ || width == Scope::point;
        has_uv_ = has_uv_ && scope_of(object.root_uv, object) != Scope::none;
        has_id_ = has_id_ && scope_of(object.id, object) != Scope::none;
        const Scope guide = scope_of(object.guide, object);
        has_guide_ = has_guide_ || guide != Scope::none;
        const bool all_guides = guide == Scope::constant && object.guide.number(0) != 0;
        has_closest_ = has_closest_ &&
                       (all_guides || (scope_of(object.closest_guides, object) == Scope::curve &&
                                       scope_of(object.guide_weights, object) == Scope::curve));
    }
    has_point_radius_ = has_point_radius_ && has_radius_;
    has_closest_ = has_closest_ && has_id_;
}

std::uint32_t Converter::group_of(const std::string& name) {
    // Names are the file's own, one an object or one a group number: they stay in proportion.
    const auto [found, is_new] =
        groups_.try_emplace(name, static_cast<std::uint32_t>(groom_.group_names.size()));
    if (is_new) groom_.group_names.push_back(name);
    return found->second;
}

std::uint32_t Converter::group_of(const CurvesObject& object, std::size_t curve) {
    const Scope scope = scope_of(object.group_id, object);
    if (!object.group_name.empty() && scope != Scope::curve) return group_of(object.group_name);
    if (scope == Scope::curve || scope == Scope::constant) {
        const auto id = object.group_id.integer(scope == Scope::curve ? curve : 0);
        return group_of("group_" + std::to_string(id));
    }
    // Exporters that write an object a curve name the curve by it, and the groom by its parent.
    return group_of(object.curve_count == 1 && !object.parent_name.empty() ? object.parent_name
                                                                           : object.name);
}

// Turns the curve's points, filled in before, into what its type says. Returns what is wrong.
std::string Converter::shape(const CurvesObject& object, const Place& place, RawCurve& curve,
                             std::vector<double>& radius) const {
    const std::size_t n = curve.points.size();
    if (n < 2) return n == 0 ? "no points" : "one point";
    for (std::size_t p = 0; p < n; ++p)
        if (!is_usable(curve.points[p]))
            return "point " + std::to_string(p) + " is not finite or is immensely far away";
    for (double value : radius)
        if (!(std::isfinite(value) && value >= 0)) return "a width is negative or not finite";
    if (object.wrap != 0) return "it is closed; a strand has two ends";
    const bool has_knots = object.knots.count() > 0;
    if (object.type == linear || (object.type == cubic && object.basis == no_basis && !has_knots))
        return {};
    curve.degree = 3;
    const bool is_bspline =
        object.type == variable || object.basis == bspline || object.basis == no_basis;
    if (is_bspline && has_knots) {
        curve.degree = static_cast<int>(place.order) - 1;
        const std::size_t count = n + place.order - (object.knots_as_maya ? 2 : 0);
        for (std::size_t k = 0; k < count; ++k)
            curve.knots.push_back(object.knots.number(place.first_knot + k));
        if (object.knots_as_maya) {
            curve.knots.insert(curve.knots.begin(), curve.knots.front());
            curve.knots.push_back(curve.knots.back());
        }
    } else if (is_bspline) {
        if (object.type == variable) return "it has no knots";
        add_uniform_knots(curve);
    } else if (object.basis == bezier) {
        if ((n - 1) % 3 != 0) return std::to_string(n) + " points do not make cubic Bezier pieces";
        add_bezier_knots(curve);
    } else if (object.basis == catmull_rom) {
        if (n < 4) return "a Catmull-Rom curve needs 4 points";
        curve.points = catmull_rom_to_bezier(curve.points);
        if (!radius.empty()) radius = catmull_rom_to_bezier(radius);
        add_bezier_knots(curve);
    } else {
        return "basis " + std::to_string(object.basis) + " is not known";
    }
    curve.weights.assign(curve.points.size(), 1);
    if (object.weights.count() == object.point_count && curve.weights.size() == n)
        for (std::size_t p = 0; p < n; ++p)
            curve.weights[p] = object.weights.number(place.first_point + p);
    if (auto fault = find_nurbs_fault(curve.points, curve.weights, curve.knots, curve.degree))
        return *fault;
    curve.u_begin = curve.knots[static_cast<std::size_t>(curve.degree)];
    curve.u_end = curve.knots[curve.points.size()];
    return {};
}

Result<void> Converter::add_curve(const CurvesObject& object, const Place& place) {
    // Points, weights and knots, of a Catmull-Rom curve three times as many; radii.
    constexpr std::size_t kOverhead = 4 * 16;  // of the allocations
    const std::size_t grown = object.type == cubic && object.basis == catmull_rom ? 3 : 1;
    const bool is_nurbs = object.type != linear;
    const std::size_t size = kOverhead +
                             grown * place.point_count *
                                 (sizeof(Vec3) + (is_nurbs ? 2 * sizeof(double) : 0) +
                                  (has_point_radius_ ? sizeof(double) : 0)) +
                             (is_nurbs ? place.order * sizeof(double) : 0);
    if (!take(size))
        return archive_.damaged("the objects of the file share more points than it can hold");
    RawCurve curve;
    curve.index = next_curve_++;
    if (object.curve_count == 1) curve.name = object.name;
    curve.points.reserve(place.point_count);
    for (std::size_t p = place.first_point; p < place.first_point + place.point_count; ++p) {
        const Eigen::Vector4d local(object.position.number(p, 0), object.position.number(p, 1),
                                    object.position.number(p, 2), 1);
        curve.points.push_back((object.world * local).head<3>());
    }
    const Scope width = scope_of(object.width, object);
    std::vector<double> radius;
    if (has_radius_)
        for (std::size_t p = 0; p < (has_point_radius_ ? place.point_count : 1); ++p)
            radius.push_back(
                0.5 * object.width.number(element_of(width, place.curve, place.first_point + p)));
    std::string fault = shape(object, place, curve, radius);
    Vec2 uv = Vec2::Zero();
    if (has_uv_ && fault.empty()) {
        const std::size_t at =
            element_of(scope_of(object.root_uv, object), place.curve, place.first_point);
        uv = {object.root_uv.number(at, 0), object.root_uv.number(at, 1)};
        if (!uv.allFinite()) fault = "its texture coordinate is not finite";
    }
    if (!fault.empty()) {
        if (!take(2 * sizeof(CurveProblem) + fault.size()))
            return archive_.damaged("hardly any curve of the file can be used: curve " +
                                    std::to_string(curve.index) + ": " + fault);
        groom_.problems.push_back({curve.index, 0, fault});
        return {};
    }
    const auto value_of = [&](const Attribute& sample) {
        const Scope scope = scope_of(sample, object);
        return scope == Scope::none
                   ? 0
                   : sample.integer(element_of(scope, place.curve, place.first_point));
    };
    const auto id = static_cast<std::uint32_t>(value_of(object.id));
    groom_.curves.push_back(std::move(curve));
    groom_.group.push_back(group_of(object, place.curve));
    if (has_uv_) groom_.root_uv.push_back(uv);
    if (has_id_) groom_.id.push_back(id);
    if (has_guide_) groom_.is_guide.push_back(value_of(object.guide) != 0);
    if (has_point_radius_)
        groom_.point_radius.push_back(std::move(radius));
    else if (has_radius_)
        groom_.radius.push_back(radius[0]);
    if (has_closest_) {
        std::array<std::uint32_t, 3> guides = {id, id, id};
        std::array<double, 3> weights = {1, 0, 0};
        if (object.closest_guides.count() > 0)
            for (std::size_t k = 0; k < 3; ++k) {
                guides[k] =
                    static_cast<std::uint32_t>(object.closest_guides.number(place.curve, k));
                weights[k] = object.guide_weights.number(place.curve, k);
            }
        groom_.closest_guides.push_back(guides);
        groom_.guide_weights.push_back(weights);
    }
    return {};
}

Result<void> Converter::add_object(CurvesObject& object) {
    // Orders one a curve, of bytes; a cubic needs none.
    const bool has_orders = object.type == variable;
    if (has_orders && object.orders.count() != object.curve_count)
        return archive_.damaged("object \"" + object.name + "\": there are " +
                                std::to_string(object.orders.count()) + " orders for " +
                                std::to_string(object.curve_count) + " curves");
    const auto order_of = [&](std::size_t c) {
        return has_orders ? static_cast<std::size_t>(object.orders.integer(c)) : std::size_t{4};
    };
    if (object.knots.count() > 0 && (object.type == variable || object.basis != bezier)) {
        // Either points + order knots a curve, or two fewer, as Maya counts them.
        std::size_t full = object.point_count;
        for (std::size_t c = 0; c < object.curve_count; ++c) full += order_of(c);
        object.knots_as_maya = object.knots.count() + 2 * object.curve_count == full;
        if (object.knots.count() != full && !object.knots_as_maya) {
            if (object.type == variable)
                return archive_.damaged("object \"" + object.name + "\": there are " +
                                        std::to_string(object.knots.count()) + " knots, " +
                                        std::to_string(full) + " are needed");
            object.knots = Attribute();  // a cubic does without
        }
    }
    Place place;
    for (place.curve = 0; place.curve < object.curve_count; ++place.curve) {
        place.order = order_of(place.curve);
        place.point_count = static_cast<std::size_t>(object.vertex_count.integer(place.curve));
        if (place.order < 2 || place.order > kMaxDegree + 1)
            return archive_.damaged("object \"" + object.name + "\": curve " +
                                    std::to_string(place.curve) + " has the order " +
                                    std::to_string(place.order));
        if (auto added = add_curve(object, place); !added) return added;
        place.first_point += place.point_count;
        place.first_knot += place.point_count + place.order - (object.knots_as_maya ? 2 : 0);
    }
    return {};
}

Result<RawGroom> Converter::convert() {
    if (objects_.empty()) return archive_.damaged("the file holds no curves (AbcGeom ICurves)");
    choose_channels();
    std::size_t count = 0;
    for (const CurvesObject& object : objects_) count += object.curve_count;
    const std::size_t per_curve = sizeof(RawCurve) + sizeof(std::uint32_t) +
                                  (has_uv_ ? sizeof(Vec2) : 0) +
                                  (has_id_ ? sizeof(std::uint32_t) : 0) + (has_guide_ ? 1 : 0) +
                                  (has_point_radius_ ? sizeof(std::vector<double>) : 0) +
                                  (has_radius_ && !has_point_radius_ ? sizeof(double) : 0) +
                                  (has_closest_ ? 3 * (sizeof(std::uint32_t) + sizeof(double)) : 0);
    if (count > memory_left_ / per_curve || !take(count * per_curve))
        return archive_.damaged("the objects of the file share more curves than it can hold");
    groom_.curves.reserve(count);
    groom_.group.reserve(count);
    if (has_uv_) groom_.root_uv.reserve(count);
    if (has_id_) groom_.id.reserve(count);
    if (has_guide_) groom_.is_guide.reserve(count);
    if (has_point_radius_)
        groom_.point_radius.reserve(count);
    else if (has_radius_)
        groom_.radius.reserve(count);
    if (has_closest_) {
        groom_.closest_guides.reserve(count);
        groom_.guide_weights.reserve(count);
    }
    for (CurvesObject& object : objects_)
        if (auto added = add_object(object); !added) return added.error();
    return std::move(groom_);
}

}  // namespace

Result<RawGroom> read_alembic(std::string_view bytes, const std::string& file, double time) {
    auto archive = Archive::open(bytes, file);
    if (!archive) return archive.error();
    auto objects = find_objects(*archive, time, kObjectMemoryPerByte * bytes.size() + kMemoryFloor);
    if (!objects) return objects.error();
    return Converter(*archive, bytes.size(), file, std::move(*objects)).convert();
}

}  // namespace keratin
