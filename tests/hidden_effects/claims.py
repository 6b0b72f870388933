"""The rates that docs/diagnosis.md claims, which a fresh batch must not contradict.

TO BE SET AFTER EACH FINAL MEASUREMENT: until then, what the project set itself to reach. A batch contradicts a claim
when, if the claim held, so few hits or fewer would come up with a probability below IMPROBABLE. A sound tool fails less
than once in a thousand batches per claim, one that has become much worse nearly always.
"""

from scipy.stats import binom

from report import BOTH_NAMED, FIRST_OF_TWO, NAMED, NO_NAME, NOMINAL, TRUTH_IN_SET

IMPROBABLE = 1e-3

CLAIMED = {
    "full size": {
        NAMED: 0.97,
        NOMINAL: 0.99,
        NO_NAME: 0.95,
        BOTH_NAMED: 0.85,
        FIRST_OF_TWO: 0.99,
        TRUTH_IN_SET: 0.99,
    },
    "one third": {
        NAMED: 0.85,
        NO_NAME: 0.90,
        BOTH_NAMED: 0.60,
        FIRST_OF_TWO: 0.90,
        TRUTH_IN_SET: 0.97,
    },
}


def contradictions(title, score):
    """One sentence for each claim about a run that its score contradicts."""
    found = []
    rates = {line.title: line for line in score.lines()}
    for name, claimed in CLAIMED.get(title, {}).items():
        if name in rates:
            hits, count = rates[name].hits, rates[name].count
            chance = binom.cdf(hits, count, claimed)
            if chance < IMPROBABLE:
                found.append(f"{title}, {name}: {hits} of {count}; {claimed:.0%} is claimed (chance {chance:.1g})")
    return found
