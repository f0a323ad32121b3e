#include "tests/bake/stage/shapes.h"

#include <cmath>
#include <numbers>

namespace keratin::test {

RawMesh sphere_mesh(const Vec3& centre, double radius, std::uint32_t rings) {
    RawMesh mesh;
    mesh.file = "sphere.obj";
    const std::uint32_t around = 2 * rings;
    for (std::uint32_t i = 0; i <= rings; ++i) {
        for (std::uint32_t j = 0; j <= around; ++j) {
            const double theta = std::numbers::pi * i / rings;
            const double phi = 2 * std::numbers::pi * (j % around) / around;
            mesh.position.push_back(centre + radius * Vec3(std::sin(theta) * std::cos(phi),
                                                           std::cos(theta),
                                                           std::sin(theta) * std::sin(phi)));
            mesh.uv.push_back({double(j) / around, double(i) / rings});
        }
    }
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return i * (around + 1) + j; };
    for (std::uint32_t i = 0; i < rings; ++i) {
        for (std::uint32_t j = 0; j < around; ++j) {
            if (i > 0) mesh.triangle.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            if (i + 1 < rings) {
                mesh.triangle.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
            }
        }
    }
    mesh.parts.push_back({"sphere", 0, static_cast<std::uint32_t>(mesh.triangle.size())});
    return mesh;
}

RawMesh plane_mesh(double half_size, std::uint32_t cells) {
    RawMesh mesh;
    mesh.file = "plane.obj";
    for (std::uint32_t i = 0; i <= cells; ++i) {
        for (std::uint32_t j = 0; j <= cells; ++j) {
            const double u = double(i) / cells, v = double(j) / cells;
            mesh.position.push_back({half_size * (2 * u - 1), 0, half_size * (2 * v - 1)});
            mesh.uv.push_back({u, v});
        }
    }
    for (std::uint32_t i = 0; i < cells; ++i) {
        for (std::uint32_t j = 0; j < cells; ++j) {
            const std::uint32_t a = i * (cells + 1) + j, b = a + 1, c = a + cells + 1, d = c + 1;
            mesh.triangle.push_back({a, b, c});
            mesh.triangle.push_back({b, d, c});
        }
    }
    mesh.parts.push_back({"plane", 0, static_cast<std::uint32_t>(mesh.triangle.size())});
    return mesh;
}

Groom groom_of(const std::vector<std::vector<Vec3>>& strands) {
    Groom groom;
    groom.group_names = {"default"};
    for (std::size_t s = 0; s < strands.size(); ++s) {
        groom.position.insert(groom.position.end(), strands[s].begin(), strands[s].end());
        groom.first_point.push_back(static_cast<std::uint32_t>(groom.position.size()));
        groom.source.push_back(0);
        groom.curve.push_back(static_cast<std::uint32_t>(s));
        groom.id.push_back(static_cast<std::uint32_t>(s));
        groom.group.push_back(0);
        groom.even.push_back(0);
    }
    return groom;
}

Recipe recipe_of(const std::vector<std::string>& files) {
    Recipe recipe;
    recipe.file = "groom.json";
    for (const std::string& file : files) {
        CurveSource source;
        source.file = file;
        recipe.curves.push_back(source);
    }
    return recipe;
}

Groom hairy_sphere(const Vec3& centre, double radius, std::size_t count, std::size_t points,
                   double length) {
    std::vector<std::vector<Vec3>> strands(count);
    for (std::size_t s = 0; s < count; ++s) {
        const double y = 1 - (2 * double(s) + 1) / double(count);
        const double r = std::sqrt(1 - y * y);
        const double angle = double(s) * std::numbers::pi * (3 - std::sqrt(5.0));
        const Vec3 n(r * std::cos(angle), y, r * std::sin(angle));
        for (std::size_t p = 0; p < points; ++p) {
            strands[s].push_back(centre + (radius + length * double(p) / double(points - 1)) * n);
        }
    }
    return groom_of(strands);
}

}  // namespace keratin::test
