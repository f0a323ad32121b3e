"""The rod solver: discrete elastic rods with Coulomb friction."""

import json
import math
import os
import pathlib

from acceptance.demand import at_least, at_most, demand, equal_to, judged, near

CASES = "data/validation/public.json"


def validation(work, family):
    def measure():
        out, _ = work.run(f"keratin-report validate {CASES} --family {family} --json", expect=None)
        return json.loads(out)["cases"]
    return work.once("validate " + family, measure)


# What a family is called in a case file, and how many cases of it there must be at the least.
FAMILIES = [("cantilever", 7), ("helix", 2), ("kirchhoff-3d", 6), ("catenary", 1), ("self-stretch", 1),
            ("bend-twist", 4), ("lateral-buckling", 2), ("greenhill", 1), ("michell-ring", 2), ("vibration", 1),
            ("pendulum", 3), ("falling-hair", 2), ("incline", 6), ("sliding-block", 2), ("capstan", 5),
            ("stick-slip", 5), ("free-rod-contact", 1), ("coulomb-residual", 1)]


def add_family(family):
    @demand(f"every validation case of {family} is run and within its tolerance (largest error / tolerance)",
            at_most(1))
    def _(work):
        cases = validation(work, family)
        if not cases or any(c["result"] == "not_applicable" for c in cases):
            raise RuntimeError("cases that are not run")
        ratios = [math.inf if k["error"] is None else k["error"] / k["tolerance"] if k["tolerance"] else 0.0 if k["passed"] else math.inf
                  for c in cases for k in c["checks"]]
        return max(ratios)


for name, _ in FAMILIES:
    add_family(name)


@demand("no family of the validation file is left out", equal_to([]))
def _(work):
    cases = json.loads((work.root / CASES).read_text())["cases"]
    return sorted({c["family"] for c in cases} - {name for name, _ in FAMILIES})


@demand("no case id of the validation file stands in the report's sources", equal_to([]))
def _(work):
    text = "".join(p.read_text() for p in (work.root / "tools/keratin-report").glob("*.*"))
    document = json.loads((work.root / CASES).read_text())
    ids = [c["id"] for c in document["cases"] + document["robustness"]["cases"]]
    # an id that is a word of the language ("spin") may stand there: only ids with a number are sought
    return [i for i in ids if any(c.isdigit() for c in i) and f'"{i}"' in text]


def stability(work):
    def measure():
        out, _ = work.run(f"keratin-report stability {CASES} --solver rod --json", expect=None)
        return json.loads(out)["cases"]
    return work.once("stability", measure)


@demand("all 55 robustness cases are listed", equal_to(55))
def _(work):
    return len(stability(work))


@demand("robustness cases that fail or are not run", equal_to([]))
def _(work):
    return [c["id"] for c in stability(work) if c["result"] != "pass"]


def tests(work, pattern):
    work.run(f"ctest --test-dir build/release -R '{pattern}' --output-on-failure --no-tests=error")
    return True


@demand("gradients within 1e-6 and Hessians within 1e-5 of finite differences, every energy and state", equal_to(True))
def _(work):
    return tests(work, "finite differences")


@demand("a state saved and restored goes on bit by bit; threads and neighbours change nothing", equal_to(True))
def _(work):
    return tests(work, "^rod_simulation|bit by bit|same for any number of threads")


def row(work, start, threads=1, section="rod"):
    # exit code 1: a ratio misses its bound
    bench = work.once(f"{section} bench",
                      lambda: json.loads(work.run(f"keratin-bench {section} --json", expect=None)[0]))
    found = [r for r in bench["results"] if r["name"].startswith(start) and r["threads"] == threads]
    if not found:
        raise RuntimeError(f"no row \"{start}\" on {threads} threads")
    return found[0]


STEP = "rod step, 1000 strands x 40 vertices, 20 quasi-Newton iterations"


@demand("1 000 strands x 40 vertices, 20 quasi-Newton iterations, no contact, 1 thread", at_most(36, "ms"))
def _(work):
    return judged(row(work, STEP))


@demand("the same on 2 threads", at_most(19, "ms"))
def _(work):
    return judged(row(work, STEP, 2))


@demand("that step against a scalar build of the same code", at_least(6.5, "x"))
def _(work):
    return row(work, STEP + ": times faster")["value"]


@demand("time over strands, 250 to 16 000 of 40 vertices: fitted exponent", near(1, 0.1))
def _(work):
    return row(work, "rod step of 3 quasi-Newton iterations, over strands: exponent", section="rod-scaling")["value"]


@demand("time over vertices, 10 to 160 of 1 000 strands: fitted exponent", near(1, 0.1))
def _(work):
    return row(work, "rod step of 3 quasi-Newton iterations, over vertices: exponent", section="rod-scaling")["value"]


# ---- contact ------------------------------------------------------------------------------------------

SCENES = pathlib.Path("data/scenes/contact")
KINDS = {"bundle_on_bundle": 1, "bundle_on_cylinder": 1, "bundle_on_ground": 1, "strand_on_strand": 5,
         "strand_on_pipe": 5, "two_strands": 1}


def scenes(work, kind):
    files = sorted((work.root / SCENES).glob(kind + "*.json"))
    return [(f, work.once(f"scene {f.name}", lambda: work.json(f"keratin-run {SCENES / f.name} --stats -"))) for f in files]


