"""Far forms: written after the families of the tool, and not contained in them for any values of their parameters.

Those of effects.py are near: a family of the tool holds each of them, or comes close by being written with it in mind.
Sizes are those of the near forms, so that what differs is the form. None is two effects of the library at once.
"""

import numpy as np
from scipy.signal import bilinear, lfilter
from scipy.special import gamma

from effects import (
    AMBIENT,
    Creep,
    Form,
    HeavierLoad,
    LuGre,
    OrificeLeak,
    Ringing,
    Rubbing,
    StretchyCable,
    WeakSupply,
    either_sign,
    play,
    smoothed,
)
from plant import STEP, VALVE_GAIN, area, elastic_force

# --- Dry friction -----------------------------------------------------------------------------------------------------


class BroadSlip(Rubbing):
    """Prandtl-Ishlinskii, or Iwan: sixteen elements slide one after the other, the first ones soon, the last late."""

    LIMIT = np.geomspace(1e-4, 2.5e-2, 16)[:, None]

    @staticmethod
    def sizes(random, severity):
        return {**Rubbing.sizes(random, severity), "fall": random.uniform(0, 0.4)}

    def begin(self, now):
        self.bent = np.zeros((len(self.LIMIT), len(self.constant)))
        self.share = self.LIMIT**-self.fall
        self.share /= self.share.sum(axis=0)

    def act(self, now):
        self.bent = np.clip(self.bent + self.displacement(now), -self.LIMIT, self.LIMIT)
        now.force[self.at] -= self.sliding(now) * (self.share * self.bent / self.LIMIT).sum(axis=0)


class SteepFriction(Rubbing):
    """Coulomb without a memory, tanh(v/v0) for the sign; taken as a damping, so that the plant's step bears it."""

    @staticmethod
    def sizes(random, severity):
        return {**Rubbing.sizes(random, severity), "speed": random.uniform(0.5e-3, 2e-3)}

    def act(self, now):
        v = np.maximum(np.abs(now.v[self.at]), 1e-7)
        live = np.broadcast_to(now.live, now.x.shape)[self.at]
        now.damping[self.at] += live * self.sliding(now) * np.tanh(v / self.speed) / v


class FrictionOfBraid(LuGre):
    """Threads rub on each other where they touch: the loop's width changes with the contraction."""

    @staticmethod
    def sizes(random, severity):
        return {**LuGre.sizes(random, severity), "growth": either_sign(random, 2.5, 6)}

    def sliding(self, now):
        return super().sliding(now) * np.maximum(1 + self.growth * (now.x[self.at] - 0.1), 0.1)


# --- The other effects of the muscle ----------------------------------------------------------------------------------


class DampingOfPressure(Form):
    """Taut threads are damped more: B in proportion to pressure."""

    @staticmethod
    def sizes(random, severity):
        return {"per_pressure": severity * np.exp(random.uniform(np.log(150), np.log(900))) / 2e5}

    def act(self, now):
        now.damping[self.at] += self.per_pressure * np.maximum(now.p[self.at], 0)


class DampingOfContraction(Form):
    """Air and rubber have further to go in a short, thick muscle: B grows or falls with the contraction."""

    @staticmethod
    def sizes(random, severity):
        base = severity * np.exp(random.uniform(np.log(150), np.log(900)))
        return {"base": base, "growth": either_sign(random, 3, 8)}

    def act(self, now):
        now.damping[self.at] += self.base * np.maximum(1 + self.growth * (now.x[self.at] - 0.1), 0.1)


class FractionalCreep(Creep):
    """A step is followed by a drift as t^a: the spectrum of relaxation times that belongs to it, in twelve elements."""

    @staticmethod
    def sizes(random, severity):
        return {"amount": severity * random.uniform(0.05, 0.14), "power": random.uniform(0.15, 0.5)}

    def times(self):
        return np.geomspace(0.1, 500, 12)[:, None]

    def shares(self):
        """Of the drift after ten seconds."""
        spacing = np.log(500 / 0.1) / 11
        return self.power / gamma(1 - self.power) * (self.times() / 10) ** self.power * spacing


