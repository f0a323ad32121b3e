"""The main job: real hair from file to picture."""

import json
import re
import shutil
import struct
import time

from acceptance.demand import at_least, at_most, demand, equal_to


def demo(work):
    return work.once("demo", lambda: work.run("tools/demo " + work.path("demo")))


def stats(work, name):
    demo(work)
    return json.loads((work.folder / "demo" / f"{name}.stats.json").read_text())


def every(work, field):
    return [stats(work, name)[field] for name in ("head", "mohawk", "tail")]


@demand("a clean clone of what is committed builds and runs the demo in at most 5 minutes once the packages are there",
        at_most(300, "s"))
def _(work):
    clone = work.folder / "clone"
    shutil.rmtree(clone, ignore_errors=True)
    work.run(f"git clone --quiet . {work.path('clone')}")
    start = time.monotonic()
    work.run(f"{work.path('clone')}/tools/demo", environment={"CCACHE_DISABLE": "1", "CMAKE_CXX_COMPILER_LAUNCHER": ""})
    seconds = time.monotonic() - start
    shutil.rmtree(clone)
    return seconds


@demand("everything stays finite in the demo's three runs", equal_to(True))
def _(work):
    return all(every(work, "finite"))


@demand("no segment stretches by more than 5 % ever", at_most(0.05))
def _(work):
    return max(every(work, "max_stretch"))


@demand("no segment stretches by more than 2 % after the first second", at_most(0.02))
def _(work):
    worst = 0
    for name in ("head", "mohawk", "tail"):
        series = stats(work, name)["series"]
        worst = max([worst] + [s for t, s in zip(series["time"], series["stretch"]) if t >= 1])
    return worst


@demand("tips lag the rigidly carried groom by at least 20 mm at some time (least of the three runs)", at_least(0.02, "m"))
def _(work):
    return min(every(work, "max_tip_lag"))


@demand("no guide point gets more than 1 mm deeper into the mesh than max(0, its depth at rest)", at_most(0.001, "m"))
def _(work):
    return max(stats(work, name)["max_penetration"] for name in ("head", "tail"))


@demand("no strand had to be put back to rest in the demo", equal_to(0))
def _(work):
    return sum(stats(work, name)["health"]["strands_reset"] for name in ("head", "mohawk", "tail"))


@demand("one and two threads give the same hash", equal_to(1))
def _(work):
    demo(work)
    folder = work.path("demo")
    hashes = set()
    for threads in (1, 2):
        work.run(f"keratin-run {folder}/head_shake.json --frames 60 --threads {threads} --stats {work.path('threads.json')}")
        hashes.add(json.loads((work.folder / "threads.json").read_text())["hash"])
    return len(hashes)


@demand("a baked file has the same bytes for 1, 2 and 7 threads and on every run", equal_to(1))
def _(work):
    contents = set()
    for threads in (1, 2, 7, 7):
        path = work.path(f"threads{threads}.kera")
        work.run(f"keratin-bake data/ponytail/head.json -o {path} --threads {threads} --quiet")
        contents.add((work.root / path).read_bytes())
    return len(contents)


@demand("the bake prints how far fitted colliders stand from the scalp (p95, m)", at_most(0.003, "m"))
def _(work):
    report = work.json(f"keratin-bake data/ponytail/fitted.json -o {work.path('fit.kera')} --json")
    return report["colliders"]["outside_mesh"]["p95"]


def tests(work, pattern):
    """Number of tests that match and pass; a failure raises."""
    out, _ = work.run(f"ctest --test-dir build/release --no-tests=error -R '{pattern}'")
    return int(re.search(r"tests failed out of (\d+)", out).group(1))


@demand("NURBS agree with a de Boor evaluation in long double on random curves", at_most(1e-12))
def _(work):
    out, _ = work.run("build/release/tests/bake/test_nurbs -s")
    return max(float(x) for x in re.findall(r"largest error ([0-9.e+-]+)", out))


@demand("nearest triangles equal brute force: all roots of the ponytail head, 1000 of the bear (tests)", equal_to(2))
def _(work):
    return tests(work, "nearest triangle, the lowest of equals")


@demand("each pass, switched off, moves a named measure by a stated amount (tests)", at_least(7))
def _(work):
    out, _ = work.run("build/release/tests/runtime/strand/test_strand --list-test-names-only '[acts]'", expect=None)
    count = len([line for line in out.splitlines() if line.strip()])
    work.run("build/release/tests/runtime/strand/test_strand '[acts]'")
    return count


