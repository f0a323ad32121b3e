#include "bake/nurbs.h"
#include "bake/read/bytes.h"
#include "bake/read/formats.h"
#include "bake/read/ogawa.h"
#include "bake/read/read_curves.h"
#include "tests/bake/read/make_alembic.h"
#include "tests/data_dir.h"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <filesystem>
#include <limits>
#include <new>

using namespace keratin;
using namespace keratin::test;
namespace fs = std::filesystem;

// Counts what is allocated in this program, to hold the reader to its bound.
namespace {
std::size_t live_bytes = 0, peak_bytes = 0;
constexpr std::size_t kHeader = alignof(std::max_align_t);
}  // namespace

void* operator new(std::size_t size) {
    auto* block = static_cast<char*>(std::malloc(size + kHeader));
    if (!block) throw std::bad_alloc();
    *reinterpret_cast<std::size_t*>(block) = size;
    live_bytes += size;
    peak_bytes = std::max(peak_bytes, live_bytes);
    return block + kHeader;
}
void operator delete(void* pointer) noexcept {
    if (!pointer) return;
    auto* block = static_cast<char*>(pointer) - kHeader;
    live_bytes -= *reinterpret_cast<std::size_t*>(block);
    std::free(block);
}
void operator delete(void* pointer, std::size_t) noexcept { operator delete(pointer); }

namespace {

const std::string kData = KERATIN_DATA_DIR;

std::string message_of(const Result<RawGroom>& groom) {
    if (groom) return "no error";
    return to_string(groom.error());
}

RawGroom read(const std::string& bytes, double time = 0) {
    auto groom = read_alembic(bytes, "a.abc", time);
    if (!groom) FAIL(message_of(groom));
    return std::move(*groom);
}

Vec3 at(const RawCurve& curve, double u) {
    const auto nurbs = NurbsCurve::make(curve.points, curve.weights, curve.knots, curve.degree);
    REQUIRE(nurbs);
    return nurbs->position(u);
}

}  // namespace

