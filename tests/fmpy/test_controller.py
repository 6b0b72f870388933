"""The sampled controller against a loop written by hand; the margins that `sinew tune` tells against numpy."""

import json
import re

import numpy as np
import pytest

from muscles import GRAVITY, VIRTUAL_AREA_290, VIRTUAL_AREA_1000
from support import ROOT, Fmu, Instance, run

INPUTS = ("setpoint", "setpoint_velocity", "setpoint_acceleration", "measured_contraction")
MASS, PRESSURE, BANDWIDTH, VALVE_GAIN, DAMPING = 40.0, 1.4e5, 2 * np.pi * 2.5, 1e5, 80.0
GAINS = {"proportional_gain": 0.4, "integral_gain": 21.0, "derivative_gain": 0.3, "filter_time_constant": 0.02,
         "maximum_command": 1.5}


def inputs_at(time):
    """A reference with jumps of its acceleration, and a muscle that follows badly."""
    acceleration = 0.05 * np.sign(np.sin(7.0 * time))
    return np.array([0.08 + 0.03 * np.sin(time), 0.03 * np.cos(time), acceleration, 0.078 + 0.032 * np.sin(time - 0.1)])


def feed_forward(setpoint, velocity, acceleration, jerk):
    def pressure(time):
        x = setpoint + velocity * time
        pull = MASS * (GRAVITY + acceleration + jerk * time) + DAMPING * (velocity + acceleration * time)
        wanted = (pull - VIRTUAL_AREA_1000.elastic_force(x)) / VIRTUAL_AREA_1000.area(x)
        return min(max(wanted, 0.0), VALVE_GAIN * GAINS["maximum_command"])

    rate = (pressure(1e-4) - pressure(-1e-4)) / 2e-4
    return (pressure(0.0) + rate / BANDWIDTH) / VALVE_GAIN


class ByHand:
    """The sampled controller, without the FMU."""

    def __init__(self, sample_time, first):
        self.sample_time, (setpoint, _, _, measured) = sample_time, first
        error = setpoint - measured
        self.filtered_error, self.filtered_acceleration, self.samples = error, 0.0, 0
        at_rest = feed_forward(setpoint, 0.0, 0.0, 0.0) + GAINS["proportional_gain"] * error
        self.integral = PRESSURE / VALVE_GAIN - at_rest

    def sample(self, setpoint, velocity, acceleration, measured):
        filter_time, step, error = GAINS["filter_time_constant"], self.sample_time, setpoint - measured
        together = filter_time + step
        self.feed_forward = feed_forward(setpoint, velocity, acceleration,
                                         (acceleration - self.filtered_acceleration) / together)
        unlimited = (self.feed_forward + GAINS["proportional_gain"] * error + self.integral
                     + GAINS["derivative_gain"] * (error - self.filtered_error) / together)
        self.command = min(max(unlimited, 0.0), GAINS["maximum_command"])
        if (unlimited - self.command) * error * GAINS["integral_gain"] <= 0.0:
            self.integral += GAINS["integral_gain"] * step * error
        self.filtered_error = (filter_time * self.filtered_error + step * error) / together
        self.filtered_acceleration = (filter_time * self.filtered_acceleration + step * acceleration) / together
        self.samples += 1


def start(sample_time):
    first = dict(zip(INPUTS, inputs_at(0.0), strict=True))
    gains = {f"controller.{name}": value for name, value in GAINS.items()}
    plant = {"load.mass": MASS, "initial.gauge_pressure": PRESSURE}
    return first | gains | plant | {"controller.sample_time": sample_time}


