#include "bake/nurbs.h"
#include "bake/read/read_curves.h"
#include "tests/data_dir.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>

#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

using namespace keratin;

namespace {

const std::string kFile = KERATIN_DATA_DIR "/ponytail_formats/ponytail_tail.igs";

#ifdef KERATIN_WITH_OCCT

// What the parameter section of the file says, read without OpenCASCADE: entity 126 with K, M, four
// flags, knots, weights, points, range. Columns 1-64 of the lines marked P, 8 further on the
// entity.
struct Entity {
    std::size_t degree = 0;
    std::vector<double> knots, weights;
    std::vector<std::array<double, 3>> points;
};

std::vector<Entity> read_entities() {
    std::ifstream stream(kFile);
    std::string line, text;
    while (std::getline(stream, line))
        if (line.size() >= 73 && line[72] == 'P') text += line.substr(0, 64);
    std::vector<Entity> entities;
    std::vector<double> numbers;
    for (std::size_t at = 0; at < text.size();) {
        if (text[at] == ' ') {
            ++at;
            continue;
        }
        double value = 0;
        const auto [end, error] = std::from_chars(&text[at], text.data() + text.size(), value);
        REQUIRE(error == std::errc());
        numbers.push_back(value);
        at = static_cast<std::size_t>(end - text.data());
        while (text[at] == ' ') ++at;
        if (text[at++] != ';') continue;
        REQUIRE(numbers[0] == 126);
        const auto upper = static_cast<std::size_t>(numbers[1]);
        Entity entity;
        entity.degree = static_cast<std::size_t>(numbers[2]);
        std::size_t next = 7;
        for (std::size_t i = 0; i < upper + entity.degree + 2; ++i)
            entity.knots.push_back(numbers[next++]);
        for (std::size_t i = 0; i <= upper; ++i) entity.weights.push_back(numbers[next++]);
        for (std::size_t i = 0; i <= upper; ++i, next += 3)
            entity.points.push_back({numbers[next], numbers[next + 1], numbers[next + 2]});
        entities.push_back(std::move(entity));
        numbers.clear();
    }
    return entities;
}

// De Boor's algorithm on the entity's own control points.
std::array<double, 3> de_boor(const Entity& entity, double u) {
    const std::size_t p = entity.degree, n = entity.points.size();
    std::size_t span = p;
    for (std::size_t i = p; i < n; ++i)
        if (entity.knots[i] < entity.knots[i + 1] && entity.knots[i] <= u) span = i;
    std::vector<std::array<long double, 4>> d(p + 1);
    for (std::size_t j = 0; j <= p; ++j) {
        const std::size_t i = span - p + j;
        for (std::size_t k = 0; k < 3; ++k)
            d[j][k] = static_cast<long double>(entity.weights[i]) * entity.points[i][k];
        d[j][3] = entity.weights[i];
    }
    for (std::size_t r = 1; r <= p; ++r)
        for (std::size_t j = p; j >= r; --j) {
            const long double low = entity.knots[span - p + j];
            const long double t = (u - low) / (entity.knots[span + 1 + j - r] - low);
            for (std::size_t k = 0; k < 4; ++k) d[j][k] = (1 - t) * d[j - 1][k] + t * d[j][k];
        }
    std::array<double, 3> out;
    for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<double>(d[p][k] / d[p][3]);
    return out;
}

#endif

}  // namespace

#ifdef KERATIN_WITH_OCCT

TEST_CASE("IGES curves equal a de Boor evaluation of their own control points to 1e-9") {
    const auto groom = read_curves(kFile);
    if (!groom) FAIL(to_string(groom.error()));
    CHECK(groom->problems.empty());
    CHECK(groom->metres_per_unit == 1e-3);
    const std::vector<Entity> entities = read_entities();
    REQUIRE(entities.size() == 100);
    REQUIRE(groom->curves.size() == 100);
    double largest = 0;
    for (std::size_t s = 0; s < entities.size(); ++s) {
        const RawCurve& curve = groom->curves[s];
        CHECK(curve.degree == 3);
        CHECK(curve.knots == entities[s].knots);
        const auto nurbs = NurbsCurve::make(curve.points, curve.weights, curve.knots, curve.degree);
        REQUIRE(nurbs);
        for (int i = 0; i <= 200; ++i) {
            const double u = curve.u_begin + (curve.u_end - curve.u_begin) * i / 200;
            const auto truth = de_boor(entities[s], u);
            largest =
                std::max(largest, (nurbs->position(u) - Vec3(truth[0], truth[1], truth[2])).norm());
        }
    }
    std::printf("IGES: 100 curves, largest distance from de Boor %.3g\n", largest);
    CHECK(largest <= 1e-9);
}

TEST_CASE("a file that is no IGES or STEP is refused and nothing is printed") {
    const test::TemporaryFolder folder;
    for (const char* name : {"a.igs", "a.stp"}) {
        const std::string path = folder.write(name, "this is no such file\n");
        const auto groom = read_curves(path);
        REQUIRE(!groom);
        CHECK(groom.error().code == ErrorCode::input);
    }
}

TEST_CASE("a STEP B-spline is read with its knots and points") {
    const test::TemporaryFolder folder;
    const std::string path = folder.write("a.stp", R"(ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
#1=CARTESIAN_POINT('',(0.,0.,0.));
#2=CARTESIAN_POINT('',(1.,0.,0.));
#3=CARTESIAN_POINT('',(1.,1.,0.));
#4=CARTESIAN_POINT('',(2.,1.,0.));
#5=CARTESIAN_POINT('',(3.,1.,0.5));
#6=B_SPLINE_CURVE_WITH_KNOTS('',3,(#1,#2,#3,#4,#5),.UNSPECIFIED.,.F.,.F.,(4,1,4),(0.,0.5,1.),.UNSPECIFIED.);
#7=GEOMETRIC_CURVE_SET('',(#6));
#8=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#9=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#10=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#11=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#8,#9,#10))REPRESENTATION_CONTEXT('',''));
#12=GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION('',(#7),#11);
#13=APPLICATION_CONTEXT('');
#14=PRODUCT_CONTEXT('',#13,'mechanical');
#15=PRODUCT('hair','hair','',(#14));
#16=PRODUCT_DEFINITION_FORMATION('','',#15);
#17=PRODUCT_DEFINITION_CONTEXT('part definition',#13,'design');
#18=PRODUCT_DEFINITION('','',#16,#17);
#19=PRODUCT_DEFINITION_SHAPE('','',#18);
#20=SHAPE_DEFINITION_REPRESENTATION(#19,#12);
ENDSEC;
END-ISO-10303-21;
)");
    const auto groom = read_curves(path);
    if (!groom) FAIL(to_string(groom.error()));
    REQUIRE(groom->curves.size() == 1);
    CHECK(groom->curves[0].points.size() == 5);
    CHECK(groom->curves[0].points[4] == Vec3(3, 1, 0.5));
    CHECK(groom->curves[0].knots == std::vector<double>{0, 0, 0, 0, 0.5, 1, 1, 1, 1});
}

#else

TEST_CASE("a build without OpenCASCADE says so of an IGES file") {
    const auto groom = read_curves(kFile);
    REQUIRE(!groom);
    CHECK(groom.error().code == ErrorCode::unsupported);
}

#endif