// The file was written by Alembic 1.8.1 itself. Every number here is read off its bytes by hand:
//   0x008  root at 0x99d: data 0x10, 0x1c, group 0x7f5, data 0x815, 0x85a, 0x87a
//   0x85a  time samplings: 5 samples, period 1 s (f03f), 1 time, 0 s
//   0x7f5  top object: no properties, child 0x799, headers 0x7b1 (name of 0x17 letters, metadata 5)
//   0x747  headers of .geom: ".selfBnds" 0x001064b1, "P" 0x002030a2, "nVertices" 0x00001c62,
//          "curveBasisAndType" 0x00004c11, "width" 0x00301ca2, ".orders" 0x00001c12, ".knots"
TEST_CASE("curves1.abc is walked as its bytes say") {
    const auto mapped = MappedFile::open(kData + "/alembic_malformed/curves1.abc");
    REQUIRE(mapped);
    const std::string_view bytes = text_of(*mapped);
    auto archive = ogawa::Archive::open(bytes, "curves1.abc");
    REQUIRE(archive);
    CHECK(archive->top().at == 0x7f5 + 8);
    CHECK(archive->top().count == 3);
    const auto objects = archive->children(archive->top());
    REQUIRE(objects);
    REQUIRE(objects->size() == 1);
    CHECK((*objects)[0].name == "really_long_curves_name");
    CHECK((*objects)[0].name.data() == bytes.data() + 0x7b1 + 8 + 4);
    CHECK((*objects)[0].metadata.starts_with("schema=AbcGeom_Curve_v2;"));
    CHECK((*objects)[0].group.at == 0x799 + 8);
    const auto properties = archive->object_properties((*objects)[0].group);
    REQUIRE(properties);
    REQUIRE(properties->size() == 1);
    CHECK((*properties)[0].name == ".geom");
    CHECK((*properties)[0].group.at == 0x6ff + 8);
    const auto geometry = archive->properties((*properties)[0].group);
    REQUIRE(geometry);
    struct Row {
        const char* name;
        ogawa::Kind kind;
        ogawa::Pod pod;
        int extent;
        std::uint64_t group;
        std::uint32_t samples, last_changed;
        std::size_t first_data, first_size;  // behind size and key
    };
    using ogawa::Kind;
    using ogawa::Pod;
    const Row rows[] = {
        {".selfBnds", Kind::scalar, Pod::float64, 6, 0x667, 5, 4, 0x10c + 24, 48},
        {"P", Kind::array, Pod::float32, 3, 0x60f, 5, 4, 0x28 + 24, 144},
        {"nVertices", Kind::array, Pod::int32, 1, 0x5f7, 5, 0, 0xd0 + 24, 8},
        {"curveBasisAndType", Kind::scalar, Pod::uint8, 4, 0x59f, 5, 0, 0xf0 + 24, 4},
        {"width", Kind::array, Pod::float32, 1, 0x5df, 5, 0, 0x154 + 24, 48},
        {".orders", Kind::array, Pod::uint8, 1, 0x5c7, 5, 0, 0x19c + 24, 3},
        {".knots", Kind::array, Pod::float32, 1, 0x5af, 5, 0, 0x1b7 + 24, 16},
    };
    REQUIRE(geometry->size() == std::size(rows));
    for (std::size_t i = 0; i < std::size(rows); ++i) {
        const ogawa::Property& property = (*geometry)[i];
        INFO(rows[i].name);
        CHECK(property.name == rows[i].name);
        CHECK(property.kind == rows[i].kind);
        CHECK(property.pod == rows[i].pod);
        CHECK(property.extent == rows[i].extent);
        CHECK(property.group.at == rows[i].group + 8);
        CHECK(property.sample_count == rows[i].samples);
        CHECK(property.last_changed == rows[i].last_changed);
        CHECK(property.time_sampling == 0);
        const auto sample = archive->sample(property, 0);
        REQUIRE(sample);
        REQUIRE(*sample);
        CHECK((*sample)->bytes().data() == bytes.data() + rows[i].first_data);
        CHECK((*sample)->bytes().size() == rows[i].first_size);
    }
    // The samples of P at 0, 1, 2, 3 and 4 s stand at 0x28, 0x1df, 0x2cf, 0x3bf and 0x4af.
    const std::size_t data[] = {0x28, 0x1df, 0x2cf, 0x3bf, 0x4af};
    for (int second = 0; second < 5; ++second) {
        const auto sample = archive->sample((*geometry)[1], second + 0.2);
        REQUIRE(sample);
        CHECK((*sample)->bytes().data() == bytes.data() + data[second] + 24);
    }
    const auto counts = archive->sample((*geometry)[2], 3);
    CHECK((*counts)->integer(0) == 8);
    CHECK((*counts)->integer(1) == 4);
    const auto widths = archive->sample((*geometry)[4], 0);
    CHECK((*widths)->number(0) == Approx(0.2));
    CHECK((*widths)->number(7) == Approx(1.6));
    CHECK((*widths)->number(11) == 1);
}

TEST_CASE("curves1.abc gives the curve that its bytes hold and names the other") {
    // Type 0, wrap 0, basis 1, 1: Bezier, of 8 and of 4 points. Among the first are positions
    // beyond all sense (0x06c, z of point 3: d9f08945), the second starts at 0x028 + 24 + 8 * 12.
    const auto mapped = MappedFile::open(kData + "/alembic_malformed/curves1.abc");
    REQUIRE(mapped);
    const std::string_view bytes = text_of(*mapped);
    const auto groom = read_curves(kData + "/alembic_malformed/curves1.abc");
    REQUIRE(groom);
    REQUIRE(groom->problems.size() == 1);
    CHECK(groom->problems[0].curve == 0);
    CHECK(groom->problems[0].what == "point 3 is not finite or is immensely far away");
    REQUIRE(groom->curves.size() == 1);
    const RawCurve& curve = groom->curves[0];
    CHECK(curve.index == 1);
    CHECK(curve.degree == 3);
    CHECK(curve.knots == std::vector<double>{0, 0, 0, 0, 1, 1, 1, 1});
    REQUIRE(curve.points.size() == 4);
    for (std::size_t p = 0; p < 4; ++p)
        for (std::size_t axis = 0; axis < 3; ++axis)
            CHECK(curve.points[p][static_cast<Eigen::Index>(axis)] ==
                  load<float>(bytes, 0x028 + 24 + 8 * 12 + 12 * p + 4 * axis));
    CHECK(groom->point_radius == std::vector<std::vector<double>>{{0.125, 0.25, 0.375, 0.5}});
}

