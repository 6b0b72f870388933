"""The closed loop as a system of FMUs: valid, and every importer that runs it gets the same numbers.

The importers are FMPy, libcosim and ecos (C++), a master in Rust with the crate `fmi`, and fmucontainer (C), which
makes one FMU of the loop. All but FMPy's own `simulate_ssp` initialise the FMUs with what their connections say and
then let all step at once. `simulate_ssp` begins with zeros at all inputs; the Rust master can do so too, and agrees.
"""

import ctypes
import json
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from lxml import etree

from fmpy_closed_loop import simulate
from support import Fmu, run, write_parameters

SCHEMA = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureDescription.xsd"
STEP, STEPS = 1e-3, 3000
NAMES = ("reference.setpoint", "muscle.measured.contraction", "muscle.muscle.gauge_pressure", "controller.command")
SIZES = np.array([0.1, 0.1, 1e5, 1.0])  # m, m, Pa, V
COMPONENTS = {"reference": "ReferenceTrajectory", "muscle": "PneumaticMuscle", "controller": "PidFeedForward"}
LINKS = [("reference", "setpoint", "controller", "setpoint"),
         ("reference", "setpoint_velocity", "controller", "setpoint_velocity"),
         ("reference", "setpoint_acceleration", "controller", "setpoint_acceleration"),
         ("muscle", "measured.contraction", "controller", "measured_contraction"),
         ("controller", "command", "muscle", "valve.command")]
# Nothing of these is a default, so that an importer that ignores a parameter or an initial value shows.
PARAMETERS = {"load.mass": 40.0, "reference.start": 0.05, "reference.target": 0.12}


@pytest.fixture(scope="module")
def system(sinew, tmp_path_factory):
    folder = tmp_path_factory.mktemp("system")
    run(sinew, "export", "--out", folder)
    return folder / "ClosedLoop.ssp"


@pytest.fixture(scope="module")
def loaded(sinew, tmp_path_factory):
    """The system with a load and a reference of its own, unpacked in the folder of the same name."""
    folder = tmp_path_factory.mktemp("loaded")
    parameters = write_parameters(folder / "parameters.toml", PARAMETERS)
    run(sinew, "export", "--parameters", parameters, "--out", folder)
    with zipfile.ZipFile(folder / "ClosedLoop.ssp") as archive:
        archive.extractall(folder / "ClosedLoop")
    return folder / "ClosedLoop.ssp"


@pytest.fixture(scope="module")
def course(loaded):
    """What the master in examples/ gets: `NAMES` at the end of every step."""
    result = simulate(loaded, STEP, STEP * STEPS, NAMES)
    table = np.column_stack([result[name] for name in NAMES])[1:]
    assert table[0, :2] == pytest.approx(PARAMETERS["reference.start"], abs=1e-6)
    assert table[-1, :2] == pytest.approx(PARAMETERS["reference.target"], abs=2e-3)
    return table


def same(found, expected):
    """Whether two courses agree to 1e-9 of the usual size of each signal."""
    assert found.shape == expected.shape
    difference = np.abs(found - expected).max(axis=0) / SIZES[:expected.shape[1]]
    assert (difference <= 1e-9).all(), difference
    return difference.max()


def test_description_follows_the_schema(system):
    with zipfile.ZipFile(system) as archive:
        description = etree.fromstring(archive.read("SystemStructure.ssd"))
    schema = etree.XMLSchema(etree.parse(SCHEMA))
    assert schema.validate(description), schema.error_log


@pytest.mark.parametrize("preset, target", [("dmsp-40-1000", 0.15), ("dmsp-40-290", 0.05)])
def test_the_loop_follows_its_reference(sinew, tmp_path, preset, target):
    """Each muscle a reference within its reach, as the thesis has them."""
    assert run(sinew, "export", "--parameters", preset, "--out", tmp_path).stderr == ""
    result = simulate_ssp(str(tmp_path / "ClosedLoop.ssp"), stop_time=8.0, step_size=1e-3)
    error = result["reference.setpoint"] - result["muscle.measured.contraction"]
    assert result["reference.setpoint"][-1] == pytest.approx(target)
    assert np.abs(error).max() < 1e-3, "the load must start at rest on the reference and stay near it"
    assert abs(error[-1]) < 1e-5


