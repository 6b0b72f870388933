"""One case put to the tool, and what its answer is worth against the truth."""

import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

LONGEST = 300  # s, after which the tool counts as stuck
# An effect whose true model would gain less than this has nothing to be a fraction of.
WORTH_GAINING = 0.05


@dataclass(frozen=True)
class Outcome:
    """One case: what was hidden, what was said, how long it took in s."""

    name: str
    detail: dict
    said: dict
    seconds: float

    @cached_property
    def truths(self):
        return tuple(self.detail["effects"])

    @property
    def truth(self):
        return self.detail["effect"]

    @property
    def near_or_far(self):
        """What the form of a single effect is to the families of the tool; None for everything else."""
        kinds = self.detail.get("near_or_far", [])
        return kinds[0] if len(kinds) == 1 else None

    @property
    def verdict(self):
        return self.said["verdict"]

    @cached_property
    def causes(self):
        """Each cause as the set that was reported: its name, then the alternatives."""
        return tuple((cause["effect"], *cause["alternatives"]) for cause in self.said["causes"])

    @property
    def answer(self):
        """The causes with their alternatives, or the verdict where no cause is named."""
        return " + ".join("|".join(cause) for cause in self.causes) or self.verdict

    @property
    def named_exactly(self):
        return self.causes == (self.truths[:1],)

    @property
    def named(self):
        """The one effect alone, exactly or in a set of two."""
        return len(self.causes) == 1 and covers(self.causes[0], self.truths[0])

    @property
    def both_named(self):
        """Each of two effects by a cause of its own, in any order, and nothing else."""
        if len(self.causes) != 2:
            return False
        return any(all(map(covers, order, self.truths)) for order in (self.causes, self.causes[::-1]))

    @property
    def first_right(self):
        return bool(self.causes) and any(covers(self.causes[0], truth) for truth in self.truths)

    @property
    def gain_of_truth(self):
        """Improvement on held-out samples by a model that knows everything: it leaves the noise of the sensors."""
        signals = self.said.get("signals", {})
        weighted = [(signals[name], level) for name, level in self.detail["noise_rms"].items() if name in signals]
        nominal = sum((signal["nominal_rms"] / signal["noise_rms"]) ** 2 for signal, _ in weighted)
        floor = sum((level / signal["noise_rms"]) ** 2 for signal, level in weighted)
        return 1 - np.sqrt(floor / nominal) if nominal > 0 else 0.0

    @property
    def gain_ratio(self):
        """What was gained as a fraction of what there was to gain; None where there was next to nothing."""
        possible = self.gain_of_truth
        return self.said["improvement"] / possible if possible > WORTH_GAINING else None

    @property
    def coverage(self):
        """Per true parameter whether the stated interval holds it, None where none is stated.

        Empty unless the true effect was named first.
        """
        if not self.causes or self.causes[0][0] not in self.truths:
            return {}
        stated = self.said["causes"][0]["parameters"]
        return {
            name: stated[name]["low"] <= value <= stated[name]["high"] if name in stated else None
            for name, value in self.detail.get("parameters", {}).items()
        }


def covers(cause, truth):
    """Whether a reported set of at most two holds a truth."""
    return len(cause) <= 2 and truth in cause


def library(sinew):
    """Names of the effects that the tool can name."""
    listed = subprocess.run([sinew, "list", "effects", "--json"], check=True, capture_output=True, text=True)
    return {effect["name"] for effect in json.loads(listed.stdout)}


def diagnose(sinew, recordings, out, environment):
    """What the tool says of recordings; what it cannot do is an answer, too."""
    failed = {"verdict": "failed", "causes": [], "signals": {}, "improvement": 0.0}
    command = [sinew, "diagnose", *recordings, "--out", out]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, env=environment)
    except subprocess.TimeoutExpired:
        print(f"{out.name}: not done after {LONGEST} s", file=sys.stderr)
        return failed
    if run.returncode != 0:
        print(f"{out.name}: {run.stderr.strip()}", file=sys.stderr)
        return failed
    return json.loads((out / "diagnosis.json").read_text())


def judge(name, sinew, folder, environment=None, keep=False):
    recordings = sorted((folder / "cases" / name).glob("*.csv"))
    out = folder / "answers" / name
    start = time.perf_counter()
    said = diagnose(sinew, recordings, out, environment)
    seconds = time.perf_counter() - start
    if not keep:
        shutil.rmtree(out, ignore_errors=True)  # reports and FMUs of hundreds of cases fill a disk
    return Outcome(name, json.loads((folder / "truths" / f"{name}.json").read_text()), said, seconds)


def judge_all(names, sinew, folder, jobs=1, keep=False):
    """Outcomes in the order of the names. Side by side, the processes share the cores."""
    environment = dict(os.environ)
    if jobs > 1:
        environment["RAYON_NUM_THREADS"] = str(max((os.cpu_count() or 1) // jobs, 1))
    task = partial(judge, sinew=sinew, folder=folder, environment=environment, keep=keep)
    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(task, names))