class CreepOfPull(Form):
    """The pull of the pressure comes in part at once and in part slowly: the bladder settles into the braid."""

    @staticmethod
    def sizes(random, severity):
        return {"amount": severity * random.uniform(0.12, 0.3), "time": random.uniform(1, 12)}

    def begin(self, now):
        self.drift = np.zeros(len(self.amount))
        self.reference = np.zeros(len(self.amount))

    def act(self, now):
        pull = now.p[self.at] * area(now.strain[self.at])
        live = np.broadcast_to(now.live, now.x.shape)[self.at]
        self.reference = np.where(now.time < 0, pull, self.reference)
        self.drift += live * STEP / self.time * (self.amount * (pull - self.reference) - self.drift)
        now.force[self.at] += self.drift


class UnevenCreep(Creep):
    """One element that gives way faster than it comes back, or more slowly."""

    @staticmethod
    def sizes(random, severity):
        ratio = np.exp(either_sign(random, np.log(1.8), np.log(4)))
        return {"amount": severity * random.uniform(0.05, 0.18), "time": random.uniform(1.5, 8), "ratio": ratio}

    def times(self):
        away = np.sign(self.drift) * (self.shares() * self.amount * (self.position - self.reference) - self.drift) > 0
        return self.time * np.where(away, 1.0, self.ratio)

    def stretch(self, now):
        self.position = now.x[self.at]
        super().stretch(now)

    def shares(self):
        return np.ones((1, 1))


def lowest_pressure(experiments):
    """That a case commands: where a loss has ended for good before it, there is nothing hidden."""
    return VALVE_GAIN * min(experiment.command.min() for experiment in experiments)


class KinkedThreshold(Form):
    """What is lost falls along a straight line and ends with a kink, where the bladder touches the braid all over."""

    @staticmethod
    def sizes(random, severity):
        return {"lost": severity * random.uniform(0.4e5, 1.0e5), "end": random.uniform(1.0e5, 2.0e5)}

    @staticmethod
    def suited(size, experiments):
        return {**size, "end": max(size["end"], 1.4 * lowest_pressure(experiments))}

    def ending(self, now):
        return self.end

    def act(self, now):
        lost = self.lost * np.clip(1 - now.p[self.at] / self.ending(now), 0, 1)
        now.force[self.at] -= lost * area(now.strain[self.at])


class ThresholdOfPull(KinkedThreshold):
    """The stretched bladder is thinner and takes longer to touch: the end of the loss moves up with the pull."""

    @staticmethod
    def sizes(random, severity):
        loss = KinkedThreshold.sizes(random, severity)
        return {**loss, "end": random.uniform(0.8e5, 1.4e5), "per_newton": random.uniform(100, 300)}

    def ending(self, now):
        return self.end + self.per_newton * np.clip(now.force[self.at], 0, 1000)


class LogisticThreshold(Form):
    """What is lost is lost up to some pressure and comes back over a few tenths of a bar."""

    @staticmethod
    def sizes(random, severity):
        where = {"middle": random.uniform(0.6e5, 1.1e5), "width": random.uniform(0.12e5, 0.25e5)}
        return {"lost": severity * random.uniform(0.3e5, 0.6e5), **where}

    @staticmethod
    def suited(size, experiments):
        return {**size, "middle": max(size["middle"], 1.1 * lowest_pressure(experiments))}

    def act(self, now):
        lost = self.lost / (1 + np.exp((now.p[self.at] - self.middle) / self.width))
        now.force[self.at] -= np.minimum(lost, np.maximum(now.p[self.at], 0)) * area(now.strain[self.at])


class RubberBladder(Form):
    """The bladder is a rubber tube of another thickness: force of a neo-Hookean tube along its axis."""

    @staticmethod
    def sizes(random, severity):
        return {"newton": severity * either_sign(random, 60, 200)}

    @staticmethod
    def rubber(x):
        """Per force at 0.1 m; the muscle is 1 m long."""
        stretch = 1 - x
        return (stretch**-2 - stretch) / (0.9**-2 - 0.9)

    def act(self, now):
        now.force[self.at] -= self.newton * self.rubber(now.strain[self.at])


