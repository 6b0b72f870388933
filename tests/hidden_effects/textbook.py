"""The forms that a fit itself uses, on purpose: the tool's own equations, written anew.

Here model and truth share the form, so that its parameters have true values and the intervals stated for them can be
checked. Naming is easier than on the forms of effects.py; the difference says what those cost.
"""

import numpy as np

from effects import (
    Creep,
    DeadTime,
    ForceGain,
    ForceOffset,
    ForceSensorGain,
    Form,
    HeavierLoad,
    Play,
    PositionDelay,
    PositionGain,
    PositionOffset,
    PressureGain,
    PressureOffset,
    Rubbing,
    ValveOffset,
    WarmUp,
    WeakSupply,
    either_sign,
)
from plant import STEP


class Dahl(Rubbing):
    """One bristle that bends exponentially."""

    @staticmethod
    def sizes(random, severity):
        return {**Rubbing.sizes(random, severity), "bend": random.uniform(0.5e-3, 4e-3)}

    def begin(self, now):
        self.z = np.zeros(len(self.bend))

    def act(self, now):
        dx = self.displacement(now)
        towards = np.sign(dx)
        self.z = towards + (self.z - towards) * np.exp(-np.abs(dx) / self.bend)
        now.force[self.at] -= self.sliding(now) * self.z


class LinearDamping(Form):
    """B v, unlike up and down."""

    @staticmethod
    def sizes(random, severity):
        base = severity * np.exp(random.uniform(np.log(150), np.log(900)))
        return {"up": base, "down": base * random.uniform(0.6, 1.7)}

    def act(self, now):
        now.damping[self.at] += np.where(now.v[self.at] > 0, self.up, self.down)


class OneStepCreep(Creep):
    """One Kelvin-Voigt element."""

    @staticmethod
    def sizes(random, severity):
        return {"amount": severity * random.uniform(0.05, 0.18), "time": random.uniform(1, 10)}

    def times(self):
        return self.time[None]

    def shares(self):
        return np.ones((1, 1))


class ScaledBladder(Form):
    """Elastic force times a factor."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.1, 0.35)}

    def act(self, now):
        now.force[self.at] += self.more * now.own_elastic_force(self.at)


class ConstantEnds(Form):
    """Contraction counts k times."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * random.uniform(0.06, 0.2)}

    def stretch(self, now):
        now.strain[self.at] += self.more * now.x[self.at]


class ExponentialThreshold(Form):
    """Pressure lost, fading exponentially; never more than there is."""

    @staticmethod
    def sizes(random, severity):
        return {"lost": severity * random.uniform(0.4e5, 1.0e5), "fade": random.uniform(0.5e5, 1.2e5)}

    def act(self, now):
        p = np.maximum(now.p[self.at], 0)
        lost = np.minimum(self.lost * np.exp(-p / self.fade), p)
        now.force[self.at] -= lost * now.own_area(self.at)


class WarmArea(WarmUp):
    """The area grows or shrinks as 1 - exp(-t/tau)."""

    def act(self, now):
        warm = self.change * (1 - np.exp(-max(now.time, 0.0) / self.duration))
        pull = now.p[self.at] * now.own_area(self.at)
        now.force[self.at] += warm * pull


class LinearCable(Form):
    """What the position sensor shows stretches with the pull."""

    @staticmethod
    def sizes(random, severity):
        return {"compliance": -severity * random.uniform(3e-6, 1e-5)}

    def show(self, time, p, x, force):
        return p, x + self.compliance * force, force


class LongerTimeConstant(Form):
    """First order, slower."""

    @staticmethod
    def sizes(random, severity):
        return {"time": severity * random.uniform(0.03, 0.12)}

    def aim(self, now):
        now.time_constant[self.at] += self.time


