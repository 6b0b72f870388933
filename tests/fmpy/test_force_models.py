"""Every force model through the FMUs: its forces, a few steps under load, and its inversion by the feed-forward."""

import numpy as np
import pytest

from force_models import muscles
from muscles import GRAVITY
from support import Instance

MODELS = {f"{muscle}/{name}": model for muscle, models in muscles().items() for name, model in models.items()}


@pytest.mark.parametrize("preset", MODELS)
def test_force_model(export, preset):
    model, fmus = MODELS[preset], export(preset)
    contraction = 0.03 * model.rest_length

    start = {"initial.gauge_pressure": 0.8e5, "muscle.contraction": contraction, "muscle.contraction_velocity": 0.0}
    with Instance(fmus["PneumaticActuator"], start) as actuator:
        (force,) = actuator.get("muscle.force")
    expected = float(np.real(model.force(0.8e5, contraction, 0.0)))
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-6)

    with Instance(fmus["PneumaticMuscle"], {"initial.gauge_pressure": 1e5}) as muscle:
        muscle.set({"valve.command": 1.2})
        for _ in range(20):
            muscle.step(0.01)
        after, pull = muscle.get("muscle.contraction", "muscle.force")
    assert -0.1 < after / model.rest_length < 0.4
    assert 0 < pull < 1000

    with Instance(fmus["PidFeedForward"], {"setpoint": contraction, "measured_contraction": contraction}) as controller:
        (feed_forward,) = controller.get("feed_forward")
    held = float(np.real(model.force(1e5 * feed_forward, contraction, 0.0)))
    assert held == pytest.approx(20.0 * GRAVITY, rel=1e-6)