class FungBladder(Form):
    """Coated tissue stiffens exponentially with strain, as biological tissue does."""

    @staticmethod
    def sizes(random, severity):
        return {"newton": severity * random.uniform(60, 200), "power": random.uniform(5, 10)}

    def act(self, now):
        now.force[self.at] -= self.newton * np.expm1(self.power * now.strain[self.at]) / np.expm1(self.power / 10)


class BentForceGain(Form):
    """Too strong or too weak by a share that changes a little with the force itself: threads that stretch."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.05, 0.15), "bend": random.uniform(-0.3, 0.3)}

    def act(self, now):
        force = now.force[self.at]
        now.force[self.at] = force * (1 + self.more * (1 + self.bend * np.clip(force / 400 - 1, -1, 2)))


class ShortMiddle(Form):
    """The ends take up more of a short muscle: the contraction counts k(x) times, whatever the pressure."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * random.uniform(0.06, 0.2), "growth": random.uniform(3, 8)}

    def stretch(self, now):
        x = now.x[self.at]
        now.strain[self.at] += self.more * np.maximum(1 + self.growth * (x - 0.1), 0.1) * x


class SlackCable(StretchyCable):
    """Strands that are laid loosely: a toe that is soft and soon over, and little after it."""

    @staticmethod
    def sizes(random, severity):
        toe = {"toe": severity * random.uniform(1e-3, 3e-3), "over": random.uniform(100, 250)}
        return {"compliance": severity * random.uniform(2e-6, 5e-6), **toe}

    def begin(self, now):
        self.stretched = np.zeros(len(self.compliance))

    def stretch_of(self, pull):
        return self.compliance * pull - self.toe * np.expm1(-pull / self.over)


class HardeningCable(StretchyCable):
    """A webbing whose stiffness grows in proportion to its pull: the stretch goes as a logarithm."""

    @staticmethod
    def sizes(random, severity):
        return {"scale": severity * random.uniform(1.5e-3, 4e-3), "soft": random.uniform(100, 400)}

    def begin(self, now):
        self.stretched = np.zeros(len(self.scale))

    def stretch_of(self, pull):
        return self.scale * np.log1p(pull / self.soft)


class BentScale(HeavierLoad):
    """Weighed on a spring balance that is bent: the error is neither constant nor a share of the load."""

    @staticmethod
    def sizes(random, severity):
        return {**HeavierLoad.sizes(random, severity), "power": random.uniform(0.3, 0.7)}

    @staticmethod
    def suited(size, experiments):
        lightest = min(experiment.mass for experiment in experiments)
        return {**HeavierLoad.suited(size, experiments), "lightest": lightest, "power": size["power"]}

    def begin(self, now):
        now.mass[self.at] += self.additional * (now.mass[self.at] / self.lightest) ** self.power


class HyperbolicWarmth(Form):
    """Something changes as t/(t + tau), fast at first and for long after."""

    LOW, HIGH = 0.04, 0.1

    @classmethod
    def sizes(cls, random, severity):
        return {"change": severity * either_sign(random, cls.LOW, cls.HIGH), "half": random.uniform(5, 20)}

    def warm(self, now):
        t = max(now.time, 0.0)
        return self.change * t / (t + self.half)


class HyperbolicWarmUp(HyperbolicWarmth):
    """The rubber warms: the area changes."""

    def act(self, now):
        now.force[self.at] += self.warm(now) * now.p[self.at] * area(now.strain[self.at])


class SofterWhenWarm(HyperbolicWarmth):
    """The same of the elastic force alone."""

    LOW, HIGH = 0.1, 0.25

    def act(self, now):
        now.force[self.at] += self.warm(now) * elastic_force(now.strain[self.at])


class LongerWhenWarm(HyperbolicWarmth):
    """The muscle grows longer, by so many metres."""

    LOW, HIGH = 4e-3, 12e-3

    def stretch(self, now):
        now.strain[self.at] += self.warm(now)


