"""The rates that docs/diagnosis.md claims, which a fresh batch must not contradict.

To be set after each measurement. What the project wants to reach is more: 97, 99, 95, 85 and 99 %. A batch
contradicts a claim when, if the claim held, so few hits or fewer would come up with a probability below IMPROBABLE. A
sound tool fails less than once in a thousand batches per claim, one that has become much worse nearly always.
"""

from scipy.stats import binom

from report import BOTH_NAMED, FIRST_OF_TWO, NAMED, NO_NAME, NOMINAL

IMPROBABLE = 1e-3

CLAIMED = {
    "full size": {
        NAMED: 0.9,
        NOMINAL: 0.99,
        NO_NAME: 0.9,
        BOTH_NAMED: 0.75,
        FIRST_OF_TWO: 0.9,
    },
}


def contradictions(title, score):
    """One sentence for each claim about a run that its score contradicts."""
    found = []
    rates = {line.title: line for line in score.lines()}
    for name, claimed in CLAIMED.get(title, {}).items():
        if name in rates:
            hits, count = rates[name].hits, rates[name].count
            if binom.cdf(0, count, claimed) >= IMPROBABLE:
                found.append(f"{title}, {name}: {count} cases are too few to contradict {claimed:.0%}")
            chance = binom.cdf(hits, count, claimed)
            if chance < IMPROBABLE:
                found.append(f"{title}, {name}: {hits} of {count}; {claimed:.0%} is claimed (chance {chance:.1g})")
    return found
