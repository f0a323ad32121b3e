// What exporters write into Alembic files, case by case, in files put together by hand.
#include "bake/nurbs.h"
#include "bake/read/formats.h"
#include "bake/read/ogawa.h"
#include "bake/read/read_curves.h"
#include "tests/bake/read/make_alembic.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <fstream>
#include <limits>

using namespace keratin;
using namespace keratin::test;

namespace {

RawGroom read(const std::string& bytes, double time = 0) {
    auto groom = read_alembic(bytes, "a.abc", time);
    if (!groom) FAIL(to_string(groom.error()));
    return std::move(*groom);
}

std::string message_of(const std::string& bytes) {
    const auto groom = read_alembic(bytes, "a.abc", 0);
    return groom ? "no error" : to_string(groom.error());
}

bool has_remark(const RawGroom& groom, const std::string& part) {
    return std::any_of(groom.remarks.begin(), groom.remarks.end(), [&](const std::string& text) {
        return text.find(part) != std::string::npos;
    });
}

// Two curves of two points each.
CurveFile two_curves() {
    CurveFile curves;
    curves.counts = {2, 2};
    curves.x = {0, 1, 10, 11};
    return curves;
}

std::string below_top(OgawaFile& file, const std::vector<ChildObject>& children,
                      const std::string& times = "") {
    return file.finish(write_object(file, 0, children), times);
}

// One object with attributes: `add` fills the list.
template <class Add>
RawGroom with_attributes(const CurveFile& curves, Add add) {
    OgawaFile file;
    Compound attributes(file);
    add(file, attributes);
    const std::uint64_t hair =
        write_object(file, write_geometry(file, curves, attributes.write()), {});
    return read(below_top(file, {{"hair", kCurvesObject, hair}}));
}

// A list of values with indices into it.
template <class T>
std::uint64_t indexed(OgawaFile& file, std::uint32_t pod, std::uint32_t extent,
                      const std::vector<T>& values, const std::vector<std::uint32_t>& indices) {
    return Compound(file)
        .add(".vals", kArray, pod, extent, {file.sample(values)})
        .add(".indices", kArray, kU32, 1, {file.sample(indices)})
        .write();
}

std::uint64_t text_sample(OgawaFile& file, const std::vector<std::string>& texts) {
    std::string content(16, 'k');
    for (const std::string& text : texts) content += text + '\0';
    return file.data(content);
}

std::string time_sampling(double per_cycle, const std::vector<double>& times) {
    std::string out;
    append(out, std::uint32_t{16});
    append(out, per_cycle);
    append(out, static_cast<std::uint32_t>(times.size()));
    for (double time : times) append(out, time);
    return out;
}

}  // namespace

TEST_CASE("an indexed attribute is the list's value at each index") {
    const RawGroom groom = with_attributes(two_curves(), [](OgawaFile& file, Compound& list) {
        list.add("groom_root_uv", indexed<float>(file, kF32, 2, {0.1f, 0.2f, 0.3f, 0.4f}, {1, 0}))
            .add("groom_width", indexed<float>(file, kF32, 1, {2, 4}, {0, 1, 1, 0}));
    });
    CHECK(groom.root_uv == std::vector<Vec2>{{0.3f, 0.4f}, {0.1f, 0.2f}});
    CHECK(groom.point_radius == std::vector<std::vector<double>>{{1, 2}, {2, 1}});
    CHECK(groom.remarks.empty());
}

TEST_CASE("an index outside its list leaves the curve out") {
    const RawGroom groom = with_attributes(two_curves(), [](OgawaFile& file, Compound& list) {
        list.add("groom_root_uv", indexed<float>(file, kF32, 2, {0.1f, 0.2f}, {0, 7}));
    });
    CHECK(groom.curves.size() == 1);
    REQUIRE(groom.problems.size() == 1);
    CHECK(groom.problems[0].what == "its texture coordinate is not finite");
}

