"""The numbers: against independent solutions, and not depending on how a host steps."""

import numpy as np
import pytest
from scipy.optimize import brentq

from muscles import GRAVITY, LONG_REST_LENGTH, VIRTUAL_AREA_1000, mckibben, static_force
from support import REFERENCE, Instance, follow, read_csv

PRESETS = {
    "nominal_staircase_20kg": "dmsp-40-1000",
    "nominal_staircase_80kg": "dmsp-40-1000",
    "nominal_ramps_20kg": "dmsp-40-1000",
    "nominal_ramps_80kg": "dmsp-40-1000",
    "nominal_multisine_20kg": "dmsp-40-1000",
    "nominal_multisine_80kg": "dmsp-40-1000",
    "improved_mckibben_multisine_40kg": "dmsp-40-1000/improved-mckibben",
    "short_muscle_multisine_40kg": "dmsp-40-290",
}
SIGNALS = ("muscle.contraction", "muscle.gauge_pressure", "muscle.contraction_velocity", "muscle.force")


def start_of(recording):
    """Parameters that start a simulation where a recording starts: at rest."""
    return {"load.mass": recording["load_mass"][0], "initial.gauge_pressure": recording["gauge_pressure"][0]}


def test_every_reference_has_its_preset():
    """The trajectories of the muscle as it is; those with an effect are checked by tests/reference.rs."""
    all_of_them = {path.stem for path in REFERENCE.glob("*.csv")} - {"force_models"}
    trajectories = {name for name in all_of_them - {"closed_loop"} if not name.startswith("effect_")}
    assert trajectories == set(PRESETS)


@pytest.mark.parametrize("name", PRESETS)
def test_agrees_with_the_independent_solution(export, note, name):
    recording = read_csv(REFERENCE / f"{name}.csv")
    with Instance(export(PRESETS[name])["PneumaticMuscle"], start_of(recording)) as instance:
        simulated = follow(instance, recording["time"], recording["command"], SIGNALS)
    measured = np.column_stack([recording[signal.split(".")[1]] for signal in SIGNALS])
    contraction, gauge_pressure, velocity, force = np.abs(simulated - measured).max(axis=0)
    note(f"{name}: off by {contraction:.2g} m, {gauge_pressure:.2g} Pa, {velocity:.2g} m/s, {force:.2g} N")
    assert contraction < 1e-6
    assert gauge_pressure < 1.0
    assert velocity < 1e-5
    assert force < 0.01


def test_starts_in_motion(muscle):
    """From the middle of the independent solution on, where the load swings: its state there says how it goes on."""
    whole = read_csv(REFERENCE / "nominal_multisine_20kg.csv")
    recording = {name: column[403:904] for name, column in whole.items()}
    gauge_pressure, contraction = recording["gauge_pressure"][0], recording["contraction"][0]
    weight = 20.0 * GRAVITY
    hanging = brentq(lambda x: static_force(VIRTUAL_AREA_1000, gauge_pressure, x) - weight, -0.05, 0.3, xtol=1e-14)
    velocity = recording["contraction_velocity"][0]
    assert abs(velocity) > 0.01
    motion = {"contraction_offset": contraction - hanging, "contraction_velocity": velocity}
    start = start_of(recording) | {f"initial_motion.{name}": value for name, value in motion.items()}
    with Instance(muscle, start) as instance:
        simulated = follow(instance, recording["time"] - recording["time"][0], recording["command"], SIGNALS)
    measured = np.column_stack([recording[signal.split(".")[1]] for signal in SIGNALS])
    assert (np.abs(simulated - measured).max(axis=0) < [1e-6, 1.0, 1e-5, 0.01]).all()


def pieces(size):
    return lambda duration: [duration / round(duration / size)] * round(duration / size)


def uneven(seed):
    """Divides a duration at three random places, differently each time."""
    random = np.random.default_rng(seed)
    return lambda duration: np.diff([0.0, *np.sort(random.uniform(0.0, duration, 3)), duration])


@pytest.mark.parametrize("divide", [pieces(1e-3), pieces(1e-4), uneven(1), uneven(2)], ids=["1 ms", "0.1 ms", "a", "b"])
def test_communication_step_does_not_matter_for_a_moving_input(muscle, divide):
    recording = {name: column[:301] for name, column in read_csv(REFERENCE / "nominal_multisine_20kg.csv").items()}

    def simulate(steps_between):
        with Instance(muscle, start_of(recording)) as instance:
            return follow(instance, recording["time"], recording["command"], SIGNALS, steps_between)

    assert_same_to_1e6(simulate(divide), simulate(pieces(1e-2)))


