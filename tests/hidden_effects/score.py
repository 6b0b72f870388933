"""Runs `sinew diagnose` on freshly hidden effects and counts what it says against the truth.

    python score.py --sinew ../../target/release/sinew --seed 1 --cases 20
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generate import FORMS, write_cases

# For one more line of the report only: an effect that shows this many noise levels beyond the tolerance. A sound muscle
# whose area is off its straight line shows less in 99 of 100 cases.
VISIBLE = 5.0


@dataclass(frozen=True)
class Outcome:
    """One case: what was hidden, what was said."""

    name: str
    truth: str
    detail: dict
    verdict: str
    causes: tuple
    alternatives: tuple
    improvement: float
    seconds: float

    @property
    def answer(self):
        """The first cause with its rivals, or the verdict where no cause is named."""
        return "|".join([self.causes[0], *self.alternatives]) if self.causes else self.verdict

    @property
    def named_exactly(self):
        return self.causes == (self.truth,) and not self.alternatives

    @property
    def named_in_pair(self):
        named = (*self.causes, *self.alternatives)
        return len(self.causes) == 1 and len(named) <= 2 and self.truth in named


def library(sinew):
    """Names of the effects that the tool can name."""
    listed = subprocess.run([sinew, "list", "effects", "--json"], check=True, capture_output=True, text=True)
    return {effect["name"] for effect in json.loads(listed.stdout)}


def diagnose(sinew, folder, name):
    """What the tool says of a case, and how long it takes; what it cannot do is an answer, too."""
    recordings = sorted((folder / "cases" / name).glob("*.csv"))
    out = folder / "answers" / name
    start = time.perf_counter()
    run = subprocess.run([sinew, "diagnose", *recordings, "--out", out], capture_output=True, text=True)
    seconds = time.perf_counter() - start
    if run.returncode != 0:
        print(f"{name}: {run.stderr.strip()}", file=sys.stderr)
        return {"verdict": "failed", "causes": [], "improvement": 0.0}, seconds
    return json.loads((out / "diagnosis.json").read_text()), seconds


def judge(sinew, folder, name):
    detail = json.loads((folder / "truths" / f"{name}.json").read_text())
    said, seconds = diagnose(sinew, folder, name)
    causes = tuple(cause["effect"] for cause in said["causes"])
    alternatives = tuple(said["causes"][0]["alternatives"]) if causes else ()
    return Outcome(
        name, detail["effect"], detail, said["verdict"], causes, alternatives, said["improvement"], seconds
    )


def wilson(hits, count, z=1.96):
    """95 % interval of a share."""
    if count == 0:
        return 0.0, 1.0
    share, spread = hits / count, z * z / count
    middle = (share + spread / 2) / (1 + spread)
    half = z * np.sqrt(share * (1 - share) / count + spread / (4 * count)) / (1 + spread)
    return middle - half, middle + half


def rate(title, outcomes, is_hit):
    hits = sum(map(is_hit, outcomes))
    if outcomes:
        low, high = wilson(hits, len(outcomes))
        print(f"  {title:48} {hits:4d}/{len(outcomes):<4d} {hits / len(outcomes):6.1%}  [{low:.1%}, {high:.1%}]")


def print_confusion(outcomes):
    print("Truth, and what was said (verdict, or cause and |rivals):")
    for truth in FORMS:
        said = Counter(f"{o.answer} ({o.verdict})" if o.causes else o.answer for o in outcomes if o.truth == truth)
        if said:
            print(f"  {truth:28}" + ",  ".join(f"{answer} {count}" for answer, count in said.most_common()))


def print_rates(outcomes, known):
    in_library = [o for o in outcomes if o.truth in known]
    sound = [o for o in outcomes if o.truth == "none"]
    foreign = [o for o in outcomes if o.truth not in known and o.truth != "none"]
    print("Rates with 95 % intervals:")
    rate("in library: named exactly", in_library, lambda o: o.named_exactly)
    rate("in library: named, or in a set of two", in_library, lambda o: o.named_in_pair)
    rate("in library: first cause right", in_library, lambda o: o.causes[:1] == (o.truth,))
    rate("in library: wrong first cause", in_library, lambda o: bool(o.causes) and o.causes[0] != o.truth)
    rate("in library: called nominal", in_library, lambda o: o.verdict == "nominal")
    visible = [o for o in in_library if o.detail["visibility"] > VISIBLE]
    rate("  of those that show: named, or in a set of two", visible, lambda o: o.named_in_pair)
    rate("none: called nominal", sound, lambda o: o.verdict == "nominal")
    rate("none: a cause named (false alarm)", sound, lambda o: bool(o.causes))
    rate("not in library: no name", foreign, lambda o: not o.causes)
    rate("not in library: a name (wrong)", foreign, lambda o: bool(o.causes))
    rate("not in library: called nominal (missed)", foreign, lambda o: o.verdict == "nominal")
    sets = [o for o in in_library if o.alternatives]
    rate("reported sets: truth inside", sets, lambda o: o.truth in (*o.causes, *o.alternatives))
    if sets:
        print(f"  mean size of reported sets {np.mean([1 + len(o.alternatives) for o in sets]):.2f}")
    seconds = [o.seconds for o in outcomes]
    print(f"  time per case: median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s")


def print_failures(outcomes, known):
    """One line for every answer that is not right, with what might explain it."""
    print("Not right:")
    for o in outcomes:
        wanted = o.truth in known
        right = o.named_in_pair if wanted else o.verdict == "nominal" if o.truth == "none" else not o.causes
        if not right:
            recordings = [(r["load_mass"], r["excitation"], *r["columns"]) for r in o.detail["recordings"]]
            shows = f"visibility {o.detail['visibility']:.1f}"
            print(f"  {o.name} {o.truth}/{o.detail['form']} -> {o.answer} ({o.verdict}), {shows}, {recordings}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sinew", required=True, help="the program")
    parser.add_argument("--seed", type=int, default=None, help="default: a fresh one, printed")
    parser.add_argument("--cases", type=int, default=5, help="of each effect")
    parser.add_argument("--effects", default=",".join(FORMS), help="separated by commas; NAME:COUNT for another count")
    parser.add_argument("--severity", type=float, default=1.0, help="size of the effects: 1 full, 0.333 one third")
    parser.add_argument("--keep", type=Path, default=None, help="folder for cases, truths and answers; default: none")
    options = parser.parse_args()
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy % 2**32)
    print(f"Seed {seed}, severity {options.severity}")
    truths = []
    for item in options.effects.split(","):
        effect, _, count = item.partition(":")
        truths += [effect] * int(count or options.cases)
    known = library(options.sinew)
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        names = write_cases(truths, options.severity, seed, folder)
        outcomes = [judge(options.sinew, folder, name) for name in names]
    print_confusion(outcomes)
    print_rates(outcomes, known)
    print_failures(outcomes, known)


if __name__ == "__main__":
    main()
