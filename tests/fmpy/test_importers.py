"""FMPy (Python), libcosim (C++, FMILibrary) and the crate `fmi` (Rust) get the same numbers from the same FMU."""

import numpy as np
import pytest
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

from support import Instance, run

STEP, STEPS = 1e-3, 2000
START = {"load.mass": 40.0, "initial.gauge_pressure": 2e5, "valve.command": 3.0, "load.external_force": 5.0,
         "friction_hysteresis.half_width": 40.0}
OUTPUTS = ("muscle.contraction", "muscle.contraction_velocity", "muscle.gauge_pressure", "muscle.force",
           "measured.contraction")


def test_importer_is_clean(cargo_of_importer):
    cargo_of_importer("clippy", "--", "-D", "warnings")


def with_fmpy(fmu):
    with Instance(fmu, START) as instance:
        table = []
        for _ in range(STEPS):
            instance.step(STEP)
            table.append(instance.get(*OUTPUTS))
    return np.array(table)


def with_libcosim(fmu):
    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_step_size(STEP * 1e9)
    slave = execution.add_local_slave(CosimLocalSlave(str(fmu.path), "muscle"))
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    for name, value in START.items():
        assert execution.real_initial_value(slave, fmu.variables[name].valueReference, value)
    table = []
    for _ in range(STEPS):
        assert execution.step()
        table.append(observer.last_real_values(slave, fmu.references(OUTPUTS)))
    return np.array(table)


def with_rust(fmu, importer):
    starts = [f"{name}={value!r}" for name, value in START.items()]
    header, *rows = run(importer, fmu.path, STEP, STEPS, *starts, *OUTPUTS).stdout.splitlines()
    assert header.split(",")[1:] == list(OUTPUTS)
    return np.array([row.split(",")[1:] for row in rows], dtype=float)[1:]


def test_three_importers_same_numbers(muscle, importer):
    expected = with_fmpy(muscle)
    nominal = [float(muscle.variables[name].nominal) for name in OUTPUTS]
    assert expected[-1][0] != pytest.approx(expected[0][0], abs=1e-3), "the muscle should move"
    for table in (with_libcosim(muscle), with_rust(muscle, importer)):
        assert table.shape == expected.shape
        assert (np.abs(table - expected).max(axis=0) <= 1e-12 * np.array(nominal)).all()

