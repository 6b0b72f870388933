"""How small an effect may be and still be named: the share of cases against size, per effect.

    python detection.py --sinew ../../target/release/sinew --seed 9500 --cases 6 --out detection
    python detection.py --sinew … --seed 9501 --cases 6 --out detection --effects creep,leakage  # adds to what is there
    python detection.py --out detection                                                         # draws it again

`cases.csv` in the folder keeps one line per case. What is there already is not done again, so that it may be stopped,
and run in pieces with other seeds, effects and sizes. `detection.csv` and `detection.svg` are made from all lines.
A case counts as named if the one cause, alone or with one alternative, is the truth. Near and far forms as drawn.
"""

import argparse
import csv
import os
import tempfile
from collections import defaultdict
from pathlib import Path

from effects import KNOWN
from generate import Kind, write_cases
from judge import judge_all, library
from report import wilson

SIZES = "0.05,0.1,0.2,0.35,0.6,1"
FIELDS = ["effect", "size", "seed", "case", "form", "near_or_far", "visibility", "answer", "named", "named_exactly"]
COLUMNS = 4


def read_lines(file):
    if not file.exists():
        return []
    with open(file, newline="") as source:
        return list(csv.DictReader(source))


def append_lines(file, lines):
    is_new = not file.exists()
    with open(file, "a", newline="") as target:
        writer = csv.DictWriter(target, FIELDS)
        if is_new:
            writer.writeheader()
        writer.writerows(lines)


def measure(effects, size, options):
    """Lines for cases of one size; every effect has cases of its own."""
    truths = [effect for effect in effects for _ in range(options.cases)]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        names = write_cases(truths, Kind(size), options.seed, folder, options.jobs, visible=options.visibility)
        outcomes = judge_all(names, options.sinew, folder, options.jobs)
    return [line_of(outcome, size, options.seed) for outcome in outcomes]


def line_of(outcome, size, seed):
    visibility = outcome.detail["visibility"]
    return {
        "effect": outcome.truth,
        "size": f"{size:g}",
        "seed": seed,
        "case": outcome.name,
        "form": outcome.detail["forms"][0],
        "near_or_far": outcome.near_or_far,
        "visibility": "" if visibility is None else f"{visibility:.2f}",
        "answer": outcome.answer,
        "named": int(outcome.named),
        "named_exactly": int(outcome.named_exactly),
    }


def add_cases(options, file):
    """Effects a few at a time, so that not much is lost when it is stopped."""
    able = library(options.sinew)
    wanted = [effect for effect in options.effects.split(",") if effect in able]
    for size in map(float, options.sizes.split(",")):
        done = {line["effect"] for line in read_lines(file) if key(line) == (f"{size:g}", str(options.seed))}
        left = [effect for effect in wanted if effect not in done]
        for start in range(0, len(left), options.at_once):
            effects = left[start : start + options.at_once]
            append_lines(file, measure(effects, size, options))
            print(f"size {size:g}: {', '.join(effects)}", flush=True)


def key(line):
    return line["size"], line["seed"]


def shares(lines):
    """Cases, those named and those named exactly, for each effect and size, in order."""
    counts = defaultdict(lambda: [0, 0, 0])
    for line in lines:
        one = counts[line["effect"], float(line["size"])]
        for place, more in enumerate([1, int(line["named"]), int(line["named_exactly"])]):
            one[place] += more
    order = list(KNOWN)
    return sorted(
        ((effect, size, *count) for (effect, size), count in counts.items()),
        key=lambda row: (order.index(row[0]), row[1]),
    )


def write_table(rows, file):
    with open(file, "w", newline="") as target:
        writer = csv.writer(target)
        writer.writerow(["effect", "size", "cases", "named", "named_exactly", "share", "low", "high"])
        for effect, size, count, named, exactly in rows:
            limits = [f"{limit:.3f}" for limit in (named / count, *wilson(named, count))]
            writer.writerow([effect, f"{size:g}", count, named, exactly, *limits])


def draw(rows, file):
    """One small plot per effect: share named with its 95 % band, and that named exactly."""
    import matplotlib  # needed here only, so that everything else does without

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    plt.rcParams.update({"svg.hashsalt": "sinew", "svg.fonttype": "none", "font.size": 8})
    effects = list(dict.fromkeys(row[0] for row in rows))
    high = -(-len(effects) // COLUMNS)
    figure, axes = plt.subplots(
        high, COLUMNS, figsize=(10, 1.9 * high + 0.6), sharex=True, sharey=True, squeeze=False, layout="constrained"
    )
    for effect, place in zip(effects, axes.flat, strict=False):
        draw_one(place, effect, [row[1:] for row in rows if row[0] == effect])
    for place in axes.flat[len(effects) :]:
        place.set_visible(False)
    figure.supxlabel("size of the effect (1: full)")
    figure.supylabel("share of cases that are named")
    for place in axes.flat[max(len(effects) - COLUMNS, 0) : len(effects)]:
        place.tick_params(labelbottom=True)
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    figure.savefig(file, metadata={"Date": None})


def draw_one(place, effect, rows):
    sizes, counts, named, exactly = zip(*rows, strict=True)
    low, high = zip(*(wilson(hits, count) for hits, count in zip(named, counts, strict=True)), strict=True)
    place.fill_between(sizes, low, high, alpha=0.2, color="tab:blue", linewidth=0, label="95 % interval")
    place.plot(sizes, [a / b for a, b in zip(named, counts, strict=True)], "o-", ms=3, label="alone or in a set of two")
    place.plot(sizes, [a / b for a, b in zip(exactly, counts, strict=True)], ":", color="black", label="alone")
    place.set(title=effect, xscale="log", ylim=(-0.03, 1.03))
    place.set_xticks(sizes, [f"{size:g}" for size in sizes], minor=False)
    place.minorticks_off()
    place.grid(alpha=0.3)


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sinew", default=None, help="the program; without it only table and figure are made")
    parser.add_argument("--seed", type=int, default=9500)
    parser.add_argument("--cases", type=int, default=6, help="of each effect and size, for this seed")
    parser.add_argument("--effects", default=",".join(KNOWN), help="names, separated by commas")
    parser.add_argument("--sizes", default=SIZES, help="shares of full size, separated by commas")
    parser.add_argument("--out", type=Path, required=True, help="folder for lines, table and figure")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes side by side")
    parser.add_argument("--at-once", type=int, default=9, help="effects that are done, then written, together")
    parser.add_argument(
        "--visibility", action="store_true", help="also how much of each effect shows; costs as much again"
    )
    return parser.parse_args()


def main():
    options = read_options()
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "cases.csv"
    if options.sinew:
        add_cases(options, file)
    rows = shares(read_lines(file))
    write_table(rows, options.out / "detection.csv")
    draw(rows, options.out / "detection.svg")


if __name__ == "__main__":
    main()
