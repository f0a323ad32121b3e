// keratin-fit: rational cubics through real strands, as OBJ free-form curves.
#include "bake/read/read_curves.h"
#include "schema/files/write_file.h"
#include "tools/keratin-fit/fit_curve.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace {

using namespace keratin;

// Nine significant digits: what the strands' own single precision holds.
void append_numbers(std::string& text, std::initializer_list<double> values) {
    char word[32];
    for (double value : values) {
        std::snprintf(word, sizeof word, " %.9g", value);
        text += word;
    }
}

void append_curve(std::string& text, const RawCurve& curve, std::size_t strand) {
    for (std::size_t j = 0; j < curve.points.size(); ++j) {
        const Vec3& point = curve.points[j];
        text += 'v';
        append_numbers(text, {point.x(), point.y(), point.z(), curve.weights[j]});
        text += '\n';
    }
    text += "g strand_" + std::to_string(strand) + "\ncurv";
    append_numbers(text, {curve.u_begin, curve.u_end});
    for (std::size_t j = curve.points.size(); j > 0; --j) text += " -" + std::to_string(j);
    text += "\nparm u";
    for (double knot : curve.knots) append_numbers(text, {knot});
    text += "\nend\n";
}

int fail(const Error& error) {
    std::fprintf(stderr, "keratin-fit: %s\n", to_string(error).c_str());
    return exit_code(error);
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app(
        "Fits a rational cubic NURBS curve to each strand of a groom and writes them as OBJ\n"
        "free-form curves. Prints how far the strands' points are from the curves.");
    app.set_version_flag("--version", KERATIN_VERSION);
    std::string input, output;
    std::size_t control_points = 8;
    std::size_t unclamped_every = 4;
    app.add_option("groom", input, "strands of points (.tfx, .obj, ...)")->required();
    app.add_option("-o,--output", output, "the OBJ file to write")->required();
    app.add_option("--control-points", control_points, "control points a curve")
        ->check(CLI::Range(kMinControlPoints, std::size_t{64}))
        ->capture_default_str();
    app.add_option("--unclamped-every", unclamped_every,
                   "every how many strands the curve is an unclamped one; 0: none")
        ->capture_default_str();
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }

    const auto groom = read_curves(input);
    if (!groom) return fail(groom.error());
    std::string text =
        "# Rational cubic NURBS fitted to strands by keratin-fit\n"
        "cstype rat bspline\ndeg 3\n";
    double sum = 0, largest = 0, lengths = 0;
    std::size_t curves = 0, points = 0, unclamped = 0;
    for (const RawCurve& strand : groom->curves) {
        double length = 0;
        for (std::size_t i = 1; i < strand.points.size(); ++i)
            length += (strand.points[i] - strand.points[i - 1]).norm();
        if (strand.degree > 0 || length == 0) {
            std::fprintf(stderr, "keratin-fit: %s: strand %zu is %s and is left out\n",
                         input.c_str(), strand.index,
                         strand.degree > 0 ? "a curve already" : "of no length");
            continue;
        }
        const bool is_unclamped =
            unclamped_every > 0 && strand.index % unclamped_every == unclamped_every - 1;
        const CurveFit fit = fit_rational_cubic(
            strand.points, control_points, is_unclamped ? KnotEnds::unclamped : KnotEnds::clamped);
        append_curve(text, fit.curve, strand.index);
        sum += fit.rms_error * fit.rms_error * static_cast<double>(strand.points.size());
        largest = std::max(largest, fit.max_error);
        lengths += length;
        points += strand.points.size();
        unclamped += is_unclamped;
        ++curves;
    }
    if (curves == 0)
        return fail({ErrorCode::input, input, "the file holds no strand that can be fitted"});
    if (auto written = write_file(output, text); !written) return fail(written.error());
    const double mean_length = lengths / static_cast<double>(curves);
    const double rms = std::sqrt(sum / static_cast<double>(points));
    std::printf(
        "%zu curves, %zu of them unclamped, mean length %.4g\n"
        "distance of the strands' points: rms %.3g (%.2g %% of the mean length), "
        "largest %.3g (%.2g %%)\n",
        curves, unclamped, mean_length, rms, 100 * rms / mean_length, largest,
        100 * largest / mean_length);
    return 0;
}
