"""The examples do what their first lines say."""

import csv
import os
import signal
import sys

import numpy as np
import pytest
from distributed import Client, LocalCluster

import cable_robot
import fmpy_closed_loop
import largest_step
import parameter_sweep_dask
from support import EXAMPLES, ROOT, run


@pytest.fixture(scope="module")
def fmus(sinew, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    run(sinew, "export", "--out", folder)
    return folder


def example(name, *options):
    return run(sys.executable, EXAMPLES / name, *options).stdout


def column(path, name):
    with open(path, newline="") as file:
        return np.array([float(row[name]) for row in csv.DictReader(file)])


def test_closed_loop_is_drawn(fmus, tmp_path, note):
    note(example("fmpy_closed_loop.py", fmus / "ClosedLoop.ssp", "--out", tmp_path / "loop.png").strip())
    assert (tmp_path / "loop.png").read_bytes().startswith(b"\x89PNG")


def test_input_derivatives_come_nearer_to_the_limit_of_small_steps(fmus, note):
    """Read in order, the error of held inputs is of first order in the step, that of moving ones of second."""
    names = fmpy_closed_loop.NAMES[1:2]

    def contraction(step_size, derivatives):
        course = fmpy_closed_loop.simulate(fmus / "ClosedLoop.ssp", step_size, 6.0, names, derivatives,
                                           fmpy_closed_loop.exchange_in_order)
        return course[names[0]][::round(0.01 / step_size)]

    limit = contraction(2.5e-4, derivatives=True)
    held, moving = ([np.abs(contraction(step_size, derivatives) - limit).max() for step_size in (5e-3, 2.5e-3)]
                    for derivatives in (False, True))
    note(f"closed loop in order, 5 ms: off by {1e6 * held[0]:.0f} um, with input derivatives {1e6 * moving[0]:.0f} um")
    assert moving[0] < 0.5 * held[0], (held, moving)
    assert held[0] / held[1] == pytest.approx(2.0, rel=0.1), held
    assert moving[0] / moving[1] > 3.5, moving


def test_readme_states_the_largest_stable_steps(sinew, tmp_path):
    """As examples/largest_step.py prints them; where this fails after a change of the loop, copy its new table."""
    systems = [largest_step.export(sinew, "dmsp-40-1000", None, mass, tmp_path) for mass in largest_step.MASSES]
    motion = largest_step.end_of_motion(systems[0])
    readme = (ROOT / "README.md").read_text()
    steps = [round(step, 6) for step in largest_step.STEPS]
    for name, how, derivatives in largest_step.MASTERS:
        row = next(line for line in readme.splitlines() if f"| {name} | {'on' if derivatives else 'off'} |" in line)
        _, _, _, stable, *stated, _ = (cell.strip() for cell in row.split("|"))
        place = steps.index(round(float(stable.removesuffix(" ms")) * 1e-3, 6))

        def error(step, how=how, derivatives=derivatives):
            return max(largest_step.largest_error(ssp, step, motion, how, derivatives) for ssp in systems)

        assert error(steps[place]) < np.inf, f"{row} is not stable"
        assert error(steps[place + 1]) == np.inf, f"{row} is stable with longer steps as well"
        step, said = largest_step.SHOWN[1], stated[1]  # the first step takes the longest
        assert 1e3 * error(step) == pytest.approx(float(said.removesuffix(" mm")), abs=0.01), f"{row} at {step} s"


def loaded_libraries(dask_worker):
    """Paths of the FMU libraries in the process of a worker."""
    with open("/proc/self/maps") as maps:
        return sorted({line.split()[-1] for line in maps if "PneumaticMuscle.so" in line})


def test_sweep_outlives_a_worker_and_gives_the_serial_numbers(fmus):
    fmu = (fmus / "PneumaticMuscle.fmu").read_bytes()
    cases = parameter_sweep_dask.CASES
    expected = parameter_sweep_dask.sweep_serially(fmu, cases)
    assert len({tuple(result.values()) for result in expected}) == len(cases), "every case should be one of its own"
    killed = []
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        processes = client.run(os.getpid)

        def kill_one(done):
            if done == 3:
                killed.append(next(iter(processes.values())))
                os.kill(killed[0], signal.SIGKILL)

        assert parameter_sweep_dask.sweep(client, fmu, cases, kill_one) == expected
        client.wait_for_workers(2)
        assert killed and killed[0] not in client.run(os.getpid).values(), "another worker should have come"
        for libraries in client.run(loaded_libraries).values():
            assert len(libraries) == 1, "a worker loads the library once"


def test_sweep_writes_the_same_bytes_in_parallel(fmus, tmp_path):
    fmu = fmus / "PneumaticMuscle.fmu"
    example("parameter_sweep_dask.py", fmu, "--serial", "--out", tmp_path / "serial.csv")
    example("parameter_sweep_dask.py", fmu, "--workers", 2, "--out", tmp_path / "parallel.csv")
    assert (tmp_path / "parallel.csv").read_bytes() == (tmp_path / "serial.csv").read_bytes()


def test_two_processes_with_a_broker_give_the_numbers_of_one(fmus, tmp_path):
    steps, out = 2000, tmp_path / "muscle.csv"
    example("helics/run.py", fmus, "--steps", steps, "--out", out)
    name = "muscle.measured.contraction"
    expected = fmpy_closed_loop.simulate(fmus / "ClosedLoop.ssp", 1e-3, 1e-3 * steps, [name])[name]
    found = column(out, "contraction [m]")
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= 1e-10


@pytest.fixture(scope="module")
def muscles(fmus, tmp_path_factory):
    muscles = cable_robot.Muscles(fmus / "PneumaticActuator.fmu", tmp_path_factory.mktemp("robot"))
    yield muscles
    muscles.free()


def test_cable_robot_is_drawn(fmus, tmp_path, note):
    note(example("cable_robot.py", fmus / "PneumaticActuator.fmu", "--out", tmp_path / "robot.png").strip())
    assert (tmp_path / "robot.png").read_bytes().startswith(b"\x89PNG")


def test_cable_robot_comes_to_rest_where_statics_say(muscles, note):
    """The commands change to those of another pressure: FMUs over time and scipy at once must find the same pose."""
    commands = muscles.pressures(cable_robot.MIDDLE) / muscles.gain + np.array([0.3, -0.2, 0.1, 0.25])
    course = cable_robot.simulate(muscles, lambda time: commands, 12.0)
    expected = muscles.equilibrium(muscles.gain * commands)
    assert np.linalg.norm(expected[:2]) > 0.01 and abs(expected[2]) > 0.005, "the platform should move"
    assert course["tensions"].min() > 0.0
    difference = np.abs(course["poses"][-1] - expected)
    note(f"cable robot at rest, FMUs against scipy: {difference[:2].max():.0e} m, {difference[2]:.0e} rad")
    assert difference.max() < 1e-7


def test_cable_robot_keeps_its_energy_to_second_order(muscles, note):
    """Work is counted along the cables, motion by their wrench: both must belong to one geometry."""
    commands = muscles.pressures(cable_robot.path(1.0)) / muscles.gain

    def drift(step_size):
        energy = cable_robot.simulate(muscles, lambda time: commands, 1.0, step_size)["energy"]
        return np.abs(energy - energy[0]).max()

    coarse, fine = drift(4e-3), drift(2e-3)
    note(f"cable robot, energy that the master loses in 1 s: {coarse:.1e} J at 4 ms, {fine:.1e} J at 2 ms")
    assert 3.0 < coarse / fine < 5.0