TEST_CASE("numbers of every type that Alembic knows are read") {
    const auto ids = [](std::uint32_t pod, auto first, auto second) {
        return with_attributes(two_curves(),
                               [&](OgawaFile& file, Compound& list) {
                                   list.add("groom_id", kArray, pod, 1,
                                            {file.sample(std::vector{first, second})});
                               })
            .id;
    };
    const std::vector<std::uint32_t> expected = {7, 120};
    CHECK(ids(kU8, std::uint8_t{7}, std::uint8_t{120}) == expected);
    CHECK(ids(kI8, std::int8_t{7}, std::int8_t{120}) == expected);
    CHECK(ids(kU16, std::uint16_t{7}, std::uint16_t{120}) == expected);
    CHECK(ids(kI16, std::int16_t{7}, std::int16_t{120}) == expected);
    CHECK(ids(kU32, std::uint32_t{7}, std::uint32_t{120}) == expected);
    CHECK(ids(kI32, std::int32_t{7}, std::int32_t{120}) == expected);
    CHECK(ids(kU64, std::uint64_t{7}, std::uint64_t{120}) == expected);
    CHECK(ids(kI64, std::int64_t{7}, std::int64_t{120}) == expected);
    CHECK(ids(kF32, 7.0f, 120.0f) == expected);
    CHECK(ids(kF64, 7.0, 120.0) == expected);
    // Half: sign, 5 bits of exponent (bias 15), 10 of mantissa: 7 = 1.75 * 2^2, 120 = 1.875 * 2^6.
    CHECK(ids(kF16, std::uint16_t{17 << 10 | 0x300}, std::uint16_t{21 << 10 | 0x380}) == expected);
}

TEST_CASE("positions may be doubles or halves") {
    OgawaFile file;
    Compound geometry(file);
    geometry.add("P", kArray, kF64, 3, {file.sample(std::vector<double>{0, 0, 0, 0.1, 0, 0})})
        .add("nVertices", kArray, kI32, 1, {file.sample(std::vector<std::int32_t>{2})})
        .add("curveBasisAndType", kScalar, kU8, 4,
             {file.sample(std::vector<std::uint8_t>{1, 0, 0, 0})});
    const std::uint64_t hair =
        write_object(file, Compound(file).add(".geom", geometry.write()).write(), {});
    CHECK(read(below_top(file, {{"hair", kCurvesObject, hair}})).curves[0].points[1].x() == 0.1);
}

TEST_CASE("vectors may come as plain numbers or with more numbers than needed") {
    const RawGroom groom = with_attributes(two_curves(), [](OgawaFile& file, Compound& list) {
        // Texture coordinates as three numbers, guides as colours, weights one after the other.
        list.add("groom_root_uv", kArray, kF32, 3,
                 {file.sample(std::vector<float>{0.1f, 0.2f, 0, 0.3f, 0.4f, 0})})
            .add("groom_id", kArray, kI32, 1, {file.sample(std::vector<std::int32_t>{5, 6})})
            .add("groom_closest_guides", kArray, kF32, 4,
                 {file.sample(std::vector<float>{5, 6, 5, 1, 6, 5, 6, 1})})
            .add("groom_guide_weights", kArray, kF32, 1,
                 {file.sample(std::vector<float>{0.5f, 0.25f, 0.25f, 1, 0, 0})});
    });
    CHECK(groom.root_uv == std::vector<Vec2>{{0.1f, 0.2f}, {0.3f, 0.4f}});
    REQUIRE(groom.closest_guides.size() == 2);
    CHECK(groom.closest_guides[0] == std::array<std::uint32_t, 3>{5, 6, 5});
    CHECK(groom.guide_weights[1] == std::array<double, 3>{1, 0, 0});
}

