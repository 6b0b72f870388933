"""The hidden effects, in near forms: the families of the tool hold them, or nearly so. The far ones are in far.py.

A form has `sizes(random, severity)` (its parameters for one case) and hooks that act on its columns `at`:
`drive` on the commands before the run, `stretch` on the contraction as the muscle feels it, `act` on force and damping,
`aim` on the target and the time constant of the valve, `valve` on the pressure, `show` on what the sensors give. Forms
of several effects work on the same columns where a case hides more than one. Ranges are those known from practice; see
README.md.
"""

import numpy as np
from scipy.signal import lfilter

from plant import STEP, VALVE_GAIN, area, elastic_force

AMBIENT = 1e5


def either_sign(random, low, high):
    return random.choice([-1, 1]) * random.uniform(low, high)


def play(series, half):
    """Follows a series with play of a half width per column."""
    out = series.copy()
    for k in range(1, len(out)):
        out[k] = np.clip(out[k - 1], series[k] - half, series[k] + half)
    return out


class Form:
    """Its parameters become attributes, each an array with one entry per column."""

    @staticmethod
    def suited(size, experiments):
        """The size for the experiments of a case, where it depends on them; the same in all of them."""
        return size

    @staticmethod
    def in_recording(size, number):
        """The size in one of the recordings of a case, counted from 0, where they differ."""
        return size

    def __init__(self, at, size):
        self.at = at
        for name, values in size.items():
            setattr(self, name, values)


# --- Dry friction -----------------------------------------------------------------------------------------------------


class Rubbing(Form):
    """Sliding force of 20 to 55 N at 2 bar: constant, in proportion to pressure, or both."""

    @staticmethod
    def sizes(random, severity):
        sliding, share = severity * random.uniform(20, 55), random.choice([0, 1, random.uniform(0, 1)])
        return {"constant": sliding * (1 - share), "per_pressure": sliding * share / 2e5}

    def sliding(self, now):
        return self.constant + self.per_pressure * now.p[self.at]

    def displacement(self, now):
        return (now.step * now.live)[self.at]


class MaxwellSlip(Rubbing):
    """Six springs that slide one after the other."""

    STRETCH = np.geomspace(3e-4, 1.2e-2, 6)[:, None]

    @staticmethod
    def sizes(random, severity):
        return {**Rubbing.sizes(random, severity), "spread": random.uniform(0.5, 1.5)}

    def begin(self, now):
        self.stretch_now = np.zeros((6, len(self.constant)))
        self.limit = self.STRETCH * self.spread

    def act(self, now):
        self.stretch_now = np.clip(self.stretch_now + self.displacement(now), -self.limit, self.limit)
        now.force[self.at] -= self.sliding(now) * (self.stretch_now / self.limit).mean(axis=0)


class LuGre(Rubbing):
    """Bristles whose sliding force falls a little with speed."""

    @staticmethod
    def sizes(random, severity):
        bristle = {"bend": random.uniform(0.5e-3, 4e-3), "stribeck": random.uniform(0.05, 0.2)}
        return {**Rubbing.sizes(random, severity), **bristle}

    def begin(self, now):
        self.z = np.zeros(len(self.bend))

    def act(self, now):
        dx = self.displacement(now)
        level = 1 + self.stribeck * np.exp(-((now.v[self.at] / 0.01) ** 2))
        towards = np.sign(dx) * level
        self.z = towards + (self.z - towards) * np.exp(-np.abs(dx) / (self.bend * level))
        now.force[self.at] -= self.sliding(now) * self.z


class BoucWen(Rubbing):
    """A loop with a sharp knee and soft unloading."""

    @staticmethod
    def sizes(random, severity):
        knee = {"reach": random.uniform(1e-3, 5e-3), "order": random.uniform(1.5, 3)}
        return {**Rubbing.sizes(random, severity), **knee}

    def begin(self, now):
        self.z = np.zeros(len(self.reach))

    def act(self, now):
        dx = self.displacement(now)
        slope = 1 - (0.6 * np.sign(dx * self.z) + 0.4) * np.abs(self.z) ** self.order
        self.z = np.clip(self.z + dx / self.reach * slope, -1, 1)
        now.force[self.at] -= self.sliding(now) * self.z


# --- The other effects of the muscle ----------------------------------------------------------------------------------


class PowerDamping(Form):
    """B v |v/v0|^a, unlike up and down."""

    @staticmethod
    def sizes(random, severity):
        base = severity * np.exp(random.uniform(np.log(150), np.log(900)))
        return {"up": base, "down": base * random.uniform(0.6, 1.7), "power": random.uniform(-0.25, 0.35)}

    def act(self, now):
        v = now.v[self.at]
        speed = np.maximum(np.abs(v), 1e-3) / 0.05
        now.damping[self.at] += np.where(v > 0, self.up, self.down) * speed**self.power