@pytest.mark.parametrize("divide", [pieces(1e-3), pieces(1e-4), pieces(0.1), uneven(3)],
                         ids=["1 ms", "0.1 ms", "100 ms", "uneven"])
def test_communication_step_does_not_matter_for_a_held_input(muscle, divide):
    def simulate(steps_between):
        with Instance(muscle, {"valve.command": 3.0, "load.mass": 40.0, "initial.gauge_pressure": 2e5}) as instance:
            return follow(instance, np.arange(0.0, 2.05, 0.1), np.full(21, 3.0), SIGNALS, steps_between)

    assert_same_to_1e6(simulate(divide), simulate(pieces(1e-2)))


def assert_same_to_1e6(table, expected):
    assert (np.abs(table - expected).max(axis=0) <= 1e-6 * np.abs(expected).max(axis=0)).all()


def test_starts_in_static_equilibrium(muscle):
    """80 kg at 4.5 bar contract DMSP-40-1000 by 22.6 cm; outputs hold before the first step."""
    mass, gauge_pressure = 80.0, 4.5e5

    def surplus(x):
        return static_force(VIRTUAL_AREA_1000, gauge_pressure, x) - mass * GRAVITY

    expected = brentq(surplus, 0.1, 0.3, xtol=1e-14)
    assert expected == pytest.approx(0.226, abs=5e-4)
    with Instance(muscle, {"load.mass": mass, "initial.gauge_pressure": gauge_pressure}, initialize=False) as instance:
        instance.slave.setupExperiment()
        instance.slave.enterInitializationMode()
        before = instance.get(*muscle.names("output"))
        instance.slave.exitInitializationMode()
        after = instance.get(*muscle.names("output"))
    assert (before == after).all()
    outputs = dict(zip(muscle.names("output"), after, strict=True))
    diameter = mckibben(LONG_REST_LENGTH).diameter(LONG_REST_LENGTH - expected)
    for group in ("muscle", "measured"):
        assert outputs[f"{group}.contraction"] == pytest.approx(expected, abs=1e-9)
        assert outputs[f"{group}.gauge_pressure"] == gauge_pressure
        assert outputs[f"{group}.force"] == pytest.approx(mass * GRAVITY, abs=1e-6)
    assert outputs["muscle.contraction_velocity"] == 0.0
    assert outputs["muscle.diameter"] == pytest.approx(diameter, abs=1e-9)


def test_stays_in_static_equilibrium(muscle):
    start = {"load.mass": 80.0, "initial.gauge_pressure": 4.5e5, "valve.command": 4.5}
    with Instance(muscle, start) as instance:
        before = instance.get(*SIGNALS)
        instance.step(5.0)
        assert instance.get(*SIGNALS) == pytest.approx(before, rel=1e-9, abs=1e-9)


def test_actuator_pulls_as_the_muscle_that_hangs(export):
    """The same motion imposed on the actuator gives the same force and pressure."""
    recording = {name: column[:501] for name, column in read_csv(REFERENCE / "nominal_multisine_80kg.csv").items()}
    pull, expected, motion = [], recording["force"][1:], ("contraction", "contraction_velocity")
    start = {"initial.gauge_pressure": recording["gauge_pressure"][0]}
    with Instance(export()["PneumaticActuator"], start) as instance:
        for row in range(500):
            slope = (recording["command"][row + 1] - recording["command"][row]) / 0.01
            instance.set({"valve.command": recording["command"][row]})
            instance.set_slopes({"valve.command": slope})
            instance.step(0.01)
            instance.set({f"muscle.{name}": recording[name][row + 1] for name in motion})
            pull.append(instance.get("muscle.force")[0])
    assert np.abs(pull - expected).max() < 0.01


def test_trajectory_keeps_its_limits_and_arrives(export):
    start = {"start": 0.02, "target": 0.15, "velocity": 0.03, "acceleration": 0.05, "start_time": 0.5}
    names = ("setpoint", "setpoint_velocity", "setpoint_acceleration")
    with Instance(export()["ReferenceTrajectory"], start) as instance:
        table = [instance.get(*names)]
        for _ in range(700):
            instance.step(0.01)
            table.append(instance.get(*names))
    setpoint, velocity, acceleration = np.array(table).T
    assert setpoint[0] == 0.02 and setpoint[-1] == 0.15
    assert velocity.max() == pytest.approx(0.03) and velocity.min() >= 0.0
    assert np.abs(acceleration).max() == pytest.approx(0.05)
    # The trapezoid's corners lie on the samples or between them; the velocity is piecewise linear.
    assert np.cumsum(0.5 * (velocity[1:] + velocity[:-1])) * 0.01 == pytest.approx(setpoint[1:] - 0.02, abs=2e-5)