TEST_CASE("widths: one in all, one a curve, one a piece's end, one a point") {
    CurveFile curves;
    curves.type = 0;
    curves.basis = 1;  // Bezier: two pieces, one piece
    curves.counts = {7, 4};
    curves.x = {0, 1, 2, 3, 4, 5, 6, 0, 1, 2, 3};
    curves.width = {3, 5};
    CHECK(read(write_curves(curves)).radius == std::vector<double>{1.5, 2.5});
    curves.width = {2, 4, 8, 10, 16};  // at 0, 3 and 6; at 0 and 3
    RawGroom groom = read(write_curves(curves));
    REQUIRE(groom.point_radius.size() == 2);
    CHECK(groom.point_radius[0][0] == Approx(1));
    CHECK(groom.point_radius[0][1] == Approx(1 + 1 / 3.0));
    CHECK(groom.point_radius[0][3] == Approx(2));
    CHECK(groom.point_radius[0][6] == Approx(4));
    CHECK(groom.point_radius[1][0] == Approx(5));
    CHECK(groom.point_radius[1][3] == Approx(8));
    // Of a B-spline of 5 points the pieces meet near the points 1, 2 and 3.
    curves.basis = 2;
    curves.counts = {5};
    curves.x = {0, 1, 2, 3, 4};
    curves.width = {2, 4, 8};
    groom = read(write_curves(curves));
    CHECK(groom.point_radius[0] == std::vector<double>{1, 1, 2, 4, 4});
    curves.width = {2, 4, 8, 9};  // fits nothing
    groom = read(write_curves(curves));
    CHECK(groom.radius.empty());
    CHECK(has_remark(groom, "width has 4 values, which fit neither the 1 curves nor the 5 points"));
}

TEST_CASE("group names come one in all, one a curve, or by index") {
    const auto names = [](auto add) {
        const RawGroom groom = with_attributes(two_curves(), add);
        std::vector<std::string> out;
        for (std::uint32_t group : groom.group) out.push_back(groom.group_names[group]);
        return out;
    };
    using Names = std::vector<std::string>;
    CHECK(names([](OgawaFile& file, Compound& list) {
              list.add("groom_group_name", kScalar, kText, 1, {text_sample(file, {"fringe"})});
          }) == Names{"fringe", "fringe"});
    CHECK(
        names([](OgawaFile& file, Compound& list) {
            list.add("groom_group_name", kArray, kText, 1, {text_sample(file, {"fringe", "back"})});
        }) == Names{"fringe", "back"});
    CHECK(names([](OgawaFile& file, Compound& list) {
              list.add("groom_group_name",
                       Compound(file)
                           .add(".vals", kArray, kText, 1, {text_sample(file, {"brow", "beard"})})
                           .add(".indices", kArray, kU32, 1,
                                {file.sample(std::vector<std::uint32_t>{1, 0})})
                           .write());
          }) == Names{"beard", "brow"});
    // Ids one a curve are finer than one name in all.
    CHECK(names([](OgawaFile& file, Compound& list) {
              list.add("groom_group_name", kScalar, kText, 1, {text_sample(file, {"all"})})
                  .add("groom_group_id", kArray, kI32, 1,
                       {file.sample(std::vector<std::int32_t>{3, 4})});
          }) == Names{"group_3", "group_4"});
}

TEST_CASE("a guide that is an object of its own needs no guides") {
    OgawaFile file;
    const auto write = [&](float x, std::int32_t id, bool guide) {
        CurveFile curves;
        curves.counts = {2};
        curves.x = {x, x + 1};
        Compound list(file);
        list.add("groom_id", kArray, kI32, 1, {file.sample(std::vector{id})})
            .add("groom_guide", kArray, kI16, 1, {file.sample(std::vector<std::int16_t>{guide})});
        if (!guide)
            list.add("groom_closest_guides", kArray, kI32, 3,
                     {file.sample(std::vector<std::int32_t>{1, 2, 1})})
                .add("groom_guide_weights", kArray, kF32, 3,
                     {file.sample(std::vector<float>{0.25f, 0.75f, 0})});
        return write_object(file, write_geometry(file, curves, list.write()), {});
    };
    const std::vector<ChildObject> objects = {{"g1", kCurvesObject, write(0, 1, true)},
                                              {"g2", kCurvesObject, write(10, 2, true)},
                                              {"s", kCurvesObject, write(5, 3, false)}};
    const RawGroom groom = read(below_top(file, objects));
    CHECK(groom.is_guide == std::vector<std::uint8_t>{1, 1, 0});
    REQUIRE(groom.closest_guides.size() == 3);
    CHECK(groom.closest_guides[2] == std::array<std::uint32_t, 3>{1, 2, 1});
    CHECK(groom.closest_guides[1] == std::array<std::uint32_t, 3>{2, 2, 2});
}

