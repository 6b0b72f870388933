"""Runs `sinew diagnose` on freshly hidden effects and counts what it says against the truth.

    python score.py --sinew ../../target/release/sinew --seed 1 --cases 20
    python score.py --sinew … --effects none:300,known,pairs:200 --severity 1,0.333 --same-form --markdown tables.md

Cases are drawn anew for every seed and do not depend on each other; those of two sizes differ in the size alone.
"""

import argparse
import json
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from claims import contradictions
from generate import Kind, add_options, wanted_truths, write_cases
from judge import judge_all, library
from report import Score, markdown, print_score
from textbook import SAME_FORM

SIZES = {1.0: "full size", 0.333: "one third"}


@dataclass(frozen=True)
class Run(Kind):
    """Cases of one kind."""

    @property
    def title(self):
        size = SIZES.get(self.severity, f"{self.severity:g} of full size")
        return size + (", same form" if self.same_form else "")

    @property
    def folder(self):
        return self.title.replace(", ", "-").replace(" ", "-")


def fresh_seed():
    return int(np.random.SeedSequence().entropy % 2**32)


def wanted_runs(options):
    severities = [float(severity) for severity in options.severity.split(",")]
    same_form = {None: [False], "beside": [False, True], "only": [True]}[options.same_form]
    what = (options.session, options.edges, options.cut)
    return [Run(severity, same, *what) for severity in severities for same in same_form]


def score_run(run, options, seed, known, folder):
    """Draws the cases of a run, or takes those that are kept, and puts them to the tool."""
    if options.again:
        names = sorted(path.stem for path in (folder / "truths").glob("*.json"))
    else:
        truths = wanted_truths(options.effects, options.cases, seed, known)
        if run.same_form:
            truths = [truth for truth in truths if truth == "none" or truth in SAME_FORM]
        names = write_cases(truths, run, seed, folder, options.jobs, not options.check)
    outcomes = judge_all(names, options.sinew, folder, options.jobs, keep=bool(options.keep or options.again))
    return Score(outcomes, known)


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sinew", required=True, help="the program")
    parser.add_argument("--seed", type=int, default=None, help="default: a fresh one, printed")
    parser.add_argument("--severity", default="1", help="sizes of the effects, separated by commas: 1,0.333")
    parser.add_argument(
        "--same-form",
        nargs="?",
        const="beside",
        choices=["beside", "only"],
        help="also, or only, cases in the forms that the fit itself uses; they give the coverage of intervals",
    )
    parser.add_argument("--markdown", type=Path, default=None, help="file for the tables")
    parser.add_argument("--keep", type=Path, default=None, help="folder for cases, truths and answers; default: none")
    parser.add_argument("--again", type=Path, default=None, help="folder of --keep, to put its cases to the tool again")
    parser.add_argument("--check", action="store_true", help="status 1 if the score contradicts claims.py")
    add_options(parser)
    return parser.parse_args()


def main():
    options = read_options()
    seed = options.seed if options.seed is not None else fresh_seed()
    known = library(options.sinew)
    scores = {}
    with tempfile.TemporaryDirectory() as scratch:
        for run in wanted_runs(options):
            print(f"Kept cases of {options.again}" if options.again else f"Seed {seed}", run.title, sep=", ")
            folder = (options.again or options.keep or Path(scratch)) / run.folder
            scores[run.title] = score_run(run, options, seed, known, folder)
            print_score(scores[run.title])
    if options.markdown:
        source = f"Seed {seed}; {json.dumps(options.effects)}, {options.cases} cases each where no count is given.\n\n"
        options.markdown.write_text(source + markdown(scores))
    if options.check:
        sys.exit("\n".join(line for title, score in scores.items() for line in contradictions(title, score)) or 0)


if __name__ == "__main__":
    main()
