# Run by Blender: blender -b --factory-startup --python read_obj_in_blender.py -- FILE.obj OUT.json
# Writes the strands that Blender makes of the file: the points of each chain of edges in order, in
# the file's axes.
import json
import sys

import bpy

source, target = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.wm.obj_import(filepath=source, forward_axis="Y", up_axis="Z", clamp_size=0)
strands = []
for thing in bpy.data.objects:
    mesh, at = thing.data, thing.matrix_world
    neighbours = [[] for _ in mesh.vertices]
    for edge in mesh.edges:
        a, b = edge.vertices
        neighbours[a].append(b)
        neighbours[b].append(a)
    used = set()
    for start, beside in enumerate(neighbours):
        if len(beside) != 1 or start in used:
            continue
        chain, here = [], start
        while here is not None:
            used.add(here)
            chain.append(list(at @ mesh.vertices[here].co))
            here = next((v for v in neighbours[here] if v not in used), None)
        strands.append(chain)
with open(target, "w") as out:
    json.dump(strands, out)
