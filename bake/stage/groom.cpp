#include "bake/stage/groom.h"

namespace keratin {
namespace {

template <class T>
std::vector<T> pick(const std::vector<T>& all, std::span<const std::uint32_t> keep) {
    std::vector<T> out;
    if (all.empty()) return out;
    out.reserve(keep.size());
    for (std::uint32_t s : keep) out.push_back(all[s]);
    return out;
}

}  // namespace

Groom select(const Groom& groom, std::span<const std::uint32_t> keep) {
    Groom out;
    out.first_point.reserve(keep.size() + 1);
    std::size_t total = 0;
    for (std::uint32_t s : keep) total += groom.point_count(s);
    out.position.reserve(total);
    for (std::uint32_t s : keep) {
        const auto points = groom.points(s);
        out.position.insert(out.position.end(), points.begin(), points.end());
        out.first_point.push_back(static_cast<std::uint32_t>(out.position.size()));
    }
    out.source = pick(groom.source, keep);
    out.curve = pick(groom.curve, keep);
    out.id = pick(groom.id, keep);
    out.group = pick(groom.group, keep);
    out.group_names = groom.group_names;
    out.even = pick(groom.even, keep);
    out.radius = pick(groom.radius, keep);
    out.root_uv = pick(groom.root_uv, keep);
    out.has_root_uv = pick(groom.has_root_uv, keep);
    out.is_guide = pick(groom.is_guide, keep);
    out.closest_guides = pick(groom.closest_guides, keep);
    out.guide_weights = pick(groom.guide_weights, keep);
    return out;
}

double polyline_length(std::span<const Vec3> points) {
    double length = 0;
    for (std::size_t p = 1; p < points.size(); ++p) length += (points[p] - points[p - 1]).norm();
    return length;
}

std::vector<double> strand_lengths(const Groom& groom) {
    std::vector<double> out(groom.strand_count());
#pragma omp parallel for schedule(static)
    for (std::size_t s = 0; s < out.size(); ++s) out[s] = polyline_length(groom.points(s));
    return out;
}

Vec3 point_at_length(std::span<const Vec3> points, double s) {
    if (s <= 0) return points.front();
    for (std::size_t p = 1; p < points.size(); ++p) {
        const double segment = (points[p] - points[p - 1]).norm();
        if (s <= segment && segment > 0) {
            return points[p - 1] + (s / segment) * (points[p] - points[p - 1]);
        }
        s -= segment;
    }
    return points.back();
}

}  // namespace keratin