class WarmCoil(HyperbolicWarmth):
    """The valve gives another pressure per volt as its coil warms."""

    def aim(self, now):
        now.target[self.at] *= 1 + self.warm(now)


# --- Valve ------------------------------------------------------------------------------------------------------------


class SlowNearTarget(Form):
    """The pilot stage opens little for small errors: the time constant grows where the pressure is near its target."""

    @staticmethod
    def sizes(random, severity):
        return {"time": severity * random.uniform(0.04, 0.14), "small": random.uniform(0.08e5, 0.3e5)}

    def aim(self, now):
        error = np.abs(now.target[self.at] - now.p[self.at])
        now.time_constant[self.at] += self.time * (0.4 + 0.6 / (1 + error / self.small))


class TwoMorePoles(Form):
    """Two volumes before the valve, one after the other, equally slow."""

    @staticmethod
    def sizes(random, severity):
        return {"time": severity * random.uniform(0.03, 0.12)}

    def drive(self, command):
        kept = np.exp(-STEP / (self.time / 2))
        return smoothed(smoothed(command, kept), kept)


class RingingPilot(Form):
    """A pilot that rings, before a main stage that is as nominal."""

    @staticmethod
    def sizes(random, severity):
        # Well damped it would be a lag, whatever its size: a small one still has a peak.
        return {"frequency": random.uniform(14, 30), "ratio": random.uniform(0.12, 0.25) + 0.25 * (1 - severity)}

    def drive(self, command):
        columns = zip(self.frequency, self.ratio, command.T, strict=True)
        return np.stack([self.ringing(*column) for column in columns], axis=1)

    @staticmethod
    def ringing(frequency, ratio, u):
        shape = bilinear([frequency**2], [1, 2 * ratio * frequency, frequency**2], 1 / STEP)
        return u[0] + lfilter(*shape, u - u[0])


class FadingRinging(Ringing):
    """A second-order valve that is damped more for fast changes: turbulent flow."""

    @staticmethod
    def sizes(random, severity):
        return {**Ringing.sizes(random, severity), "turbulent": random.uniform(0.2, 0.6)}

    def valve(self, now, before):
        error = now.target[self.at] - before[self.at]
        damping = 2 * self.ratio * self.frequency * (1 + self.turbulent * np.abs(self.rate) / 1e6)
        self.rate = (self.rate + STEP * self.frequency**2 * error) / (1 + STEP * damping)
        now.p[self.at] = before[self.at] + STEP * self.rate


def later(series, delay):
    """A series on the grid of the plant, late by seconds."""
    time = STEP * np.arange(len(series))
    return np.interp(time - delay, time, series)


class UnevenDeadTime(Form):
    """Up and down are late by a little more and less."""

    @staticmethod
    def sizes(random, severity):
        return {"delay": severity * random.uniform(0.02, 0.1), "uneven": either_sign(random, 0.08, 0.2)}

    def drive(self, command):
        columns = zip(self.delay, self.uneven, command.T, strict=True)
        return np.stack([self.late(*column) for column in columns], axis=1)

    @staticmethod
    def late(delay, uneven, u):
        """Where u rises, the larger of two delayed ones is the earlier one; where it falls, the smaller is."""
        first, second = later(u, delay * (1 - uneven)), later(u, delay * (1 + uneven))
        return np.maximum(first, second) if uneven > 0 else np.minimum(first, second)


class BusCycle(Form):
    """A field bus hands the command on in cycles: late by a time, and then by up to one cycle."""

    @staticmethod
    def sizes(random, severity):
        return {"delay": severity * random.uniform(0.02, 0.1), "phase": random.uniform(0, 1)}

    def drive(self, command):
        columns = zip(self.delay, self.phase, command.T, strict=True)
        return np.stack([self.handed_on(*column) for column in columns], axis=1)

    @staticmethod
    def handed_on(delay, phase, u):
        """Two thirds as a dead time, one third as the mean age of what the last cycle brought."""
        time, cycle = STEP * np.arange(len(u)), 2 / 3 * delay
        brought = cycle * (np.floor(time / cycle + phase) - phase)
        return np.interp(brought - 2 / 3 * delay, time, u)


