"""The plain way: every effect in its textbook form, fitted by scipy on simulation error, the lowest BIC wins.

No refusal, no families of forms, no second effect. Along with each effect area, elastic force and damping are fitted
within the tolerance of 3 %. The textbook forms are those of textbook.py, here in one loop that numba compiles: a fit
takes some hundred simulations.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares

STEP = 2e-3
SETTLE = 2.5  # s of rest, strongly damped, before the recording starts
RATE = 50  # Hz, at which readings are compared
TOLERANCE = 0.03
SAME = 2.0  # difference in BIC below which two effects count as equally good

# Parameters of an effect with start values (several starts: several rows) and bounds; neutral values in NEUTRAL.
EFFECTS = {
    "friction_hysteresis": (("width", "width_p", "bend"), [(10, 5e-5, 2e-3)], [(0, 300), (0, 1e-3), (2e-4, 2e-2)]),
    "viscous_damping": (("damp_up", "damp_down"), [(200, 200)], [(-60, 5e3), (-60, 5e3)]),
    "creep": (("creep", "creep_time"), [(0.05, 2), (0.05, 12)], [(-0.3, 0.6), (0.1, 100)]),
    "threshold_pressure": (("lost", "fade"), [(0.3e5, 0.8e5)], [(0, 2e5), (0.2e5, 2.5e5)]),
    "bladder_stiffness": (("elastic_more",), [(0.02,)], [(-0.9, 2)]),
    "force_gain": (("force_more",), [(0.02,)], [(-0.5, 0.5)]),
    "end_effects": (("excess",), [(0.02,)], [(-0.5, 1)]),
    "series_elasticity": (("compliance",), [(-1e-6,)], [(-1e-4, 1e-4)]),
    "payload_mass": (("mass_more",), [(0.3,)], [(-9, 50)]),
    "valve_lag": (("lag",), [(0.02,)], [(0, 2)]),
    "valve_resonance": (("frequency", "ratio"), [(20, 0.4), (35, 0.4)], [(5, 200), (0.03, 0.95)]),
    "valve_dead_time": (("dead_time",), [(0.02,)], [(0, 0.4)]),
    "valve_dead_band": (("play",), [(0.03,)], [(0, 0.6)]),
    "valve_gain": (("valve_more",), [(0.01,)], [(-0.5, 0.5)]),
    "valve_offset": (("valve_off",), [(0.02,)], [(-1, 1)]),
    "supply_saturation": (("ceiling",), [(0.9,), (0.7,)], [(0.2, 1.2)]),  # of the highest command
    "flow_limit": (("filling", "emptying"), [(1.5e5, 1.5e5), (6e5, 6e5)], [(1e4, 1e7), (1e4, 1e7)]),
    "leakage": (("leak",), [(0.1,)], [(0, 20)]),
    "contraction_sensor_offset": (("x_off",), [(1e-3,)], [(-0.05, 0.05)]),
    "contraction_sensor_gain": (("x_more",), [(0.01,)], [(-0.5, 0.5)]),
    "contraction_sensor_delay": (("x_delay",), [(0.02,)], [(0, 0.4)]),
    "pressure_sensor_offset": (("p_off",), [(2e3,)], [(-1e5, 1e5)]),
    "pressure_sensor_gain": (("p_more",), [(0.01,)], [(-0.5, 0.5)]),
    "force_sensor_offset": (("f_off",), [(3,)], [(-200, 200)]),
    "force_sensor_gain": (("f_more",), [(0.01,)], [(-0.5, 0.5)]),
    "temperature_drift": (("warm", "warm_time"), [(0.02, 10)], [(-0.5, 0.5), (1, 200)]),
}  # fmt: skip
NUISANCES = ("area", "elastic", "damping")
NEUTRAL = {
    "area": 1, "elastic": 1, "damping": 1, "bend": 1e-3, "creep_time": 1, "fade": 1e5, "ratio": 0.5, "ceiling": np.inf,
    "filling": np.inf, "emptying": np.inf, "warm_time": 10,
}  # fmt: skip
NAMES = [*NUISANCES, *(name for names, _, _ in EFFECTS.values() for name in names)]
PLACE = {name: k for k, name in enumerate(NAMES)}
# What shows in the reading of a sensor only, and so asks for it.
NEEDS = {
    "pressure_sensor_offset": "gauge_pressure",
    "pressure_sensor_gain": "gauge_pressure",
    "force_sensor_offset": "force",
    "force_sensor_gain": "force",
}
HANGING = {"payload_mass", "series_elasticity"}
OF_VALVE = {
    "valve_lag", "valve_resonance", "valve_dead_time", "valve_dead_band", "valve_gain", "valve_offset",
    "supply_saturation", "flow_limit", "leakage",
}  # fmt: skip


@dataclass
class Recording:
    """What the logger has, on the times that are compared; command and imposed motion on the grid of the simulation."""

    times: np.ndarray
    command: np.ndarray | None
    motion: np.ndarray | None
    pressure: np.ndarray | None  # as the muscle's pressure where there is no command
    mass: float
    measured: dict
    noise: dict
    all_times: np.ndarray
    logged: dict  # everything but time, command and load, on all times
    highest: float = 1.0  # command in all recordings of a case

    @property
    def length(self):
        return len(self.motion if self.command is None else self.command)


def read_case(folder):
    """All recordings of a case."""
    recordings = [read(path) for path in sorted(folder.glob("*.csv"))]
    commands = [recording.command.max() for recording in recordings if recording.command is not None]
    return [replace(recording, highest=max(commands, default=1.0)) for recording in recordings]


def read(path):
    """A recording in SI, from the file that the tool gets."""
    header = path.open().readline().strip().split(",")
    names = [name.split(" [")[0] for name in header]
    factors = {"gauge_pressure": 1e5, "contraction": 1e-3}
    values = np.genfromtxt(path, delimiter=",", skip_header=1, filling_values=np.nan)
    columns = {name: factors.get(name, 1.0) * values[:, k] for k, name in enumerate(names)}
    times = columns.pop("time")
    grid = STEP * np.arange(int(times[-1] / STEP) + 2)

    def on_grid(name, smoothed=0.0):
        known = np.isfinite(columns[name])
        series = np.interp(grid, times[known], columns[name][known])
        return gaussian_filter1d(series, smoothed / STEP, mode="nearest") if smoothed else series

    driven = "load_mass" not in columns
    every = max(round(1 / (RATE * np.median(np.diff(times)))), 1)
    outputs = {"gauge_pressure", "force"} | (set() if driven else {"contraction"})
    if driven and "command" not in columns:
        outputs.discard("gauge_pressure")
    measured = {name: columns[name][::every] for name in sorted(outputs) if name in columns}
    return Recording(
        times[::every],
        on_grid("command") if "command" in columns else None,
        on_grid("contraction", 0.02) if driven else None,
        on_grid("gauge_pressure", 0.02) if "command" not in columns else None,
        1.0 if driven else columns["load_mass"][0],
        measured,
        {name: white_noise(columns[name]) for name in measured},
        times,
        {name: columns[name] for name in ("gauge_pressure", "contraction", "force") if name in columns},
    )


def white_noise(series):
    """From third differences, over which even motion is nearly straight."""
    thirds = np.diff(series[np.isfinite(series)], 3)
    return max(1.4826 * np.median(np.abs(thirds)) / np.sqrt(20), 1e-9)


@njit(cache=True)
def area_of(x):
    return 0.0091 - 0.0266 * x


@njit(cache=True)
def elastic_of(x):
    return -113.29 + x * (-8808.9 + x * (5.2111e4 - 1.0067e5 * x))


@njit(cache=True)
def with_play(u, half):
    out = u.copy()
    for k in range(1, len(u)):
        out[k] = min(max(out[k - 1], u[k] - half), u[k] + half)
    return out


@njit(cache=True)
def rest(pressure, mass):
    """Least contraction that holds the mass."""
    x = 0.0
    while x < 0.25 and (mass * 9.81 - elastic_of(x)) / area_of(x) < pressure:
        x += 1e-4
    return x


@njit(cache=True)
def course(target, given, motion, mass, step, settle, q):
    """Pressure, contraction and pull on the grid; q in the order of the arguments below.

    `target` of the valve; with `given` it is the pressure itself. `motion` is empty for a hanging load.
    """
    (area, elastic, damping, width, width_p, bend, up, down, creep, creep_time, lost, fade, elastic_more, force_more,
     excess, lag, frequency, ratio, filling, emptying, leak, warm, warm_time) = q  # fmt: skip
    driven = len(motion) > 0
    n = len(target)
    out = np.empty((3, n))
    loss = 1 + leak * (1 / VALVE_RATE + lag)
    constant = (1 / VALVE_RATE + lag) / loss
    kept = np.exp(-step / constant)
    p = target[0] / (1.0 if given else loss)
    x = motion[0] if driven else rest(p, mass)
    v = z = drift = rate = 0.0
    start = x
    for k in range(-settle, n):
        now, following = max(k, 0), min(max(k + 1, 0), n - 1)
        strain = x - drift + excess * x
        own = (elastic * elastic_of(strain)) * (1 + elastic_more)
        gone = min(lost * np.exp(-max(p, 0.0) / fade), max(p, 0.0)) if lost > 0 else 0.0
        heat = warm * (1 - np.exp(-now * step / warm_time)) if warm != 0 else 0.0
        force = ((p * (1 + heat) - gone) * area * area_of(strain) + own) * (1 + force_more)
        force -= (width + width_p * p) * z
        resist = 80 * damping + (up if v > 0 else down)
        if driven:
            after = (motion[following] - motion[now]) / step
        else:
            share = step * (resist + (25 * mass if k < 0 else 0.0)) / (2 * mass)
            after = (v * (1 - share) + step * (force / mass - 9.81)) / (1 + share)
        if k >= 0:
            out[0, k], out[1, k], out[2, k] = p, x, force - resist * (v + after) / 2
        moved = step * after
        x, v = x + moved, after
        if k < 0:
            start = x
        else:
            drift += step / creep_time * (creep * (x - start) - drift)
            if moved != 0:
                towards = 1.0 if moved > 0 else -1.0
                z = towards + (z - towards) * np.exp(-abs(moved) / bend)
        aim = (target[now] + target[following]) / 2
        if given:
            p = target[following]
        elif frequency > 0:
            rate = (rate + step * frequency**2 * (aim - p)) / (1 + 2 * step * ratio * frequency)
            p += step * rate
        else:
            wanted = aim / loss + (p - aim / loss) * kept - p
            p += min(max(wanted, -step * emptying), step * filling)
    return out


VALVE_RATE = 2 * np.pi * 2.5
OF_COURSE = (
    "area", "elastic", "damping", "width", "width_p", "bend", "damp_up", "damp_down", "creep", "creep_time", "lost",
    "fade", "elastic_more", "force_more", "excess", "lag", "frequency", "ratio", "filling", "emptying", "leak", "warm",
    "warm_time",
)  # fmt: skip


def delayed(series, delay):
    grid = STEP * np.arange(len(series))
    return np.interp(grid - delay, grid, series) if delay else series


def target_of(recording, q):
    """Of the valve on the grid, in Pa."""
    u = delayed(recording.command, q["dead_time"])
    if q["play"] > 0:
        u = with_play(u, q["play"])
    target = 1e5 * np.maximum(u * (1 + q["valve_more"]) + q["valve_off"], 0)
    return np.minimum(target, q["ceiling"] * 1e5 * recording.highest)


def simulate(recording, q):
    """Readings at the recording's times, by column."""
    motion = np.zeros(0)
    if recording.motion is not None:
        motion = delayed((recording.motion - q["x_off"]) / (1 + q["x_more"]), -q["x_delay"])
    given = recording.command is None
    target = (recording.pressure - q["p_off"]) / (1 + q["p_more"]) if given else target_of(recording, q)
    numbers = tuple(float(q[name]) for name in OF_COURSE)
    mass = recording.mass + q["mass_more"]
    p, x, force = course(target, given, motion, mass, STEP, round(SETTLE / STEP), numbers)
    shown = {
        "gauge_pressure": p * (1 + q["p_more"]) + q["p_off"],
        "contraction": delayed(x * (1 + q["x_more"]) + q["x_off"] + q["compliance"] * force, q["x_delay"]),
        "force": force * (1 + q["f_more"]) + q["f_off"],
    }
    grid = STEP * np.arange(recording.length)
    return {name: np.interp(recording.times, grid, shown[name]) for name in recording.measured}


