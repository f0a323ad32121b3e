// The groom between the stages: the strands of all curve files one after another as flat
// polylines, double precision. After stage/place everything is in metres, y up.
#pragma once

#include "bake/raw_groom.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace keratin {

// Arrays marked (optional) are empty or have one entry a strand.
struct Groom {
    std::vector<std::uint32_t> first_point{0};  // [strand_count + 1]
    std::vector<Vec3> position;                 // m, root first once stage/root_end has run
    std::vector<std::uint32_t> source;          // curve file, index into Recipe::curves
    std::vector<std::uint32_t> curve;           // number of the curve in its file
    std::vector<std::uint32_t> id;              // unique: counted through all files, or authored
    std::vector<std::uint32_t> group;           // index into group_names
    std::vector<std::string> group_names;
    std::vector<std::uint8_t> even;  // 1: the points already stand at equal arc length of the curve

    std::vector<std::array<double, 2>>
        radius;                 // (optional) m, at the first and last point; 0: the group's
    std::vector<Vec2> root_uv;  // (optional)
    std::vector<std::uint8_t> has_root_uv;  // (optional) 1 where root_uv is the file's
    std::vector<std::uint8_t> is_guide;     // (optional) authored guides
    std::vector<std::array<std::uint32_t, 3>> closest_guides;  // (optional) authored,
                                                               // as ids; kNoStrand: none
    std::vector<std::array<double, 3>> guide_weights;          // (optional) authored

    std::size_t strand_count() const { return first_point.size() - 1; }
    std::size_t point_count(std::size_t s) const { return first_point[s + 1] - first_point[s]; }
    std::span<const Vec3> points(std::size_t s) const {
        return {position.data() + first_point[s], point_count(s)};
    }
    std::span<Vec3> points(std::size_t s) {
        return {position.data() + first_point[s], point_count(s)};
    }
};

// The strands named by `keep` (ascending or not), in that order.
Groom select(const Groom& groom, std::span<const std::uint32_t> keep);

// Sum of the segment lengths of a polyline.
double polyline_length(std::span<const Vec3> points);

// polyline_length of each strand.
std::vector<double> strand_lengths(const Groom& groom);

// The point at arc length `s` from the first point, on the polyline; s is clamped to its ends.
Vec3 point_at_length(std::span<const Vec3> points, double s);

}  // namespace keratin
