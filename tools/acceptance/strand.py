"""The strand runtime: as fast as the machine, right at any frame rate, a library for games."""

import json
import re
import shlex

from acceptance.demand import at_least, at_most, demand, equal_to, judged

TEST = "build/release/tests/runtime/strand/test_strand"


def test(work, name, figure=None):
    """1 when the tests of this name pass, or the largest of the figures that they print."""
    program = "build/release/tests/runtime/strand/test_c_interface" if name.startswith("the C interface") else TEST
    whole = name.replace(",", "\\,")  # a comma parts names
    out, _ = work.run(f"{program} {shlex.quote(whole)} -s")
    if "No test cases matched" in out or "All tests passed" not in out:
        raise RuntimeError(out.strip()[-200:])
    if figure is None:
        return 1
    return max(float(x) for x in re.findall(figure, out))


# ---- speed -------------------------------------------------------------------------------------------

# Name in the bench, threads, bound as the table states it, whether larger is better.
SPEED = [("constraints, 1k guides x 16, K = 4", 1, 1.35), ("constraints, 10k guides x 16, K = 4", 1, 1.6),
         ("constraints, 50k guides x 16, K = 4", 1, 1.9),
         ("naive strand-by-strand loop, 1k guides x 16", 1, 60),
         ("frame, 10k x 16, grid 48, 100k render strands", 1, 4.0), ("frame, 10k x 16, grid 48, 100k render strands", 2, 2.1),
         ("frame, 1k x 16, grid 32, 10k render strands", 1, 0.35), ("frame, 1k x 16, grid 32, 10k render strands", 2, 0.25),
         ("frame, 50k x 32, grid 64, 500k render strands", 1, 34), ("frame, 50k x 32, grid 64, 500k render strands", 2, 18)]


def bench(work):
    return work.once("bench", lambda: json.loads(work.run("keratin-bench strand --json", expect=None)[0]))


def result(work, name, threads):
    found = [r for r in bench(work)["results"] if r["name"] == name and r["threads"] == threads]
    if not found:
        raise RuntimeError(f"keratin-bench has no row '{name}' for {threads} threads")
    return found[0]


def absolute(name, threads, bound):
    @demand(f"{name}, {threads} thread{'s' * (threads > 1)}", at_most(bound, "ms" if name.startswith("frame") else "ns"))
    def _(work):
        return judged(result(work, name, threads))


def ratio(text, name, threads, bound):
    @demand(text, bound)
    def _(work):
        return result(work, name, threads)["value"]


for row in SPEED:
    absolute(*row)
BASE = "constraints, 1k guides x 16, K = 4: "
ratio("two threads over one", BASE + "two threads over one", 2, at_most(0.55))
ratio("times faster than the naive loop, 1 thread", BASE + "times faster than naive", 1, at_least(25))
ratio("times faster than the naive loop, 2 threads", BASE + "times faster than naive", 2, at_least(45))
ratio("share of the measured multiply-add peak, in cache (%)", BASE + "share of the multiply-add peak", 1, at_least(45))
ratio("bytes of a guide point, state and rest", "memory of a guide point, state and rest, 10k x 16", 1, at_most(40))


def head(work):
    def bake():
        work.run(f"keratin-bake data/ponytail/head.json -o {work.path('head.kera')} --quiet")
        (work.folder / "head_shake.json").write_text((work.root / "data/scenes/head_shake.json").read_text())
    return work.once("head", bake)


@demand("the demo groom, whole frame: reported (ms a frame, one thread)", at_least(0, "ms"))
def _(work):
    head(work)
    frames, times = 60, []
    for _ in range(3):
        work.run(f"keratin-run {work.path('head_shake.json')} --threads 1 --frames {frames} --stats {work.path('demo.json')}")
        seconds = json.loads((work.folder / "demo.json").read_text())["seconds"]
        times.append(1000 * sum(v for k, v in seconds.items() if k != "total") / frames)
    return min(times)


# ---- right -------------------------------------------------------------------------------------------