def residual(recordings, q):
    """Of all readings in noise levels; a simulation that ran away counts as very wrong."""
    parts = []
    for recording in recordings:
        shown = simulate(recording, q)
        parts += [(recording.measured[name] - shown[name]) / recording.noise[name] for name in recording.measured]
    together = np.concatenate(parts)
    known = np.concatenate([np.isfinite(value) for r in recordings for value in r.measured.values()])
    return np.clip(np.nan_to_num(together[known], nan=1e6), -1e6, 1e6)


def candidates(recordings):
    """Effects that can show in these recordings."""
    hanging, valve = recordings[0].motion is None, recordings[0].command is not None
    logged = set(recordings[0].measured) | (set() if valve else {"gauge_pressure"})
    shut = {effect for effect, column in NEEDS.items() if column not in logged}
    shut |= set() if hanging else HANGING
    shut |= set() if valve else OF_VALVE
    return [effect for effect in EFFECTS if effect not in shut]


def fit(recordings, effect=None, nominal=None):
    """Lowest sum of squares of an effect, or of the nominal model, with its parameters; the better of its starts."""
    names, starts, bounds = EFFECTS[effect] if effect else ((), [()], [])
    free = [*NUISANCES, *names]
    base = {name: NEUTRAL.get(name, 0.0) for name in NAMES}
    low, high = map(np.array, zip(*[(1 - TOLERANCE, 1 + TOLERANCE)] * 3, *bounds, strict=True))
    best = None
    for start in starts:
        first = np.array([*(nominal or (1.0, 1.0, 1.0)), *start], float)
        scale = np.abs([0.02, 0.02, 0.02, *start])
        first = np.clip(first, low + 1e-6 * scale, high - 1e-6 * scale)
        found = least_squares(
            lambda values: residual(recordings, base | dict(zip(free, values, strict=True))),
            first,
            bounds=(low, high),
            x_scale=scale,
            max_nfev=15,
            diff_step=1e-4,
        )
        if best is None or found.cost < best.cost:
            best = found
    return 2 * best.cost, dict(zip(free, best.x, strict=True)), len(best.fun)


def name_by_fit(recordings):
    """Names within SAME of the lowest BIC, the lowest first; none where the nominal model has it."""
    squares, nominal, count = fit(recordings)
    bic = {None: count * np.log(squares / count) + 3 * np.log(count)}
    start = [nominal[name] for name in NUISANCES]
    for effect in candidates(recordings):
        squares, _, count = fit(recordings, effect, start)
        bic[effect] = count * np.log(squares / count) + (3 + len(EFFECTS[effect][0])) * np.log(count)
    order = sorted(bic, key=bic.get)
    if order[0] is None:
        return ()
    return tuple(effect for effect in order if effect is not None and bic[effect] - bic[order[0]] < SAME)