@pytest.mark.parametrize("sample_time, step", [(0.01, 0.01), (0.01, 0.004), (0.01, 0.025), (0.003, 0.001)])
def test_sampled_controller_is_the_loop_by_hand(export, sample_time, step):
    """Also where samples fall within communication steps: inputs are held over a step."""
    by_hand, commands, limited = ByHand(sample_time, inputs_at(0.0)), [], 0
    with Instance(export()["PidFeedForward"], start(sample_time)) as controller:
        for k in range(round(3.0 / step)):
            inputs = inputs_at(k * step)
            controller.set(dict(zip(INPUTS, inputs, strict=True)))
            while by_hand.samples * sample_time < (k + 1) * step - 1e-9:
                by_hand.sample(*inputs)
                limited += by_hand.command == GAINS["maximum_command"]
            controller.step(step)
            # The next sample would be taken from what is still to come.
            if by_hand.samples * sample_time > (k + 1) * step + 1e-9:
                commands.append((*controller.get("command", "feed_forward"), by_hand.command, by_hand.feed_forward))
                assert (controller.output_derivatives("command", "feed_forward") == 0.0).all()
    if commands:
        of_fmu, by_hand = np.split(np.array(commands), 2, axis=1)
        assert of_fmu == pytest.approx(by_hand, abs=1e-8)
        assert limited > 10
    else:
        assert sample_time == step


def test_sample_at_a_communication_point_sees_the_inputs_set_there(export):
    """Sample time and step alike: the command that follows the inputs is that of the sample that is due."""
    by_hand = ByHand(0.01, inputs_at(0.0))
    with Instance(export()["PidFeedForward"], start(0.01)) as controller:
        for k in range(300):
            inputs = inputs_at(0.01 * k)
            controller.set(dict(zip(INPUTS, inputs, strict=True)))
            by_hand.sample(*inputs)
            assert controller.get("command")[0] == pytest.approx(by_hand.command, abs=1e-8)
            controller.step(0.01)


def test_samples_are_part_of_the_state(export):
    """Saved between two samples; what was held is held again, and the next sample comes when it was due."""
    with Instance(export()["PidFeedForward"], start(0.01)) as controller:
        def go(steps):
            table = []
            for _ in range(steps):
                controller.set(dict(zip(INPUTS, inputs_at(controller.time), strict=True)))
                controller.step(0.003)
                table.append(controller.get("command", "feed_forward", "control_error"))
            return np.array(table).tobytes()

        go(50)
        state, time = controller.slave.getFMUstate(), controller.time
        serialized = controller.slave.serializeFMUstate(state)
        first = go(50)
        controller.slave.setFMUstate(controller.slave.deSerializeFMUstate(serialized))
        controller.time = time
        assert go(50) == first


def polynomials(muscle, mass, x, gains, filter_time):
    """Numerator and denominator of the open loop, highest power first."""
    tiny = 1e-20
    area, elastic = muscle.area(x), muscle.elastic_force(x)
    pressure = (mass * GRAVITY - elastic) / area
    stiffness = -(pressure * muscle.area(x + 1j * tiny) + muscle.elastic_force(x + 1j * tiny)).imag / tiny
    plant = np.polymul([1.0, BANDWIDTH], [mass, DAMPING, stiffness])
    proportional, integral, derivative = gains
    controller = [proportional * filter_time + derivative, proportional + integral * filter_time, integral]
    return BANDWIDTH * VALVE_GAIN * area * np.array(controller), np.polymul(plant, [filter_time, 1.0, 0.0])


def largest_factor(numerator, denominator):
    """Gain margin: the smallest factor above one at which a root of the characteristic polynomial is unstable."""
    def stable(factor):
        return np.roots(np.polyadd(denominator, factor * numerator)).real.max() < 0.0

    factors = np.geomspace(1.0, 1e3, 3000)
    first = next(k for k, factor in enumerate(factors) if not stable(factor))
    low, high = factors[first - 1:first + 1]
    while high / low > 1.0 + 1e-9:
        middle = np.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


