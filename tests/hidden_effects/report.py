"""Rates and tables of many outcomes, for the terminal and for a document."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from effects import KNOWN
from unknown import UNKNOWN

# For one more line of the report only: an effect that shows this many noise levels beyond the tolerance. A sound muscle
# whose area is off its straight line shows less in 99 of 100 cases.
VISIBLE = 5.0

# Rates for which something is claimed.
NAMED = "one effect: named, or in a set of two"
NOMINAL = "no effect: called nominal"
NO_NAME = "not in the library: no name"
BOTH_NAMED = "two effects: both named, nothing else"
FIRST_OF_TWO = "two effects: first cause right"
TRUTH_IN_SET = "reported sets: a truth inside"

ORDER = {name: place for place, name in enumerate(["none", *KNOWN, *UNKNOWN])}


def wilson(hits, count, z=1.96):
    """95 % interval of a share."""
    if count == 0:
        return 0.0, 1.0
    share, spread = hits / count, z * z / count
    middle = (share + spread / 2) / (1 + spread)
    half = z * np.sqrt(share * (1 - share) / count + spread / (4 * count)) / (1 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass(frozen=True)
class Rate:
    """A share with its interval."""

    title: str
    hits: int
    count: int

    @property
    def text(self):
        low, high = wilson(self.hits, self.count)
        return f"{self.hits / self.count:.1%} ({self.hits}/{self.count}; {100 * low:.1f}–{100 * high:.1f})"


@dataclass(frozen=True)
class Measure:
    """Any other number."""

    title: str
    text: str


def share(title, outcomes, is_hit):
    """A rate as a list of one, empty where there is nothing to count."""
    outcomes = list(outcomes)
    return [Rate(title, sum(map(bool, map(is_hit, outcomes))), len(outcomes))] if outcomes else []


class Score:
    """What the outcomes of one run amount to; `known` are the effects that the tool can name."""

    def __init__(self, outcomes, known):
        self.outcomes, self.known = outcomes, known
        self.sound = [o for o in outcomes if not o.truths]
        self.single = [o for o in outcomes if len(o.truths) == 1 and o.truth in known]
        self.foreign = [o for o in outcomes if len(o.truths) == 1 and o.truth not in known]
        self.pairs = [o for o in outcomes if len(o.truths) == 2 and set(o.truths) <= known]
        self.in_library = self.single + self.pairs

    def lines(self):
        parts = [self.of_singles, self.of_sound, self.of_foreign, self.of_pairs, self.of_sets, self.of_gain]
        return [line for part in [*parts, self.of_coverage, self.of_time] for line in part()]

    def of_singles(self):
        visible = [o for o in self.single if all_show(o)]
        return [
            *share(NAMED, self.single, lambda o: o.named),
            *self.of_forms(),
            *share("one effect: named exactly", self.single, lambda o: o.named_exactly),
            *share("one effect that shows: named, or in a set of two", visible, lambda o: o.named),
            *share("one effect: first cause right", self.single, lambda o: o.first_right),
            *share("one effect: first cause wrong", self.single, is_wrong),
            *share("one effect: called nominal", self.single, lambda o: o.verdict == "nominal"),
            *self.of_macro_f1("one effect: macro-F1", self.single),
            *self.of_macro_f1("one effect that shows: macro-F1", visible),
        ]

    def of_forms(self):
        """Forms that a family of the tool holds, apart from those that none holds."""
        groups = {kind: [o for o in self.single if o.near_or_far == kind] for kind in ("near", "far")}
        lines = [share(f"… in a {kind} form", group, lambda o: o.named) for kind, group in groups.items()]
        wrong = [share(f"… in a {kind} form: first cause wrong", group, is_wrong) for kind, group in groups.items()]
        return sum(lines + wrong, [])

    def of_sound(self):
        return [
            *share(NOMINAL, self.sound, lambda o: o.verdict == "nominal"),
            *share("no effect: a cause named (false alarm)", self.sound, lambda o: o.causes),
        ]

    def of_foreign(self):
        return [
            *share(NO_NAME, self.foreign, lambda o: not o.causes),
            *share("not in the library: called nominal (missed)", self.foreign, lambda o: o.verdict == "nominal"),
        ]

    def of_pairs(self):
        visible = [o for o in self.pairs if all_show(o)]
        return [
            *share(BOTH_NAMED, self.pairs, lambda o: o.both_named),
            *share("two effects that each show beside the other: both named", visible, lambda o: o.both_named),
            *share(FIRST_OF_TWO, self.pairs, lambda o: o.first_right),
            *share("two effects that each show beside the other: first cause right", visible, lambda o: o.first_right),
            *share("two effects: a cause named that is not there", self.pairs, names_a_stranger),
        ]

    def of_sets(self):
        """Every cause named where the library holds the truth."""
        causes = [(cause, o.truths) for o in self.in_library for cause in o.causes]
        sets = [(cause, truths) for cause, truths in causes if len(cause) > 1]
        lines = []
        whole = "all named, with or without alternatives: a truth inside"
        for title, group in {TRUTH_IN_SET: sets, whole: causes}.items():
            lines += share(title, group, lambda pair: set(pair[0]) & set(pair[1]))
            if group:
                size = np.mean([len(cause) for cause, _ in group])
                lines.append(Measure(title.replace("a truth inside", "mean size"), f"{size:.2f}"))
        return lines

    def of_gain(self):
        lines = []
        named = [o for o in self.in_library if o.causes]
        for title, group in {"all cases": self.in_library, "a cause named": named}.items():
            ratios = [ratio for o in group if (ratio := o.gain_ratio) is not None]
            if ratios:
                lower, middle, upper = np.quantile(ratios, [0.25, 0.5, 0.75])
                text = f"{middle:.3f} (quartiles {lower:.3f}, {upper:.3f}; {len(ratios)} cases)"
                lines.append(Measure(f"share of the true model's held-out gain, median: {title}", text))
        return lines

    def of_coverage(self):
        covered = [item for o in self.single for item in o.coverage.items()]
        stated = [(name, inside) for name, inside in covered if inside is not None]
        lines = share("95 % intervals hold the truth", stated, lambda item: item[1])
        for wanted in sorted({name for name, _ in covered}):
            own = [item for item in stated if item[0] == wanted]
            lines += share(f"… {wanted}", own, lambda item: item[1]) or [Measure(f"… {wanted}", "never stated")]
        return lines

    def of_time(self):
        seconds = [o.seconds for o in self.outcomes]
        return [Measure("time per case", f"{np.median(seconds):.1f} s median, {max(seconds):.1f} s longest")]

    def of_macro_f1(self, title, single):
        """Mean over the effects of the library that were hidden alone; a set of two with the truth counts as the truth.

        False alarms on sound muscles and names for what is in no library count against the name that was given.
        """
        pairs = [(o.truth, label(o)) for o in single + self.sound + self.foreign]
        scores = []
        for effect in {o.truth for o in single}:
            hits = sum(pair == (effect, effect) for pair in pairs)
            scores.append(2 * hits / sum((truth == effect) + (answer == effect) for truth, answer in pairs))
        return [Measure(title, f"{np.mean(scores):.3f}")] if scores else []

    def is_right(self, o):
        if not o.truths:
            return o.verdict == "nominal"
        if len(o.truths) == 2:
            return o.both_named
        return o.named if o.truth in self.known else not o.causes

    def confusion(self):
        """Rows of truth, number of cases, and the answers with their numbers; pairs last."""
        rows = []
        for truth in sorted({o.truth for o in self.outcomes}, key=lambda truth: (ORDER.get(truth, len(ORDER)), truth)):
            own = [o for o in self.outcomes if o.truth == truth]
            rows.append((truth, len(own), Counter(o.answer for o in own).most_common()))
        return rows


def all_show(o):
    """Whether the effect of a case shows, or each of two beside the other."""
    return min(shown(o), default=0) > VISIBLE


def shown(o):
    """In noise levels how much the effect of a case shows, or each of two beside the other; empty where not known."""
    alone, each = o.detail["visibility"], o.detail.get("visibility_of_each", [])
    return each or ([] if alone is None else [alone])


def is_wrong(o):
    return o.causes and not o.first_right


def names_a_stranger(o):
    return any(not set(cause) & set(o.truths) for cause in o.causes)


def label(o):
    """The one answer that a case counts as."""
    if len(o.truths) == 1 and o.named:
        return o.truth
    return o.causes[0][0] if o.causes else o.verdict


# --- Terminal ---------------------------------------------------------------------------------------------------------


def print_score(score):
    print("Truth -> answers (cause|alternatives + second cause, or the verdict where no cause is named):")
    for truth, count, answers in score.confusion():
        print(f"  {truth:28} {count:4d} -> " + ",  ".join(f"{answer} {n}" for answer, n in answers))
    print("Rates with 95 % intervals:")
    for line in score.lines():
        print(f"  {line.title:60} {line.text}")
    print_failures(score)


def print_failures(score):
    """One line for every answer that is not right, with what might explain it."""
    print("Not right:")
    for o in score.outcomes:
        if not score.is_right(o):
            shown_of = ("load_mass", "excitation", "edges")
            recordings = [(*map(r.get, shown_of), *r["columns"]) for r in o.detail["recordings"]]
            shows = f" visibility {' and '.join(f'{value:.1f}' for value in shown(o))}," if shown(o) else ""
            hidden = f"{o.truth}/{'+'.join(o.detail['forms'])}" + (f" ({o.near_or_far})" if o.near_or_far else "")
            print(f"  {o.name} {hidden} -> {o.answer} ({o.verdict}),{shows} {recordings}")


# --- Document ---------------------------------------------------------------------------------------------------------


def markdown(scores):
    """Tables of scores by title: one of rates with a column each, then one of confusion each."""
    columns = {title: {line.title: line.text for line in score.lines()} for title, score in scores.items()}
    titles = list(dict.fromkeys(line for column in columns.values() for line in column))
    rows = [[line, *(column.get(line, "") for column in columns.values())] for line in titles]
    parts = [table(["", *scores], rows)]
    for title, score in scores.items():
        rows = [(truth, count, ", ".join(f"{a} {n}" for a, n in said)) for truth, count, said in score.confusion()]
        parts.append(f"Hidden → answers, {title}:\n\n" + table(["hidden", "cases", "answers"], rows))
    return "\n\n".join(parts) + "\n"


def table(header, rows):
    cells = [list(map(str, header)), ["---"] * len(header), *(list(map(str, row)) for row in rows)]
    return "\n".join("| " + " | ".join(cell.replace("|", " or ") for cell in row) + " |" for row in cells)
