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
from plant import STEP, elastic_force


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
        now.force[self.at] += self.more * now.elastic_factor[self.at] * elastic_force(now.strain[self.at])


class ConstantEnds(Form):
    """Contraction counts k times."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * random.uniform(0.06, 0.2)}

    def stretch(self, now):
        now.strain[self.at] += self.more * now.x[self.at]


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


class LaminarLeak(Form):
    """A loss in proportion to gauge pressure; together with the valve first order again, and exact."""

    @staticmethod
    def sizes(random, severity):
        return {"rate": severity * random.uniform(0.3, 1.2)}

    def aim(self, now):
        loss = 1 + self.rate * now.time_constant[self.at]
        now.target[self.at] /= loss
        now.time_constant[self.at] /= loss


def size_of(name, plus=0.0):
    return lambda size: size[name] + plus


# Per effect its form, and the true values of the tool's parameters.
SAME_FORM = {
    "friction_hysteresis": (
        Dahl,
        {
            "half_width": size_of("constant"),
            "half_width_per_pressure": size_of("per_pressure"),
            "presliding_displacement": size_of("bend"),
        },
    ),
    "viscous_damping": (LinearDamping, {"contraction": size_of("up"), "extension": size_of("down")}),
    "creep": (OneStepCreep, {"amount": size_of("amount"), "time_constant": size_of("time")}),
    "bladder_stiffness": (ScaledBladder, {"factor": size_of("more", 1)}),
    "force_gain": (ForceGain, {"factor": size_of("more", 1)}),
    "end_effects": (ConstantEnds, {"factor": size_of("more", 1)}),
    "payload_mass": (HeavierLoad, {"additional_mass": size_of("additional")}),
    "valve_lag": (LongerTimeConstant, {"time_constant": size_of("time")}),
    "valve_resonance": (LinearRinging, {"frequency": size_of("frequency"), "damping_ratio": size_of("ratio")}),
    "valve_dead_time": (DeadTime, {"delay": size_of("delay")}),
    "valve_gain": (StraightGain, {"factor": size_of("more", 1)}),
    "valve_offset": (ValveOffset, {"offset": size_of("volts")}),
    "supply_saturation": (SharpCeiling, {"ceiling": size_of("ceiling")}),
    "leakage": (LaminarLeak, {"rate": size_of("rate")}),
    "contraction_sensor_offset": (PositionOffset, {"offset": size_of("off")}),
    "contraction_sensor_gain": (PositionGain, {"factor": size_of("more", 1)}),
    "contraction_sensor_delay": (PositionDelay, {"delay": size_of("delay")}),
    "pressure_sensor_offset": (PressureOffset, {"offset": size_of("off")}),
    "pressure_sensor_gain": (PressureGain, {"factor": size_of("more", 1)}),
    "force_sensor_offset": (ForceOffset, {"offset": size_of("off")}),
    "force_sensor_gain": (ForceSensorGain, {"factor": size_of("more", 1)}),
    "temperature_drift": (WarmUp, {"change": size_of("change"), "time_constant": size_of("duration")}),
}


def true_parameters(effect, size):
    """By their full names in the tool."""
    return {f"{effect}.{name}": float(value(size)) for name, value in SAME_FORM[effect][1].items()}
