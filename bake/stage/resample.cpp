#include "bake/stage/resample.h"

#include "schema/layout.h"

#include <algorithm>
#include <cmath>

namespace keratin {
namespace {

constexpr std::uint32_t kFewestForError = 3;
constexpr double kEvenShare = 1e-6;  // of the length

bool stands_evenly(std::span<const Vec3> points) {
    const double length = polyline_length(points);
    const double step = length / static_cast<double>(points.size() - 1);
    double s = 0;
    for (std::size_t p = 1; p < points.size(); ++p) {
        s += (points[p] - points[p - 1]).norm();
        if (std::abs(s - step * static_cast<double>(p)) > kEvenShare * length) return false;
    }
    return true;
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 ab = b - a;
    const double squared = ab.squaredNorm();
    const double t = squared > 0 ? std::clamp((p - a).dot(ab) / squared, 0.0, 1.0) : 0.0;
    return (p - (a + t * ab)).norm();
}

// Fewest points within max_error. The error does not fall strictly with the count, so the doubling
// search that brackets it is followed by a search for the least count in the bracket that fits and
// whose upper neighbours up to the bracket fit as well.
std::uint32_t points_for_error(std::span<const Vec3> points, double max_error, bool& missed) {
    std::vector<Vec3> trial;
    const auto fits = [&](std::uint32_t count) {
        trial.resize(count);
        resample_polyline(points, trial);
        return resampling_error(points, trial) <= max_error;
    };
    std::uint32_t low = kFewestForError;
    if (fits(low)) return low;
    std::uint32_t high = low;
    do {
        low = high;
        if (high == kBakeMaxPoints) {
            missed = true;
            return kBakeMaxPoints;
        }
        high = std::min(2 * high, kBakeMaxPoints);
    } while (!fits(high));
    while (high - low > 1) {
        const std::uint32_t middle = (low + high) / 2;
        (fits(middle) ? high : low) = middle;
    }
    return high;
}

}  // namespace

void resample_polyline(std::span<const Vec3> points, std::span<Vec3> out) {
    const double length = polyline_length(points);
    const double step = length / static_cast<double>(out.size() - 1);
    out.front() = points.front();
    std::size_t segment = 1;
    double before = 0, here = (points[1] - points[0]).norm();
    for (std::size_t p = 1; p + 1 < out.size(); ++p) {
        const double s = step * static_cast<double>(p);
        while (before + here < s && segment + 1 < points.size()) {
            before += here;
            ++segment;
            here = (points[segment] - points[segment - 1]).norm();
        }
        const double t = here > 0 ? std::clamp((s - before) / here, 0.0, 1.0) : 0.0;
        out[p] = points[segment - 1] + t * (points[segment] - points[segment - 1]);
    }
    out.back() = points.back();
}

double resampling_error(std::span<const Vec3> points, std::span<const Vec3> resampled) {
    const double length = polyline_length(points);
    if (length <= 0) return 0;
    const auto segments = static_cast<double>(resampled.size() - 1);
    double error = 0, s = 0;
    for (std::size_t p = 1; p + 1 < points.size(); ++p) {
        s += (points[p] - points[p - 1]).norm();
        const auto middle = static_cast<std::ptrdiff_t>(s / length * segments);
        double nearest = (points[p] - resampled.front()).norm();
        for (std::ptrdiff_t i = middle - 1; i <= middle + 1; ++i) {
            if (i < 0 || i + 1 >= static_cast<std::ptrdiff_t>(resampled.size())) continue;
            const auto k = static_cast<std::size_t>(i);
            nearest =
                std::min(nearest, distance_to_segment(points[p], resampled[k], resampled[k + 1]));
        }
        error = std::max(error, nearest);
    }
    return error;
}

Groom resample(Groom groom, const Recipe& recipe, Findings& findings) {
    const std::size_t n = groom.strand_count();
    std::vector<std::uint32_t> count(n, recipe.points_per_strand.value_or(kDefaultPoints));
    if (recipe.max_error) {
        std::vector<std::uint8_t> missed(n, 0);
#pragma omp parallel for schedule(dynamic, 64)
        for (std::size_t s = 0; s < n; ++s) {
            if (groom.even[s]) {
                count[s] = static_cast<std::uint32_t>(groom.point_count(s));
                continue;
            }
            bool over = false;
            count[s] = points_for_error(groom.points(s), *recipe.max_error, over);
            missed[s] = over;
        }
        std::vector<std::vector<std::uint32_t>> over(recipe.curves.size());
        for (std::size_t s = 0; s < n; ++s) {
            if (missed[s]) over[groom.source[s]].push_back(groom.curve[s]);
        }
        for (std::size_t f = 0; f < over.size(); ++f) {
            if (over[f].empty()) continue;
            std::sort(over[f].begin(), over[f].end());
            findings.push_back({Rule::error_bound, recipe.curves[f].file,
                                std::to_string(over[f].size()) +
                                    " strands have 1024 points and still miss max_error",
                                to_ranges(over[f])});
        }
    }

    std::vector<std::uint32_t> first_point(n + 1, 0);
    for (std::size_t s = 0; s < n; ++s) first_point[s + 1] = first_point[s] + count[s];
    std::vector<Vec3> position(first_point[n]);
#pragma omp parallel for schedule(static)
    for (std::size_t s = 0; s < n; ++s) {
        const auto from = groom.points(s);
        const std::span<Vec3> to(position.data() + first_point[s], count[s]);
        if (from.size() == to.size() && (groom.even[s] || stands_evenly(from))) {
            std::copy(from.begin(), from.end(), to.begin());
        } else {
            resample_polyline(from, to);
        }
    }
    groom.first_point = std::move(first_point);
    groom.position = std::move(position);
    return groom;
}

}  // namespace keratin
