"""Recordings with effects hidden in them, drawn from a seed; the truth goes to a place of its own.

    python generate.py --seed 1 --cases 5 --out hidden      # 5 cases of every effect in hidden/cases, hidden/truths

A truth is `none`, the name of an effect, or two names with a plus between them. Every case has random numbers of its
own, from the seed and its number: what else is drawn beside it, and by how many processes, does not matter.
"""

import argparse
import json
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import lfilter

from effects import KNOWN
from far import FAR, SINCE_HELD
from pairs import NEEDS_COLUMN_IN_PAIR, PAIRS
from plant import STEP, VALVE_GAIN, Experiment, Specimen, holding_pressure, simulate
from textbook import SAME_FORM, true_parameters
from unknown import UNKNOWN
from visibility import add_visibility

FORMS = {**KNOWN, **UNKNOWN}
NEAR_OR_FAR = {
    **dict.fromkeys(sum(KNOWN.values(), []), "near"),
    **dict.fromkeys(sum(FAR.values(), []), "far"),
    # Were far until the families of the tool were widened with a sight of them.
    **dict.fromkeys(SINCE_HELD, "near"),
}
DRIVEN_SHARE = 0.25
CUT = (3, 8)  # s before a recording that begins on the way
MOST_DRAWS = 20
CONTRACTION = (0.045, 0.165)  # m, of commands at rest; overshoot takes some more
COMMAND_STEP = 0.00025  # V, of the logger
ALLOWED = (0.015, 0.225)  # m, of everything that happens
SHOWN_OF_PLAN = ("excitation", "edges", "columns", "rate", "jitter", "begins")
CASES_PER_BLOCK = 60  # made by one process at a time; larger ones take memory, smaller ones time

# What must be there for an effect to show at all.
HANGING_ONLY = {
    "payload_mass", "series_elasticity", "contraction_sensor_gain", "contraction_sensor_delay", "unknown_rubber_stop",
    "unknown_pendulum", "unknown_guide_spot", "unknown_loose_bracket", "unknown_breathing_frame",
    "unknown_trembling_frame", "unknown_kinked_hose", "unknown_side_wall", "unknown_slipping_wheel",
    "unknown_eccentric_pulley", "unknown_cross_talk", "unknown_drifting_clock", "unknown_slow_amplifier",
    "unknown_wavy_encoder", "unknown_frozen_sensor", "unknown_shaking_floor", "unknown_cell_hysteresis",
}  # fmt: skip
NEEDS_COLUMN = {
    "pressure_sensor_offset": "gauge_pressure",
    "pressure_sensor_gain": "gauge_pressure",
    "force_sensor_offset": "force",
    "force_sensor_gain": "force",
    "unknown_mains_hum": "force",
    "unknown_cross_talk": "force",
    "unknown_wandering_zero": "force",
    "unknown_slow_amplifier": "force",
    "unknown_cell_hysteresis": "force",
    "unknown_hose_to_sensor": "gauge_pressure",
}
OF_VALVE = {
    "valve_lag", "valve_resonance", "valve_dead_time", "valve_dead_band", "valve_gain", "valve_offset",
    "supply_saturation", "flow_limit", "leakage", "unknown_coarse_converter", "unknown_compressor_cycle",
    "unknown_hunting_valve", "unknown_warm_gas", "unknown_hose_to_sensor", "pressure_sensor_offset",
    "pressure_sensor_gain",
}  # fmt: skip


@dataclass(frozen=True)
class Session:
    """What was recorded of a case: how many recordings, their durations in s, samples per second."""

    recordings: tuple
    seconds: tuple
    rates: tuple


USUAL = Session(recordings=(1, 2, 3), seconds=(22, 38), rates=(50, 80, 100, 125, 200))
LONG = Session(recordings=(2,), seconds=(65, 65), rates=(200,))  # 26 000 samples