class Creep(Form):
    """Kelvin-Voigt elements in series with the membrane; TIMES and SHARES are those of a subclass."""

    def begin(self, now):
        self.drift = np.zeros((len(self.shares()), len(self.amount)))
        self.reference = now.x[self.at].copy()

    def stretch(self, now):
        live = np.broadcast_to(now.live, now.x.shape)[self.at]
        self.reference = np.where(now.time < 0, now.x[self.at], self.reference)
        wanted = self.shares() * self.amount * (now.x[self.at] - self.reference)
        self.drift += live * STEP / self.times() * (wanted - self.drift)
        now.strain[self.at] -= self.drift.sum(axis=0)


class TwoStepCreep(Creep):
    @staticmethod
    def sizes(random, severity):
        times = {"fast": random.uniform(0.7, 3), "slow": random.uniform(6, 30)}
        return {"amount": severity * random.uniform(0.05, 0.18), **times}

    def times(self):
        return np.stack([self.fast, self.slow])

    def shares(self):
        return np.array([[0.45], [0.55]])


class LogarithmicCreep(Creep):
    """Equal shares per decade: the drift goes as log t."""

    @staticmethod
    def sizes(random, severity):
        return {"amount": severity * random.uniform(0.08, 0.2)}

    def times(self):
        return np.geomspace(0.3, 60, 6)[:, None]

    def shares(self):
        return np.full((6, 1), 1 / 6)


class FadingThreshold(Form):
    """Pressure lost at low pressure, fading away above; less when contracted."""

    @staticmethod
    def sizes(random, severity):
        return {"lost": severity * random.uniform(0.4e5, 1.0e5), "fade": random.uniform(0.5e5, 1.2e5)}

    def act(self, now):
        p, x = now.p[self.at], now.strain[self.at]
        lost = self.lost * np.exp(-((p / self.fade) ** 1.5)) * (1 - 2 * x)
        now.force[self.at] -= lost * area(x)


class StifferBladder(Form):
    """The elastic force is larger or smaller, more so when contracted."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.1, 0.35)}

    def act(self, now):
        x = now.strain[self.at]
        now.force[self.at] += self.more * (0.8 + 2 * x) * elastic_force(x)


class ForceGain(Form):
    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.05, 0.15)}

    def begin(self, now):
        now.gain[self.at] *= 1 + self.more


class EndEffects(Form):
    """Contraction counts k(p) times, k = 1 + c + a exp(-p/p0)."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * random.uniform(0.06, 0.2), "low": severity * random.uniform(0, 0.1)}

    def stretch(self, now):
        factor = self.more + self.low * np.exp(-now.p[self.at] / 1e5)
        now.strain[self.at] += factor * now.x[self.at]


class StretchyCable(Form):
    """A cable that hardens: the load hangs lower than the muscle's end."""

    @staticmethod
    def sizes(random, severity):
        return {"compliance": severity * random.uniform(3e-6, 1e-5)}

    def begin(self, now):
        self.stretched = np.zeros(len(self.compliance))

    def stretch(self, now):
        now.strain[self.at] += self.stretched

    def act(self, now):
        wanted = self.stretch_of(np.maximum(now.force[self.at], 0))
        self.stretched += 0.3 * (wanted - self.stretched)  # settles within a few steps

    def stretch_of(self, pull):
        return self.compliance * 400 * (pull / 400) ** 0.85


class HeavierLoad(Form):
    """A hanger that was not weighed, or a weight that is not what is written on it."""

    @staticmethod
    def sizes(random, severity):
        return {"share": severity * either_sign(random, 0.05, 0.2)}

    @staticmethod
    def suited(size, experiments):
        return {"additional": size["share"] * min(experiment.mass for experiment in experiments)}

    def begin(self, now):
        now.mass[self.at] += self.additional


class MisreadScale(HeavierLoad):
    """A scale that shows a share too much or too little, of every load."""

    @staticmethod
    def suited(size, experiments):
        return size

    def begin(self, now):
        now.mass[self.at] *= 1 + self.share


class WarmUp(Form):
    """The rubber warms: area up, elastic force down."""

    @staticmethod
    def sizes(random, severity):
        return {"change": severity * either_sign(random, 0.04, 0.1), "duration": random.uniform(8, 30)}

    def act(self, now):
        warm = self.change * (1 - np.exp(-max(now.time, 0.0) / self.duration))
        now.force[self.at] += warm * now.p[self.at] * area(now.strain[self.at])


