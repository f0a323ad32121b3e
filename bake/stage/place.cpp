#include "bake/stage/place.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace keratin {
namespace {

// Beyond this a float holds positions less exactly than 6 cm.
constexpr double kLargestCoordinate = 1e6;  // m

bool usable(const Vec3& p) {
    return p.allFinite() && p.cwiseAbs().maxCoeff() <= kLargestCoordinate;
}

}  // namespace

Vec3 to_y_up(const Vec3& file, UpAxis up, Handedness hand) {
    Vec3 p = file;
    if (hand == Handedness::left) (up == UpAxis::z ? p.y() : p.z()) *= -1;
    switch (up) {
        case UpAxis::x:
            return {-p.y(), p.x(), p.z()};
        case UpAxis::z:
            return {p.x(), p.z(), -p.y()};
        case UpAxis::y:
            break;
    }
    return p;
}

double metres_per_unit(const RawGroom& groom, const Recipe& recipe, std::size_t source) {
    const bool scale_given = std::find(recipe.defaulted.begin(), recipe.defaulted.end(), "scale") ==
                             recipe.defaulted.end();
    const double base =
        groom.metres_per_unit && !scale_given ? *groom.metres_per_unit : recipe.scale;
    return base * recipe.curves[source].scale;
}

Result<void> place_curves(const Recipe& recipe, std::vector<RawGroom>& grooms, Findings& findings) {
    for (std::size_t f = 0; f < grooms.size(); ++f) {
        RawGroom& groom = grooms[f];
        const double scale = metres_per_unit(groom, recipe, f);
        if (groom.metres_per_unit && scale == *groom.metres_per_unit * recipe.curves[f].scale) {
            findings.push_back(
                {Rule::file_unit,
                 groom.file,
                 "the file's unit of " + std::to_string(*groom.metres_per_unit) + " m is used",
                 {}});
        }
        std::size_t first_bad = groom.curves.size();
#pragma omp parallel for schedule(static) reduction(min : first_bad)
        for (std::size_t c = 0; c < groom.curves.size(); ++c) {
            for (Vec3& x : groom.curves[c].points) {
                x = scale * to_y_up(x, recipe.up_axis, recipe.handedness);
                if (!usable(x)) first_bad = std::min(first_bad, c);
            }
        }
        if (first_bad < groom.curves.size()) {
            const auto& points = groom.curves[first_bad].points;
            const auto bad = std::find_if_not(points.begin(), points.end(), usable);
            return Error{ErrorCode::input,
                         groom.file + ": strand " + std::to_string(first_bad) + ", point " +
                             std::to_string(bad - points.begin()),
                         bad->allFinite() ? "the point lies more than 1000 km from the origin; "
                                            "check the recipe's scale"
                                          : "a coordinate is not a finite number"};
        }
        for (double& r : groom.radius) r *= scale;
        for (auto& radii : groom.point_radius) {
            for (double& r : radii) r *= scale;
        }
    }
    return {};
}

Result<void> place_mesh(const Recipe& recipe, RawMesh& mesh) {
    for (std::size_t v = 0; v < mesh.position.size(); ++v) {
        Vec3& x = mesh.position[v];
        x = recipe.scale * to_y_up(x, recipe.up_axis, recipe.handedness);
        if (!usable(x)) {
            return Error{ErrorCode::input, mesh.file + ": vertex " + std::to_string(v),
                         x.allFinite() ? "the vertex lies more than 1000 km from the origin; check "
                                         "the recipe's scale"
                                       : "a coordinate is not a finite number"};
        }
    }
    // In a mirror triangles wind the other way.
    if (recipe.handedness == Handedness::left) {
        for (auto& triangle : mesh.triangle) std::swap(triangle[1], triangle[2]);
    }
    return {};
}

}  // namespace keratin
