"""Contact of rods: the scenes of data/scenes/contact, the first part of each."""

import json
import re

from acceptance.demand import at_least, at_most, demand, equal_to

SCENES = {"bundle_on_bundle": 0.05, "bundle_on_cylinder": 0.06, "bundle_on_ground": 0.05,
          "strand_on_strand_0.3": 0.1, "strand_on_pipe_0.3": 0.1}
STRAND_DELTA, SOLID_DELTA = 1e-4, 5e-5  # m: two radii, and one


def stats(work, scene, contact="gauss_seidel"):
    def measure():
        text = (work.root / "data/scenes/contact" / f"{scene}.json").read_text()
        document = json.loads(re.sub(r"^//.*$", "", text, flags=re.M))
        document["settings"]["contact"] = contact
        file = work.write(f"{scene}.{contact}.json", json.dumps(document))
        out, _ = work.run(f"keratin-run {file} --duration {SCENES[scene]} --frame 0.001 --stats - --quiet")
        return json.loads(out)
    return work.once(f"{scene} {contact}", measure)


def overlap(s):
    depth = s["penetration"]
    return max((depth["strands"] or 0) / STRAND_DELTA, (depth["colliders"] or 0) / SOLID_DELTA)


def each(work, figure):
    return [figure(stats(work, scene)) for scene in SCENES]


@demand("strands overlap by at most 1 % of the contact distance at the end of any step", at_most(0.01))
def _(work):
    return max(each(work, overlap))


@demand("without contact the same check finds overlaps in every scene", at_least(0.1))
def _(work):
    return min(overlap(stats(work, scene, "none")) for scene in SCENES)


@demand("the mean Coulomb residual of the worst scene", at_most(1e-6))
def _(work):
    return max(each(work, lambda s: s["coulomb_residual"]["mean"]))


@demand("share of steps that end at the cap, worst scene", at_most(0.05))
def _(work):
    return max(each(work, lambda s: s["steps_at_cap"] / s["steps"]))


@demand("energy never rises", at_most(1e-6))
def _(work):
    def rise(s):
        total = [e["kinetic"] + e["elastic"] + e["potential"] for e in s["energy"]]
        return max(b - a for a, b in zip(total, total[1:])) / (max(total) - min(total))
    return max(each(work, rise))


@demand("two strands: |f_FB| is below 1e-3 within 20 iterations", at_most(1e-3))
def _(work):
    out, _ = work.run("keratin-run data/scenes/contact/two_strands.json --convergence --stats - --quiet")
    return json.loads(out)["convergence"][:20][-1]["f_fb"]


@demand("the hash is the same for 1 and 2 threads", equal_to(True))
def _(work):
    scene = "data/scenes/contact/bundle_on_cylinder.json"
    out = [json.loads(work.run(f"keratin-run {scene} --duration 0.03 --threads {n} --stats - --quiet")[0])["hash"]
           for n in (1, 2)]
    return out[0] == out[1]