TEST_CASE("what a parent says of its strands holds unless they say otherwise") {
    OgawaFile file;
    const auto hair = [&](std::uint64_t attributes) {
        return write_object(file, write_geometry(file, two_curves(), attributes), {});
    };
    const std::uint64_t plain = hair(0);
    const std::uint64_t own = hair(
        Compound(file)
            .add("groom_group_id", kScalar, kI32, 1, {file.sample(std::vector<std::int32_t>{9})})
            .write());
    const std::uint64_t list =
        Compound(file)
            .add("groom_group_id", kScalar, kI32, 1, {file.sample(std::vector<std::int32_t>{2})})
            .add("groom_guide", kArray, kU8, 1, {file.sample(std::vector<std::uint8_t>{1})})
            .add("groom_width", kScalar, kF32, 1, {file.sample(std::vector<float>{0.5f})})
            .write();
    const std::uint64_t parent = write_object(
        file,
        Compound(file).add(".xform", Compound(file).add(".userProperties", list).write()).write(),
        {{"plain", kCurvesObject, plain}, {"own", kCurvesObject, own}});
    const RawGroom groom = read(below_top(file, {{"groom", kXformObject, parent}}));
    CHECK(groom.group_names == std::vector<std::string>{"group_2", "group_9"});
    CHECK(groom.group == std::vector<std::uint32_t>{0, 0, 1, 1});
    CHECK(groom.is_guide == std::vector<std::uint8_t>{1, 1, 1, 1});
    CHECK(groom.radius == std::vector<double>{0.25, 0.25, 0.25, 0.25});
}

TEST_CASE("a channel that some objects lack is left out and named") {
    OgawaFile file;
    CurveFile with = two_curves();
    with.width = {0.1f};
    const std::uint64_t a = write_object(file, write_geometry(file, with), {});
    const std::uint64_t b = write_object(file, write_geometry(file, two_curves()), {});
    const RawGroom groom =
        read(below_top(file, {{"a", kCurvesObject, a}, {"b", kCurvesObject, b}}));
    CHECK(groom.radius.empty());
    CHECK(has_remark(groom, "1 of 2 objects of curves have no width"));
}

TEST_CASE("an instance stands for its source, where the instance is") {
    OgawaFile file;
    const std::uint64_t hair = write_object(file, write_geometry(file, two_curves()), {});
    const auto xform = [&](double x, const ChildObject& child) {
        const std::uint64_t parts =
            Compound(file)
                .add(".ops", kScalar, kU8, 1, {file.sample(std::vector<std::uint8_t>{1 << 4})})
                .add(".vals", kScalar, kF64, 3, {file.sample(std::vector<double>{x, 0, 0})})
                .write();
        return write_object(file, Compound(file).add(".xform", parts).write(), {child});
    };
    const auto instance = [&](const std::string& path) {
        return write_object(
            file,
            Compound(file)
                .add(".instanceSource", kScalar, kText, 1, {file.data(std::string(16, 'k') + path)})
                .write(),
            {});
    };
    const std::uint64_t copy = instance("/first/hair");
    const std::uint64_t first = xform(0, {"hair", kCurvesObject, hair});
    const std::uint64_t second = xform(100, {"copy", kInlineMetadata, copy, "isInstance=1"});
    const RawGroom groom =
        read(below_top(file, {{"first", kXformObject, first}, {"second", kXformObject, second}}));
    REQUIRE(groom.curves.size() == 4);
    CHECK(groom.curves[2].points[1] == Vec3(101, 0, 0));
    CHECK(groom.group_names == std::vector<std::string>{"hair", "copy"});
    // A source that is not there, and one that holds the instance.
    OgawaFile lost;
    const std::uint64_t nowhere = write_object(
        lost,
        Compound(lost)
            .add(".instanceSource", kScalar, kText, 1, {lost.data(std::string(16, 'k') + "/gone")})
            .write(),
        {});
    CHECK(message_of(below_top(lost, {{"copy", kInlineMetadata, nowhere, "isInstance=1"}})) ==
          "a.abc: object \"copy\" is an instance of \"/gone\", which the file does not hold");
    OgawaFile circle;
    const std::uint64_t around =
        write_object(circle,
                     Compound(circle)
                         .add(".instanceSource", kScalar, kText, 1,
                              {circle.data(std::string(16, 'k') + "/outer")})
                         .write(),
                     {});
    const std::uint64_t outer =
        write_object(circle, 0, {{"inner", kInlineMetadata, around, "isInstance=1"}});
    CHECK(message_of(below_top(circle, {{"outer", kPlainObject, outer}})).find("without end") !=
          std::string::npos);
}

