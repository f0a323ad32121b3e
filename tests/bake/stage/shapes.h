// Small meshes and grooms for the tests of the bake's stages.
#pragma once

#include "bake/stage/groom.h"
#include "schema/read/recipe.h"

#include <string>
#include <vector>

namespace keratin::test {

// A closed sphere of latitude-longitude triangles, normals outward, with texture coordinates.
RawMesh sphere_mesh(const Vec3& centre, double radius, std::uint32_t rings);

// A flat square in the plane y = 0, normals up, cells x cells pairs of triangles.
RawMesh plane_mesh(double half_size, std::uint32_t cells);

// A groom of the given polylines, all of one file and one group "default".
Groom groom_of(const std::vector<std::vector<Vec3>>& strands);

// A recipe with one curve file for each name.
Recipe recipe_of(const std::vector<std::string>& files = {"hair.tfx"});

// `count` straight strands of `points` points and the given length, normal to a sphere, at places
// spread evenly over it.
Groom hairy_sphere(const Vec3& centre, double radius, std::size_t count, std::size_t points,
                   double length);

}  // namespace keratin::test