@dataclass(frozen=True)
class Kind:
    """What cases have in common: the size of their effects, whether these have the forms of the fit, the session."""

    severity: float = 1.0
    same_form: bool = False
    session: Session = USUAL
    edges: str | None = None  # one of EDGES for all cases; None: drawn
    cut: bool = False  # recordings begin somewhere on the way, and not at rest


@dataclass
class Plan:
    """One recording before it is made."""

    experiment: Experiment
    mass: float | None
    columns: tuple
    excitation: str
    edges: str
    rate: float
    jitter: float
    begins: float  # s after the experiment


@dataclass
class Case:
    """What is hidden, and the recordings that hide it."""

    effects: tuple
    kind: Kind
    hidden: tuple
    specimen: Specimen
    noise: dict
    plans: list = field(default_factory=list)
    visibility: list = field(default_factory=list)


# --- Commands ---------------------------------------------------------------------------------------------------------


def held_levels(random, duration, shortest, longest, levels):
    """Piecewise constant on the grid; levels come from an iterator."""
    count = round(duration / STEP)
    out, start = np.empty(count), 0
    while start < count:
        stop = start + round(random.uniform(shortest, longest) / STEP)
        out[start:stop] = next(levels)
        start = stop
    return out


def staircase(random, duration):
    steps = random.integers(4, 8)
    climb = np.concatenate([np.linspace(0, 1, steps), np.linspace(1, 0, steps)[1:-1]])
    climb = np.roll(climb, random.integers(len(climb)))
    return held_levels(random, duration, 1.5, 3.5, iter(np.tile(climb, 100)))


def random_steps(random, duration):
    """Steps of at most a third of the range: larger ones would throw the load out of it."""

    def levels():
        level = random.uniform(0.2, 0.8)
        while True:
            yield level
            level = np.clip(level + random.choice([-1, 1]) * random.uniform(0.05, 0.33), 0, 1)

    return held_levels(random, duration, 0.6, 3.0, levels())


def ramps(random, duration):
    """Triangles and trapezes at rates from slow to fast, of several amplitudes."""
    times, levels = [0.0], [random.uniform(0.2, 0.8)]
    while times[-1] < duration:
        target = random.uniform(0, 1)
        rate = np.exp(random.uniform(np.log(0.08), np.log(1.0)))
        times += [times[-1] + abs(target - levels[-1]) / rate + 0.05]
        levels += [target]
        if random.random() < 0.5:
            times += [times[-1] + random.uniform(0.3, 2)]
            levels += [target]
    return np.interp(STEP * np.arange(round(duration / STEP)), times, levels)


def multisine(random, duration):
    t = STEP * np.arange(round(duration / STEP))
    frequencies = np.exp(random.uniform(np.log(0.05), np.log(0.8), random.integers(4, 9)))
    waves = [np.sin(2 * np.pi * f * t + random.uniform(0, 2 * np.pi)) / np.sqrt(1 + 4 * f) for f in frequencies]
    total = np.sum(waves, axis=0)
    return (total - total.min()) / np.ptp(total)


EXCITATIONS = {"staircase": staircase, "ramps": ramps, "multisine": multisine, "random_steps": random_steps}


# How the command turns: its corners rounded over 0.1 s by a filter; sharp, at any time, as where a logger runs by
# itself; sharp, steps at samples, as where one program sets and logs the command; held from sample to sample, ramps
# too, as by a digital controller that logs what it sets.
EDGES = ("rounded", "sharp", "at_samples", "held")
EDGES_SHARES = (0.4, 0.2, 0.2, 0.2)