TEST_CASE("hidden curves are baked and named") {
    OgawaFile file;
    const std::uint64_t hair = write_object(file, write_geometry(file, two_curves()), {});
    const std::uint64_t parent = write_object(
        file,
        Compound(file)
            .add("visible", kScalar, kI8, 1, {file.sample(std::vector<std::int8_t>{0})})
            .write(),
        {{"hair", kCurvesObject, hair}});
    const RawGroom groom = read(below_top(file, {{"hidden", kXformObject, parent}}));
    CHECK(groom.curves.size() == 2);
    CHECK(has_remark(groom, "object \"hair\" is marked hidden"));
}

TEST_CASE("without a basis and knots curves of any order are polylines, as Blender writes them") {
    CurveFile curves;
    curves.type = 2;
    curves.counts = {3, 2};
    curves.x = {0, 1, 2, 5, 6};
    curves.orders = {4, 4};
    const RawGroom groom = read(write_curves(curves));
    REQUIRE(groom.curves.size() == 2);
    CHECK(groom.curves[0].degree == 0);
    curves.basis = 2;  // B-splines: evenly spaced knots, if there are points enough
    const RawGroom splines = read(write_curves(curves));
    CHECK(splines.curves.empty());
    REQUIRE(splines.problems.size() == 2);
    CHECK(splines.problems[0].what == "3 points are too few for the order 4");
    curves.orders = {3, 2};
    const RawGroom lower = read(write_curves(curves));
    REQUIRE(lower.curves.size() == 2);
    CHECK(lower.curves[0].degree == 2);
    CHECK(lower.curves[0].knots == std::vector<double>{0, 1, 2, 3, 4, 5});
    CHECK(lower.curves[0].u_begin == 2);
    CHECK(lower.curves[0].u_end == 3);
    CHECK(lower.curves[1].degree == 1);
}

TEST_CASE("closed curves, odd bases and curves of too few points are named") {
    CurveFile curves;
    curves.type = 0;
    curves.basis = 2;
    curves.wrap = 1;
    curves.counts = {4};
    curves.x = {0, 1, 2, 3};
    CHECK(read(write_curves(curves)).problems.at(0).what == "it is closed; a strand has two ends");
    curves.wrap = 0;
    curves.basis = 4;
    CHECK(read(write_curves(curves)).problems.at(0).what ==
          "the Hermite basis is not read; linear, Bezier, B-spline and Catmull-Rom are");
    curves.basis = 3;
    curves.counts = {3};
    curves.x = {0, 1, 2};
    CHECK(read(write_curves(curves)).problems.at(0).what == "a Catmull-Rom curve needs 4 points");
    curves.basis = 1;
    curves.counts = {5};
    curves.x = {0, 1, 2, 3, 4};
    CHECK(read(write_curves(curves)).problems.at(0).what ==
          "5 points do not make cubic Bezier pieces");
    curves.type = 7;
    CHECK(message_of(write_curves(curves)) == "a.abc: object \"hair\": curve type 7 is not known");
}