def tfx(strands):
    """A .tfx (version 3) file of equally long strands."""
    points = len(strands[0])
    header = struct.pack("<f4I31I6I32I", 3.0, len(strands), points, 0, 0, *[0] * 31, 296, 0, 0, 0, 0, 0, *[0] * 32)
    return header + b"".join(struct.pack("<3f", *p) for strand in strands for p in strand)


GOOD = [[(0.01 * s, 0.01 * p, 0) for p in range(4)] for s in range(8)]
NURBS = "v 0 0 0\nv 0 1 0\nv 0 2 0\nv 0 3 0\ncstype {rat}bspline\ndeg 3\ncurv 0 1 1 2 3 4\nparm u {knots}\nend\n"


def bad_input(name, expected, make):
    @demand(f"bad input, {name}: exit code 2 and one message that names file and place", equal_to(True))
    def _(work):
        recipe = make(work)
        _, messages = work.run(f"keratin-bake {work.write('bad.json', recipe)} -o {work.path('bad.kera')}", expect=2)
        lines = [line for line in messages.splitlines() if line.strip()]
        found = all(re.search(part, messages) for part in expected)
        if not found or (work.folder / "bad.kera").exists():
            raise RuntimeError(messages.strip())
        return len(lines) == 1


def curves(content, ending):
    def make(work):
        path = work.folder / f"bad{ending}"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return f'{{ "curves": [ {{ "file": "bad{ending}" }} ] }}'
    return make


def recipe(text):
    def make(work):
        (work.folder / "good.tfx").write_bytes(tfx(GOOD))
        (work.folder / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
        return text
    return make


nan = float("nan")
bad_input("truncated file", [r"bad\.tfx", "cut"], curves(tfx(GOOD)[:-40], ".tfx"))
bad_input("NaN", [r"bad\.tfx", "curve 0", "point 2"], curves(tfx([[(0, 0, 0), (0, 1, 0), (nan, 2, 0)]]), ".tfx"))
bad_input("one-point strand", [r"bad\.tfx", "1 points"], curves(tfx([[(0, 0, 0)]]), ".tfx"))
bad_input("zero-length strand", [r"bad\.tfx", "strand"], curves(tfx([[(1, 1, 1)] * 4]), ".tfx"))
bad_input("unsorted knots", [r"bad\.obj", "knot"], curves(NURBS.format(rat="", knots="0 0 0 0 1 1 .5 1"), ".obj"))
bad_input("too few knots", [r"bad\.obj", "knot"], curves(NURBS.format(rat="", knots="0 0 0 1 1 1"), ".obj"))
bad_input("weight <= 0", [r"bad\.obj", "weight"], curves(NURBS.format(rat="rat ", knots="0 0 0 0 1 1 1 1").replace("v 0 1 0", "v 0 1 0 -1"), ".obj"))
bad_input("mesh without triangles", [r"points\.obj", "triangle"], recipe('{ "curves": [ { "file": "good.tfx" } ], "mesh": { "file": "points.obj" } }'))
bad_input("missing file", [r"nowhere\.tfx"], recipe('{ "curves": [ { "file": "nowhere.tfx" } ] }'))
bad_input("unknown field", [r"bad\.json:1:\d+", "scael", "scale"], recipe('{ "curves": [ { "file": "good.tfx" } ], "scael": 1 }'))
bad_input("wrong type", [r"bad\.json:1:\d+", "scale"], recipe('{ "curves": [ { "file": "good.tfx" } ], "scale": "big" }'))


def one_bad_strand(work):
    (work.folder / "mostly.tfx").write_bytes(tfx(GOOD + [[(1, 1, 1)] * 4]))
    return work.write("mostly.json", '{ "curves": [ { "file": "mostly.tfx" } ] }')


@demand("a degenerate strand in a good groom is left out, counted and named", equal_to(True))
def _(work):
    report = work.json(f"keratin-bake {one_bad_strand(work)} -o {work.path('mostly.kera')} --json")
    findings = [f for f in report["findings"] if f["code"] == "KB001"]
    return report["strands"] == 8 and len(findings) == 1 and "8" in str(findings[0]["strands"])


@demand("with --strict the same strand is fatal", equal_to(2))
def _(work):
    work.run(f"keratin-bake {one_bad_strand(work)} -o {work.path('mostly.kera')} --strict", expect=None)
    return work.exit_code