# --- Valve ------------------------------------------------------------------------------------------------------------


def smoothed(series, kept):
    """Columns behind a pole each, which keeps a share of its state from one sample to the next; at rest at first."""
    columns = [lfilter([1 - a], [1, -a], u, zi=[a * u[0]])[0] for a, u in zip(kept, series.T, strict=True)]
    return np.stack(columns, axis=1)


class SecondPole(Form):
    """A hose or pilot stage before the valve."""

    @staticmethod
    def sizes(random, severity):
        return {"time": severity * random.uniform(0.03, 0.12)}

    def drive(self, command):
        return smoothed(command, np.exp(-STEP / self.time))


class SlowerWhenFull(Form):
    """The time constant grows, and grows with pressure."""

    @staticmethod
    def sizes(random, severity):
        return {"time": severity * random.uniform(0.03, 0.12), "growth": random.uniform(-0.3, 0.5)}

    def aim(self, now):
        now.time_constant[self.at] += self.time * (1 + self.growth * (now.p[self.at] / 2e5 - 1))


class Ringing(Form):
    """A second-order valve that stiffens with the size of the error."""

    @staticmethod
    def sizes(random, severity):
        # A third of the size is an overshoot of a third, roughly: closer to well damped.
        return {"frequency": random.uniform(16, 40), "ratio": random.uniform(0.2, 0.4) + 0.5 * (1 - severity)}

    def begin(self, now):
        self.rate = np.zeros(len(self.ratio))

    def valve(self, now, before):
        error = now.target[self.at] - before[self.at]
        pull = self.frequency**2 * error * (1 + 0.2 * np.tanh(np.abs(error) / 1e5))
        damping = 2 * self.ratio * self.frequency
        self.rate = (self.rate + STEP * pull) / (1 + STEP * damping)
        now.p[self.at] = before[self.at] + STEP * self.rate


class DeadTime(Form):
    """Exact, and no multiple of the step."""

    @staticmethod
    def sizes(random, severity):
        return {"delay": severity * random.uniform(0.02, 0.1)}

    def drive(self, command):
        time = STEP * np.arange(len(command))
        columns = [np.interp(time - d, time, u) for d, u in zip(self.delay, command.T, strict=True)]
        return np.stack(columns, axis=1)


class Play(Form):
    """The pilot follows with play."""

    @staticmethod
    def sizes(random, severity):
        return {"half": severity * random.uniform(0.03, 0.12)}

    def drive(self, command):
        return play(command, self.half)


class Stiction(Form):
    """The pilot sticks, and jumps to the command when it is off by too much."""

    @staticmethod
    def sizes(random, severity):
        return {"half": severity * random.uniform(0.05, 0.2)}

    def drive(self, command):
        out = command.copy()
        for k in range(1, len(out)):
            out[k] = np.where(np.abs(command[k] - out[k - 1]) > self.half, command[k], out[k - 1])
        return out