def course(random, excitation, duration, edges="rounded", rate=None):
    """A share of the range over time: a second of rest, then the excitation."""
    share = EXCITATIONS[excitation](random, duration)
    share = np.concatenate([np.full(round(1 / STEP), share[0]), share])
    if edges == "rounded":
        return uniform_filter1d(share, round(0.1 / STEP), mode="nearest")
    if edges == "held" or edges == "at_samples" and excitation in ("staircase", "random_steps"):
        per_sample = round(1 / (rate * STEP))
        return share[np.arange(len(share)) // per_sample * per_sample]
    return share


def hanging_command(share, mass, reach):
    middle, half = np.mean(CONTRACTION), reach * np.ptp(CONTRACTION) / 2
    wanted = middle + half * (2 * share - 1)
    return holding_pressure(wanted, mass) / VALVE_GAIN


def imposed_motion(random, duration):
    """A testing machine: strokes at several rates, starting gently."""
    share = course(random, random.choice(["ramps", "multisine"]), duration)
    return uniform_filter1d(0.03 + 0.15 * share, round(0.3 / STEP), mode="nearest")


# --- Cases ------------------------------------------------------------------------------------------------------------


def draw_specimen(random, same_form):
    """Within 2 % of the preset, its area up to 0.15 % off a straight line, unless the fit is to hold the truth.

    In one half of all muscles area and elastic force are off as a whole, in the other each coefficient by itself.
    """
    each = random.random() < 0.5
    area, elastic = (off_by(random, count if each else 1) * np.ones(count) for count in (2, 4))
    damping = off_by(random, 1).item()
    ripple, phase = random.uniform(0, 0.0015), random.uniform(0, 2 * np.pi)
    return Specimen(tuple(area), tuple(elastic), damping, ripple=0.0 if same_form else ripple, ripple_phase=phase)


def off_by(random, count):
    """Factors on that many coefficients of a sound muscle."""
    return random.uniform(0.98, 1.02, count)


def draw_noise(random):
    """Standard deviation (coloured and white together), memory in s, resolution, per column in SI."""
    typical = {"gauge_pressure": 250.0, "contraction": 5e-5, "force": 0.8}
    drawn = {}
    for column, level in typical.items():
        level *= np.exp(random.uniform(-0.8, 0.8))
        drawn[column] = {
            "level": level,
            "white_share": random.uniform(0.3, 0.9),
            "memory": random.uniform(0.01, 0.06),
            "resolution": level * random.uniform(0.2, 1.5),
        }
    return drawn


def needed_columns(effects):
    tables = [NEEDS_COLUMN, NEEDS_COLUMN_IN_PAIR] if len(effects) > 1 else [NEEDS_COLUMN]
    return {table[effect] for table in tables for effect in effects if effect in table}


def draw_columns(random, effects, driven):
    """Which sensors were logged; never without those that the effects are about."""
    if driven:
        choices = [("gauge_pressure", "force", "command")] * 3 + [("force", "command")]
        if not OF_VALVE & set(effects):
            choices.append(("gauge_pressure", "force"))
        choices = [("contraction", *columns) for columns in choices]
    else:
        choices = [("gauge_pressure", "force")] * 3 + [("gauge_pressure",), ("force",), ()]
        choices = [("command", "contraction", *columns) for columns in choices]
    choices = [columns for columns in choices if needed_columns(effects) <= set(columns)]
    return choices[random.integers(len(choices))]


def draw_mass(random, effects):
    heaviest = 25 if "threshold_pressure" in effects else 80  # a threshold shows at low pressure only
    return float(np.round(np.exp(random.uniform(np.log(10), np.log(heaviest))), 1))


def draw_hidden(random, effects, kind):
    """Pairs of form and size. Near forms and far ones are equally likely, however many there are."""
    hidden = []
    for effect in effects:
        if kind.same_form:
            forms = SAME_FORM[effect][:1]
        else:
            forms = FAR[effect] if effect in FAR and random.random() < 0.5 else FORMS[effect]
        form = forms[random.integers(len(forms))]
        hidden.append((form, form.sizes(random, kind.severity)))
    return hidden


def draw_case(random, truth, kind):
    effects = () if truth == "none" else tuple(truth.split("+"))
    driven = not HANGING_ONLY & set(effects) and random.random() < DRIVEN_SHARE
    columns = draw_columns(random, effects, driven)
    masses = [None if driven else draw_mass(random, effects) for _ in range(random.choice(kind.session.recordings))]
    hidden = draw_hidden(random, effects, kind)
    specimen, noise = draw_specimen(random, kind.same_form), draw_noise(random)
    rate, jitter = random.choice(kind.session.rates), random.choice([0.0, random.uniform(0.02, 0.2)])
    edges = kind.edges or str(random.spawn(1)[0].choice(EDGES, p=EDGES_SHARES))
    jitter = jitter if edges in ("rounded", "sharp") else 0.0
    relaxed = bool(random.random() < 0.5) or kind.same_form
    excitations = [random.choice(list(EXCITATIONS)) for _ in masses]
    both = list(zip(masses, excitations, strict=True))
    seconds = kind.session.seconds
    bare = [draw_experiment(random, mass, excitation, seconds, edges, rate) for mass, excitation in both]
    hidden = tuple((form, form.suited(size, bare)) for form, size in hidden)
    case = Case(effects, kind, hidden, specimen, noise)
    for number, (experiment, excitation) in enumerate(zip(bare, excitations, strict=True)):
        here = tuple((form, form.in_recording(size, number)) for form, size in hidden)
        full = replace(experiment, specimen=specimen, hidden=here, relaxed=relaxed)
        begins = float(random.uniform(*CUT)) if kind.cut else 0.0
        plan = Plan(full, experiment.mass, columns, str(excitation), edges, float(rate), float(jitter), begins)
        case.plans.append(plan)
    return case


def draw_experiment(random, mass, excitation, seconds, edges, rate):
    """Without specimen and effects, as yet."""
    duration = random.uniform(*seconds)
    if mass is None:
        low, high = random.uniform(0.8, 1.5), random.uniform(2.5, 4.5)
        command = low + (high - low) * course(random, excitation, duration, edges, rate)
        return Experiment(Specimen(), command, motion=imposed_motion(random, duration))
    reach = random.uniform(0.6, 1.0)
    command = hanging_command(course(random, excitation, duration, edges, rate), mass, reach)
    return Experiment(Specimen(), command, mass)


# --- Sensors and files ------------------------------------------------------------------------------------------------


def sample_times(random, plan, length):
    period = 1 / plan.rate
    times = np.arange(0, length - period, period)
    times[1:] += period * plan.jitter * random.uniform(-1, 1, len(times) - 1)
    return np.round(times[times >= plan.begins], 5)


def reading(random, signal, rate, noise):
    """Noise with a memory and without, finite resolution, a few samples lost."""
    kept = np.exp(-1 / (rate * noise["memory"]))
    shocks = random.standard_normal(len(signal) + 200) * np.sqrt(1 - kept**2)
    coloured = lfilter([1], [1, -kept], shocks)[200:]
    white = noise["white_share"]
    disturbance = np.sqrt(1 - white**2) * coloured + white * random.standard_normal(len(signal))
    shown = noise["resolution"] * np.round((signal + noise["level"] * disturbance) / noise["resolution"])
    shown[random.choice(np.arange(1, len(shown)), random.integers(0, 9), replace=False)] = np.nan
    return shown


UNITS = {
    "time": ("s", 1.0, 5), "command": ("V", 1.0, 5), "gauge_pressure": ("bar", 1e-5, 6), "contraction": ("mm", 1e3, 5),
    "force": ("N", 1.0, 3), "load_mass": ("kg", 1.0, 1),
}  # fmt: skip


def write_recording(path, columns):
    headers = [f"{name} [{UNITS[name][0]}]" for name in columns]
    scaled = [UNITS[name][1] * values for name, values in columns.items()]
    decimals = [UNITS[name][2] for name in columns]
    with open(path, "w") as file:
        file.write(",".join(headers) + "\n")
        for row in zip(*scaled, strict=True):
            cells = ["" if np.isnan(v) else f"{v:.{d}f}" for v, d in zip(row, decimals, strict=True)]
            file.write(",".join(cells) + "\n")


def recorded(random, case, plan, run):
    """Columns as the logger has them, and by how much each measured one is off what ideal sensors show."""
    times = sample_times(random, plan, run.time[-1])
    signals = run.signals(times)
    grid = STEP * np.arange(len(plan.experiment.command))
    columns, errors = {"time": times}, {}
    for name in plan.columns:
        if name == "command":
            columns[name] = COMMAND_STEP * np.round(np.interp(times, grid, plan.experiment.command) / COMMAND_STEP)
        else:
            columns[name] = reading(random, signals[name], plan.rate, case.noise[name])
            errors[name] = columns[name] - signals[name]
    if plan.mass is not None:
        columns["load_mass"] = np.full(len(times), plan.mass)
    return columns, errors


def is_feasible(run):
    return ALLOWED[0] < run.contraction.min() and run.contraction.max() < ALLOWED[1]


def make(numbered, kind, seed):
    """Cases for pairs of number and truth, with the courses of their recordings, in the order given.

    What leaves the feasible range is drawn anew.
    """
    randoms = [np.random.default_rng([seed, number]) for number, _ in numbered]
    made = [None] * len(numbered)
    for _ in range(MOST_DRAWS):
        open_cases = [k for k, case in enumerate(made) if case is None]
        if not open_cases:
            return made
        drawn = [draw_case(randoms[k], numbered[k][1], kind) for k in open_cases]
        runs = iter(simulate([plan.experiment for case in drawn for plan in case.plans]))
        for k, case in zip(open_cases, drawn, strict=True):
            own = [next(runs) for _ in case.plans]
            if all(map(is_feasible, own)):
                made[k] = (case, own)
    raise RuntimeError("some effects never stay within the feasible range")


def plain(value):
    return value.item() if isinstance(value, np.generic) else value


def parameters_of(case):
    """True values by the tool's names, where it has such parameters."""
    if not case.kind.same_form:
        return {}
    sizes = zip(case.effects, case.hidden, strict=True)
    return {name: value for effect, (_, size) in sizes for name, value in true_parameters(effect, size).items()}


def noise_rms(errors):
    """Per column, over all recordings of a case and what was not lost."""
    together = {name: np.concatenate([own[name] for own in errors]) for name in errors[0]}
    return {name: float(np.sqrt(np.nanmean(values**2))) for name, values in together.items()}


def write_case(random, name, case, runs, out):
    folder = out / "cases" / name
    folder.mkdir(parents=True)
    errors = []
    for number, (plan, run) in enumerate(zip(case.plans, runs, strict=True), start=1):
        columns, own = recorded(random, case, plan, run)
        write_recording(folder / f"run{number}.csv", columns)
        errors.append(own)
    truth = {
        "effect": "+".join(case.effects) or "none",
        "effects": case.effects,
        "severity": case.kind.severity,
        "forms": [form.__name__ for form, _ in case.hidden],
        "near_or_far": ["same" if case.kind.same_form else NEAR_OR_FAR.get(form) for form, _ in case.hidden],
        "sizes": [{key: plain(value) for key, value in size.items()} for _, size in case.hidden],
        "visibility": case.visibility[0] if case.visibility else None,
        "visibility_of_each": case.visibility[1:],
        "same_form": case.kind.same_form,
        "parameters": parameters_of(case),
        "own_parameters": case.specimen.parameters(),
        "specimen": vars(case.specimen),
        "relaxed": case.plans[0].experiment.relaxed,
        "recordings": [
            {"load_mass": plan.mass, **{of: getattr(plan, of) for of in SHOWN_OF_PLAN}} for plan in case.plans
        ],
        "noise": case.noise,
        "noise_rms": noise_rms(errors),
    }
    (out / "truths").mkdir(exist_ok=True)
    (out / "truths" / f"{name}.json").write_text(json.dumps(truth, indent=1, default=plain))


def write_block(numbered, kind, seed, out, visible):
    made = make(numbered, kind, seed)
    if visible:
        add_visibility(made)
    for (number, _), (case, runs) in zip(numbered, made, strict=True):
        # The sensors have random numbers of their own, apart from those of the plant.
        write_case(np.random.default_rng([seed, number, 1]), f"case_{number:04d}", case, runs, out)


def write_cases(truths, kind, seed, out, jobs=1, visible=True):
    """Writes cases for a list of truths; gives their names. Without `visible` that costly number is left out."""
    numbered = sorted(enumerate(truths), key=lambda pair: pair[1])  # like effects side by side: that is faster
    size = min(CASES_PER_BLOCK, -(-len(numbered) // jobs))
    blocks = [numbered[start : start + size] for start in range(0, len(numbered), size)]
    write = partial(write_block, kind=kind, seed=seed, out=Path(out), visible=visible)
    (Path(out) / "cases").mkdir(parents=True, exist_ok=True)
    if jobs == 1:
        list(map(write, blocks))
    else:
        with ProcessPoolExecutor(jobs) as pool:
            list(pool.map(write, blocks))
    return [f"case_{number:04d}" for number in range(len(truths))]


# --- What to draw -----------------------------------------------------------------------------------------------------

GROUPS = {"known": list(KNOWN), "unknown": list(UNKNOWN)}


def draw_some(seed, count, possible):
    """That many of the possible ones, none twice before all were there."""
    random = np.random.default_rng([seed, 2**32 - 1])
    rounds = [random.permutation(possible) for _ in range(-(-count // len(possible)))] if possible else []
    return [str(one) for order in rounds for one in order][:count]


def wanted_truths(items, cases, seed, known=frozenset(KNOWN)):
    """Truths for a list as in `none:60,known,valve_lag:3,pairs:40`.

    Those drawn at random come from the effects of `known`, pairs of them, and effects that are in no library.
    """
    drawn = {
        "any-known": [effect for effect in KNOWN if effect in known],
        "any-unknown": list(UNKNOWN),
        "pairs": [pair for pair in PAIRS if set(pair.split("+")) <= set(known)],
    }
    truths = []
    for item in items.split(","):
        name, _, count = item.partition(":")
        count = int(count or cases)
        if name in drawn:
            truths += draw_some(seed, count, drawn[name])
            continue
        for effect in GROUPS.get(name, [name]):
            strange = [part for part in effect.split("+") if part != "none" and part not in FORMS]
            if strange:
                names = ", ".join(["none", *drawn, *GROUPS, *FORMS])
                raise SystemExit(f"there is no effect {strange[0]}; there are {names}")
            truths += [effect] * count
    return truths


def add_options(parser):
    """What generator and score have in common."""
    parser.add_argument("--cases", type=int, default=5, help="of each effect, where no other count is given")
    parser.add_argument(
        "--effects",
        default="known,unknown,none,pairs",
        help="separated by commas, each with :COUNT: names, ONE+OTHER, none; known and unknown (each of them);"
        " any-known, any-unknown and pairs (that many drawn at random)",
    )
    parser.add_argument(
        "--edges", choices=EDGES, help="how the command turns; default: rounded in six of ten cases, else sharp"
    )
    parser.add_argument("--cut", action="store_true", help="recordings begin on the way, and not at rest")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes side by side")
    parser.add_argument(
        "--long",
        dest="session",
        action="store_const",
        const=LONG,
        default=USUAL,
        help="two recordings of 13 000 samples each; with `--jobs 1` to see how long a case takes",
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--severity", type=float, default=1.0, help="size of the effects: 1 full, 0.333 one third")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--same-form", action="store_true", help="in the forms that the fit itself uses")
    add_options(parser)
    options = parser.parse_args()
    truths = wanted_truths(options.effects, options.cases, options.seed)
    kind = Kind(options.severity, options.same_form, options.session, options.edges, options.cut)
    write_cases(truths, kind, options.seed, options.out, options.jobs)


if __name__ == "__main__":
    main()
