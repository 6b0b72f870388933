"""The tool beside two plain ways of naming a cause, on the same hidden cases.

    python compare.py --sinew ../../target/release/sinew --seed 9300 --effects known:2,none:12,any-unknown:12

Plain scipy (fit.py): every effect of a textbook library fitted by least squares on simulation error, the lowest BIC
has the name. pysindy (sindy.py): sparse regression of the residuals on terms that stand for the effects. Both know the
nominal model and its tolerance, and get the same files as the tool, of which they use 50 and 20 samples per second.
Needs, beyond tests/requirements.txt: pip install pysindy numba
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from fit import name_by_fit, read_case
from generate import Kind, add_options, wanted_truths, write_cases
from judge import covers, judge_all, library
from report import table, wilson
from sindy import name_by_sindy

PLAIN = {"plain scipy": name_by_fit, "pysindy": name_by_sindy}


class Answers:
    """Of one way: cases as pairs of truth and named causes, each a set, and the seconds they took."""

    def __init__(self):
        self.cases, self.seconds = [], []

    def add(self, truth, causes, seconds):
        self.cases.append((truth, causes))
        self.seconds.append(seconds)


def row(title, hits, count):
    low, high = wilson(hits, count)
    return title, f"{hits} of {count} ({100 * low:.0f}–{100 * high:.0f} %)" if count else "–"


def is_right(truth, causes):
    """One cause, alone or with one alternative, and the truth is among them."""
    return len(causes) == 1 and covers(causes[0], truth)


def rows_of(answers, known):
    """Titles and texts of one column of the table."""
    single = [case for case in answers.cases if case[0] in known]
    sound = [causes for truth, causes in answers.cases if truth == "none"]
    foreign = [causes for truth, causes in answers.cases if truth not in known and truth != "none"]
    right = sum(is_right(*case) for case in single)
    silent = sum(not causes for _, causes in single)
    return [
        row("one effect: named right, alone or in a set of two", right, len(single)),
        row("one effect: named wrongly, or in a larger set", len(single) - right - silent, len(single)),
        row("one effect: no name", silent, len(single)),
        row("no effect: a cause named (false alarm)", sum(map(bool, sound)), len(sound)),
        row("not in the library: no name", sum(not causes for causes in foreign), len(foreign)),
        ("time per case, median", f"{np.median(answers.seconds):.1f} s"),
    ]


def name_plainly(name, folder, names):
    """Answers of one of the plain ways, from the files alone."""
    for case in names:
        start = time.perf_counter()
        found = name(read_case(folder / "cases" / case))
        yield [found] if found else [], time.perf_counter() - start


def compare(folder, names, sinew):
    """Answers by way, and one line per case for those who want to look."""
    outcomes = judge_all(names, sinew, folder)
    ways = {"sinew": Answers(), **{title: Answers() for title in PLAIN}}
    for outcome in outcomes:
        ways["sinew"].add(outcome.truth, list(outcome.causes), outcome.seconds)
    for title, name in PLAIN.items():
        for outcome, answer in zip(outcomes, name_plainly(name, folder, names), strict=True):
            ways[title].add(outcome.truth, *answer)
            print(
                f"{outcome.name} {outcome.truth}/{'+'.join(outcome.detail['forms'])}: {title} says {answer[0]}",
                flush=True,
            )
    return ways, details(outcomes, ways)


def details(outcomes, ways):
    """What each way said of each case."""
    lines = []
    for number, outcome in enumerate(outcomes):
        said = [" + ".join("|".join(cause) for cause in way.cases[number][1]) or "–" for way in ways.values()]
        form = "+".join(outcome.detail["forms"]) + (f" ({outcome.near_or_far})" if outcome.near_or_far else "")
        lines.append((outcome.truth, form, *said))
    return lines


def warm_up(folder, names):
    """Compiles the simulation before anything is timed."""
    name_by_fit(read_case(folder / "cases" / names[0])[:1])


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sinew", required=True, help="the program")
    parser.add_argument("--seed", type=int, default=9300)
    parser.add_argument("--severity", type=float, default=1.0, help="size of the effects: 1 full, 0.333 one third")
    parser.add_argument("--markdown", type=Path, default=None, help="file for the tables")
    add_options(parser)
    parser.set_defaults(effects="known:1,none:8,any-unknown:8")
    return parser.parse_args()


def main():
    options = read_options()
    known = library(options.sinew)
    truths = wanted_truths(options.effects, options.cases, options.seed, known)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        kind = Kind(options.severity, session=options.session, edges=options.edges)
        names = write_cases(truths, kind, options.seed, folder, options.jobs, visible=False)
        warm_up(folder, names)
        ways, lines = compare(folder, names, options.sinew)
    columns = [dict(rows_of(way, known)) for way in ways.values()]
    text = table(["", *ways], [(title, *(column[title] for column in columns)) for title in columns[0]])
    print(text)
    if options.markdown:
        each = table(["hidden", "form", *ways], lines)
        options.markdown.write_text(f"Seed {options.seed}; `{options.effects}`.\n\n{text}\n\n{each}\n")


if __name__ == "__main__":
    main()
