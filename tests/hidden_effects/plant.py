"""The true plant: valve, muscle, and a hanging load or an imposed motion, with effects hidden in it.

Many experiments run side by side as columns of numpy arrays. Mechanics: leapfrog with implicit damping; valve: exact
for a command held over a step; dry friction and the like: exact in displacement. Nothing is shared with the product.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

GRAVITY = 9.81
STEP = 5e-4
STORE_EVERY = 4  # steps between stored samples; 2 ms resolves everything the plant does
SETTLE = 2.5  # s of rest, strongly damped, before the recording starts
VALVE_GAIN = 1e5
VALVE_RATE = 2 * np.pi * 2.5
KEPT = np.exp(-VALVE_RATE * STEP)  # by the nominal valve over a step
# Of the preset: area in m2 and elastic force in N over powers of the contraction in m, damping in N s/m.
AREA = (0.0091, -0.0266)
ELASTIC_FORCE = (-113.29, -8808.9, 5.2111e4, -1.0067e5)
DAMPING = 80


@dataclass(frozen=True)
class Specimen:
    """One muscle: factors on each of the preset's coefficients, and how far its area is off a straight line."""

    area: tuple = (1.0, 1.0)
    elastic: tuple = (1.0, 1.0, 1.0, 1.0)
    damping: float = 1.0
    ripple: float = 0.0
    ripple_phase: float = 0.0

    def parameters(self):
        """In the tool's own names, but for the ripple."""
        area = {f"virtual_area.area_{k}": f * own for k, (f, own) in enumerate(zip(self.area, AREA, strict=True))}
        both = zip(self.elastic, ELASTIC_FORCE, strict=True)
        elastic = {f"virtual_area.elastic_{k}": factor * own for k, (factor, own) in enumerate(both)}
        return {**area, **elastic, "muscle.damping": DAMPING * self.damping}


@dataclass(frozen=True)
class Experiment:
    """One recording to be made: command in V (and motion in m, if imposed) on a grid of STEP."""

    specimen: Specimen
    command: np.ndarray
    mass: float | None = None
    motion: np.ndarray | None = None
    hidden: tuple = ()  # pairs of the form of an effect and its size
    relaxed: bool = True  # whether friction and creep start without a past


@dataclass
class Course:
    """What truly happened and what ideal sensors with the hidden effect show; arrays over time."""

    time: np.ndarray
    pressure: np.ndarray
    contraction: np.ndarray
    force: np.ndarray

    def signals(self, times):
        """By the names of their columns, at any times."""
        quantities = {"gauge_pressure": self.pressure, "contraction": self.contraction, "force": self.force}
        return {name: CubicSpline(self.time, values)(times) for name, values in quantities.items()}


def area(x, factors=Specimen.area):
    return AREA[0] * factors[0] + AREA[1] * factors[1] * x


def elastic_force(x, factors=Specimen.elastic):
    first, linear, square, cube = (own * factors[k] for k, own in enumerate(ELASTIC_FORCE))
    return first + x * (linear + x * (square + x * cube))


def holding_pressure(x, mass):
    """Pressure at which the preset muscle holds a mass at rest."""
    return (mass * GRAVITY - elastic_force(x)) / area(x)


class Now:
    """The plant at one instant, one entry per experiment; the forms of effects change it in place."""

    def __init__(self, experiments):
        specimens = [experiment.specimen for experiment in experiments]
        self.area_factors = np.array([s.area for s in specimens]).T
        self.elastic_factors = np.array([s.elastic for s in specimens]).T
        self.nominal_damping = DAMPING * np.array([s.damping for s in specimens])
        self.ripple = np.array([s.ripple for s in specimens])
        self.ripple_phase = np.array([s.ripple_phase for s in specimens])
        self.mass = np.array([experiment.mass or 1.0 for experiment in experiments])
        self.driven = np.flatnonzero([experiment.motion is not None for experiment in experiments])
        self.relaxed = np.array([experiment.relaxed for experiment in experiments])
        count = len(experiments)
        self.time = 0.0
        self.gain, self.step, self.v = np.ones(count), np.zeros(count), np.zeros(count)
        self.external, self.live = np.zeros(count), np.zeros(count)
        self.p = self.x = self.target = self.strain = self.damping = self.force = None
        self.time_constant = np.full(count, 1 / VALVE_RATE)

    def own_area(self, at=slice(None)):
        return area(self.strain[at], self.area_factors[:, at])

    def own_elastic_force(self, at=slice(None)):
        return elastic_force(self.strain[at], self.elastic_factors[:, at])

    def static_force(self):
        wave = 1 + self.ripple * np.sin(30 * self.strain + self.ripple_phase)
        return self.p * self.own_area() * wave + self.own_elastic_force()


def forms_together(experiments):
    """One object per form of an effect that occurs, with the columns where it acts.

    They act in the order of their names, whatever else is in the batch. Neighbouring columns become a slice, which
    numpy handles faster than a list of indices.
    """
    found = {}
    for column, experiment in enumerate(experiments):
        for form, size in experiment.hidden:
            found.setdefault(form, []).append((column, size))
    forms = []
    for form, members in sorted(found.items(), key=lambda item: item[0].__name__):
        columns, sizes = zip(*members, strict=True)
        contiguous = columns[-1] - columns[0] + 1 == len(columns)
        at = slice(columns[0], columns[-1] + 1) if contiguous else np.array(columns)
        forms.append(form(at, {name: np.array([size[name] for size in sizes]) for name in sizes[0]}))
    return forms


