"""Every capability flag of the description is true of the library, and wrong calls are refused with a sentence."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackLoggerTYPE,
    fmi2Error,
    fmi2LastSuccessfulTime,
)

from support import FMICallException, Instance

# Away from rest, with effects in action, so that no derivative vanishes by chance.
OPERATING_POINTS = {
    "PneumaticMuscle": {"valve.command": 3.0, "load.external_force": 20.0, "initial.gauge_pressure": 2e5,
                        "friction_hysteresis.half_width": 30.0},
    "PneumaticActuator": {"valve.command": 3.0, "muscle.contraction": 0.1, "muscle.contraction_velocity": 0.05,
                          "friction_hysteresis.half_width": 30.0},
    "PidFeedForward": {"setpoint": 0.1, "setpoint_velocity": 0.02, "setpoint_acceleration": 0.03,
                       "measured_contraction": 0.0995, "initial.gauge_pressure": 2e5},
    "ReferenceTrajectory": {},
}


def running(fmu):
    """An instance at its operating point after some steps."""
    instance = Instance(fmu, OPERATING_POINTS[fmu.description.modelName])
    for _ in range(20):
        instance.step(0.01)
    return instance


def test_flags_are_as_promised(fmu):
    flags = fmu.description.coSimulation
    assert flags.canHandleVariableCommunicationStepSize
    assert flags.canInterpolateInputs
    assert flags.maxOutputDerivativeOrder == 1
    assert flags.canGetAndSetFMUstate and flags.canSerializeFMUstate
    assert flags.providesDirectionalDerivative
    assert flags.canNotUseMemoryManagementFunctions
    assert not flags.canBeInstantiatedOnlyOncePerProcess
    assert not flags.needsExecutionTool and not flags.canRunAsynchronuously


def test_version_and_types(fmu):
    with Instance(fmu) as instance:
        assert (instance.slave.getVersion(), instance.slave.getTypesPlatform()) == ("2.0", "default")


def test_variables_start_as_described(fmu):
    """The library and the description agree on the value of every parameter and input."""
    with Instance(fmu) as instance:
        for name in fmu.names("parameter") + fmu.names("input"):
            getter = instance.slave.getReal if fmu.is_real(name) else instance.slave.getInteger
            assert getter(fmu.references([name])) == [float(fmu.variables[name].start)], name


def test_directional_derivatives_are_those_of_the_outputs(fmu):
    with running(fmu) as instance:
        for known in fmu.names("input"):
            for output in fmu.names("output"):
                expected = pytest.approx(central_difference(instance, output, known), rel=1e-5, abs=1e-5)
                assert instance.derivative(output, known) == expected, (output, known)


def central_difference(instance, output, known):
    here, step = instance.get(known)[0], 1e-4
    values = []
    for value in (here + step, here - step):
        instance.set({known: value})
        values.append(instance.get(output)[0])
    instance.set({known: here})
    return (values[0] - values[1]) / (2 * step)


def test_dependencies_are_exact(fmu):
    """An output depends on the inputs that the description lists, and on no other."""
    listed = fmu.unknowns("outputs")
    with running(fmu) as instance:
        if "series_elasticity.compliance" in fmu.variables:  # what stretches makes a reading depend on the force
            instance.set({"series_elasticity.compliance": -5e-6})
        for output in fmu.names("output"):
            acting = [known for known in fmu.names("input") if instance.derivative(output, known) != 0.0]
            assert acting == sorted(listed[output], key=fmu.names("input").index), output


def test_directional_derivative_in_a_direction(export):
    fmu = export()["PidFeedForward"]
    names, direction = fmu.names("input"), [0.3, -1.0, 2.0, 0.7]
    with running(fmu) as instance:
        along = instance.slave.getDirectionalDerivative(fmu.references(["command", "control_error"]),
                                                        fmu.references(names), direction)
        for total, output in zip(along, ("command", "control_error"), strict=True):
            parts = [seed * instance.derivative(output, name) for seed, name in zip(direction, names, strict=True)]
            assert total == pytest.approx(sum(parts), rel=1e-9)


@pytest.mark.parametrize("known", ["initial.gauge_pressure", "load.mass", "load.external_force", "muscle.rest_length",
                                   "contraction_sensor_offset.offset"])
def test_directional_derivatives_of_the_start(muscle, known):
    """While initialising, the state follows the parameters: the equilibrium moves."""
    start = {"load.mass": 40.0, "initial.gauge_pressure": 3e5, "muscle.rest_length": 0.98}

    def equilibrium(value):
        with Instance(muscle, start | {known: value}) as instance:
            return instance.get("measured.contraction")[0]

    here = start.get(known, 0.0)
    step = 1e-3 * max(here, 0.1)
    expected = (equilibrium(here + step) - equilibrium(here - step)) / (2 * step)
    with Instance(muscle, start, initialize=False) as instance:
        instance.slave.setupExperiment()
        instance.slave.enterInitializationMode()
        assert instance.derivative("measured.contraction", known) == pytest.approx(expected, rel=1e-4)


def test_output_derivatives_are_those_of_the_outputs(fmu):
    outputs, duration = fmu.names("output"), 1e-4
    with running(fmu) as instance:
        before, slope_before = instance.get(*outputs), instance.output_derivatives(*outputs)
        instance.step(duration)
        after, slope_after = instance.get(*outputs), instance.output_derivatives(*outputs)
    quotient = (after - before) / duration
    assert quotient == pytest.approx(0.5 * (slope_before + slope_after), rel=1e-3, abs=1e-4)


def test_output_derivatives_do_not_straddle_a_corner_of_the_reference(export):
    """The acceleration jumps where the motion begins; a difference across the jump would be thousands of m/s³."""
    velocity, acceleration = 0.03, 0.05
    with Instance(export()["ReferenceTrajectory"], {"velocity": velocity, "acceleration": acceleration}) as instance:
        names = ("setpoint", "setpoint_velocity", "setpoint_acceleration")
        assert instance.output_derivatives(*names) == pytest.approx([0.0, acceleration, 0.0])
        instance.step(velocity / acceleration)  # to where the velocity has been reached
        assert instance.output_derivatives(*names) == pytest.approx([velocity, 0.0, 0.0])


def test_input_derivatives_make_a_ramp(muscle):
    """One long step under a ramp: the first-order valve has its closed-form pressure."""
    start, slope, duration, bandwidth, gain = 2.0, 4.0, 0.25, 15.0, 1e5
    parameters = {"valve.command": start, "initial.gauge_pressure": gain * start, "valve.bandwidth": bandwidth}
    expected = gain * (start + slope * (duration - (1 - np.exp(-bandwidth * duration)) / bandwidth))
    with Instance(muscle, parameters) as instance:
        instance.set_slopes({"valve.command": slope})
        instance.step(duration)
        assert instance.get("muscle.gauge_pressure")[0] == pytest.approx(expected, abs=0.1)
        assert instance.get("valve.command")[0] == pytest.approx(start + slope * duration)
        instance.step(duration)
        assert instance.get("valve.command")[0] == pytest.approx(start + slope * duration), "a slope holds for one step"


def simulate(fmu, load_mass):
    """Bytes of all outputs over a second."""
    with Instance(fmu, {"load.mass": load_mass, "initial.gauge_pressure": 2e5, "valve.command": 3.0}) as instance:
        table = []
        for _ in range(1000):
            instance.step(1e-3)
            table.append(instance.get(*fmu.names("output")))
    return np.array(table).tobytes()


def test_instances_do_not_disturb_each_other(muscle):
    alone = simulate(muscle, 20.0), simulate(muscle, 60.0)
    start = {"initial.gauge_pressure": 2e5, "valve.command": 3.0}
    tables = [], []
    with Instance(muscle, start | {"load.mass": 20.0}) as light, Instance(muscle, start | {"load.mass": 60.0}) as heavy:
        for _ in range(1000):
            for instance, table in zip((light, heavy), tables, strict=True):
                instance.step(1e-3)
                table.append(instance.get(*muscle.names("output")))
    assert tuple(np.array(table).tobytes() for table in tables) == alone


def test_ten_instances_in_four_threads(muscle):
    masses = np.linspace(20.0, 65.0, 10)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda mass: simulate(muscle, mass), masses))
    assert together == [simulate(muscle, mass) for mass in masses]


def test_wrong_guid_is_refused(fmu):
    with Instance(fmu) as instance:  # a second one: the library must be told apart by the GUID alone
        instance.slave.guid = "{00000000-0000-0000-0000-000000000000}"
        component = instance.slave.component
        with pytest.raises(Exception, match="Failed to instantiate"):
            instance.slave.instantiate(callbacks=instance.log.callbacks)
        instance.slave.component = component
        assert "GUID" in " ".join(message for _, _, message in instance.log)


def test_host_without_callbacks_is_served(muscle):
    """canNotUseMemoryManagementFunctions; and a logger may be missing."""
    with Instance(muscle, initialize=False) as instance:
        callbacks = instance.log.callbacks
        callbacks.allocateMemory, callbacks.freeMemory = fmi2CallbackAllocateMemoryTYPE(), fmi2CallbackFreeMemoryTYPE()
        callbacks.logger = fmi2CallbackLoggerTYPE()
        first = instance.slave.component
        instance.slave.instantiate(callbacks=callbacks)
        instance.initialize()
        with pytest.raises(FMICallException):
            instance.step(-1.0)
        instance.slave.fmi2FreeInstance(first)


WRONG_CALLS = {
    "NaN input": (lambda i: i.set({"valve.command": float("nan")}), "valve.command"),
    "infinite parameter": (lambda i: i.set({"load.mass": float("inf")}), "load.mass"),
    "parameter out of range": (lambda i: i.set({"load.mass": -1.0}), "load.mass"),
    "fixed parameter while stepping": (lambda i: i.set({"initial.gauge_pressure": 1e5}), "initial.gauge_pressure"),
    "setting an output": (lambda i: i.set({"muscle.force": 1.0}), "muscle.force"),
    "unknown value reference": (lambda i: i.slave.getReal([987654]), "987654"),
    "real read as integer": (lambda i: i.slave.getInteger(i.fmu.references(["load.mass"])), "load.mass"),
    "enumeration out of range": (lambda i: i.set({"muscle.force_model": 99}), "muscle.force_model"),
    "step of zero": (lambda i: i.step(0.0), "step"),
    "step backwards": (lambda i: i.step(-1e-3), "step"),
    "NaN step": (lambda i: i.step(float("nan")), "step"),
    "wrong communication point": (lambda i: i.slave.doStep(5.0, 1e-3), "5 s"),
    "second derivative of an input": (
        lambda i: i.slave.setRealInputDerivatives(i.fmu.references(["valve.command"]), [2], [1.0]), "order"),
    "derivative of a parameter": (lambda i: i.set_slopes({"load.mass": 1.0}), "load.mass"),
    "initialising twice": (lambda i: i.initialize(), ""),
}


@pytest.mark.parametrize("call, named", WRONG_CALLS.values(), ids=WRONG_CALLS)
def test_wrong_call_is_refused_and_logged(muscle, call, named):
    with Instance(muscle) as instance:
        before = instance.get(*muscle.names("output"))
        with pytest.raises(FMICallException):
            call(instance)
        status, category, message = instance.log[-1]
        assert status >= fmi2Error
        assert category in {entry.name for entry in muscle.description.logCategories}
        assert named.lower() in message.lower()
        assert (instance.get(*muscle.names("output")) == before).all()


def test_step_before_initialisation_is_refused(fmu):
    with Instance(fmu, initialize=False) as instance:
        with pytest.raises(FMICallException):
            instance.step(1e-3)
        assert instance.log


def test_no_equilibrium_is_a_sentence(muscle):
    with Instance(muscle, {"load.mass": 5000.0, "initial.gauge_pressure": 1e5}, initialize=False) as instance:
        with pytest.raises(FMICallException):
            instance.initialize()
        assert "5000" in instance.log[-1][2]


def test_diverged_model_keeps_its_last_good_state(muscle):
    with Instance(muscle) as instance:
        instance.step(0.01)
        before = instance.get(*muscle.names("output"))
        instance.set({"load.external_force": 1e9})
        with pytest.raises(FMICallException):
            instance.step(1.0)
        assert instance.log and "muscle.contraction" in instance.log[-1][2]
        assert (instance.get(*muscle.names("output"))[:3] == before[:3]).all()
        assert instance.slave.getRealStatus(fmi2LastSuccessfulTime) == pytest.approx(0.01)