TEST_CASE("linear curves are polylines with their widths, one a point or one in all") {
    CurveFile curves;
    curves.counts = {2, 3};
    curves.x = {0, 1, 10, 11, 12};
    curves.width = {1, 2, 3, 4, 5};
    RawGroom groom = read(write_curves(curves));
    REQUIRE(groom.curves.size() == 2);
    CHECK(groom.curves[0].degree == 0);
    CHECK(groom.curves[1].points == std::vector<Vec3>{{10, 0, 0}, {11, 0, 0}, {12, 0, 0}});
    REQUIRE(groom.point_radius.size() == 2);
    CHECK(groom.point_radius[1] == std::vector<double>{1.5, 2, 2.5});
    CHECK(groom.radius.empty());
    CHECK(groom.group_names == std::vector<std::string>{"hair"});
    curves.width = {0.5};
    groom = read(write_curves(curves));
    CHECK(groom.radius == std::vector<double>{0.25, 0.25});
    CHECK(groom.point_radius.empty());
}

TEST_CASE("cubic bases become NURBS that pass where they should") {
    CurveFile curves;
    curves.type = 0;
    curves.counts = {7};
    curves.x = {0, 1, 2, 3, 5, 6, 8};
    curves.basis = 1;  // Bezier
    RawGroom groom = read(write_curves(curves));
    REQUIRE(groom.curves.size() == 1);
    CHECK(at(groom.curves[0], 0).x() == Approx(0).margin(1e-12));
    CHECK(at(groom.curves[0], 1).x() == Approx(3));
    CHECK(at(groom.curves[0], 1.5).x() == Approx((3 + 3 * 5 + 3 * 6 + 8) / 8.0));
    curves.basis = 2;  // B-spline without knots: from its second point's neighbourhood on
    groom = read(write_curves(curves));
    CHECK(at(groom.curves[0], groom.curves[0].u_begin).x() == Approx((0 + 4 * 1 + 2) / 6.0));
    CHECK(at(groom.curves[0], groom.curves[0].u_end).x() == Approx((5 + 4 * 6 + 8) / 6.0));
    curves.basis = 3;  // Catmull-Rom
    curves.width = {2, 4, 6, 8, 10, 12, 14};
    groom = read(write_curves(curves));
    const RawCurve& curve = groom.curves[0];
    CHECK(at(curve, curve.u_begin).x() == Approx(1));
    CHECK(at(curve, curve.u_end).x() == Approx(6));
    CHECK(at(curve, 1).x() == Approx(2));
    // Half way: (-p0 + 9 p1 + 9 p2 - p3) / 16.
    CHECK(at(curve, 0.5).x() == Approx((-0 + 9 * 1 + 9 * 2 - 3) / 16.0));
    CHECK(groom.point_radius[0].size() == curve.points.size());
    CHECK(groom.point_radius[0].front() == Approx(2));
    CHECK(groom.point_radius[0].back() == Approx(6));
}

TEST_CASE("knots come with all or, as Maya counts, without the outer two") {
    CurveFile curves;
    curves.type = 0;
    curves.basis = 2;
    curves.counts = {5, 4};
    curves.x = {0, 1, 2, 3, 4, 0, 1, 2, 3};
    curves.knots = {0, 0, 0, 0, 1, 2, 2, 2, 2, 0, 0, 0, 0, 3, 3, 3, 3};
    for (bool as_maya : {false, true}) {
        if (as_maya) curves.knots = {0, 0, 0, 1, 2, 2, 2, 0, 0, 0, 3, 3, 3};
        const RawGroom groom = read(write_curves(curves));
        REQUIRE(groom.curves.size() == 2);
        CHECK(groom.curves[0].knots == std::vector<double>{0, 0, 0, 0, 1, 2, 2, 2, 2});
        CHECK(groom.curves[1].knots == std::vector<double>{0, 0, 0, 0, 3, 3, 3, 3});
        CHECK(groom.curves[1].u_end == 3);
    }
}

