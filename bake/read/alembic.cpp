// Curves of an Alembic file: the objects of alembic_objects.h turned into strands.
#include "bake/nurbs.h"
#include "bake/read/alembic_objects.h"
#include "bake/read/formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace keratin {
namespace {

using namespace alembic;
using ogawa::Archive;

// How many values of an attribute there are for what. The counts tell; the scope that the file also
// names says nothing more. RenderMan's varying: one at each end of a piece of a curve.
enum class Scope { none, constant, curve, piece_end, point };

// Ends of the pieces of a curve.
std::size_t piece_ends(const CurvesObject& object, std::size_t point_count, std::size_t order) {
    // Less than a piece: unusable, but the counts go on.
    if (object.type == linear || point_count < order) return point_count;
    if (object.type == cubic && object.basis == bezier) return (point_count - 1) / 3 + 1;
    return point_count - order + 2;
}

// Evenly spaced knots: the curve runs inside its control polygon.
void add_uniform_knots(RawCurve& curve, std::size_t order) {
    for (std::size_t i = 0; i < curve.points.size() + order; ++i)
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

// Where the values of a curve begin in the lists of its object.
struct Place {
    std::size_t curve = 0, first_point = 0, point_count = 0, first_knot = 0, first_end = 0,
                order = 4;
};

std::size_t order_of(const CurvesObject& object, std::size_t curve) {
    // A byte a curve; cubics need none.
    return object.type == variable ? static_cast<std::size_t>(object.orders.integer(curve)) : 4;
}

Scope scope_of(const Attribute& attribute, const CurvesObject& object) {
    const std::size_t count = attribute.count();
    if (count == 0) return Scope::none;
    if (count == object.point_count) return Scope::point;
    if (count == object.curve_count) return Scope::curve;
    if (count == 1) return Scope::constant;
    std::size_t ends = 0;
    for (std::size_t c = 0; c < object.curve_count && ends < count; ++c)
        ends += piece_ends(object, object.points_of(c), order_of(object, c));
    return count == ends ? Scope::piece_end : Scope::none;
}

// The value of an attribute at a point of a curve.
double value_at(const Attribute& attribute, Scope scope, const CurvesObject& object,
                const Place& place, std::size_t point, std::size_t component) {
    switch (scope) {
        case Scope::none:
            return 0;
        case Scope::constant:
            return attribute.number(0, component);
        case Scope::curve:
            return attribute.number(place.curve, component);
        case Scope::point:
            return attribute.number(place.first_point + point, component);
        case Scope::piece_end:
            break;
    }
    // Between the ends of the pieces, at the point's share of the parameter range.
    const std::size_t ends = piece_ends(object, place.point_count, place.order);
    const auto p = static_cast<double>(point);
    const double at = object.type == linear ? p
                      : object.type == cubic && object.basis == bezier
                          ? p / 3
                          : p - 0.5 * (static_cast<double>(place.order) - 2);
    const double clamped = std::clamp(at, 0.0, static_cast<double>(ends - 1));
    const auto before = static_cast<std::size_t>(clamped);
    const std::size_t after = std::min(before + 1, ends - 1);
    const double share = clamped - static_cast<double>(before);
    return (1 - share) * attribute.number(place.first_end + before, component) +
           share * attribute.number(place.first_end + after, component);
}

Result<void> check_type(const Archive& archive, const CurvesObject& object) {
    const std::string place = "object \"" + object.name + "\": ";
    if (object.type < cubic || object.type > variable)
        return archive.damaged(place + "curve type " + std::to_string(object.type) +
                               " is not known");
    if (object.type == variable && object.orders.count() != object.curve_count)
        return archive.damaged(place + "there are " + std::to_string(object.orders.count()) +
                               " orders for " + std::to_string(object.curve_count) + " curves");
    return {};
}

// Whether every strand of the object is a guide, which needs no guides of its own.
bool is_all_guides(const CurvesObject& object) {
    const Attribute& guide = object.groom.guide;
    for (std::size_t i = 0; i < guide.count(); ++i)
        if (guide.integer(i) == 0) return false;
    return guide.count() > 0;
}

class Converter {
  public:
    Converter(Archive& archive, std::size_t file_size, const std::string& file,
              std::deque<CurvesObject> objects)
        : archive_(archive),
          objects_(std::move(objects)),
          memory_left_(kCurveMemoryPerByte * file_size + kMemoryFloor) {
        groom_.file = file;
    }
    Result<RawGroom> convert();

  private:
    // Of the object at hand.
    struct Scopes {
        Scope width, root_uv, id, group_id, guide, closest_guides, guide_weights;
    };

    bool take(std::size_t bytes) {
        if (bytes > memory_left_) return false;
        memory_left_ -= bytes;
        return true;
    }
    void remark(const std::string& text);
    void choose_channels();
    bool reserve();
    Result<void> find_knots(CurvesObject& object);
    Result<void> find_names(const CurvesObject& object);
    Result<void> add_object(CurvesObject& object);
    Result<void> add_curve(const CurvesObject& object, const Scopes& scopes, const Place& place);
    std::string shape(const CurvesObject& object, const Place& place, RawCurve& curve,
                      std::vector<double>& radius) const;
    std::uint32_t group_of(const std::string& name);
    std::uint32_t group_of(const CurvesObject& object, const Scopes& scopes, std::size_t curve);

    Archive& archive_;
    std::deque<CurvesObject> objects_;
    std::size_t memory_left_;
    RawGroom groom_;
    std::unordered_map<std::string, std::uint32_t> groups_;
    bool has_radius_ = true, has_point_radius_ = false, has_uv_ = true, has_id_ = true,
         has_guide_ = false, has_closest_ = true;
    bool knots_as_maya_ = false;        // of the object at hand: curves lack the outer two knots
    std::vector<std::uint32_t> names_;  // of the object at hand: where its group names begin
    std::size_t next_curve_ = 0;
};

void Converter::remark(const std::string& text) {
    constexpr std::size_t kRemarks = 8;
    if (groom_.remarks.size() < kRemarks) groom_.remarks.push_back(text);
}

// A channel is kept if every object has it. Guides are an exception: an object that says nothing
// has none, and a guide needs no guides.
void Converter::choose_channels() {
    struct Channel {
        const char* name;
        std::size_t objects = 0;
    };
    Channel width{"width"}, uv{"root uv"}, id{"id"}, closest{"closest guides"};
    for (const CurvesObject& object : objects_) {
        const auto scope = [&](const char* name, const Attribute& attribute) {
            const Scope found = scope_of(attribute, object);
            if (found == Scope::none && attribute.count() > 0)
                remark("object \"" + object.name + "\": " + name + " has " +
                       std::to_string(attribute.count()) + " values, which fit neither the " +
                       std::to_string(object.curve_count) + " curves nor the " +
                       std::to_string(object.point_count) + " points; they are left out");
            return found;
        };
        const GroomAttributes& groom = object.groom;
        const Scope width_scope = scope("width", groom.width);
        width.objects += width_scope != Scope::none;
        has_point_radius_ =
            has_point_radius_ || width_scope == Scope::point || width_scope == Scope::piece_end;
        uv.objects += scope("the root uv", groom.root_uv) != Scope::none;
        id.objects += scope("groom_id", groom.id) != Scope::none;
        (void)scope("groom_group_id", groom.group_id);
        has_guide_ = has_guide_ || scope("groom_guide", groom.guide) != Scope::none;
        const Scope guides = scope("groom_closest_guides", groom.closest_guides);
        const Scope weights = scope("groom_guide_weights", groom.guide_weights);
        closest.objects +=
            is_all_guides(object) || (guides == Scope::curve && weights == Scope::curve);
        if (object.weights.count() > 0 && object.weights.count() != object.point_count)
            remark("object \"" + object.name + "\": there are " +
                   std::to_string(object.weights.count()) + " weights for " +
                   std::to_string(object.point_count) + " points; they are left out");
        if (object.is_hidden)
            remark("object \"" + object.name +
                   "\" is marked hidden; its curves are baked like all");
    }
    const auto everywhere = [&](const Channel& channel) {
        if (channel.objects > 0 && channel.objects < objects_.size())
            remark(std::to_string(objects_.size() - channel.objects) + " of " +
                   std::to_string(objects_.size()) + " objects of curves have no " + channel.name +
                   ", so those of the others are left out");
        return channel.objects == objects_.size();
    };
    has_radius_ = everywhere(width);
    has_uv_ = everywhere(uv);
    has_id_ = everywhere(id);
    has_closest_ = everywhere(closest);
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

// Where the texts of an object's group names begin.
Result<void> Converter::find_names(const CurvesObject& object) {
    names_.clear();
    const std::string_view text = object.groom.group_name.bytes;
    std::size_t count = text.empty() ? 0 : 1;
    for (std::size_t i = 0; i + 1 < text.size(); ++i) count += text[i] == '\0';
    if (count == 0) return {};
    if (text.size() > std::numeric_limits<std::uint32_t>::max() ||
        !take(count * sizeof(std::uint32_t)))
        return archive_.damaged("the file names more groups than it can hold");
    names_.reserve(count);
    names_.push_back(0);
    for (std::size_t i = 0; i + 1 < text.size(); ++i)
        if (text[i] == '\0') names_.push_back(static_cast<std::uint32_t>(i + 1));
    return {};
}

std::uint32_t Converter::group_of(const CurvesObject& object, const Scopes& scopes,
                                  std::size_t curve) {
    const TextAttribute& text = object.groom.group_name;
    const auto name = [&](std::size_t i) {
        const std::string_view rest = text.bytes.substr(names_[i]);
        return std::string(rest.substr(0, rest.find('\0')));
    };
    const std::size_t name_count = text.is_indexed ? text.indices.count() : names_.size();
    if (!names_.empty() && name_count > 0 &&
        (name_count == object.curve_count || scopes.group_id != Scope::curve)) {
        std::size_t i = name_count == object.curve_count ? curve : 0;
        if (text.is_indexed) {
            const std::int64_t index = text.indices.integer(i);
            i = index < 0 ? names_.size() : static_cast<std::size_t>(index);
        }
        if (i < names_.size())
            if (std::string found = name(i); !found.empty()) return group_of(found);
    }
    if (scopes.group_id == Scope::curve || scopes.group_id == Scope::constant) {
        const auto id = object.groom.group_id.integer(scopes.group_id == Scope::curve ? curve : 0);
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
    // Without a basis and knots there is nothing to bend the polygon by, whatever the order says:
    // so Blender writes polylines.
    if (object.type == linear || (object.basis == no_basis && !has_knots)) return {};
    curve.degree = 3;
    const bool is_bspline =
        object.type == variable || object.basis == bspline || object.basis == no_basis;
    if (is_bspline) {
        curve.degree = static_cast<int>(place.order) - 1;
        if (n < place.order)
            return std::to_string(n) + " points are too few for the order " +
                   std::to_string(place.order);
        if (has_knots) {
            const std::size_t count = n + place.order - (knots_as_maya_ ? 2 : 0);
            for (std::size_t k = 0; k < count; ++k)
                curve.knots.push_back(object.knots.number(place.first_knot + k));
            if (knots_as_maya_) {
                curve.knots.insert(curve.knots.begin(), curve.knots.front());
                curve.knots.push_back(curve.knots.back());
            }
        } else {
            add_uniform_knots(curve, place.order);
        }
    } else if (object.basis == bezier) {
        if ((n - 1) % 3 != 0) return std::to_string(n) + " points do not make cubic Bezier pieces";
        add_bezier_knots(curve);
    } else if (object.basis == catmull_rom) {
        if (n < 4) return "a Catmull-Rom curve needs 4 points";
        curve.points = catmull_rom_to_bezier(curve.points);
        if (!radius.empty()) radius = catmull_rom_to_bezier(radius);
        add_bezier_knots(curve);
    } else {
        constexpr std::array<const char*, 2> kOthers = {"Hermite", "power"};
        const auto other = static_cast<std::size_t>(object.basis - catmull_rom - 1);
        return (other < kOthers.size() ? std::string("the ") + kOthers[other] + " basis"
                                       : "basis " + std::to_string(object.basis)) +
               " is not read; linear, Bezier, B-spline and Catmull-Rom are";
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

Result<void> Converter::add_curve(const CurvesObject& object, const Scopes& scopes,
                                  const Place& place) {
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
    const GroomAttributes& groom = object.groom;
    RawCurve curve;
    curve.index = next_curve_++;
    if (object.curve_count == 1) curve.name = object.name;
    curve.points.reserve(place.point_count);
    for (std::size_t p = place.first_point; p < place.first_point + place.point_count; ++p) {
        const Eigen::Vector4d local(object.position.number(p, 0), object.position.number(p, 1),
                                    object.position.number(p, 2), 1);
        curve.points.push_back((object.world * local).head<3>());
    }
    std::vector<double> radius;
    if (has_radius_ && place.point_count > 0)
        for (std::size_t p = 0; p < (has_point_radius_ ? place.point_count : 1); ++p)
            radius.push_back(0.5 * value_at(groom.width, scopes.width, object, place, p, 0));
    std::string fault = shape(object, place, curve, radius);
    Vec2 uv = Vec2::Zero();
    if (has_uv_ && fault.empty()) {
        uv = {value_at(groom.root_uv, scopes.root_uv, object, place, 0, 0),
              value_at(groom.root_uv, scopes.root_uv, object, place, 0, 1)};
        if (!uv.allFinite()) fault = "its texture coordinate is not finite";
    }
    if (!fault.empty()) {
        if (!take(2 * sizeof(CurveProblem) + fault.size()))
            return archive_.damaged("hardly any curve of the file can be used: curve " +
                                    std::to_string(curve.index) + ": " + fault);
        groom_.problems.push_back({curve.index, 0, fault});
        return {};
    }
    // Of whole numbers, which must not be blended: the first of the curve.
    const auto integer_of = [&](const Attribute& attribute, Scope scope) -> std::int64_t {
        if (scope == Scope::none) return 0;
        return attribute.integer(scope == Scope::constant ? 0
                                 : scope == Scope::curve  ? place.curve
                                 : scope == Scope::point  ? place.first_point
                                                          : place.first_end);
    };
    const auto id = static_cast<std::uint32_t>(integer_of(groom.id, scopes.id));
    groom_.curves.push_back(std::move(curve));
    groom_.group.push_back(group_of(object, scopes, place.curve));
    if (has_uv_) groom_.root_uv.push_back(uv);
    if (has_id_) groom_.id.push_back(id);
    if (has_guide_) groom_.is_guide.push_back(integer_of(groom.guide, scopes.guide) != 0);
    if (has_point_radius_)
        groom_.point_radius.push_back(std::move(radius));
    else if (has_radius_)
        groom_.radius.push_back(radius[0]);
    if (has_closest_) {
        std::array<std::uint32_t, 3> guides = {id, id, id};
        std::array<double, 3> weights = {1, 0, 0};
        if (scopes.closest_guides == Scope::curve && scopes.guide_weights == Scope::curve)
            for (std::size_t k = 0; k < 3; ++k) {
                const double guide = groom.closest_guides.number(place.curve, k);
                constexpr double kLargestId = 4294967295.0;
                // What is no number of a strand names none: the stage that uses it says so.
                guides[k] = guide >= 0 && guide <= kLargestId
                                ? static_cast<std::uint32_t>(std::lround(guide))
                                : static_cast<std::uint32_t>(kLargestId);
                weights[k] = groom.guide_weights.number(place.curve, k);
            }
        groom_.closest_guides.push_back(guides);
        groom_.guide_weights.push_back(weights);
    }
    return {};
}

// Either points + order knots a curve, or two fewer, as Maya counts them.
Result<void> Converter::find_knots(CurvesObject& object) {
    knots_as_maya_ = false;
    if (object.knots.count() == 0 || (object.type == cubic && object.basis == bezier)) return {};
    std::size_t full = object.point_count;
    for (std::size_t c = 0; c < object.curve_count; ++c) full += order_of(object, c);
    knots_as_maya_ = object.knots.count() + 2 * object.curve_count == full;
    if (object.knots.count() == full || knots_as_maya_) return {};
    const std::string counts = "object \"" + object.name + "\": there are " +
                               std::to_string(object.knots.count()) + " knots, " +
                               std::to_string(full) + " are needed";
    if (object.type == variable) return archive_.damaged(counts);
    if (object.type == cubic) remark(counts + "; they are spaced evenly instead");
    object.knots = Attribute();
    return {};
}

Result<void> Converter::add_object(CurvesObject& object) {
    if (auto found = find_knots(object); !found) return found;
    if (auto found = find_names(object); !found) return found;
    const GroomAttributes& groom = object.groom;
    const Scopes scopes{
        scope_of(groom.width, object),
        scope_of(groom.root_uv, object),
        scope_of(groom.id, object),
        scope_of(groom.group_id, object),
        scope_of(groom.guide, object),
        scope_of(groom.closest_guides, object),
        scope_of(groom.guide_weights, object),
    };
    Place place;
    for (place.curve = 0; place.curve < object.curve_count; ++place.curve) {
        place.order = order_of(object, place.curve);
        place.point_count = object.points_of(place.curve);
        if (place.order < 2 || place.order > kMaxDegree + 1)
            return archive_.damaged("object \"" + object.name + "\": curve " +
                                    std::to_string(place.curve) + " has the order " +
                                    std::to_string(place.order));
        if (auto added = add_curve(object, scopes, place); !added) return added;
        place.first_point += place.point_count;
        place.first_knot += place.point_count + place.order - (knots_as_maya_ ? 2 : 0);
        place.first_end += piece_ends(object, place.point_count, place.order);
    }
    return {};
}

// Makes room for every curve of the file, once.
bool Converter::reserve() {
    std::size_t count = 0;
    for (const CurvesObject& object : objects_) count += object.curve_count;
    const std::size_t per_curve = sizeof(RawCurve) + sizeof(std::uint32_t) +
                                  (has_uv_ ? sizeof(Vec2) : 0) +
                                  (has_id_ ? sizeof(std::uint32_t) : 0) + (has_guide_ ? 1 : 0) +
                                  (has_point_radius_ ? sizeof(std::vector<double>) : 0) +
                                  (has_radius_ && !has_point_radius_ ? sizeof(double) : 0) +
                                  (has_closest_ ? 3 * (sizeof(std::uint32_t) + sizeof(double)) : 0);
    if (count > memory_left_ / per_curve || !take(count * per_curve)) return false;
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
    return true;
}

Result<RawGroom> Converter::convert() {
    if (objects_.empty()) return archive_.damaged("the file holds no curves (AbcGeom ICurves)");
    for (const CurvesObject& object : objects_)
        if (auto sound = check_type(archive_, object); !sound) return sound.error();
    choose_channels();
    if (!reserve())
        return archive_.damaged("the objects of the file share more curves than it can hold");
    for (CurvesObject& object : objects_)
        if (auto added = add_object(object); !added) return added.error();
    return std::move(groom_);
}

}  // namespace

Result<RawGroom> read_alembic(std::string_view bytes, const std::string& file, double time) {
    auto archive = Archive::open(bytes, file);
    if (!archive) return archive.error();
    auto objects = find_curves(*archive, time, kObjectMemoryPerByte * bytes.size() + kMemoryFloor);
    if (!objects) return objects.error();
    return Converter(*archive, bytes.size(), file, std::move(*objects)).convert();
}

}  // namespace keratin