@demand("one binary; 1, 2 and 5 threads and every instruction set of this machine give the same bits (test)", equal_to(1))
def _(work):
    return test(work, "the result does not depend on threads or instruction set")


@demand("tip paths at 30, 60, 120 Hz from those at 240 Hz, of the length", at_most(0.05))
def _(work):
    return test(work, "the path of a tip hardly depends on the frame rate", r"Hz: ([0-9.e-]+) of the length")


@demand("tip paths at random steps within 5 % of the length of even ones (test)", equal_to(1))
def _(work):
    return test(work, "random steps follow the same path as even ones")


@demand("sag of the demo hair at rest, 30 to 240 Hz apart (largest move of a guide point, m)", at_most(0.001, "m"))
def _(work):
    head(work)
    work.write("rest.json", '{ "duration": 4, "assets": [ { "file": "head.kera" } ] }')
    shapes = []
    for rate in (30, 60, 120, 240):
        work.run(f"keratin-run {work.path('rest.json')} --threads 1 --frame {1 / rate!r} --step {1 / rate!r} --final "
                 f"--stats {work.path('rest_stats.json')}")
        shapes.append(json.loads((work.folder / "rest_stats.json").read_text())["final"])
    return max(abs(a - b) for shape in shapes[1:] for s, t in zip(shapes[0], shape) for p, q in zip(s, t)
               for a, b in zip(p, q))


@demand("stretch of 16 and 32 points, root driven 10 cm at 1 Hz, 30 to 240 Hz", at_most(0.01))
def _(work):
    return max(test(work, name, r"stretch ([0-9.e-]+)") for name in
               ("shaken hair keeps its length*", "32 points keep their length as well as 16"))


@demand("penetration in the same runs (m)", at_most(0.001, "m"))
def _(work):
    return max(test(work, name, r"depth ([0-9.e-]+) m") for name in
               ("shaken hair keeps its length*", "32 points keep their length as well as 16"))


@demand("tip of the cantilever for Gamma 1 to 100, of the length", at_most(0.1))
def _(work):
    return test(work, "the sag of a cantilever follows from its material", r"at 16 points: ([0-9.e-]+) of")


@demand("the effective E over the given: reported", at_least(0))
def _(work):
    return test(work, "the effective Young's modulus is the given one", r"16 points: ([0-9.e-]+)")


@demand("robustness cases that apply to strand and fail", equal_to(0))
def _(work):
    report = json.loads(work.run("keratin-report stability data/validation/public.json --solver strand --json", expect=None)[0])
    failed = [c["id"] for c in report["cases"] if c["result"] == "fail"]
    if failed:
        raise RuntimeError(f"{len(failed)} of {sum(c['result'] != 'not_applicable' for c in report['cases'])}: {', '.join(failed)}")
    return 0


def tests(text, *names):
    @demand(text + " (tests)", equal_to(len(names)))
    def _(work):
        return sum(test(work, name) for name in names)


tests("a NaN in one strand is reset and counted, the others bitwise unchanged",
      "a strand that is no number is reset, and the others do not notice",
      "with friction a spoiled strand does not reach the others through the grid")
tests("teleport keeps the shape, velocity by choice", "a jump of the root carries the strand rigidly and keeps its shape",
      "teleport drops or turns the velocity as asked")
tests("floating origin", "a million metres from the origin nothing changes when the origin goes along",
      "moving the origin moves what is handed out, not the hair")
tests("moving colliders of every shape, no limit on their number",
      "hair stays out of a collider of every shape that moves into it, and keeps its length",
      "colliders have no limit on their number")
tests("no collider of any shape passes through at 20 m/s", "no collider of any shape passes through hair at 20 m/s",
      "a thin collider at 11 m/s does not pass through")
tests("Coulomb friction against every shape", "a surface of any shape drags hair along by friction alone",
      "friction drags hair along with a moving surface")
tests("sleeping strands wake with root, collider, grid", "hair at rest falls asleep and wakes with its root, a collider or its neighbours")
tests("level of detail by prefix, switched every frame without popping",
      "the level of detail is a prefix and what remains does not move",
      "switching the level of detail every frame moves no strand that stays")