@pytest.mark.parametrize("preset, parameters, expected", [
    ("dmsp-40-290", {"reference.target": 0.15}, "cannot hold 20 kg at `reference.target`, 0.15 m"),
    ("dmsp-40-1000", {"controller.integral_gain": 500.0}, "not stable with 20 kg at `reference.start`, 0 m"),
    ("dmsp-40-1000/tondu-lopez-kq", {"load.mass": 40.0}, "cannot hold 40 kg at `reference.target`, 0.15 m"),
])
def test_a_loop_that_cannot_follow_is_told(sinew, tmp_path, preset, parameters, expected):
    source = write_parameters(tmp_path / "parameters.toml", parameters, preset)
    assert expected in run(sinew, "export", "--parameters", source, "--out", tmp_path).stderr


def with_libcosim(system):
    log_output_level(CosimLogLevel.WARNING)
    unpacked = system.with_suffix("")
    execution = CosimExecution.from_ssp_file(str(unpacked), STEP * 1e9)
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    signals = []
    for name in NAMES:
        component, variable = name.split(".", 1)
        fmu = Fmu(unpacked / "resources" / f"{COMPONENTS[component]}.fmu")
        signals.append((execution.slave_index_from_instance_name(component), fmu.references([variable])))
    table = []
    for _ in range(STEPS):
        assert execution.step()
        table.append([observer.last_real_values(slave, references)[0] for slave, references in signals])
    return np.array(table)


def with_ecos(system):
    # ecos needs the library of Debian's libtbb12, which comes as a wheel as well.
    ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation

    # After a step ecos has set the inputs already: the command of this step is what the valve has got.
    names = [name.replace("controller.command", "muscle.valve.command").replace(".", "::", 1) for name in NAMES]
    with EcosSimulation(STEP, ssp_path=str(system)) as simulation:
        assert simulation.init(0.0, "initialValues")
        table = []
        for _ in range(STEPS):
            simulation.step()
            table.append([simulation.get_real(name) for name in names])
        simulation.terminate()
    return np.array(table)


def with_rust(system, importer, *options):
    # After a step this master has set the inputs already, as ecos has.
    names = [name.replace("controller.command", "muscle.valve.command") for name in NAMES]
    _, *rows = run(importer, system, STEP, STEPS, *options, *names).stdout.splitlines()
    return np.array([row.split(",")[1:] for row in rows], dtype=float)[1:]


def test_libcosim_agrees(loaded, course, note):
    note(f"closed loop, libcosim against FMPy: {same(with_libcosim(loaded), course):.0e} of the signals' size")


def test_ecos_agrees(loaded, course, note):
    note(f"closed loop, ecos against FMPy: {same(with_ecos(loaded), course):.0e} of the signals' size")


def test_rust_agrees(loaded, course, importer, note):
    note(f"closed loop, crate fmi against FMPy: {same(with_rust(loaded, importer), course):.0e} of the signals' size")


def test_fmpys_own_master_agrees_where_the_first_inputs_are_zero(system, importer, note):
    result = simulate_ssp(str(system), stop_time=(STEPS - 0.5) * STEP, step_size=STEP)
    found = np.column_stack([result[name] for name in ("reference.setpoint", "muscle.measured.contraction")])
    expected = with_rust(system, importer, "--zero-first-inputs")[:, :2]
    note(f"closed loop, simulate_ssp against crate fmi with first inputs zero: {same(found, expected):.0e}")


def container(system):
    """One FMU of the unpacked system, by fmucontainer.

    It breaks the loop where it initialises, and takes the FMUs in the order of its list: what the muscle shows at the
    start does not depend on the command, so it comes before the controller. From the .ssp itself it makes an FMU
    without outputs, and with the controller first.
    """
    folder = system.with_suffix("") / "resources"
    files = {component: f"{model}.fmu" for component, model in COMPONENTS.items()}
    description = {
        "name": "Container.fmu", "step_size": STEP, "auto_link": False, "fmu": list(files.values()),
        "link": [[files[source], output, files[sink], variable] for source, output, sink, variable in LINKS],
        "output": [[files[name.split(".")[0]], name.split(".", 1)[1], name] for name in NAMES],
    }
    (folder / "container.json").write_text(json.dumps(description))
    run("fmucontainer", "-fmu-directory", folder, "-container", "container.json")
    return folder / "Container.fmu"


def test_one_fmu_of_the_loop_agrees(loaded, course, note):
    result = fmpy.simulate_fmu(str(container(loaded)), stop_time=STEP * STEPS, output_interval=STEP, output=NAMES)
    found = np.column_stack([result[name] for name in NAMES])[1:]
    note(f"closed loop, fmucontainer against FMPy: {same(found, course):.0e} of the signals' size")
