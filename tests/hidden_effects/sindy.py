"""Sparse regression: pysindy picks the terms that the model's residuals consist of; what counts most has the name.

The residuals of two links of the chain, pressure after command and force after pressure and contraction, and of the
weighed load against the force sensor, stand below each other in one regression. Every term is the change that a small
effect makes to all of them, by hand and to first order, so that an effect of the sensors counts wherever it is seen.
"""

import warnings

import numpy as np
import pysindy
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import lsq_linear
from scipy.signal import lfilter

import fit
from fit import TOLERANCE, VALVE_RATE, area_of, elastic_of, white_noise

STEP = 0.005  # s, of the grid on which is filtered and differentiated
EVERY = 10  # of these for the regression: 20 Hz, so that neighbours have noise of their own after the smoothing
SMOOTH = 0.02  # s, before differentiation
THRESHOLDS = (0.05, 0.1, 0.2, 0.4)  # of the whole residual
MOST_TERMS = 5  # more, and they cancel each other: that is no explanation


def first_order(series, time):
    kept = np.exp(-STEP / time)
    return lfilter([1 - kept], [1, -kept], series, zi=[kept * series[0]])[0]


def rate(series):
    return np.gradient(series, STEP)


class Signals:
    """A recording on an even grid; what was not logged comes from the nominal model."""

    def __init__(self, recording, logged):
        self.time = np.arange(0, recording.times[-1], STEP)
        self.mass = recording.mass if recording.motion is None else None
        self.u = self._on_grid(recording.command) if recording.command is not None else None
        self.nominal_p = first_order(1e5 * self.u, 1 / VALVE_RATE) if self.u is not None else None
        self.measured_p, self.f, x = (logged.get(name) for name in ("gauge_pressure", "force", "contraction"))
        self.p = self.measured_p if self.measured_p is not None else self.nominal_p
        self.x = x
        self.v = rate(x)
        self.load = self.mass * (9.81 + rate(self.v)) if self.mass else None

    def _on_grid(self, series):
        return np.interp(self.time, fit.STEP * np.arange(len(series)), series)


def signals_of(recording):
    times = recording.times
    grid = np.arange(0, times[-1], STEP)
    logged = {}
    for name, series in recording.logged.items():
        known = np.isfinite(series)
        even = np.interp(grid, recording.all_times[known], series[known])
        logged[name] = gaussian_filter1d(even, SMOOTH / STEP, mode="nearest")
    return Signals(recording, logged)


def pressure_terms(s):
    """What effects of the valve add to the pressure."""
    p, slope, lag = s.nominal_p, rate(s.nominal_p), 1 / VALVE_RATE
    beyond = {limit: slope - np.clip(slope, -limit, limit) for limit in (0.5e5, 1.2e5, 2.5e5)}
    direction = np.tanh(rate(gaussian_filter1d(s.u, SMOOTH / STEP)) / 0.02)
    return {
        "valve_lag": [-first_order(slope, lag)],
        "valve_resonance": [-first_order(rate(slope), lag)],
        "valve_dead_time": [-slope],
        "valve_dead_band": [-first_order(direction, lag)],
        "valve_gain": [p],
        "valve_offset": [np.ones_like(p)],
        "supply_saturation": [-np.maximum(p - (p.min() + share * np.ptp(p)), 0) for share in (0.5, 0.65, 0.8)],
        "flow_limit": [-first_order(over, lag) for over in beyond.values()],
        "leakage": [-first_order(p, lag)],
    }


def force_terms(s):
    """What effects of the muscle and of the position sensor add to the pull that belongs to what was read."""
    pull, own, slope = static(s)
    sign, moved = np.tanh(s.v / 3e-3), s.x - s.x[0]
    return {
        "friction_hysteresis": [-sign, -s.p * sign],
        "viscous_damping": [-np.maximum(s.v, 0), -np.minimum(s.v, 0)],
        "creep": [-slope * first_order(moved, time) for time in (2, 12)],
        "threshold_pressure": [-area_of(s.x) * np.exp(-s.p / 0.8e5)],
        "bladder_stiffness": [own],
        "force_gain": [pull + own],
        "end_effects": [slope * s.x],
        "temperature_drift": [pull * (1 - np.exp(-s.time / 15))],
        "contraction_sensor_offset": [-slope],
        "contraction_sensor_gain": [-slope * s.x],
        "contraction_sensor_delay": [slope * s.v],
    }


def static(s):
    """Pull of the pressure, elastic force, and how their sum changes with the contraction."""
    slope = -0.0266 * s.p - 8808.9 + s.x * (2 * 5.2111e4 - 3 * 1.0067e5 * s.x)
    return s.p * area_of(s.x), elastic_of(s.x), slope


