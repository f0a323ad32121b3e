#include "bake/nurbs.h"
#include "bake/read/formats.h"
#include "bake/read/read_curves.h"
#include "tests/data_dir.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

using namespace keratin;

namespace {

const std::string kData = KERATIN_DATA_DIR;

RawGroom read(const std::string& text) {
    auto groom = read_obj_curves(text, "c.obj");
    if (!groom) FAIL(to_string(groom.error()));
    return std::move(*groom);
}

std::string message_of(const std::string& text) {
    const auto groom = read_obj_curves(text, "c.obj");
    REQUIRE(!groom);
    CHECK(groom.error().code == ErrorCode::input);
    return to_string(groom.error());
}

const std::string kPoints = "v 0 0 0 1\nv 1 0 0 2\nv 1 1 0 1\nv 2 1 0 0.5\nv 3 1 0.5 1\n";

// A cubic over the five points with these knots, on line 8 of the text.
std::string cubic(const std::string& type, const std::string& knots,
                  const std::string& points = "1 2 3 4 5", const std::string& range = "0 1") {
    return kPoints + "cstype " + type + "\ndeg 3\ncurv " + range + ' ' + points + "\nparm u " +
           knots + "\nend\n";
}

const std::string kClamped = "0 0 0 0 0.5 1 1 1 1";

// The one problem of a text whose other curve is sound.
CurveProblem problem_of(const std::string& text) {
    const RawGroom groom = read(text + "v 0 0 0\nv 0 1 0\nv 0 2 0\nl -3 -2 -1\n");
    REQUIRE(groom.curves.size() == 1);
    CHECK(groom.curves[0].index == 1);
    REQUIRE(groom.problems.size() == 1);
    CHECK(groom.problems[0].curve == 0);
    return groom.problems[0];
}

}  // namespace

TEST_CASE("Blender's curves are read as written: reversed, clamped and unclamped") {
    const auto groom = read_curves(kData + "/blender34_curv.obj");
    REQUIRE(groom);
    REQUIRE(groom->curves.size() == 2);
    const RawCurve& clamped = groom->curves[0];
    CHECK(clamped.name == "clamped_w");
    CHECK(clamped.degree == 3);
    CHECK(clamped.line == 11);
    CHECK(clamped.points.front() == Vec3(3, 1, 0.5));
    CHECK(clamped.points.back() == Vec3(0, 0, 0));
    CHECK(clamped.weights == std::vector<double>(5, 1.0));
    CHECK(clamped.u_begin == 0);
    CHECK(clamped.u_end == 1);
    // It declares 0..1, of which only this part is defined.
    const RawCurve& unclamped = groom->curves[1];
    CHECK(unclamped.name == "unclamped");
    CHECK(unclamped.u_begin == 0.375);
    CHECK(unclamped.u_end == 0.625);
    // Blender writes points + 4 knots whatever the degree, which is right for cubics alone.
    REQUIRE(groom->problems.size() == 1);
    CHECK(groom->problems[0].curve == 2);
    CHECK(groom->problems[0].what == "11 knots are too many: 7 points of degree 2 need 10");
}

TEST_CASE("the fourth number of a vertex is a weight in rational curves only") {
    CHECK(read(cubic("rat bspline", kClamped)).curves[0].weights ==
          std::vector<double>{1, 2, 1, 0.5, 1});
    CHECK(read(cubic("bspline", kClamped)).curves[0].weights == std::vector<double>(5, 1.0));
}

TEST_CASE("continued lines, comments, negative indices and several parm lines are understood") {
    const RawGroom groom = read(kPoints +
                                "g fringe left # a name\ncstype rat \\\n bspline\ndeg 3\n"
                                "curv 0 1 -5 -4 \\\n  -3 -2 5\nparm u 0 0 0 0 \\\n0.5\n"
                                "parm u 1 1 1 1\nend");
    REQUIRE(groom.curves.size() == 1);
    CHECK(groom.curves[0].name == "fringe left");
    CHECK(groom.curves[0].line == 10);
    CHECK(groom.curves[0].points.front() == Vec3(0, 0, 0));
    CHECK(groom.curves[0].points.back() == Vec3(3, 1, 0.5));
    CHECK(groom.curves[0].knots == std::vector<double>{0, 0, 0, 0, 0.5, 1, 1, 1, 1});
}

