"""What a build pipeline trusts: readers, damaged assets, differences, messages."""

import json
import random
import re

from acceptance.demand import at_least, at_most, demand, equal_to

BAKE, RUN, DIFF = ("keratin-bake", "keratin-run", "keratin-diff")


def tests(work, pattern):
    """Number of tests that match and pass; a failure raises."""
    out, _ = work.run(f"ctest --test-dir build/release --no-tests=error -R '{pattern}'")
    return int(re.search(r"tests failed out of (\d+)", out).group(1))


def tail(work):
    """A baked ponytail tail."""
    recipe = work.path("trust.json")
    (work.root / recipe).write_text('{ "scale": 0.0027, "points_per_strand": 8, "curves": [ { "file": "'
                                    + str(work.root / "data/tressfx/tail.tfx") + '" } ] }')
    asset = work.path("trust.kera")
    work.run(f"{BAKE} {recipe} -o {asset} --quiet")
    return recipe, asset


@demand("every groom, mesh and recipe in data bakes, or is refused with a message that names it (tests)", equal_to(3))
def _(work):
    return tests(work, "^all_data: ")


@demand("malformed Alembic files take at most 16 times their size and 1 MiB, none crashes (tests)", at_least(5))
def _(work):
    return tests(work, "^alembic: .*(malformed|contain themselves|share their points|an object a curve|stay within)")


@demand("the ponytail's tail is the same within 1e-5 of its diagonal in each format (tests)", equal_to(2))
def _(work):
    return tests(work, "ponytail equals its TressFX strands in every format|ponytail's polylines equal")


@demand("what exporters write into Alembic files is read as meant (tests)", at_least(20))
def _(work):
    return tests(work, "^alembic: ")


@demand("readers and the opener stand their corpora and damaged copies of them (tests)", at_least(14))
def _(work):
    return tests(work, "^fuzz: ")


@demand("of 300 flipped bits of a baked file the check and the runner accept", equal_to(0))
def _(work):
    _, asset = tail(work)
    sound = (work.root / asset).read_bytes()
    chance = random.Random(1)
    damaged = work.path("damaged.kera")
    accepted = 0

    def accepts(command):
        work.run(command, expect=None)
        return work.exit_code == 0

    for number in range(300):
        data = bytearray(sound)
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        (work.root / damaged).write_bytes(data)
        accepted += accepts(f"{BAKE} --check {damaged} --quiet")
        if number % 10 == 0:
            accepted += accepts(f"{RUN} {damaged} --frames 1 --quiet")
    del work.commands[3:]  # all alike
    return accepted


@demand("any flipped bit, cut or appended byte of an asset with every field is refused (tests)", equal_to(1))
def _(work):
    return tests(work, "^diff: any flipped bit")


@demand("an error in each field of schema/fields.h is named by the diff, and nothing else (tests)", equal_to(1))
def _(work):
    return tests(work, "^diff: an error in one field is named, and nothing else")


@demand("a changed recipe shows as the recipe and its settings alone", equal_to("recipe settings"))
def _(work):
    recipe, asset = tail(work)
    text = (work.root / recipe).read_text()
    (work.root / recipe).write_text(text.replace("{", '{ "strand": { "damping": 0.2 },', 1))
    other = work.path("trust2.kera")
    work.run(f"{BAKE} {recipe} -o {other} --quiet")
    out, _ = work.run(f"{DIFF} {asset} {other} --json", expect=1)
    return " ".join(sorted(finding["name"] for finding in json.loads(out)["findings"]))
