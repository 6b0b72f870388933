"""Golden trajectories of the nominal model: valve, muscle and hanging load, solved far beyond the product's accuracy.

The command is linear between samples 10 ms apart, and the integration restarts at every sample, so that no step of
the solver crosses a kink. With --verify each trajectory is solved again in a way that shares only the static forces:
pressure in closed form, motion by an implicit method.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from muscles import GRAVITY, IMPROVED_1000, VIRTUAL_AREA_1000, VIRTUAL_AREA_290, static_force

VALVE_GAIN = 1e5
VALVE_BANDWIDTH = 2 * np.pi * 2.5
DAMPING = 80.0
SAMPLE_TIME = 0.01
HEADER = ("time [s],command [V],gauge_pressure [Pa],contraction [m],"
          "contraction_velocity [m/s],force [N],load_mass [kg]")


@dataclass(frozen=True)
class Case:
    name: str
    muscle: object
    load_mass: float
    command: np.ndarray  # one value per sample
    contraction_limit: float

    @property
    def time(self):
        return np.arange(len(self.command)) * SAMPLE_TIME


def staircase(levels, hold):
    """Jumps between levels; sampling turns each into a ramp over one sample."""
    return np.append(np.repeat(levels, round(hold / SAMPLE_TIME)), levels[-1])


def ramps(corners):
    times, levels = np.transpose(corners)
    return np.interp(np.arange(round(times[-1] / SAMPLE_TIME) + 1) * SAMPLE_TIME, times, levels)


def multisine(mean, amplitude, duration=12.0):
    """Five incommensurable sines; amplitude bounds the sum."""
    time = np.arange(round(duration / SAMPLE_TIME) + 1) * SAMPLE_TIME
    frequencies = 0.13, 0.37, 0.71, 1.27, 2.3
    weights = 0.4, 0.25, 0.17, 0.12, 0.06
    return mean + amplitude * sum(w * np.sin(2 * np.pi * f * time + 0.9 * k)
                                  for k, (w, f) in enumerate(zip(weights, frequencies)))


RAMPS_20 = [(0, 0.8), (0.5, 0.8), (2.5, 2.1), (3.5, 2.1), (4.0, 1.4), (5, 1.4), (8, 2.2), (8.5, 2.2), (9.5, 1), (11, 1)]
RAMPS_80 = [(0, 1.5), (0.5, 1.5), (2.5, 3.3), (3.5, 3.3), (4.0, 2.5), (5, 2.5), (8, 3.8), (8.5, 3.8), (9.5, 1.8), (11, 1.8)]

CASES = [
    Case("nominal_staircase_20kg", VIRTUAL_AREA_1000, 20.0, staircase([0.8, 1.1, 1.6, 2.0, 1.7, 1.2], 2.0), 0.22),
    Case("nominal_staircase_80kg", VIRTUAL_AREA_1000, 80.0, staircase([1.5, 2.0, 2.6, 3.0, 2.5, 1.8], 2.0), 0.22),
    Case("nominal_ramps_20kg", VIRTUAL_AREA_1000, 20.0, ramps(RAMPS_20), 0.22),
    Case("nominal_ramps_80kg", VIRTUAL_AREA_1000, 80.0, ramps(RAMPS_80), 0.22),
    Case("nominal_multisine_20kg", VIRTUAL_AREA_1000, 20.0, multisine(1.5, 0.8), 0.22),
    Case("nominal_multisine_80kg", VIRTUAL_AREA_1000, 80.0, multisine(2.7, 1.2), 0.22),
    Case("improved_mckibben_multisine_40kg", IMPROVED_1000, 40.0, multisine(2.0, 1.0), 0.22),
    Case("short_muscle_multisine_40kg", VIRTUAL_AREA_290, 40.0, multisine(2.4, 1.4), 0.065),
]


def equilibrium(case):
    """Pressure, contraction and velocity at rest under the first command."""
    pressure = VALVE_GAIN * case.command[0]
    imbalance = lambda x: static_force(case.muscle, pressure, x) - case.load_mass * GRAVITY
    return np.array([pressure, brentq(imbalance, 0.0, case.contraction_limit, xtol=1e-15, rtol=1e-15), 0.0])


def pull(case, pressure, x, velocity):
    return static_force(case.muscle, pressure, x) - DAMPING * velocity


def solve(case, relative_tolerance=1e-11):
    """States at the samples, (n_samples, 3): pressure, contraction, velocity."""
    states = [equilibrium(case)]
    scales = np.array([1e5, 0.1, 0.1])
    for before, after in zip(case.command[:-1], case.command[1:]):
        def derivative(t, state):
            pressure, x, velocity = state
            command = before + (after - before) * t / SAMPLE_TIME
            return [VALVE_BANDWIDTH * (VALVE_GAIN * command - pressure),
                    velocity,
                    pull(case, pressure, x, velocity) / case.load_mass - GRAVITY]
        piece = solve_ivp(derivative, (0, SAMPLE_TIME), states[-1], "DOP853",
                          rtol=relative_tolerance, atol=relative_tolerance * scales * 1e-2)
        states.append(piece.y[:, -1])
    return np.array(states)


def solve_again(case):
    """The same trajectory with the valve solved by hand and only the motion integrated, implicitly."""
    pressure, x, velocity = equilibrium(case)
    states = [(pressure, x, velocity)]
    for before, after in zip(case.command[:-1], case.command[1:]):
        slope = VALVE_GAIN * (after - before) / SAMPLE_TIME
        lag = slope / VALVE_BANDWIDTH
        start = pressure - VALVE_GAIN * before + lag
        pressure_at = lambda t: VALVE_GAIN * before + slope * t - lag + start * np.exp(-VALVE_BANDWIDTH * t)
        derivative = lambda t, motion: [motion[1], pull(case, pressure_at(t), *motion) / case.load_mass - GRAVITY]
        piece = solve_ivp(derivative, (0, SAMPLE_TIME), [x, velocity], "Radau", rtol=1e-12, atol=1e-15)
        pressure, (x, velocity) = pressure_at(SAMPLE_TIME), piece.y[:, -1]
        states.append((pressure, x, velocity))
    return np.array(states)


def write(case, states, folder):
    pressure, x, velocity = states.T
    mass = np.full_like(x, case.load_mass)
    table = np.column_stack([case.time, case.command, pressure, x, velocity, pull(case, *states.T), mass])
    np.savetxt(folder / f"{case.name}.csv", table, "%.12g", ",", header=HEADER, comments="")


def check_ranges(case, states):
    x = states[:, 1]
    assert x.min() >= 0 and x.max() <= case.contraction_limit, f"{case.name}: contraction {x.min()} ... {x.max()} m"
    assert case.command.min() >= 0.5 and case.command.max() <= 5.0, f"{case.name}: command out of range"


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--verify", action="store_true", help="solve again by other means and print the differences")
    verify = arguments.parse_args().verify
    for case in CASES:
        states = solve(case)
        check_ranges(case, states)
        write(case, states, Path(__file__).parent)
        print(f"{case.name}: contraction {states[:, 1].min():.4f} ... {states[:, 1].max():.4f} m")
        if verify:
            for label, other in ("tighter tolerance", solve(case, 1e-13)), ("second method", solve_again(case)):
                pressure, x, velocity = np.abs(states - other).max(axis=0)
                print(f"  {label}: {pressure:.1e} Pa, {x:.1e} m, {velocity:.1e} m/s", flush=True)


if __name__ == "__main__":
    main()