TEST_CASE("curves of variable order take their orders, knots and weights") {
    CurveFile curves;
    curves.type = 2;
    curves.counts = {2, 3};
    curves.x = {0, 1, 0, 1, 2};
    curves.orders = {2, 3};
    curves.knots = {0, 0, 1, 1, 0, 0, 0, 1, 1, 1};
    curves.weights = {1, 1, 1, 2, 1};
    const RawGroom groom = read(write_curves(curves));
    REQUIRE(groom.curves.size() == 2);
    CHECK(groom.curves[0].degree == 1);
    CHECK(groom.curves[1].degree == 2);
    CHECK(groom.curves[1].weights == std::vector<double>{1, 2, 1});
    curves.knots.pop_back();
    CHECK(message_of(read_alembic(write_curves(curves), "a.abc", 0)) ==
          "a.abc: object \"hair\": there are 9 knots, 10 are needed");
    curves.orders = {2};
    CHECK(message_of(read_alembic(write_curves(curves), "a.abc", 0)) ==
          "a.abc: object \"hair\": there are 1 orders for 2 curves");
}

TEST_CASE("parents' transforms place curves: operations in order, and those not inherited") {
    const auto place = [](std::vector<std::uint8_t> ops, std::vector<double> values,
                          bool inherits) {
        OgawaFile file;
        CurveFile curves;
        curves.counts = {2};
        curves.x = {0, 1};
        const std::uint64_t hair = write_object(file, write_geometry(file, curves), {});
        const auto xform = [&](const std::vector<std::uint8_t>& codes,
                               const std::vector<double>& numbers, bool inherit) {
            const std::uint64_t parts =
                Compound(file)
                    .add(".inherits", kScalar, kU8, 1,
                         {file.sample(std::vector<std::uint8_t>{inherit})})
                    .add(".ops", kScalar, kU8, static_cast<std::uint32_t>(codes.size()),
                         {file.sample(codes)})
                    .add(".vals", kScalar, kF64, static_cast<std::uint32_t>(numbers.size()),
                         {file.sample(numbers)})
                    .write();
            return Compound(file).add(".xform", parts).write();
        };
        const std::uint64_t inner =
            write_object(file, xform(ops, values, inherits), {{"hair", kCurvesObject, hair}});
        const std::uint64_t outer = write_object(file, xform({1 << 4}, {100, 0, 0}, true),
                                                 {{"inner", kXformObject, inner}});
        return read(file.finish(write_object(file, 0, {{"outer", kXformObject, outer}}), ""));
    };
    // Move by (1, 2, 3) after turning a quarter about z after doubling.
    const RawGroom groom = place({1 << 4, 2 << 4, 0 << 4}, {1, 2, 3, 0, 0, 1, 90, 2, 2, 2}, true);
    CHECK((groom.curves[0].points[1] - Vec3(101, 4, 3)).norm() < 1e-12);
    CHECK(groom.curves[0].name == "hair");
    CHECK(groom.group_names == std::vector<std::string>{"inner"});
    const RawGroom alone = place({1 << 4}, {1, 2, 3}, false);
    CHECK((alone.curves[0].points[1] - Vec3(2, 2, 3)).norm() < 1e-12);
    // A matrix in rows, its last row the translation; a turn about y by its own operation.
    const RawGroom matrix =
        place({3 << 4, 5 << 4}, {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1, 90}, true);
    CHECK((matrix.curves[0].points[1] - Vec3(107, 8, 8)).norm() < 1e-12);
}

TEST_CASE("a moving file gives the sample nearest to the time") {
    OgawaFile file;
    Compound geometry(file);
    geometry
        .add("P", kArray, kF32, 3,
             {file.sample(on_x_axis({0, 1})), file.sample(on_x_axis({10, 11})),
              file.sample(on_x_axis({20, 21}))})
        .add("nVertices", kArray, kI32, 1, {file.sample(std::vector<std::int32_t>{2})})
        .add("curveBasisAndType", kScalar, kU8, 4,
             {file.sample(std::vector<std::uint8_t>{1, 0, 0, 0})});
    const std::uint64_t hair =
        write_object(file, Compound(file).add(".geom", geometry.write()).write(), {});
    // Sampling 0: as always; 1: every half second from 2 s on.
    std::string times;
    for (double start : {0.0, 2.0}) {
        append(times, std::uint32_t{3});
        append(times, start == 0 ? 1.0 : 0.5);
        append(times, std::uint32_t{1});
        append(times, start);
    }
    const std::string bytes =
        file.finish(write_object(file, 0, {{"hair", kCurvesObject, hair}}), times);
    CHECK(read(bytes, 0).curves[0].points[0].x() == 0);
    CHECK(read(bytes, 2.2).curves[0].points[0].x() == 0);
    CHECK(read(bytes, 2.6).curves[0].points[0].x() == 10);
    CHECK(read(bytes, 99).curves[0].points[0].x() == 20);
}

