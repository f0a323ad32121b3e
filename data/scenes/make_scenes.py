#!/usr/bin/env python3
"""Writes the scenes of tools/demo beside this file.

    data/scenes/make_scenes.py            writes them
    data/scenes/make_scenes.py --check    exits 1 when a file is not what would be written

Every motion rests for half a second, moves at 1 Hz with a quarter of a second to start and to stop,
then rests for a second. There is a keyframe for every frame of 1/60 s, for bones every second one.
"""

import math
import pathlib
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
REST, AFTER, EASE, FREQUENCY = 0.5, 1.0, 0.25, 1.0


def smoothstep(x):
    x = min(max(x, 0.0), 1.0)
    return x * x * (3 - 2 * x)


def swing(time, duration):
    """-1..1: a sine with eased ends."""
    s = time - REST
    if s <= 0 or s >= duration:
        return 0.0
    return smoothstep(s / EASE) * smoothstep((duration - s) / EASE) * math.sin(2 * math.pi * FREQUENCY * s)


# Rotations as quaternions (x, y, z, w), rigid motions as (rotation, translation): x -> R x + T.
def about(axis, degrees):
    half = math.radians(degrees) / 2
    return tuple(math.sin(half) * a for a in axis) + (math.cos(half),)


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def rotate(q, v):
    x, y, z, w = q
    return product(product(q, (*v, 0.0)), (-x, -y, -z, w))[:3]


def turn_about(point, rotation, shift=(0.0, 0.0, 0.0)):
    turned = rotate(rotation, point)
    return rotation, tuple(p - t + s for p, t, s in zip(point, turned, shift))


def after(outer, inner):
    """First inner, then outer."""
    turned = rotate(outer[0], inner[1])
    return product(outer[0], inner[0]), tuple(t + o for t, o in zip(turned, outer[1]))


def number(value):
    text = f"{value:.7f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def keyframes(motion_at, duration, indent, a_second=60):
    times = [REST + i / a_second for i in range(round(duration * a_second) + 1)]
    lines = []
    for time in times:
        rotation, translation = motion_at(time)
        lines.append(f'{indent}{{ "time": {number(time)}, "translation": [{", ".join(map(number, translation))}], '
                     f'"rotation": [{", ".join(map(number, rotation))}] }}')
    return ",\n".join(lines)


def scene(comment, asset, duration, motion=None, bones=None):
    lines = [f"// {line}" for line in comment] + ["{", f'    "duration": {number(REST + duration + AFTER)},', '    "assets": [ {',
                                                 f'        "file": "{asset}"{"," if motion or bones else ""}']
    if bones:
        lines.append(f'        "bones": "{bones}"')
    if motion:
        lines += ['        "motion": [', keyframes(motion, duration, "            "), "        ]"]
    return "\n".join(lines + ["    } ]", "}"]) + "\n"


HEAD_AXIS = (0.0, 0.0, 0.03)  # the neck of data/tressfx/ponytail.obj
UP, ACROSS, AHEAD = (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def head_shake():
    def motion(time):
        s = swing(time, 5)
        return turn_about(HEAD_AXIS, about(UP, 40 * s), (0.10 * s, 0.0, 0.0))

    return scene(["A head is shaken for 5 s: yaw +-40 degrees and 10 cm to either side at 1 Hz.",
                  "Written by make_scenes.py."], "head.kera", 5, motion)


def nurbs_tail():
    def motion(time):
        return turn_about((0.0, 0.10, 0.03), about(ACROSS, 25 * swing(time, 3)))

    return scene(["The ponytail of NURBS curves nods for 3 s: +-25 degrees at 1 Hz.", "Written by make_scenes.py."],
                 "tail.kera", 3, motion)


# The spine of the Ratboy: where each joint stands (m) and how far it leans and turns (degrees).
SPINE = [("spine01", (0.0, 0.31, -0.10), 6, 0), ("spine02", (0.0, 0.385, -0.085), 6, 4), ("spine03", (0.0, 0.514, -0.056), 6, 6),
         ("neck", (0.0, 0.626, -0.035), 5, 10), ("head", (0.0, 0.70, -0.01), 5, 15)]
FOLLOWERS = {"head": ["maineyebrow", "L_maineyebrow", "R_maineyebrow", "L_eyebrow01", "R_eyebrow01", "L_ear", "R_ear", "jaw",
                      "L_LeyeLid"],
             "spine03": ["L_clavicle", "R_clavicle", "L_UpperArm", "R_UpperArm"]}
MOHAWK_SECONDS = 3


def mohawk_poses():
    def motion_of(joint):
        def motion(time):
            s = swing(time, MOHAWK_SECONDS)
            total = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
            for name, place, lean, turn in SPINE:
                total = after(total, turn_about(place, product(about(AHEAD, lean * s), about(UP, turn * s))))
                if name == joint:
                    return total
            raise KeyError(joint)

        return motion

    bones = []
    for joint, *_ in SPINE:
        for name in [joint] + FOLLOWERS.get(joint, []):
            bones.append(f'        "frenchHornMonster_{name}_JNT": [\n' +
                         keyframes(motion_of(joint), MOHAWK_SECONDS, "            ", 30) + "\n        ]")
    return ("// The Ratboy sways from side to side and looks around for 3 s at 1 Hz. A bone maps its rest pose to\n"
            "// the present one; bones that are not named rest. Written by make_scenes.py.\n"
            '{\n    "bones": {\n' + ",\n".join(bones) + "\n    }\n}\n")


def mohawk():
    return scene(["The Ratboy's mohawk on his swaying spine.", "Written by make_scenes.py."], "mohawk.kera", MOHAWK_SECONDS,
                 bones="mohawk_poses.json")


FILES = {"head_shake.json": head_shake, "nurbs_tail.json": nurbs_tail, "mohawk.json": mohawk, "mohawk_poses.json": mohawk_poses}


def main():
    if sys.argv[1:] not in ([], ["--check"]):
        sys.exit(__doc__)
    wrong = 0
    for name, make in FILES.items():
        path, text = FOLDER / name, make()
        if sys.argv[1:]:
            if not path.exists() or path.read_text() != text:
                print(f"{path}: is not what make_scenes.py writes")
                wrong = 1
        else:
            path.write_text(text)
            print(f"{path}: {len(text)} bytes")
    sys.exit(wrong)


if __name__ == "__main__":
    main()