TEST_CASE("an object without curves at this time is passed over") {
    OgawaFile file;
    CurveFile none;
    const std::uint64_t empty = write_object(file, write_geometry(file, none), {});
    const std::uint64_t hair = write_object(file, write_geometry(file, two_curves()), {});
    CHECK(read(below_top(file, {{"empty", kCurvesObject, empty}, {"hair", kCurvesObject, hair}}))
              .curves.size() == 2);
}

TEST_CASE("headers count with one, two or four bytes and may carry their own metadata") {
    for (std::uint32_t bytes : {1u, 2u, 4u}) {
        OgawaFile file;
        const HeaderStyle style{bytes, "geoScope=vtx;interpretation=point", 0};
        Compound geometry(file);
        geometry.add("P", kArray, kF32, 3, {file.sample(on_x_axis({0, 1}))}, style)
            .add("nVertices", kArray, kI32, 1, {file.sample(std::vector<std::int32_t>{2})}, style)
            .add("curveBasisAndType", kScalar, kU8, 4,
                 {file.sample(std::vector<std::uint8_t>{1, 0, 0, 0})}, style);
        const std::uint64_t hair =
            write_object(file, Compound(file).add(".geom", geometry.write(), style).write(), {});
        const RawGroom groom =
            read(below_top(file, {{"hair", kInlineMetadata, hair,
                                   "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1"}}));
        CHECK(groom.curves.at(0).points.at(1) == Vec3(1, 0, 0));
    }
}

TEST_CASE("samples are found by uniform, cyclic and acyclic times") {
    // P stands at 10 i in sample i of five.
    const auto x_at = [](const std::string& sampling, double time) {
        OgawaFile file;
        std::vector<std::uint64_t> samples;
        for (int i = 0; i < 5; ++i)
            samples.push_back(file.sample(on_x_axis({10.0f * float(i), 10.0f * float(i) + 1})));
        Compound geometry(file);
        geometry.add("P", kArray, kF32, 3, samples)
            .add("nVertices", kArray, kI32, 1, {file.sample(std::vector<std::int32_t>{2})})
            .add("curveBasisAndType", kScalar, kU8, 4,
                 {file.sample(std::vector<std::uint8_t>{1, 0, 0, 0})});
        const std::uint64_t hair =
            write_object(file, Compound(file).add(".geom", geometry.write()).write(), {});
        const std::string times = time_sampling(1, {0}) + sampling;
        return read(below_top(file, {{"hair", kCurvesObject, hair}}, times), time)
            .curves.at(0)
            .points.at(0)
            .x();
    };
    const std::string uniform = time_sampling(1 / 24.0, {1.0});
    CHECK(x_at(uniform, 0) == 0);
    CHECK(x_at(uniform, 1 + 2 / 24.0) == 20);
    CHECK(x_at(uniform, 1 + 2.4 / 24.0) == 20);
    CHECK(x_at(uniform, 9) == 40);
    // A frame is sampled as its shutter opens and closes: 0, 0.1, 1, 1.1, 2.
    const std::string cyclic = time_sampling(1, {0, 0.1});
    CHECK(x_at(cyclic, 0.08) == 10);
    CHECK(x_at(cyclic, 0.9) == 20);
    CHECK(x_at(cyclic, 1.1) == 30);
    CHECK(x_at(cyclic, 2) == 40);
    const double acyclic = std::numeric_limits<double>::max() / 32;
    const std::string listed = time_sampling(acyclic, {0, 1, 10, 11, 50});
    CHECK(x_at(listed, 4) == 10);
    CHECK(x_at(listed, 8) == 20);
    CHECK(x_at(listed, 40) == 40);
}