TEST_CASE("the range that a curve asks for is cut out of it") {
    const RawGroom groom = read(cubic("bspline", kClamped, "1 2 3 4 5", "0.25 7"));
    CHECK(groom.curves[0].u_begin == 0.25);
    CHECK(groom.curves[0].u_end == 1);
}

TEST_CASE("Bezier pieces become a B-spline that passes through their joints") {
    const RawGroom groom = read(
        "v 0 0 0\nv 1 0 0\nv 2 1 0\nv 3 1 0\nv 4 1 0\nv 5 2 0\nv 6 2 0\n"
        "cstype bezier\ndeg 3\ncurv 0 4 1 2 3 4 5 6 7\nparm u 0 1 4\nend\n");
    REQUIRE(groom.curves.size() == 1);
    const RawCurve& curve = groom.curves[0];
    CHECK(curve.knots == std::vector<double>{0, 0, 0, 0, 1, 1, 1, 4, 4, 4, 4});
    const auto nurbs = NurbsCurve::make(curve.points, curve.weights, curve.knots, 3);
    REQUIRE(nurbs);
    CHECK((nurbs->position(1) - Vec3(3, 1, 0)).norm() < 1e-15);
    // Half way through the second piece: de Casteljau by hand.
    CHECK((nurbs->position(2.5) - Vec3(4.5, 1.5, 0)).norm() < 1e-15);
}

TEST_CASE("a faulty curve is left out with its line and fault, the others stay") {
    struct Case {
        std::string text;
        int line;
        const char* what;
    };
    const Case cases[] = {
        {cubic("bspline", "0 0 0 0 0.5 0.4 1 1 1"), 8,
         "the knots are not sorted: they decrease at knot 5 (0.400000)"},
        {cubic("bspline", "0 0 0 0 1 1 1 1"), 8,
         "8 knots are too few: 5 points of degree 3 need 9"},
        {cubic("bspline", "0 0 0 0 nan 1 1 1 1"), 8, "knot 4 is not finite"},
        {cubic("bspline", kClamped, "1 2 3 4 6"), 8, "vertex 6 is out of range; 5 stand above it"},
        {cubic("bspline", kClamped, "1 2 3 4 0"), 8, "vertex 0 is out of range; 5 stand above it"},
        {cubic("bspline", kClamped, "1"), 8, "1 point is too few: a curve of degree 3 needs 4"},
        {cubic("bspline", kClamped, "1 2 3 4 5", "1 0"), 8,
         "its range of parameters is empty or reversed"},
        {cubic("bspline", kClamped, "1 2 3 4 5", "2 3"), 8,
         "its range of parameters lies outside of its knots"},
        {cubic("cardinal", kClamped), 8, "this type of curve is not known; bspline and bezier are"},
        {cubic("bezier", "0 1"), 8,
         "5 points do not make 1 Bezier pieces of degree 3; 4 are needed"},
        {"v 0 0 0 1\nv nan 0 0 1\nv 1 0 0 1\nv 2 0 0 1\ncstype bspline\ndeg 3\n"
         "curv 0 1 1 2 3 4\nparm u 0 0 0 0 1 1 1 1\nend\n",
         7, "its point in line 2 is not finite or is immensely far away"},
        {"v 0 0 0 1\nv 1 0 0 0\ncstype rat bspline\ndeg 1\ncurv 0 1 1 2\nparm u 0 0 1 1\nend\n", 5,
         "weight 1 is 0.000000; weights must be above 0"},
        {"v 0 0 0 1\nv 1 0 0 0\ndeg 1\ncurv 0 1 1 2\nparm u 0 0 1 1\nend\n", 4,
         "no \"cstype\" stands above it"},
        {"v 0 0 0\nl 1\n", 2, "it has fewer than 2 points"},
    };
    for (const Case& faulty : cases) {
        INFO(faulty.text);
        const CurveProblem problem = problem_of(faulty.text);
        CHECK(problem.line == faulty.line);
        CHECK(problem.what == faulty.what);
    }
}