@pytest.mark.parametrize("preset, muscle", [("dmsp-40-1000", VIRTUAL_AREA_1000), ("dmsp-40-290", VIRTUAL_AREA_290)])
def test_margins_are_those_of_numpy(sinew, tmp_path, note, preset, muscle):
    answer = json.loads(run(sinew, "tune", "--parameters", preset, "--out", tmp_path, "--json").stdout)
    gains = [answer["gains"][f"controller.{name}_gain"]["value"] for name in ("proportional", "integral", "derivative")]
    s = 1j * np.geomspace(0.05, 1e3, 400_000)
    for point in answer["points"]:
        open_loop = polynomials(muscle, point["load_mass"], point["contraction"], gains, answer["filter_time_constant"])
        assert point["known"]["gain_margin"] == pytest.approx(largest_factor(*open_loop), rel=0.01)
        response = np.polyval(open_loop[0], s) / np.polyval(open_loop[1], s)
        assert point["known"]["sensitivity_peak"] == pytest.approx((1.0 / np.abs(1.0 + response)).max(), rel=1e-3)
        crossing = np.flatnonzero(np.diff(np.sign(np.abs(response) - 1.0)))
        lead = np.mod(np.angle(response[crossing]) - np.pi, 2 * np.pi)
        phase = np.degrees(np.minimum(lead, 2 * np.pi - lead).min())
        assert point["known"]["phase_margin_degrees"] == pytest.approx(phase, abs=0.5)
        assert point["known"]["delay_margin"] == pytest.approx((lead / s[crossing].imag).min(), rel=0.01)
        assert point["uncertain"]["sensitivity_peak"] < 1.01 * answer["sensitivity_bound"]
    worst, shown = answer["worst"], ", ".join(f"{gain:.3g}" for gain in gains)
    note(f"sinew tune, {preset}: {shown} V/m, V/(m s), V s/m; sensitivity peak "
         f"{worst['uncertain']['sensitivity_peak']:.2f} at {worst['load_mass']:g} kg, {worst['contraction']:.3f} m")


def test_tuned_parameters_export_the_tuned_controller(sinew, tmp_path):
    run(sinew, "tune", "--load-mass", "30", "--out", tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert page.count("<svg") >= 4 and "src=" not in page and "<script" not in page
    gains = json.loads((tmp_path / "tuning.json").read_text())["gains"]
    run(sinew, "export", "--parameters", tmp_path / "parameters.toml", "--out", tmp_path)
    variables = Fmu(tmp_path / "PidFeedForward.fmu").variables
    for name, gain in gains.items():
        assert float(variables[name].start) == gain["value"]


def test_loads_that_are_no_loads_are_wrong_usage(sinew, tmp_path):
    with pytest.raises(AssertionError, match="gave 2"):
        run(sinew, "tune", "--load-mass", "-3", "--out", tmp_path)


NUMBER = re.compile(r"\d+(?:\.\d+)?")


def assert_same_but_for_rounding(made, committed):
    """Equal texts, whose numbers may differ by one in the last digit: another machine may round otherwise."""
    assert NUMBER.split(made) == NUMBER.split(committed)
    for pair in zip(NUMBER.findall(made), NUMBER.findall(committed), strict=True):
        digits = [len(number.partition(".")[2]) for number in pair]
        found, expected = map(float, pair)
        assert digits[0] == digits[1] and abs(found - expected) < 1.5 * 10.0 ** -digits[0], pair


def test_page_of_the_closed_loop_is_fresh(sinew, tmp_path, note):
    """All of the committed page but what follows from the number of random plants, and the figures.

    Where this fails after a change of the loop: `target/release/sinew closed-loop --out docs`.
    """
    answer = json.loads(run(sinew, "closed-loop", "--plants", "18", "--out", tmp_path, "--json").stdout)
    made, committed = (folder.joinpath("closed-loop.md").read_text() for folder in (tmp_path, ROOT / "docs"))
    assert_same_but_for_rounding(made.split("\n## On 18 random")[0], committed.split("\n## On 1000 random")[0])
    assert made.split("\n## Figures")[1] == committed.split("\n## Figures")[1]
    figures = {path.name for path in (ROOT / "docs" / "closed-loop").iterdir()}
    assert figures == {path.name for path in (tmp_path / "closed-loop").iterdir()}
    for name in figures - {"random_plants.svg"}:
        made, committed = ((folder / "closed-loop" / name).read_text() for folder in (tmp_path, ROOT / "docs"))
        assert_same_but_for_rounding(made, committed)
    for controller in answer["known"]:
        errors = [1e3 * case["largest_error"] for case in controller["cases"]]
        assert len(errors) == 18
        note(f"closed loop, {controller['controller']}: worst error {max(errors):.2f} mm")
    assert all(plant["outcomes"]["tuned"]["held"] == 18 for plant in answer["unknown"])