TEST_CASE("Unreal's groom attributes become channels and groups") {
    OgawaFile file;
    const auto write = [&](const std::vector<float>& x, std::vector<std::int32_t> ids,
                           std::vector<std::uint8_t> guide, std::int32_t group) {
        CurveFile curves;
        curves.counts = {2, 2};
        curves.x = x;
        Compound attributes(file);
        attributes.add("groom_id", kArray, kI32, 1, {file.sample(ids)})
            .add("groom_guide", kArray, kU8, 1, {file.sample(guide)})
            .add("groom_group_id", kArray, kI32, 1, {file.sample(std::vector{group})})
            .add("groom_root_uv", kArray, kF32, 2,
                 {file.sample(std::vector<float>{0.25f, 0.5f, 0.75f, 1.0f})});
        if (guide[0] == 0)
            attributes
                .add("groom_closest_guides", kArray, kI32, 3,
                     {file.sample(std::vector<std::int32_t>{7, 8, 7, 8, 7, 8})})
                .add("groom_guide_weights", kArray, kF32, 3,
                     {file.sample(std::vector<float>{0.5f, 0.5f, 0, 0.25f, 0.75f, 0})});
        return write_object(file, write_geometry(file, curves, attributes.write()), {});
    };
    const std::uint64_t guides = write({0, 1, 2, 3}, {7, 8}, {1}, 0);
    const std::uint64_t strands = write({4, 5, 6, 7}, {20, 21}, {0}, 4);
    const RawGroom groom = read(file.finish(
        write_object(file, 0,
                     {{"guides", kCurvesObject, guides}, {"strands", kCurvesObject, strands}}),
        ""));
    CHECK(groom.id == std::vector<std::uint32_t>{7, 8, 20, 21});
    CHECK(groom.is_guide == std::vector<std::uint8_t>{1, 1, 0, 0});
    CHECK(groom.group_names == std::vector<std::string>{"group_0", "group_4"});
    CHECK(groom.group == std::vector<std::uint32_t>{0, 0, 1, 1});
    CHECK(groom.root_uv[3] == Vec2(0.75, 1));
    REQUIRE(groom.closest_guides.size() == 4);
    CHECK(groom.closest_guides[0] == std::array<std::uint32_t, 3>{7, 7, 7});
    CHECK(groom.guide_weights[0] == std::array<double, 3>{1, 0, 0});
    CHECK(groom.closest_guides[3] == std::array<std::uint32_t, 3>{8, 7, 8});
    CHECK(groom.guide_weights[3] == std::array<double, 3>{0.25, 0.75, 0});
}

TEST_CASE("an HDF5 archive, an unfinished one and one without curves are refused by name") {
    std::string hdf5("\x89HDF\r\n\x1a\n", 8);
    hdf5.resize(600, '\0');
    CHECK(message_of(read_alembic(hdf5, "old.abc", 0)).find("HDF5") != std::string::npos);
    CurveFile curves;
    curves.counts = {2};
    curves.x = {0, 1};
    std::string bytes = write_curves(curves);
    bytes[5] = '\0';
    CHECK(message_of(read_alembic(bytes, "a.abc", 0)) ==
          "a.abc: the file was not finished by the program that wrote it");
    OgawaFile file;
    CHECK(message_of(read_alembic(file.finish(write_object(file, 0, {}), ""), "a.abc", 0)) ==
          "a.abc: the file holds no curves (AbcGeom ICurves)");
}

TEST_CASE("no cut or flipped byte of an Alembic file crashes its reader") {
    CurveFile curves;
    curves.type = 2;
    curves.counts = {2, 3};
    curves.x = {0, 1, 0, 1, 2};
    curves.orders = {2, 3};
    curves.knots = {0, 0, 1, 1, 0, 0, 0, 1, 1, 1};
    curves.width = {1, 2, 3, 4, 5};
    const std::string whole = write_curves(curves);
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK(!read_alembic(std::string_view(whole).substr(0, size), "a.abc", 0));
    std::size_t accepted = 0;
    for (std::size_t i = 0; i < whole.size(); ++i)
        for (int bit = 0; bit < 8; ++bit) {
            std::string flipped = whole;
            flipped[i] = static_cast<char>(flipped[i] ^ 1 << bit);
            accepted += static_cast<bool>(read_alembic(flipped, "a.abc", 0));
        }
    CHECK(accepted > 0);
}

