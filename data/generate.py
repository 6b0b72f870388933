"""Makes the recordings in this folder. They are simulated, not measured; see README.md.

Written apart from the product and sharing no code with it: area and elastic force are splines through tabulated
points, the integrator is adaptive, and dry friction is a chain of elasto-plastic Maxwell-slip elements.
Run with numpy and scipy: python generate.py
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

SEED = 20260
GRAVITY = 9.81
VALVE_GAIN = 1e5
VALVE_RATE = 2 * np.pi * 2.5

# A DMSP-40-1000: contraction in m, area in cm², elastic force in N. The area bows by 0.15 % off a straight line.
CONTRACTION_TABLE = np.array([0.0, 0.03, 0.06, 0.09, 0.12, 0.15, 0.18, 0.21, 0.24])
AREA_TABLE = 1e-4 * np.array([91.00, 83.10, 75.15, 67.14, 59.09, 51.06, 43.06, 35.09, 27.15])
ELASTIC_TABLE = np.array([-113.3, -333.4, -476.0, -557.4, -593.9, -601.9, -597.6, -597.4, -617.5])

# Maxwell slip: stretch at which each element slides, and its share of the sliding force.
SLIP_STRETCH = 1e-3 * np.array([0.4, 1.2, 3.0, 6.0, 12.0])
SLIP_SHARE = np.array([0.15, 0.25, 0.25, 0.20, 0.15])
STIFF_PART = 0.9  # fraction of the slip stretch over which an element is purely elastic


@dataclass(frozen=True)
class Plant:
    """One specimen: how far it is off the tables, and its dry friction in newton per pascal."""

    area_factor: float
    elastic_factor: float
    damping: float
    sliding_force_per_pressure: float = 0.0

    def static_force(self, pressure, x):
        return pressure * self.area_factor * AREA(x) + self.elastic_factor * ELASTIC(x)

    def friction(self, pressure, stretch):
        """Pull lost while shortening; the normal force between the threads follows the pressure."""
        return self.sliding_force_per_pressure * pressure * np.dot(SLIP_SHARE, stretch / SLIP_STRETCH)


AREA = CubicSpline(CONTRACTION_TABLE, AREA_TABLE)
ELASTIC = CubicSpline(CONTRACTION_TABLE, ELASTIC_TABLE)


def stretch_rate(stretch, velocity):
    """An element follows the motion until it nears its slip stretch, then slides; it turns back elastically."""
    nearness = np.clip((np.abs(stretch) / SLIP_STRETCH - STIFF_PART) / (1 - STIFF_PART), 0, 1)
    sliding = np.where(stretch * velocity > 0, nearness, 0)
    return velocity * (1 - sliding)


def command_signal(corners):
    times, levels = np.transpose(corners)
    return lambda t: np.interp(t, times, levels)


def hold(corners, duration):
    corners.append((corners[-1][0] + duration, corners[-1][1]))


def ramp(corners, level, rate):
    time, start = corners[-1]
    corners.append((time + abs(level - start) / rate, level))


def step(corners, level, duration):
    """A step takes 40 ms, as a signal generator with a slew limit makes it."""
    corners.append((corners[-1][0] + 0.04, level))
    hold(corners, duration)


def friction_programme(low, high):
    """Triangles of shrinking amplitude, ramps at two rates, steps."""
    middle, reach = (low + high) / 2, (high - low) / 2
    corners = [(0.0, middle)]
    hold(corners, 1.0)
    for share in 1.0, 0.75, 0.5, 0.3, 0.15:
        for side in 1, -1:
            ramp(corners, middle + side * share * reach, rate=0.3 * reach + 0.05)
    for rate in 0.2, 0.8:
        for level in high, low:
            ramp(corners, level, rate)
            hold(corners, 0.7)
    for share in 0.4, 0.8, 0.55, 0.3:
        step(corners, low + share * (high - low), 2.0)
    return corners


def nominal_programme():
    corners = [(0.0, 1.5)]
    hold(corners, 1.0)
    for level, rate in (2.3, 0.25), (1.2, 0.25), (2.3, 0.8), (1.0, 0.8), (1.7, 0.15), (1.2, 0.15):
        ramp(corners, level, rate)
        hold(corners, 1.0)
    for level in 1.6, 2.0, 1.7, 1.3, 1.5:
        step(corners, level, 3.5)
    return corners


def prescribed_programme():
    corners = [(0.0, 2.0)]
    hold(corners, 2.0)
    for level in 3.0, 4.0, 2.5, 3.5:
        step(corners, level, 4.0)
    for level, rate in (2.2, 0.2), (4.2, 0.4), (2.2, 1.0), (3.0, 0.2):
        ramp(corners, level, rate)
        hold(corners, 2.0)
    return corners


def prescribed_contraction(t):
    """A testing machine: slow and fast strokes, starting gently."""
    strokes = 0.035 * np.sin(2 * np.pi * 0.11 * t) + 0.02 * np.sin(2 * np.pi * 0.47 * t + 1.0)
    return 0.08 + (1 - np.exp(-(t / 1.5) ** 2)) * strokes


def sample_times(random, duration):
    """About 80 Hz; the logger is late or early by up to a fifth of its period."""
    period = 0.0125
    regular = np.arange(0, duration, period)
    regular[1:] += period * random.uniform(-0.2, 0.2, len(regular) - 1)
    return np.round(regular, 5)


def simulate_hanging(plant, mass, corners, times):
    """Pressure, contraction and pull at the sample times, from static equilibrium with relaxed friction elements."""
    command = command_signal(corners)

    def pull(pressure, x, velocity, stretch):
        return plant.static_force(pressure, x) - plant.damping * velocity - plant.friction(pressure, stretch)

    def derivative(t, state):
        pressure, x, velocity, *stretch = state
        stretch = np.array(stretch)
        return np.concatenate([[VALVE_RATE * (VALVE_GAIN * command(t) - pressure), velocity,
                                pull(pressure, x, velocity, stretch) / mass - GRAVITY],
                               stretch_rate(stretch, velocity)])

    start_pressure = VALVE_GAIN * command(0.0)
    start = brentq(lambda x: plant.static_force(start_pressure, x) - mass * GRAVITY, 0.0, 0.23)
    state = np.concatenate([[start_pressure, start, 0.0], np.zeros(len(SLIP_STRETCH))])
    result = solve_ivp(derivative, (0, times[-1]), state, "RK45", t_eval=times, max_step=0.005, rtol=1e-7,
                       atol=np.concatenate([[1e-1, 1e-8, 1e-7], np.full(len(SLIP_STRETCH), 1e-8)]))
    pressure, x, velocity, *stretch = result.y
    force = np.array([pull(*sample) for sample in zip(pressure, x, velocity, np.transpose(stretch))])
    return pressure, x, force


def simulate_prescribed(plant, corners, times):
    command = command_signal(corners)
    result = solve_ivp(lambda t, p: VALVE_RATE * (VALVE_GAIN * command(t) - p), (0, times[-1]),
                       [VALVE_GAIN * command(0.0)], t_eval=times, max_step=0.01, rtol=1e-8, atol=1e-2)
    pressure, x = result.y[0], prescribed_contraction(times)
    small = 1e-5
    velocity = (prescribed_contraction(times + small) - prescribed_contraction(times - small)) / (2 * small)
    return pressure, x, plant.static_force(pressure, x) - plant.damping * velocity


def sensor(random, times, signal, coloured, white, resolution, correlation_time=0.03):
    """What a sensor shows: noise with a memory, white noise, finite resolution."""
    memory = np.exp(-np.diff(times, prepend=times[0]) / correlation_time)
    noise = np.zeros(len(times))
    noise[0] = coloured * random.standard_normal()
    for k, shock in enumerate(random.standard_normal(len(times) - 1), start=1):
        noise[k] = memory[k] * noise[k - 1] + coloured * np.sqrt(1 - memory[k] ** 2) * shock
    reading = signal + noise + white * random.standard_normal(len(times))
    return resolution * np.round(reading / resolution)


def readings(random, times, corners, pressure, x, force):
    """Columns in the units of the file, with the samples that the logger lost."""
    command = 0.0025 * np.round(command_signal(corners)(times) / 0.0025)
    measured = {
        "gauge_pressure [bar]": sensor(random, times, pressure * 1e-5, 0.002, 0.001, 0.002),
        "contraction [mm]": sensor(random, times, x * 1e3, 0.03, 0.02, 0.02),
        "force [N]": sensor(random, times, force, 0.6, 0.4, 0.5),
    }
    for column in measured.values():
        column[random.choice(np.arange(1, len(times)), 4, replace=False)] = np.nan
    return {"time [s]": times, "command [V]": command, **measured}


DECIMALS = {"time [s]": 5, "command [V]": 4, "gauge_pressure [bar]": 3, "contraction [mm]": 2,
            "force [N]": 1, "load_mass [kg]": 0}


def cell(value, column):
    return "" if np.isnan(value) else f"{value:.{DECIMALS[column]}f}"


def write(name, columns):
    with open(Path(__file__).with_name(name), "w") as file:
        file.write(",".join(columns) + "\n")
        for row in zip(*columns.values()):
            file.write(",".join(map(cell, row, columns)) + "\n")


def record_hanging(name, plant, mass, corners, random):
    times = sample_times(random, corners[-1][0])
    pressure, x, force = simulate_hanging(plant, mass, corners, times)
    columns = readings(random, times, corners, pressure, x, force)
    write(name, {**columns, "load_mass [kg]": np.full(len(times), mass)})
    summary(name, times, pressure, x, force)


def record_prescribed(name, plant, corners, random):
    times = sample_times(random, corners[-1][0])
    pressure, x, force = simulate_prescribed(plant, corners, times)
    write(name, readings(random, times, corners, pressure, x, force))
    summary(name, times, pressure, x, force)


def summary(name, times, pressure, x, force):
    print(f"{name}: {len(times)} rows, {times[-1]:.1f} s, {pressure.min() / 1e5:.2f} ... {pressure.max() / 1e5:.2f} bar, "
          f"{1e3 * x.min():.1f} ... {1e3 * x.max():.1f} mm, {force.min():.0f} ... {force.max():.0f} N")


def main():
    rubbing = Plant(area_factor=1.008, elastic_factor=0.99, damping=80.8, sliding_force_per_pressure=38.0 / 3e5)
    sound = Plant(area_factor=0.995, elastic_factor=1.006, damping=79.5)
    streams = map(np.random.default_rng, np.random.SeedSequence(SEED).spawn(4))
    record_hanging("dry_friction_20kg.csv", rubbing, 20.0, friction_programme(0.7, 1.9), next(streams))
    record_hanging("dry_friction_60kg.csv", rubbing, 60.0, friction_programme(1.4, 3.0), next(streams))
    record_hanging("nominal_40kg.csv", sound, 40.0, nominal_programme(), next(streams))
    record_prescribed("prescribed_motion.csv", sound, prescribed_programme(), next(streams))


if __name__ == "__main__":
    main()