TEST_CASE("damage to the file itself is an error with line and column") {
    CHECK(message_of(kPoints + "cstype bspline\ndeg three\n") ==
          "c.obj:7:5: \"deg\" needs a whole number");
    CHECK(message_of(kPoints + "cstype bspline\ndeg 3\ncurv 0 1 1 2 x 4\n") ==
          "c.obj:8:14: \"x\" is not the number of a vertex");
    CHECK(message_of(kPoints + "cstype bspline\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 0 0,5 1\n") ==
          "c.obj:9:12: \"0,5\" is not a number");
    CHECK(message_of(kPoints + "cstype bspline\ndeg 3\ncurv 0 1 1 2 3 4\n") ==
          "c.obj:8: the curve has no \"end\"; the file is cut");
    CHECK(message_of(kPoints + "cstype bspline\ndeg 3\ncurv 0 1 1 2 3 4\ncurv 0 1 1 2 3 4\n") ==
          "c.obj:9:1: the curve of line 8 has no \"end\" above this line");
    CHECK(message_of("v 0 0 zero\n") == "c.obj:1:7: \"zero\" is not a number");
}

TEST_CASE("polylines keep their points and objects become groups") {
    const RawGroom groom = read(
        "o fringe\nv 0 0 0\nv 0 1 0\nv 0 2 0\nl 3 2 1\no back\nl -3/1 -2/1 -1/1\ng left\n"
        "l 1 2 3 3\n");
    REQUIRE(groom.curves.size() == 3);
    CHECK(groom.group_names == std::vector<std::string>{"fringe", "back"});
    CHECK(groom.group == std::vector<std::uint32_t>{0, 1, 1});
    CHECK(groom.curves[0].points[0] == Vec3(0, 2, 0));
    CHECK(groom.curves[0].degree == 0);
    CHECK(groom.curves[1].points[0] == Vec3(0, 0, 0));
    CHECK(groom.curves[2].name == "left");
    CHECK(groom.curves[2].points.size() == 4);
}

TEST_CASE("Blender's loose segments become the strands they were") {
    const auto groom = read_curves(kData + "/blender34_particle_hair_lines.obj");
    REQUIRE(groom);
    CHECK(groom->problems.empty());
    CHECK(groom->curves.size() == 20);
    for (const RawCurve& curve : groom->curves) {
        CHECK(curve.points.size() == groom->curves[0].points.size());
        // Hair on a unit sphere: one end on it, all else outside.
        CHECK(curve.points.front().norm() < curve.points.back().norm());
        CHECK(curve.points.front().norm() == Approx(1).margin(0.1));
    }
}

TEST_CASE("the ponytail's polylines equal its TressFX strands") {
    const auto lines = read_curves(kData + "/ponytail_formats/ponytail_tail.lines.obj");
    const auto tfx = read_curves(kData + "/tressfx/tail.tfx");
    REQUIRE(lines);
    REQUIRE(tfx);
    REQUIRE(lines->curves.size() == tfx->curves.size());
    Eigen::AlignedBox3d box;
    double largest = 0;
    for (std::size_t s = 0; s < tfx->curves.size(); ++s) {
        REQUIRE(lines->curves[s].points.size() == tfx->curves[s].points.size());
        for (std::size_t p = 0; p < tfx->curves[s].points.size(); ++p) {
            box.extend(tfx->curves[s].points[p]);
            largest =
                std::max(largest, (lines->curves[s].points[p] - tfx->curves[s].points[p]).norm());
        }
    }
    CHECK(largest <= 1e-5 * box.diagonal().norm());
}