def links(s):
    """Residuals with the terms that belong to them, one entry per link that was logged."""
    found = []
    if s.measured_p is not None and s.nominal_p is not None:
        sensor = {"pressure_sensor_offset": [np.ones_like(s.p)], "pressure_sensor_gain": [s.p]}
        found.append((s.measured_p - s.nominal_p, {**pressure_terms(s), **sensor}, []))
    found.append(force_link(s))
    if s.f is not None and s.load is not None:
        sensor = {"force_sensor_offset": [np.ones_like(s.f)], "force_sensor_gain": [s.f]}
        found.append((s.f - s.load, {"payload_mass": [s.load / s.mass], **sensor}, []))
    return found


def force_link(s):
    pull, own, slope = static(s)
    seen = s.f if s.f is not None else s.load
    terms = force_terms(s)
    if s.measured_p is None:
        valve = pressure_terms(s).items()
        terms |= {effect: [area_of(s.x) * column for column in columns] for effect, columns in valve}
    else:
        terms |= {"pressure_sensor_offset": [-area_of(s.x)], "pressure_sensor_gain": [-pull]}
    if s.f is None:
        terms["payload_mass"] = [-seen / s.mass]
    else:
        terms |= {"force_sensor_offset": [np.ones_like(seen)], "force_sensor_gain": [seen]}
    if s.mass is not None:
        terms["series_elasticity"] = [-slope * seen]
    return seen - (pull + own - 80 * s.v), terms, [pull, own, -80 * s.v]


def stacked(recordings):
    """The residual, columns by effect, and those of the nuisances, all links of all recordings below each other."""
    rows = [link for recording in recordings for link in links(signals_of(recording))]
    width = {effect: len(columns) for _, terms, _ in rows for effect, columns in terms.items()}
    residual, library, nuisances = [], {effect: [] for effect in width}, []
    for values, terms, own in rows:
        noise = white_noise(values[::EVERY])
        nothing = np.zeros_like(values)
        residual.append(values[::EVERY] / noise)
        for effect, count in width.items():
            columns = terms.get(effect, [nothing] * count)
            library[effect].append(np.stack(columns, axis=1)[::EVERY] / noise)
        nuisances.append(np.stack(own or [nothing] * 3, axis=1)[::EVERY] / noise)
    columns = {effect: np.concatenate(blocks) for effect, blocks in library.items()}
    return np.concatenate(residual), columns, np.concatenate(nuisances)


def name_by_sindy(recordings):
    """The effect whose terms the best sparse model can spare least, with those that have the same term.

    None where no term is worth its parameter.
    """
    residual, columns, nuisances = stacked(recordings)
    allowed = lsq_linear(nuisances, residual, bounds=(-TOLERANCE, TOLERANCE)).x
    left = residual - nuisances @ allowed
    left /= np.linalg.norm(left)
    library, owners = distinct(columns)
    best = min(sparse_models(library, left), key=lambda weights: bic(library, left, weights))
    chosen = {owners[k] for k in np.flatnonzero(best)}
    return max(chosen, key=lambda owner: squares_without(owner, library, left, best, owners), default=())


def squares_without(owner, library, left, weights, owners):
    """Sum of squares if an effect's terms are taken out, the others fitted anew.

    Terms that are alike have large weights of opposite signs, so that these say nothing of what a term is worth.
    """
    kept = library[:, [k for k in np.flatnonzero(weights) if owners[k] != owner]]
    return np.sum((left - kept @ np.linalg.lstsq(kept, left)[0]) ** 2)


def distinct(columns):
    """Columns of length one, none twice, and for each the effects that it stands for."""
    kept, owners = [], []
    for effect, block in columns.items():
        for column in block.T:
            length = np.linalg.norm(column)
            if length < 1e-9:
                continue
            same = [k for k, other in enumerate(kept) if abs(other @ column) > (1 - 1e-6) * length]
            if not same:
                kept.append(column / length)
                owners.append((effect,))
            elif effect not in owners[same[0]]:
                owners[same[0]] += (effect,)
    return np.stack(kept, axis=1), owners


def sparse_models(library, left):
    """Weights from thresholded least squares and from forward selection, of few terms; and none at all."""
    thresholded = [pysindy.STLSQ(threshold=threshold, alpha=1e-4) for threshold in THRESHOLDS]
    forward = [pysindy.FROLS(max_iter=count, alpha=1e-6) for count in (1, 2, 3, MOST_TERMS)]
    models = [np.zeros(library.shape[1])]
    for optimizer in thresholded + forward:
        model = pysindy.SINDy(optimizer=optimizer, feature_library=pysindy.IdentityLibrary())
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of thresholds that leave nothing
                model.fit(library, t=STEP * EVERY, x_dot=left[:, None])
        except ValueError:  # terms that depend on each other, to the last digits
            continue
        weights = model.coefficients()[0]
        if np.count_nonzero(weights) <= MOST_TERMS:
            models.append(weights)
    return models


def bic(library, left, weights):
    count = len(left)
    squares = np.sum((left - library @ weights) ** 2)
    return count * np.log(squares / count) + np.count_nonzero(weights) * np.log(count)
