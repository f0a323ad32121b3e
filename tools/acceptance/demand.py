"""A demand: a sentence, a bound, and a function that measures. The files beside this one hold the
demands of one capability each; tools/accept runs them.

    @demand("a demo run stretches no segment by more than 5 %", at_most(0.05))
    def _(work):
        return work.json("keratin-run data/scenes/demo.json --stats -")["max_stretch"]
"""

import json
import os
import shlex
import subprocess

ALL = []


class Bound:
    def __init__(self, text, holds):
        self.text, self.holds = text, holds

    def __str__(self):
        return self.text


def at_most(limit, unit=""):
    return Bound(f"<= {limit}{unit and ' ' + unit}", lambda value: value <= limit)


def at_least(limit, unit=""):
    return Bound(f">= {limit}{unit and ' ' + unit}", lambda value: value >= limit)


def near(middle, reach):
    return Bound(f"{middle} +- {reach}", lambda value: abs(value - middle) <= reach)


def equal_to(expected):
    return Bound(f"= {expected}", lambda value: value == expected)


class NotJudged:
    """What a measurement returns when its bound does not hold here: it neither passes nor fails."""

    def __init__(self, value, reason):
        self.value, self.reason = value, reason


def judged(row):
    """The value of a row of keratin-bench that has a bound, where it holds on this machine."""
    return row["value"] if row["ok"] is not None else NotJudged(row["value"], "machine differs")


class Demand:
    def __init__(self, text, bound, function):
        self.text, self.bound, self.function = text, bound, function

    def measure(self, work):
        work.commands, work.notes = [], []
        try:
            value = self.function(work)
            ok = None if isinstance(value, NotJudged) else bool(self.bound.holds(value))
        except Exception as error:  # a measurement that breaks is a demand that fails
            value, ok = f"nothing: {error}", False
        if isinstance(value, NotJudged):
            value = f"{value.value:.6g} ({value.reason})"
        if isinstance(value, float):
            value = float(f"{value:.6g}")
        return {"demand": self.text, "commands": list(work.commands), "notes": list(work.notes), "measured": value,
                "bound": str(self.bound), "ok": ok}


def demand(text, bound):
    def add(function):
        ALL.append(Demand(text, bound, function))
        return function
    return add


class Workspace:
    """Where commands run (the project's root) and where their files go (folder)."""

    def __init__(self, root, folder):
        self.root, self.folder = root, folder
        self.commands = []
        self.notes = []  # what a measurement wants shown beside its value
        self.cache = {}
        folder.mkdir(parents=True, exist_ok=True)

    def path(self, name):
        return str((self.folder / name).relative_to(self.root))

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return self.path(name)

    def run(self, command, expect=0, environment=None):
        """Runs a command and returns (stdout, stderr). `expect`: the exit code, or None for any."""
        shown = " ".join(f"{k}={v}" for k, v in (environment or {}).items())
        self.commands.append(f"{shown} {command}".strip())
        arguments = shlex.split(command)
        program = self.root / "build" / "release" / "bin" / arguments[0]
        if program.exists():
            arguments[0] = str(program)
        done = subprocess.run(arguments, cwd=self.root, capture_output=True, text=True, timeout=1500,
                              env={**os.environ, **(environment or {})}, stdin=subprocess.DEVNULL)
        self.exit_code = done.returncode
        if expect is not None and done.returncode != expect:
            raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")
        return done.stdout, done.stderr

    def json(self, command):
        return json.loads(self.run(command)[0])

    def once(self, key, make):
        """make() the first time, its result ever after: for runs that several demands look at. The
        commands are shown with each of them."""
        if key not in self.cache:
            before = len(self.commands)
            value = make()
            self.cache[key] = (value, self.commands[before:])
        else:
            self.commands += self.cache[key][1]
        return self.cache[key][0]
