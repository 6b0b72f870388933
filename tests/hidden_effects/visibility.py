"""How much of the hidden effects shows: what no muscle within the tolerance can stand for.

The sensors are those of the case, without their noise, which is the unit.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import lsq_linear

from plant import STEP, Specimen, simulate

TOLERANCE = 0.03  # of the preset's coefficients, that of the tool by default
SMALL = 0.01  # share by which a coefficient or a size is changed to see what that does


def add_visibility(cases):
    """How much the effects of a case show beyond what the tolerance allows; of two also each beside the other.

    All that is compared is simulated together.
    """
    compared = [(case, runs, known) for case, runs in cases for known in taken_as_known(case)]
    wanted = []
    for case, runs, known in compared:
        pairs = zip(case.plans, runs, strict=True)
        wanted.append([references(plan, run, hidden_of(case, plan, known)) for plan, run in pairs])
    done = iter(simulate([experiment for case in wanted for recording in case for experiment in recording]))
    for (case, runs, _), recordings in zip(compared, wanted, strict=True):
        case.visibility.append(visibility(case, runs, [[next(done) for _ in recording] for recording in recordings]))


def taken_as_known(case):
    """Which of the hidden effects are taken as known: none; of two also each, the second one first."""
    nothing = slice(0)
    return [nothing, slice(1, 2), slice(1)] if len(case.effects) == 2 else [nothing]


def hidden_of(case, plan, which):
    """Some of the hidden effects by name, as they are in a recording."""
    return dict(list(zip(case.effects, plan.experiment.hidden, strict=True))[which])


def references(plan, run, known):
    """The preset muscle in place of the true one, with those of the hidden effects that are known; then the same again
    and again, each time with a coefficient or a size of what is known more by SMALL.

    An imposed motion is taken as the sensor shows it, unless it is known what that sensor does.
    """
    motion = plan.experiment.motion
    knows_sensor = any(effect.startswith("contraction_sensor") for effect in known)
    if motion is not None and not knows_sensor:
        motion = np.interp(STEP * np.arange(len(motion)), run.time, run.contraction)
    hidden = tuple(known.values())
    as_preset = replace(plan.experiment, specimen=Specimen(), motion=motion, hidden=hidden)
    muscles = [replace(as_preset, specimen=Specimen(**change)) for change in one_coefficient_more()]
    sizes = [replace(as_preset, hidden=change) for change in one_size_more(hidden)]
    return [as_preset, *muscles, *sizes]


def one_coefficient_more():
    """Changes of a specimen, each of one of its coefficients."""
    changes = [{"damping": 1 + SMALL}]
    for name in ("area", "elastic"):
        nominal = getattr(Specimen, name)
        changes += [{name: tuple(nominal + SMALL * unit)} for unit in np.eye(len(nominal))]
    return changes


def one_size_more(hidden):
    """Hidden effects, each time with one of their sizes changed."""
    for which, (form, size) in enumerate(hidden):
        for name, value in size.items():
            changed = (form, {**size, name: (1 + SMALL) * value})
            yield (*hidden[:which], changed, *hidden[which + 1 :])


def visibility(case, runs, references):
    """How much of what is hidden and not known shows, in noise levels, in the signal where it shows most.

    The best muscle within the tolerance, and sizes of what is known, are found by linear least squares, without noise.
    """
    rows = {}
    for plan, run, own in zip(case.plans, runs, references, strict=True):
        at = run.time[run.time >= plan.begins][::10]
        truth, nominal, *changed = (course.signals(at) for course in (run, *own))
        inputs = {"command"} if plan.mass else {"command", "contraction"}
        for name in set(plan.columns) - inputs:
            slopes = [(other[name] - nominal[name]) / SMALL for other in changed]
            block = np.stack([truth[name] - nominal[name], *slopes], axis=1) / case.noise[name]["level"]
            rows.setdefault(name, []).append(block)
    return remaining({name: np.concatenate(blocks) for name, blocks in rows.items()})


def remaining(rows):
    """Largest rms per signal of the first column after the best combination of the others is taken off.

    The others are those of coefficients, which stay within the tolerance, and then those of sizes, which are free.
    """
    together = np.concatenate(list(rows.values()))
    bounds = np.full(together.shape[1] - 1, np.inf)
    bounds[: len(one_coefficient_more())] = TOLERANCE
    best = lsq_linear(together[:, 1:], together[:, 0], bounds=(-bounds, bounds)).x
    return float(max(np.sqrt(np.mean((block[:, 0] - block[:, 1:] @ best) ** 2)) for block in rows.values()))