class ShutNearTarget(Form):
    """The spool's overlap: nothing flows while the error is small, and all at once when it is not."""

    @staticmethod
    def sizes(random, severity):
        return {"half": severity * random.uniform(0.04, 0.14)}

    def aim(self, now):
        target, p = now.target[self.at], now.p[self.at]
        now.target[self.at] = np.where(np.abs(target - p) < VALVE_GAIN * self.half, p, target)


class SoftPlay(Form):
    """Dry friction at the pilot's spring: play with many widths, so that it sets in gradually."""

    @staticmethod
    def sizes(random, severity):
        return {"half": severity * random.uniform(0.04, 0.14)}

    def drive(self, command):
        return np.mean([play(command, share * self.half) for share in np.linspace(0.1, 1.9, 7)], axis=0)


class KneedGain(Form):
    """The slope is off, and another one from some voltage on: two ranges that were adjusted apart."""

    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.04, 0.1), "knee": random.uniform(1, 2.5),
                "kept": random.uniform(0.4, 0.8)}  # fmt: skip

    def drive(self, command):
        return command + self.more * (command - (1 - self.kept) * np.maximum(command - self.knee, 0))


class SettlingZero(Form):
    """The valve's zero, in its own pressure sensor: it settles a little as the electronics warm."""

    @staticmethod
    def sizes(random, severity):
        return {"volts": severity * either_sign(random, 0.05, 0.2), **settling(random)}

    def aim(self, now):
        now.target[self.at] += VALVE_GAIN * self.volts * settled(self, max(now.time, 0.0))


class EmptyingTank(WeakSupply):
    """The supply is a tank: what fills the muscle lowers the ceiling, and a small compressor brings it back."""

    @staticmethod
    def sizes(random, severity):
        tank = {"taken": random.uniform(0.01, 0.04), "refill": random.uniform(8, 25)}
        return {"cut": severity * random.uniform(0.2, 0.45), **tank}

    def begin(self, now):
        self.missing = np.zeros(len(self.cut))

    def aim(self, now):
        now.target[self.at] = np.minimum(now.target[self.at], self.ceiling - self.missing)

    def valve(self, now, before):
        filled = np.maximum(now.p[self.at] - before[self.at], 0) * (now.time >= 0)
        self.missing += self.taken * filled - STEP / self.refill * self.missing


class TwoSwitches(WeakSupply):
    """A tank that others use steadily, and the muscle as well; a compressor fills it between two switches."""

    @staticmethod
    def sizes(random, severity):
        use = {"used": random.uniform(1.5e3, 5e3), "taken": random.uniform(0.0, 0.01)}
        compressor = {"delivered": random.uniform(0.8e4, 3e4), "between": random.uniform(0.15e5, 0.4e5)}
        cut = severity * random.uniform(0.25, 0.45)
        return {"cut": cut, **use, **compressor, "begins": [*random.uniform(0.0, 1.0, 3)]}

    @staticmethod
    def in_recording(size, number):
        return {**size, "begins": size["begins"][number]}

    def begin(self, now):
        self.missing = self.begins * self.between
        self.running = np.zeros(len(self.between), dtype=bool)

    def aim(self, now):
        now.target[self.at] = np.minimum(now.target[self.at], self.ceiling - self.missing)

    def valve(self, now, before):
        if now.time < 0:
            return
        filled = np.maximum(now.p[self.at] - before[self.at], 0)
        self.missing += self.taken * filled + STEP * (self.used - self.running * self.delivered)
        self.running = np.where(self.missing >= self.between, True, self.running & (self.missing > 0))


class FallingCeiling(WeakSupply):
    """Others use the same line more and more: the ceiling falls slowly."""

    @staticmethod
    def sizes(random, severity):
        return {"cut": severity * random.uniform(0.15, 0.4), "fall": severity * random.uniform(0.001, 0.004)}

    def aim(self, now):
        ceiling = self.ceiling * (1 - self.fall * max(now.time, 0.0))
        now.target[self.at] = np.minimum(now.target[self.at], ceiling)


