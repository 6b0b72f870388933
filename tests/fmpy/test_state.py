"""Saving and restoring the state of an FMU, with an effect that has a memory."""

import numpy as np
import pytest

from support import FMICallException, Instance

START = {"friction_hysteresis.half_width": 40.0, "load.mass": 40.0, "initial.gauge_pressure": 2e5}
OUTPUTS = ("muscle.contraction", "muscle.contraction_velocity", "muscle.gauge_pressure", "muscle.force")


def swing(instance, steps):
    """Steps of uneven size under a moving command with reversals; every output of every step, as bytes."""
    table = []
    for _ in range(steps):
        duration = 0.004 + 0.003 * np.sin(37.0 * instance.time)
        instance.set({"valve.command": 2.5 + np.sin(3.0 * instance.time)})
        instance.set_slopes({"valve.command": 3.0 * np.cos(3.0 * instance.time)})
        instance.step(duration)
        table.append(instance.get(*OUTPUTS))
    return np.array(table).tobytes()


def test_restored_state_continues_to_the_last_bit(muscle):
    with Instance(muscle, START) as instance:
        swing(instance, 300)
        state, time = instance.slave.getFMUstate(), instance.time
        first = swing(instance, 300)
        instance.slave.setFMUstate(state)
        instance.slave.freeFMUstate(state)
        instance.time = time
        assert swing(instance, 300) == first


@pytest.mark.parametrize("own", [True, False], ids=["same instance", "other instance"])
def test_serialized_state_continues_to_the_last_bit(muscle, own):
    with Instance(muscle, START) as instance, Instance(muscle) as other:
        swing(instance, 300)
        state = instance.slave.getFMUstate()
        serialized, time = instance.slave.serializeFMUstate(state), instance.time
        instance.slave.freeFMUstate(state)
        first = swing(instance, 300)
        heir = instance if own else other
        restored = heir.slave.deSerializeFMUstate(serialized)
        heir.slave.setFMUstate(restored)
        heir.slave.freeFMUstate(restored)
        heir.time = time
        assert swing(heir, 300) == first


def test_same_state_same_bytes(muscle):
    """No addresses and no uninitialised memory in the serialised state."""
    def serialized():
        with Instance(muscle, START) as instance:
            swing(instance, 20)
            return instance.slave.serializeFMUstate(instance.slave.getFMUstate())

    assert serialized() == serialized()


def test_hysteresis_is_in_the_state(muscle):
    """What the tests above restore is not only position, velocity and pressure."""
    def states(half_width):
        with Instance(muscle, START | {"friction_hysteresis.half_width": half_width}) as instance:
            return swing(instance, 300)

    assert states(40.0) != states(0.0)


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b + b"x", lambda b: b"", lambda b: b"X" * len(b),
                                    lambda b: b[:-8] + b"\xff" * 8],
                         ids=["short", "long", "empty", "garbage", "nan"])
def test_damaged_state_is_refused(muscle, damage):
    with Instance(muscle, START) as instance:
        swing(instance, 20)
        serialized, before = instance.slave.serializeFMUstate(instance.slave.getFMUstate()), instance.get(*OUTPUTS)
        with pytest.raises(FMICallException):
            instance.slave.setFMUstate(instance.slave.deSerializeFMUstate(damage(serialized)))
        assert (instance.get(*OUTPUTS) == before).all()
        assert instance.log


def test_state_of_another_model_is_refused(export):
    fmus = export()
    with Instance(fmus["PidFeedForward"]) as instance, Instance(fmus["ReferenceTrajectory"]) as other:
        foreign = instance.slave.serializeFMUstate(instance.slave.getFMUstate())
        with pytest.raises(FMICallException):
            other.slave.setFMUstate(other.slave.deSerializeFMUstate(foreign))


def test_reset_starts_anew(fmu):
    with Instance(fmu) as instance:
        outputs = fmu.names("output")
        first = instance.get(*outputs)
        instance.set({name: 0.01 for name in fmu.names("input")})
        instance.step(0.1)
        instance.slave.reset()
        instance.initialize()
        assert (instance.get(*outputs) == first).all()