class ValveGain(Form):
    """A calibration that is off and slightly bent."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.03, 0.1), "bend": severity * random.uniform(-0.005, 0.005)}

    def drive(self, command):
        return command * (1 + self.more + self.bend * (command - 2))


class ValveOffset(Form):
    @staticmethod
    def sizes(random, severity):
        return {"volts": severity * either_sign(random, 0.05, 0.2)}

    def drive(self, command):
        return command + self.volts


def set_anew(form, name):
    """The form of an offset whose size of this name is another one in each recording."""

    class Anew(form):
        @staticmethod
        def sizes(random, severity):
            return {**form.sizes(random, severity), "shares": [1.0, *random.uniform(-0.5, 1.5, 2)]}

        @staticmethod
        def in_recording(size, number):
            return {name: size[name] * size["shares"][number]}

    Anew.__name__ = f"{form.__name__}Anew"
    return Anew


ValveOffsetAnew = set_anew(ValveOffset, "volts")


class WeakSupply(Form):
    """A ceiling within the range of the command, rounded, that droops while filling."""

    @staticmethod
    def sizes(random, severity):
        # At a third of the size the ceiling cuts off a third as much.
        return {"cut": severity * random.uniform(0.2, 0.45), "droop": random.uniform(0.0, 0.02)}

    @staticmethod
    def suited(size, experiments):
        """One supply for all recordings: the share is cut off from that which goes highest."""
        command = max((experiment.command for experiment in experiments), key=np.max)
        ceiling = VALVE_GAIN * (command.max() - size["cut"] * np.ptp(command))
        return {**size, "ceiling": ceiling}

    def aim(self, now):
        target = now.target[self.at]
        droop = self.droop * np.maximum(target - now.p[self.at], 0)
        soft = 2e3
        now.target[self.at] = target - soft * np.logaddexp(0, (target - self.ceiling + droop) / soft)


class ChokedFlow(Form):
    """Filling and emptying saturate smoothly; emptying is slower."""

    @staticmethod
    def sizes(random, severity):
        rate = random.uniform(0.6e5, 2.0e5) / severity
        return {"filling": rate, "emptying": rate / random.uniform(1.2, 2.5)}

    def valve(self, now, before):
        wanted = (now.target[self.at] - before[self.at]) / now.time_constant[self.at]
        most = np.where(wanted > 0, self.filling, self.emptying)
        now.p[self.at] = before[self.at] + STEP * wanted / np.sqrt(1 + (wanted / most) ** 2)


class OrificeLeak(Form):
    """A hole: choked above the critical pressure ratio, an ellipse below; slower in a fuller muscle."""

    @staticmethod
    def sizes(random, severity):
        return {"rate": severity * random.uniform(0.3, 1.2)}

    def valve(self, now, before):
        p, x = before[self.at], now.x[self.at]
        ratio = AMBIENT / (p + AMBIENT)
        subsonic = np.sqrt(np.clip(1 - (np.maximum(ratio - 0.35, 0) / 0.65) ** 2, 0, 1))
        volume = 1 + 4 * x
        now.p[self.at] -= STEP * self.rate * (p + AMBIENT) * subsonic / volume


# --- Sensors ----------------------------------------------------------------------------------------------------------


class PositionOffset(Form):
    @staticmethod
    def sizes(random, severity):
        return {"off": severity * either_sign(random, 0.003, 0.01)}

    def show(self, time, p, x, force):
        return p, x + self.off, force


PositionOffsetAnew = set_anew(PositionOffset, "off")


class PositionGain(Form):
    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.03, 0.1)}

    def show(self, time, p, x, force):
        return p, x * (1 + self.more), force


class PositionDelay(Form):
    @staticmethod
    def sizes(random, severity):
        return {"delay": severity * random.uniform(0.02, 0.08)}

    def show(self, time, p, x, force):
        columns = [np.interp(time - d, time, column) for d, column in zip(self.delay, x.T, strict=True)]
        return p, np.stack(columns, axis=1), force


class PressureOffset(Form):
    @staticmethod
    def sizes(random, severity):
        return {"off": severity * either_sign(random, 0.04e5, 0.2e5)}

    def show(self, time, p, x, force):
        return p + self.off, x, force


PressureOffsetAnew = set_anew(PressureOffset, "off")


class PressureGain(Form):
    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.03, 0.1)}

    def show(self, time, p, x, force):
        return p * (1 + self.more), x, force


class ForceOffset(Form):
    @staticmethod
    def sizes(random, severity):
        return {"off": severity * either_sign(random, 10, 40)}

    def show(self, time, p, x, force):
        return p, x, force + self.off


ForceOffsetAnew = set_anew(ForceOffset, "off")


class ForceSensorGain(Form):
    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.04, 0.12)}

    def show(self, time, p, x, force):
        return p, x, force * (1 + self.more)


KNOWN = {
    "friction_hysteresis": [MaxwellSlip, LuGre, BoucWen],
    "viscous_damping": [PowerDamping],
    "creep": [TwoStepCreep, LogarithmicCreep],
    "threshold_pressure": [FadingThreshold],
    "bladder_stiffness": [StifferBladder],
    "force_gain": [ForceGain],
    "end_effects": [EndEffects],
    "series_elasticity": [StretchyCable],
    "payload_mass": [HeavierLoad, MisreadScale],
    "valve_lag": [SecondPole, SlowerWhenFull],
    "valve_resonance": [Ringing],
    "valve_dead_time": [DeadTime],
    "valve_dead_band": [Play, Stiction],
    "valve_gain": [ValveGain],
    "valve_offset": [ValveOffset, ValveOffsetAnew],
    "supply_saturation": [WeakSupply],
    "flow_limit": [ChokedFlow],
    "leakage": [OrificeLeak],
    "contraction_sensor_offset": [PositionOffset, PositionOffsetAnew],
    "contraction_sensor_gain": [PositionGain],
    "contraction_sensor_delay": [PositionDelay],
    "pressure_sensor_offset": [PressureOffset, PressureOffsetAnew],
    "pressure_sensor_gain": [PressureGain],
    "force_sensor_offset": [ForceOffset, ForceOffsetAnew],
    "force_sensor_gain": [ForceSensorGain],
    "temperature_drift": [WarmUp],
}
