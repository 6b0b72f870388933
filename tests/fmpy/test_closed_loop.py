"""The position loop with the printed gains, put together from three FMUs by a master of a few lines."""

import csv

import numpy as np
import pytest

from closed_loop import ACCELERATION, BANDWIDTHS, DAMPING, STROKE, holding_pressure, profile
from support import REFERENCE, Instance

PRESET = "dmsp-40-1000/improved-mckibben/thesis"
STEP = 1e-3
TRAJECTORY = ("setpoint", "setpoint_velocity", "setpoint_acceleration")


def reference_errors():
    """Largest position error in m by valve, mass and velocity."""
    with open(REFERENCE / "closed_loop.csv", newline="") as file:
        return {(row["valve"], float(row["load_mass [kg]"]), float(row["velocity [m/s]"])): float(row["max_error [m]"])
                for row in csv.DictReader(file) if row["feed_forward"] == "static"}


def largest_error(fmus, valve, mass, velocity):
    """Largest position error in m; every FMU gets what the others showed at the beginning of the step."""
    plant = {"load.mass": mass, "valve.bandwidth": BANDWIDTHS[valve], "muscle.damping": DAMPING,
             "initial.gauge_pressure": holding_pressure(0.0, mass)}
    way = {"start": 0.0, "target": STROKE, "velocity": velocity, "acceleration": ACCELERATION}
    duration = profile(velocity)[0][-1]
    with (Instance(fmus["PneumaticMuscle"], plant) as muscle, Instance(fmus["PidFeedForward"], plant) as controller,
          Instance(fmus["ReferenceTrajectory"], way) as trajectory):
        largest = 0.0
        for _ in range(round(duration / STEP)):
            setpoints = trajectory.get(*TRAJECTORY)
            measured = muscle.get("measured.contraction")[0]
            controller.set(dict(zip(TRAJECTORY, setpoints, strict=True)) | {"measured_contraction": measured})
            muscle.set({"valve.command": controller.get("command")[0]})
            largest = max(largest, abs(setpoints[0] - measured))
            for instance in (trajectory, controller, muscle):
                instance.step(STEP)
    return largest


@pytest.mark.parametrize("valve", ["2.5 rad/s", "2.5 Hz"])
def test_printed_gains_give_the_table(export, note, valve):
    fmus, rows = export(PRESET), []
    for (of_valve, mass, velocity), expected in reference_errors().items():
        if of_valve == valve:
            rows.append((mass, velocity, expected, largest_error(fmus, valve, mass, velocity)))
    note(f"largest position error, printed gains, 1 ms, valve {valve}\n  kg    m/s   reference mm   FMUs mm")
    for mass, velocity, expected, found in rows:
        note(f"{mass:4g} {velocity:6g} {1e3 * expected:14.3f} {1e3 * found:9.3f}")
    assert len(rows) == 9
    expected, found = np.array(rows)[:, 2:].T
    assert found == pytest.approx(expected, rel=0.2)