tests("save and resume bit for bit", "a saved state goes on bit for bit")
tests("a step allocates nothing", "a step allocates nothing")


# ---- facial hair -------------------------------------------------------------------------------------

def face(work):
    def make():
        work.run(f"keratin-bake data/ict/face.json -o {work.path('face.kera')} --quiet")
        scene = (work.root / "data/ict/expressions.json").read_text()
        scene = scene.replace("../../out/face/face.kera", str(work.folder / "face.kera"))
        scene = re.sub(r'"file": "(ict_\w+\.obj)"', lambda m: f'"file": "{work.root}/data/ict/{m.group(1)}"', scene)
        work.write("face.json", scene)
        work.run(f"keratin-run {work.path('face.json')} --stats {work.path('face_stats.json')} --points "
                 f"{work.path('face.csv')} --every 10 --quiet")
        plan, _ = work.run(f"keratin-run {work.path('face.json')} --explain --frames 1")
        return json.loads((work.folder / "face_stats.json").read_text()), plan
    return work.once("face", make)


def obj(path):
    vertices, triangles = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            vertices.append(tuple(float(x) * 0.01 for x in line.split()[1:4]))
        elif line.startswith("f "):
            corner = [int(x.split("/")[0]) - 1 for x in line.split()[1:]]
            triangles += [(corner[0], corner[k], corner[k + 1]) for k in range(1, len(corner) - 1)]
    return vertices, triangles


@demand("roots of brows and beard off their triangle under a blend of expressions, of its size (independent of the runtime)",
        at_most(1e-6))