def smallest_sum_of_radii(file):
    text = "\n".join(line.split("//")[0] for line in file.read_text().splitlines())
    scene = json.loads(text)
    return scene.get("contact_distance") or 2 * min(s["radius"] for s in scene["strands"])


def add_kind(kind, count):
    @demand(f"{kind}: number of scenes", at_least(count))
    def _(work):
        return len(list((work.root / SCENES).glob(kind + "*.json")))

    @demand(f"{kind}: deepest overlap at the end of any step, share of the contact distance", at_most(0.01))
    def _(work):
        return max(stats["max_penetration"] / smallest_sum_of_radii(file) for file, stats in scenes(work, kind))

    @demand(f"{kind}: mean |f_FB| of the converged steps", at_most(1e-6))
    def _(work):
        return max(stats["coulomb_residual"]["mean"] for _, stats in scenes(work, kind))

    @demand(f"{kind}: share of steps at the iteration cap", at_most(0.05))
    def _(work):
        return max(stats["steps_at_cap"] / stats["steps"] for _, stats in scenes(work, kind))

    @demand(f"{kind}: contacts at some time", at_least(1))
    def _(work):
        return min(stats["contacts_max"] for _, stats in scenes(work, kind))


for kind, count in KINDS.items():
    add_kind(kind, count)


for size, limit in (("10k", 1.2), ("100k", 20), ("1M", 380)):
    def add_phase(size, limit):
        @demand(f"broad and narrow phase, {size} edges, 1 thread", at_most(limit, "ms"))
        def _(work):
            return judged(row(work, f"broad and narrow phase, {size} edges", section="contact"))
    add_phase(size, limit)


@demand("Gauss-Seidel, cost of a contact and sweep, 1 thread", at_most(60, "ns"))
def _(work):
    return judged(row(work, "Gauss-Seidel, 5500 contacts", section="contact"))


@demand("hairball, turning phase, a step on 2 threads", at_most(60, "ms"))
def _(work):
    return judged(row(work, "hairball, turning phase", 2, "hairball"))


@demand("hairball, turning phase: mean contacts", at_least(3000))
def _(work):
    return row(work, "hairball, turning phase: contacts", 2, "hairball")["value"]


# ---- sag-free -----------------------------------------------------------------------------------------


def rods_at_rest(work, sag_free):
    """Report of the ponytail head's bake, and the distances (m) of the guides' tips, as rods, from the groom after 20 s at rest, ascending."""
    def measure():
        source = (work.root / "data/ponytail/head.json").read_text()
        recipe = json.loads("\n".join(line.split("//")[0] for line in source.splitlines()))
        for named in [*recipe["curves"], recipe["mesh"]]:
            named["file"] = os.path.relpath(work.root / "data/x" / named["file"], work.folder)
        recipe["rod"] = {"sag_free": sag_free}
        recipe["guides"] = {"measure": False}
        name = "sag_free_rods" if sag_free else "rods"
        report = work.json(f"keratin-bake {work.write(name + '.json', json.dumps(recipe))} -o {work.path(name + '.kera')} --json")
        scene = {"solver": "rod", "duration": 20, "settings": {"contact": "none"}, "assets": [{"file": f"{name}.kera"}]}
        work.run(f"keratin-run {work.write(name + '.scene.json', json.dumps(scene))} --points {work.path(name + '.csv')} --every 1200 --quiet")
        tips = {}
        for line in (work.folder / f"{name}.csv").read_text().splitlines()[1:]:
            frame, _, strand, _, x, y, z = line.split(",")
            tips.setdefault(int(frame), {})[int(strand)] = (float(x), float(y), float(z))
        return report, sorted(math.dist(tips[0][s], tips[1200][s]) for s in tips[0])
    return work.once(f"rods at rest {sag_free}", measure)


@demand("sag-free: nine in ten of the ponytail head's guides can be held as rods, the others are named", at_least(0.9))
def _(work):
    report = rods_at_rest(work, True)[0]
    rods = report["rod_sag_free"]
    named = [f["strand_count"] for f in report["findings"] if f["code"] == "KB026"]
    if named != [rods["too_soft"]]:
        raise RuntimeError(f"{named} are named of {rods['too_soft']}")
    return 1 - rods["too_soft"] / rods["guides"]


@demand("sag-free: unbalanced force over weight of the rods that can be held", at_most(1e-6))
def _(work):
    return max(g["residual"] for g in rods_at_rest(work, True)[0]["rod_sag_free"]["each"] if g["held"])


@demand("sag-free: tips of rods that can be held are where they were groomed after 20 s", at_most(1e-6, "m"))
def _(work):
    report, tips = rods_at_rest(work, True)
    return tips[report["rod_sag_free"]["guides"] - report["rod_sag_free"]["too_soft"] - 1]


@demand("sag-free: mean distance of the tips of all rods from the groom against without", at_most(0.15))
def _(work):
    return sum(rods_at_rest(work, True)[1]) / sum(rods_at_rest(work, False)[1])


@demand("sag-free: how far rods settle is as the report says (mean, over the measured)", at_most(0.05))
def _(work):
    report, tips = rods_at_rest(work, True)
    return abs(report["rod_sag_free"]["settles"]["mean"] * len(tips) / sum(tips) - 1)


@demand("sag-free: rods of random curls and straight strands at rest, soft ones named, same bytes for any threads (tests)", equal_to(True))
def _(work):
    return tests(work, "^rod_sag_free|bear their weight|bears its weight|too soft settle")
