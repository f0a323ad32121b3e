#!/usr/bin/env python3
"""Grows brows and a beard on the ICT head: brows.data and beard.data beside this file.

    data/ict/grow_hair.py            writes them
    data/ict/grow_hair.py --check    exits 1 when a file is not what would be written

Roots stand on triangles of the neutral face. The brows lie on a band over each eye; the beard where
opening the jaw moves the skin, and on the upper lip. Lengths in cm, as the head's. The files are USC
strands: the number of strands, then for each its number of points and x y z as floats.
"""

import math
import pathlib
import random
import struct
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
POINTS = 6
BROW_STRANDS, BEARD_STRANDS = 160, 900  # a brow; the beard


def read(name):
    """Vertices, and triangles by material."""
    vertices, triangles, material = [], {}, None
    for line in (FOLDER / name).read_text().splitlines():
        word = line.split(maxsplit=1)
        if line.startswith("v "):
            vertices.append(tuple(float(x) for x in line.split()[1:4]))
        elif line.startswith("usemtl"):
            material = word[1].strip()
        elif line.startswith("f "):
            corner = [int(x.split("/")[0]) - 1 for x in line.split()[1:]]
            for k in range(1, len(corner) - 1):
                triangles.setdefault(material, []).append((corner[0], corner[k], corner[k + 1]))
    return vertices, triangles


def add(a, b, s=1.0):
    return tuple(x + s * y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    n = math.sqrt(dot(a, a))
    return tuple(x / n for x in a)


def middle(points):
    return tuple(sum(p[c] for p in points) / len(points) for c in range(3))


class Face:
    def __init__(self):
        self.vertex, triangles = read("ict_generic_neutral_mesh.obj")
        jaw, _ = read("ict_jawOpen.obj")
        self.moved = [math.dist(a, b) for a, b in zip(self.vertex, jaw)]
        self.triangle = triangles["M_Face"]
        eyes = {c for t in triangles["M_ScleraLeft"] for c in t}
        self.eye = middle([self.vertex[c] for c in eyes])
        self.eye = (abs(self.eye[0]), self.eye[1], self.eye[2])
        teeth = {c for t in triangles["M_Teeth"] for c in t}
        self.mouth = (0.0,) + middle([self.vertex[c] for c in teeth])[1:]
        self.most = max(self.moved[c] for t in self.triangle for c in t)

    def corners(self, t):
        return [self.vertex[c] for c in t]

    def normal(self, t):
        a, b, c = self.corners(t)
        return unit(cross(add(b, a, -1), add(c, a, -1)))

    def grow(self, chosen, count, length, lie, direction, seed):
        """Strands of about `length`, roots spread by area, leaving the skin by 1 - lie."""
        draw = random.Random(seed)
        areas = []
        for t in chosen:
            a, b, c = self.corners(t)
            n = cross(add(b, a, -1), add(c, a, -1))
            areas.append(math.sqrt(dot(n, n)) / 2)
        strands = []
        for t in draw.choices(chosen, areas, k=count):
            u, v = draw.random(), draw.random()
            if u + v > 1:
                u, v = 1 - u, 1 - v
            a, b, c = self.corners(t)
            root = add(add(a, add(b, a, -1), u), add(c, a, -1), v)
            n = self.normal(t)
            way = direction(root, draw)
            way = unit(add(way, n, -dot(way, n)))
            size = length * (0.7 + 0.6 * draw.random()) / (POINTS - 1)
            line = [root]
            for k in range(1, POINTS):
                # flatter from point to point, never into the skin
                flat = lie * (0.6 + 0.4 * k / (POINTS - 1))
                line.append(add(line[-1], unit(add(tuple(x * flat for x in way), n, 1 - flat)), size))
            strands.append(line)
        return strands

    def brows(self):
        ex, ey, _ = self.eye
        strands = []
        for side in (1, -1):
            def inside(t, side=side):
                x, y, z = middle(self.corners(t))
                x *= side
                along = (x - 0.9) / (ex + 1.9 - 0.9)
                arc = ey + 1.55 + 0.55 * math.sin(min(1.0, max(0.0, along)) * 2.2)
                return 0 < along < 1 and abs(y - arc) < 0.36 - 0.18 * along and self.normal(t)[2] > 0.2
            chosen = [t for t in self.triangle if inside(t)]
            strands += self.grow(chosen, BROW_STRANDS, 0.8, 0.75,
                                 lambda p, d, side=side: (side, 0.35 + 0.3 * (d.random() - 0.5), -0.2), 11 + side)
        return strands

    def beard(self):
        mx, my, mz = self.mouth
        def inside(t):
            x, y, z = middle(self.corners(t))
            moved = sum(self.moved[c] for c in t) / 3
            n = self.normal(t)
            lips = (x / 3.1) ** 2 + ((y - my) / 1.35) ** 2 < 1
            chin = moved > 0.35 * self.most and y < my and z > mz - 7 and n[1] > -0.93
            upper = abs(x) < 3.0 and 0.9 < y - my < 2.0 and z > mz and n[2] > 0.4
            return (chin or upper) and not lips and (z > mz - 0.5 or y < my - 1.2) and n[2] > -0.3
        chosen = [t for t in self.triangle if inside(t)]
        return self.grow(chosen, BEARD_STRANDS, 1.1, 0.55,
                         lambda p, d: (0.25 * p[0] / 5 + 0.2 * (d.random() - 0.5), -1, 0.15), 7)


def packed(strands):
    data = struct.pack("<i", len(strands))
    for line in strands:
        data += struct.pack("<i", len(line)) + b"".join(struct.pack("<3f", *p) for p in line)
    return data


def main():
    face = Face()
    same = True
    for name, strands in (("brows.data", face.brows()), ("beard.data", face.beard())):
        path, data = FOLDER / name, packed(strands)
        if "--check" in sys.argv[1:]:
            if not path.exists() or path.read_bytes() != data:
                print(f"{path} is not what {__file__} writes", file=sys.stderr)
                same = False
        else:
            path.write_bytes(data)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