TEST_CASE("samples that repeat are stored once") {
    // Of six samples only 2 and 3 differ from the one before: stored are 0, 2 and 3.
    const auto x_at = [](double time) {
        OgawaFile file;
        Compound geometry(file);
        geometry
            .add_changing("P", kF32, 3, 6, 2, 3,
                          {file.sample(on_x_axis({0, 1})), file.sample(on_x_axis({20, 21})),
                           file.sample(on_x_axis({30, 31}))})
            .add("nVertices", kArray, kI32, 1, {file.sample(std::vector<std::int32_t>{2})})
            .add("curveBasisAndType", kScalar, kU8, 4,
                 {file.sample(std::vector<std::uint8_t>{1, 0, 0, 0})});
        const std::uint64_t hair =
            write_object(file, Compound(file).add(".geom", geometry.write()).write(), {});
        const std::string times = time_sampling(1, {0}) + time_sampling(1, {0});
        return read(below_top(file, {{"hair", kCurvesObject, hair}}, times), time)
            .curves.at(0)
            .points.at(0)
            .x();
    };
    const double expected[] = {0, 0, 20, 30, 30, 30};
    for (int second = 0; second < 6; ++second) CHECK(x_at(second) == expected[second]);
}

TEST_CASE("a parent that moves places its curves where it is at the time") {
    OgawaFile file;
    const std::uint64_t hair = write_object(file, write_geometry(file, two_curves()), {});
    std::vector<std::uint64_t> values;
    for (double x : {0.0, 10.0, 20.0}) values.push_back(file.sample(std::vector<double>{x, 0, 0}));
    const std::uint64_t parts =
        Compound(file)
            .add(".ops", kScalar, kU8, 1, {file.sample(std::vector<std::uint8_t>{1 << 4})})
            .add(".vals", kScalar, kF64, 3, values)
            .write();
    const std::uint64_t parent = write_object(file, Compound(file).add(".xform", parts).write(),
                                              {{"hair", kCurvesObject, hair}});
    const std::string bytes = below_top(file, {{"parent", kXformObject, parent}},
                                        time_sampling(1, {0}) + time_sampling(0.5, {0}));
    CHECK(read(bytes, 0).curves[0].points[0].x() == 0);
    CHECK(read(bytes, 0.5).curves[0].points[0].x() == 10);
    CHECK(read(bytes, 7).curves[0].points[0].x() == 20);
}

TEST_CASE("more than 255 numbers of a transform come as a list") {
    OgawaFile file;
    const std::uint64_t hair = write_object(file, write_geometry(file, two_curves()), {});
    const std::vector<std::uint8_t> ops(100, 1 << 4);
    std::vector<double> values;
    for (int i = 0; i < 100; ++i) values.insert(values.end(), {0.5, 0, 0});
    const std::uint64_t parts = Compound(file)
                                    .add(".ops", kScalar, kU8, 100, {file.sample(ops)})
                                    .add(".vals", kArray, kF64, 1, {file.sample(values)})
                                    .write();
    const std::uint64_t parent = write_object(file, Compound(file).add(".xform", parts).write(),
                                              {{"hair", kCurvesObject, hair}});
    CHECK(read(below_top(file, {{"parent", kXformObject, parent}})).curves[0].points[0].x() == 50);
}

TEST_CASE("places beyond 4 GiB are followed") {
    // The whole archive is moved behind a hole of 5 GiB, which the file system does not store.
    constexpr std::uint64_t kHole = std::uint64_t{5} << 30;
    OgawaFile file(kHole);
    const std::uint64_t hair = write_object(file, write_geometry(file, two_curves()), {});
    const std::string bytes = below_top(file, {{"hair", kCurvesObject, hair}});
    const TemporaryFolder folder;
    const std::string path = folder.file("large.abc");
    {
        std::ofstream out(path, std::ios::binary);
        out.write(bytes.data(), 16);
        out.seekp(static_cast<std::streamoff>(kHole + 16));
        out.write(bytes.data() + 16, static_cast<std::streamsize>(bytes.size() - 16));
    }
    const auto groom = read_curves(path);
    REQUIRE(groom);
    CHECK(groom->curves.at(1).points.at(1) == Vec3(11, 0, 0));
}