TEST_CASE("malformed Alembic files take at most 16 times their size and a megabyte") {
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(kData + "/alembic_malformed")) {
        if (entry.path().extension() != ".abc") continue;
        ++files;
        INFO(entry.path().filename());
        const auto mapped = MappedFile::open(entry.path().string());
        REQUIRE(mapped);
        const std::size_t before = live_bytes;
        peak_bytes = live_bytes;
        const auto groom = read_alembic(text_of(*mapped), entry.path().string(), 0);
        const std::size_t used = peak_bytes - before;
        CHECK(used <= 16 * mapped->bytes().size() + (1 << 20));
        CHECK(!groom == !(groom && (!groom->curves.empty() || !groom->problems.empty())));
    }
    CHECK(files == 44);
}

TEST_CASE("objects that share their points cannot make a small file big") {
    OgawaFile file;
    CurveFile curves;
    curves.counts.assign(500, 2);
    curves.x.assign(1000, 1);
    const std::uint64_t object = write_object(file, write_geometry(file, curves), {});
    std::vector<ChildObject> children(3000, {"h", kCurvesObject, object});
    const std::string bytes = file.finish(write_object(file, 0, children), "");
    const std::size_t before = live_bytes;
    peak_bytes = live_bytes;
    const auto groom = read_alembic(bytes, "a.abc", 0);
    CHECK(!groom);
    CHECK(peak_bytes - before <= 16 * bytes.size() + (1 << 20));
}

TEST_CASE("objects that contain themselves cannot make a small file big") {
    // A group whose places all lead back to it, and headers of as many children without a name.
    constexpr std::uint64_t kChildren = 200;
    OgawaFile file;
    std::string headers;
    for (std::uint64_t i = 0; i < kChildren; ++i) headers.append(5, '\0');
    headers.resize(headers.size() + 32, 'h');
    const std::uint64_t data = file.data(headers);
    const std::uint64_t here = file.bytes().size();
    std::vector<std::uint64_t> places(kChildren + 1, here);
    places[0] = 0;
    places.push_back(data);
    const std::uint64_t object = file.group(places);
    REQUIRE(object == here);
    const std::string bytes = file.finish(object, "");
    const std::size_t before = live_bytes;
    peak_bytes = live_bytes;
    CHECK(!read_alembic(bytes, "a.abc", 0));
    CHECK(peak_bytes - before <= 16 * bytes.size() + (1 << 20));
}

TEST_CASE("an object a curve stays within 16 times the file and a megabyte") {
    OgawaFile file;
    std::vector<ChildObject> children;
    for (int i = 0; i < 5000; ++i) {
        CurveFile curves;
        curves.counts = {2};
        curves.x = {float(i), float(i) + 1};
        children.push_back({"c" + std::to_string(i), kCurvesObject,
                            write_object(file, write_geometry(file, curves), {})});
    }
    const std::string bytes = file.finish(write_object(file, 0, children), "");
    const std::size_t before = live_bytes;
    peak_bytes = live_bytes;
    const auto groom = read_alembic(bytes, "a.abc", 0);
    INFO(message_of(groom));
    REQUIRE(groom);
    CHECK(groom->curves.size() == 5000);
    CHECK(peak_bytes - before <= 16 * bytes.size() + (1 << 20));
}

TEST_CASE("plain strands of two points stay within 16 times the file and a megabyte") {
    CurveFile curves;
    curves.counts.assign(100000, 2);
    curves.x.assign(200000, 1);
    curves.width.assign(200000, 1);
    const std::string bytes = write_curves(curves);
    const std::size_t before = live_bytes;
    peak_bytes = live_bytes;
    const RawGroom groom = read(bytes);
    CHECK(groom.curves.size() == 100000);
    CHECK(peak_bytes - before <= 16 * bytes.size() + (1 << 20));
}