class LinearRinging(Form):
    """Second order; exact for a target held over a step."""

    @staticmethod
    def sizes(random, severity):
        return {"frequency": random.uniform(16, 40), "ratio": random.uniform(0.2, 0.4) + 0.5 * (1 - severity)}

    def begin(self, now):
        self.rate = np.zeros(len(self.ratio))
        decay, ringing = self.ratio * self.frequency, self.frequency * np.sqrt(1 - self.ratio**2)
        fade, swing = np.exp(-decay * STEP), np.sin(ringing * STEP) / ringing
        own = fade * np.cos(ringing * STEP)
        self.keep, self.swing = own + fade * decay * swing, fade * swing
        self.pull, self.keep_rate = -fade * self.frequency**2 * swing, own - fade * decay * swing

    def valve(self, now, before):
        target = now.target[self.at]
        error = before[self.at] - target
        now.p[self.at] = target + self.keep * error + self.swing * self.rate
        self.rate = self.pull * error + self.keep_rate * self.rate


class StraightGain(Form):
    """A calibration that is off."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.03, 0.1)}

    def drive(self, command):
        return command * (1 + self.more)


class SharpCeiling(WeakSupply):
    """The target is cut off."""

    def aim(self, now):
        now.target[self.at] = np.minimum(now.target[self.at], self.ceiling)


class SharpRateLimit(Form):
    """Filling and emptying are cut off at a rate."""

    @staticmethod
    def sizes(random, severity):
        rate = random.uniform(0.6e5, 2.0e5) / severity
        return {"filling": rate, "emptying": rate / random.uniform(1.2, 2.5)}

    def valve(self, now, before):
        change = now.p[self.at] - before[self.at]
        now.p[self.at] = before[self.at] + np.clip(change, -STEP * self.emptying, STEP * self.filling)


class LaminarLeak(Form):
    """A loss in proportion to gauge pressure; together with the valve first order again, and exact."""

    @staticmethod
    def sizes(random, severity):
        return {"rate": severity * random.uniform(0.3, 1.2)}

    def aim(self, now):
        loss = 1 + self.rate * now.time_constant[self.at]
        now.target[self.at] /= loss
        now.time_constant[self.at] /= loss


# Per effect its form, and which of its sizes the parameters of the tool are.
SAME_FORM = {
    "friction_hysteresis": (
        Dahl,
        {
            "half_width": "constant",
            "half_width_per_pressure": "per_pressure",
            "presliding_displacement": "bend",
        },
    ),
    "viscous_damping": (LinearDamping, {"contraction": "up", "extension": "down"}),
    "creep": (OneStepCreep, {"amplitude_1": "amount", "time_1": "time"}),
    "threshold_pressure": (ExponentialThreshold, {"lost": "lost", "fade": "fade"}),
    "bladder_stiffness": (ScaledBladder, {"relative_change": "more"}),
    "force_gain": (ForceGain, {"relative_error": "more"}),
    "end_effects": (ConstantEnds, {"excess": "more"}),
    "series_elasticity": (LinearCable, {"compliance": "compliance"}),
    "payload_mass": (HeavierLoad, {"additional_mass": "additional"}),
    "valve_lag": (LongerTimeConstant, {"time_constant": "time"}),
    "valve_resonance": (LinearRinging, {"natural_frequency": "frequency", "damping_ratio": "ratio"}),
    "valve_dead_time": (DeadTime, {"delay": "delay"}),
    "valve_dead_band": (Play, {"play": "half"}),
    "valve_gain": (StraightGain, {"relative_error": "more"}),
    "valve_offset": (ValveOffset, {"offset": "volts"}),
    "supply_saturation": (SharpCeiling, {"gauge_pressure": "ceiling"}),
    "flow_limit": (SharpRateLimit, {"filling": "filling", "emptying": "emptying"}),
    "leakage": (LaminarLeak, {"rate": "rate"}),
    "contraction_sensor_offset": (PositionOffset, {"offset": "off"}),
    "contraction_sensor_gain": (PositionGain, {"relative_error": "more"}),
    "contraction_sensor_delay": (PositionDelay, {"delay": "delay"}),
    "pressure_sensor_offset": (PressureOffset, {"offset": "off"}),
    "pressure_sensor_gain": (PressureGain, {"relative_error": "more"}),
    "force_sensor_offset": (ForceOffset, {"offset": "off"}),
    "force_sensor_gain": (ForceSensorGain, {"relative_error": "more"}),
    "temperature_drift": (WarmArea, {"area_change": "change", "time_constant": "duration"}),
}


def true_parameters(effect, size):
    """By their full names in the tool."""
    return {f"{effect}.{name}": float(size[own]) for name, own in SAME_FORM[effect][1].items()}