def subsonic(ratio, critical):
    """Share of the choked flow through a nozzle for a ratio of the pressures after and before it: ISO 6358."""
    return np.sqrt(np.clip(1 - (np.maximum(ratio - critical, 0) / (1 - critical)) ** 2, 0, 1))


class NozzleFlow(Form):
    """ISO 6358: filling fades towards the supply's pressure, emptying with the muscle's; the volume grows.

    The spool is wide open as soon as more is wanted than flows.
    """

    @staticmethod
    def sizes(random, severity):
        rate = {"rate": random.uniform(0.7e5, 2.2e5) / severity, "slower": random.uniform(1.0, 2.0)}
        return {**rate, "supply": random.uniform(6e5, 8e5), "critical": random.uniform(0.2, 0.45)}

    def valve(self, now, before):
        p, volume = before[self.at] + AMBIENT, 1 + 4 * now.x[self.at]
        filling = self.rate * subsonic(p / self.supply, self.critical) / volume
        emptying = self.rate / self.slower * p / 3e5 * subsonic(AMBIENT / p, self.critical) / volume
        wanted = (now.target[self.at] - before[self.at]) / now.time_constant[self.at]
        now.p[self.at] = before[self.at] + STEP * np.clip(wanted, -emptying, filling)


class Throttle(Form):
    """A narrow hose with turbulent flow: it lets through what goes as the root of the difference in pressure."""

    @staticmethod
    def sizes(random, severity):
        return {"rate": random.uniform(0.8e5, 2.4e5) / severity}

    def valve(self, now, before):
        error = now.target[self.at] - before[self.at]
        wanted = error / now.time_constant[self.at]
        most = self.rate * np.sqrt(np.abs(error) / 1e5) + 1
        now.p[self.at] = before[self.at] + STEP * wanted / np.sqrt(1 + (wanted / most) ** 2)


class PorousLeak(OrificeLeak):
    """Laminar flow of a gas through a worn wall: as the difference of the squares of the pressures."""

    def valve(self, now, before):
        p = np.maximum(before[self.at], 0) + AMBIENT
        now.p[self.at] -= STEP * self.rate * (p**2 - AMBIENT**2) / (8 / 3 * AMBIENT)  # like a hole at 2 bar


class LiftingSeal(OrificeLeak):
    """A lip seal that pressure lifts: tight at first, more and more open above."""

    @staticmethod
    def sizes(random, severity):
        return {**OrificeLeak.sizes(random, severity), "lifts": random.uniform(0.2e5, 0.8e5)}

    def valve(self, now, before):
        above = np.maximum(before[self.at] - self.lifts, 0)
        now.p[self.at] -= STEP * self.rate * 2 * above


# --- Sensors ----------------------------------------------------------------------------------------------------------


def settling(random):
    """An electronic zero that is a little smaller or larger at first."""
    return {"first": random.uniform(-0.35, 0.35), "time": random.uniform(5, 15)}


def settled(form, time):
    return 1 + form.first * np.exp(-time / form.time)


class SettlingPosition(Form):
    @staticmethod
    def sizes(random, severity):
        return {"off": severity * either_sign(random, 0.003, 0.01), **settling(random)}

    def show(self, time, p, x, force):
        return p, x + self.off * settled(self, time[:, None]), force


class SettlingPressure(Form):
    @staticmethod
    def sizes(random, severity):
        return {"off": severity * either_sign(random, 0.04e5, 0.2e5), **settling(random)}

    def show(self, time, p, x, force):
        return p + self.off * settled(self, time[:, None]), x, force


class SettlingForce(Form):
    @staticmethod
    def sizes(random, severity):
        return {"off": severity * either_sign(random, 10, 40), **settling(random)}

    def show(self, time, p, x, force):
        return p, x, force + self.off * settled(self, time[:, None])


def bent(value, usual, more, bend):
    """A reading whose scale is off, a little differently over the range."""
    return value * (1 + more * (1 + bend * (value / usual - 1)))


class BentPosition(Form):
    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.03, 0.1), "bend": random.uniform(-0.3, 0.3)}

    def show(self, time, p, x, force):
        return p, bent(x, 0.1, self.more, self.bend), force