class Batch:
    """Experiments simulated together, those with the same form of an effect side by side."""

    def __init__(self, experiments):
        hidden = [[form.__name__ for form, _ in experiment.hidden] for experiment in experiments]
        self.order = sorted(range(len(experiments)), key=hidden.__getitem__)
        self.experiments = [experiments[k] for k in self.order]
        self.now = Now(self.experiments)
        self.forms = forms_together(self.experiments)
        self.length = max(len(experiment.command) for experiment in experiments)
        self.command = self._columns([experiment.command for experiment in self.experiments])
        driven = [self.experiments[k].motion for k in self.now.driven]
        self.motion = self._columns(driven) if driven else np.zeros((self.length, 0))

    def _columns(self, series):
        """Side by side; a shorter one stays where it ends."""
        return np.stack([np.pad(s, (0, self.length - len(s)), mode="edge") for s in series], axis=1)

    def _hooks(self, name):
        return [getattr(form, name) for form in self.forms if hasattr(form, name)]

    def run(self):
        """Courses in the order in which the experiments were given."""
        for form in self.forms:
            if hasattr(form, "drive"):
                self.command[:, form.at] = form.drive(self.command[:, form.at])
        stored = self._integrate()
        time = STEP * STORE_EVERY * np.arange(len(stored[0]))
        courses = [None] * len(self.experiments)
        for form in self.forms:
            if hasattr(form, "show"):
                shown = form.show(time, *(quantity[:, form.at] for quantity in stored))
                for quantity, reading in zip(stored, shown, strict=True):
                    quantity[:, form.at] = reading
        for column, index in enumerate(self.order):
            length = len(self.experiments[column].command) // STORE_EVERY
            courses[index] = Course(time[:length], *(quantity[:length, column] for quantity in stored))
        return courses

    def _start(self):
        now = self.now
        now.target = VALVE_GAIN * self.command[0]
        now.p = now.target.copy()
        # The least contraction whose holding pressure reaches the present one, from a table.
        table = np.linspace(0, 0.25, 501)
        pairs = zip(now.p, now.mass, strict=True)
        now.x = np.array([np.interp(p, holding_pressure(table, mass), table) for p, mass in pairs])
        if len(now.driven):
            now.x[now.driven] = self.motion[0]

    def _integrate(self):
        now, hooks = self.now, {name: self._hooks(name) for name in ("aim", "valve", "stretch", "act")}
        self._start()
        for form in self.forms:
            if hasattr(form, "begin"):
                form.begin(now)
        settle = round(SETTLE / STEP)
        stored = [np.empty((self.length // STORE_EVERY, len(self.experiments))) for _ in range(3)]
        for k in range(-settle, self.length):
            now.time = k * STEP
            # Without a past: until the recording starts nothing that remembers takes notice.
            now.live = 1.0 if k >= 0 else np.where(now.relaxed, 0.0, 1.0)
            self._pull(hooks)
            before = now.x
            pull = self._move(k, settling=k < 0)
            if k >= 0 and k % STORE_EVERY == 0 and k // STORE_EVERY < len(stored[0]):
                for row, quantity in zip(stored, (now.p, before, pull), strict=True):
                    row[k // STORE_EVERY] = quantity
            self._fill(max(k, 0), hooks)
        return stored

    def _pull(self, hooks):
        now = self.now
        now.strain = now.x.copy()
        for stretch in hooks["stretch"]:
            stretch(now)
        now.force = now.static_force() * now.gain
        now.damping = now.nominal_damping.copy()
        for act in hooks["act"]:
            act(now)

    def _move(self, k, settling):
        """One step of the load; gives the pull at its start."""
        now = self.now
        damping = now.damping + (25 * now.mass if settling else 0)
        share = STEP * damping / (2 * now.mass)
        push = (now.force + now.external) / now.mass - GRAVITY
        v = (now.v * (1 - share) + STEP * push) / (1 + share)
        if len(now.driven):
            last, following = max(k, 0), min(max(k + 1, 0), self.length - 1)
            v[now.driven] = (self.motion[following] - self.motion[last]) / STEP
        pull = now.force - now.damping * (now.v + v) / 2
        now.step = STEP * v
        now.x, now.v = now.x + now.step, v
        return pull

    def _fill(self, k, hooks):
        now = self.now
        command = (self.command[k] + self.command[min(k + 1, self.length - 1)]) / 2
        now.target = VALVE_GAIN * np.maximum(command, 0)
        now.time_constant[:] = 1 / VALVE_RATE
        for aim in hooks["aim"]:
            aim(now)
        before = now.p
        kept = np.exp(-STEP / now.time_constant) if hooks["aim"] else KEPT
        now.p = now.target + (before - now.target) * kept
        for valve in hooks["valve"]:
            valve(now, before)


def simulate(experiments, largest=400):
    """Courses of experiments, in batches that fit into memory."""
    courses = []
    for start in range(0, len(experiments), largest):
        courses += Batch(experiments[start : start + largest]).run()
    return courses