def _(work):
    """Where each guide's root stands on the neutral face gives its triangle and barycentrics; the blended
    vertices then say where it must be."""
    face(work)
    folder = work.root / "data/ict"
    names = {"neutral": "ict_generic_neutral_mesh", "smile": "ict_mouthSmile_L", "jaw": "ict_jawOpen", "brow": "ict_browInnerUp_L"}
    meshes = {k: obj(folder / f"{v}.obj") for k, v in names.items()}
    triangles = meshes["neutral"][1]
    keys = [(0, "neutral"), (0.4, "smile"), (0.8, "neutral"), (1.2, "jaw"), (1.6, "brow"), (2.0, "neutral")]

    def blend(time, vertex):
        for (t0, a), (t1, b) in zip(keys, keys[1:]):
            if time <= t1:
                s = (time - t0) / (t1 - t0)
                return [x + s * (y - x) for x, y in zip(meshes[a][0][vertex], meshes[b][0][vertex])]
        return list(meshes["neutral"][0][vertex])

    roots = {}
    for line in (work.folder / "face.csv").read_text().splitlines()[1:]:
        frame, time, strand, point, x, y, z = line.split(",")
        if point == "0":
            roots.setdefault(int(strand), []).append((float(time), (float(x), float(y), float(z))))
    cells = {}
    vertices = meshes["neutral"][0]
    for index, t in enumerate(triangles):
        low = [min(vertices[c][k] for c in t) for k in range(3)]
        high = [max(vertices[c][k] for c in t) for k in range(3)]
        for i in range(int(low[0] // 0.01), int(high[0] // 0.01) + 1):
            for j in range(int(low[1] // 0.01), int(high[1] // 0.01) + 1):
                cells.setdefault((i, j), []).append(index)

    def dot(a, b):
        return sum(p * q for p, q in zip(a, b))

    def place(p, t):
        a, b, c = (vertices[k] for k in t)
        e, f, d = ([y - x for x, y in zip(a, q)] for q in (b, c, p))
        ee, ef, ff, de, df = dot(e, e), dot(e, f), dot(f, f), dot(d, e), dot(d, f)
        det = ee * ff - ef * ef
        if det <= 0:
            return 1, 0, 0, 1
        u, v = (ff * de - ef * df) / det, (ee * df - ef * de) / det
        off = [d[k] - u * e[k] - v * f[k] for k in range(3)]
        outside = max(0, -u, -v, u + v - 1)
        return dot(off, off) ** 0.5 + outside * ee ** 0.5, u, v, ee ** 0.5

    worst = 0
    for path in roots.values():
        first = min(path)[1]
        near = cells.get((int(first[0] // 0.01), int(first[1] // 0.01)), [])
        # frame 0 is the end of no step: the neutral face
        _, u, v, size, t = min((place(first, triangles[i]) + (triangles[i],) for i in near), key=lambda x: x[0])
        for time, at in path:
            a, b, c = (blend(time, k) for k in t)
            want = [(1 - u - v) * a[k] + u * b[k] + v * c[k] for k in range(3)]
            worst = max(worst, sum((want[k] - at[k]) ** 2 for k in range(3)) ** 0.5 / size)
    return worst


@demand("frames turn with the triangles (test), and a face's plan has no grid, collision or bones", equal_to(True))
def _(work):
    _, plan = face(work)
    test(work, "roots stay on their triangle as it moves, stretches and turns")
    planned = re.findall(r"^  (\w+):", plan.split("buffers:")[0], re.M)
    return not set(planned) & {"grid_scatter", "grid_resolve", "grid_gather", "collide", "carry"}


@demand("brows.data and beard.data are what grow_hair.py grows", equal_to(0))
def _(work):
    work.run("python3 data/ict/grow_hair.py --check", expect=None)
    return work.exit_code


# ---- leave out ---------------------------------------------------------------------------------------

@demand("a plan for each scene of data/ beside everything on (rows of the README's table)", at_least(5))
def _(work):
    rows = json.loads(work.run(f"tools/plan-table --json --frames 5 -o {work.path('plan')}")[0])
    readme = (work.root / "README.md").read_text()
    for row in rows:
        if f"| {row['scene']} |" not in readme or f"{row['planned']['bytes']:,} / {row['everything']['bytes']:,}" not in readme:
            raise RuntimeError(f"the README does not have the plan of '{row['scene']}': {row}")
    return len(rows)


tests("attach: all allocates nothing beyond its output; no grid, no interpolation, no collision where not needed, by plan and bytes",
      "short hair that is only carried allocates nothing beyond its output", "without friction and volume there is no grid",
      "without render strands nothing is interpolated", "without colliders there is no collision pass")

# ---- for a game programmer -----------------------------------------------------------------------------

tests("the C interface does what the C++ one does", "the C interface runs an asset as the C++ one does")
tests("the host's memory and messages", "the host's memory holds the buffers and comes back",
      "a host without memory is an error, and what it lent comes back", "the host hears what was made and what was reset")
tests("positions of the step before", "the strands of the step before are where they were")
tests("instances of one asset step on different threads", "instances of one asset step on threads of their own as they would alone")


@demand("the host's thread pool can be given (keratin_host has a function for it)", equal_to(True))
def _(work):
    work.run("grep -c parallel runtime/keratin.h", expect=None)
    return bool(re.search(r"\(\*parallel\)", (work.root / "runtime/keratin.h").read_text()))


@demand("the example programs in C and C++ run (tests)", equal_to(2))
def _(work):
    out, _ = work.run("ctest --test-dir build/release --no-tests=error -R 'example runs an asset'")
    return int(re.search(r"tests failed out of (\d+)", out).group(1))


@demand("a foreign project uses the library by find_package and by add_subdirectory (tests)", at_least(3))
def _(work):
    out, _ = work.run("ctest --test-dir build/release --no-tests=error -R '^consume'")
    return int(re.search(r"tests failed out of (\d+)", out).group(1))


@demand("size of the lean runtime (KiB), nothing needed but libc, libstdc++, OpenMP", at_most(600, "KiB"))
def _(work):
    out, _ = work.run("tools/check-lean")
    return int(re.search(r"keratin_runtime\S*\s+(\d+) KiB", out).group(1))


@demand("the runtime cross-compiles and links for Windows", equal_to(0))
def _(work):
    work.run("tools/check-windows")
    return work.exit_code


@demand("each CMake option switched off in turn configures and builds the runtime", equal_to(0))
def _(work):
    work.run("tools/check-options", expect=None)
    return work.exit_code