class BentPressure(Form):
    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.03, 0.1), "bend": random.uniform(-0.3, 0.3)}

    def show(self, time, p, x, force):
        return bent(p, 2e5, self.more, self.bend), x, force


class BentForce(Form):
    @staticmethod
    def sizes(random, severity):
        return {"more": severity * either_sign(random, 0.04, 0.12), "bend": random.uniform(-0.3, 0.3)}

    def show(self, time, p, x, force):
        return p, x, bent(force, 400, self.more, self.bend)


class AveragedPosition(Form):
    """The sensor's electronics show the mean of the last samples; late by half of that time."""

    @staticmethod
    def sizes(random, severity):
        return {"delay": severity * random.uniform(0.02, 0.08)}

    def show(self, time, p, x, force):
        columns = [self.mean(time, 2 * d, column) for d, column in zip(self.delay, x.T, strict=True)]
        return p, np.stack(columns, axis=1), force

    @staticmethod
    def mean(time, window, x):
        """Over a window before each instant; before the start it was what it was at the start."""
        early = np.arange(-window - 2 * time[1], 0, time[1])
        grid, held = np.concatenate([early, time]), np.concatenate([np.full(len(early), x[0]), x])
        total = np.concatenate([[0], np.cumsum((held[1:] + held[:-1]) / 2 * np.diff(grid))])
        return (np.interp(time, grid, total) - np.interp(time - window, grid, total)) / window


FAR = {
    "friction_hysteresis": [BroadSlip, SteepFriction, FrictionOfBraid],
    "viscous_damping": [DampingOfPressure, DampingOfContraction],
    "creep": [FractionalCreep, CreepOfPull, UnevenCreep],
    "threshold_pressure": [KinkedThreshold, ThresholdOfPull, LogisticThreshold],
    "bladder_stiffness": [RubberBladder, FungBladder],
    "force_gain": [BentForceGain],
    "end_effects": [ShortMiddle],
    "series_elasticity": [SlackCable, HardeningCable],
    "payload_mass": [BentScale],
    "valve_lag": [SlowNearTarget, TwoMorePoles],
    "valve_resonance": [RingingPilot, FadingRinging],
    "valve_dead_time": [UnevenDeadTime, BusCycle],
    "valve_dead_band": [ShutNearTarget, SoftPlay],
    "valve_gain": [KneedGain],
    "valve_offset": [SettlingZero],
    "supply_saturation": [EmptyingTank, FallingCeiling, TwoSwitches],
    "flow_limit": [NozzleFlow, Throttle],
    "leakage": [PorousLeak, LiftingSeal],
    "contraction_sensor_offset": [SettlingPosition],
    "contraction_sensor_gain": [BentPosition],
    "contraction_sensor_delay": [AveragedPosition],
    "pressure_sensor_offset": [SettlingPressure],
    "pressure_sensor_gain": [BentPressure],
    "force_sensor_offset": [SettlingForce],
    "force_sensor_gain": [BentForce],
    "temperature_drift": [HyperbolicWarmUp, LongerWhenWarm, SofterWhenWarm, WarmCoil],
}

# Forms that the families of the tool hold by now, or almost: named as far, they would flatter it.
SINCE_HELD = [
    AveragedPosition,
    BentForce,
    BentForceGain,
    BentPosition,
    BentPressure,
    BentScale,
    CreepOfPull,
    DampingOfContraction,
    DampingOfPressure,
    EmptyingTank,
    FallingCeiling,
    FractionalCreep,
    FungBladder,
    KneedGain,
    LiftingSeal,
    LogisticThreshold,
    LongerWhenWarm,
    NozzleFlow,
    PorousLeak,
    RingingPilot,
    RubberBladder,
    SettlingForce,
    SettlingPosition,
    SettlingPressure,
    SettlingZero,
    ShortMiddle,
    ShutNearTarget,
    SlowNearTarget,
    SoftPlay,
    SteepFriction,
    Throttle,
    TwoMorePoles,
    TwoSwitches,
    UnevenCreep,
    UnevenDeadTime,
]
