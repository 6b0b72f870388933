"""Golden trajectories of a hanging load with one effect each, in an implementation of its own.

As in nominal.py the command is linear between samples 10 ms apart; here the integration also restarts wherever the
command that the valve sees has a corner or a jump. Each case states its equation as text-book mathematics, not as the
product does: the play of the valve is a running clip of its corners, stiction is stepped from jump to jump.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from muscles import GRAVITY, VIRTUAL_AREA_1000
from nominal import DAMPING, HEADER, SAMPLE_TIME, VALVE_BANDWIDTH, VALVE_GAIN, ramps, staircase

MASS = 20.0
AMBIENT = 1e5
TOLERANCE = 1e-11


class Plant:
    """The nominal plant; effects override what they change. States: pressure, contraction, velocity, own ones."""

    own_scales = ()
    weighing = moving = MASS
    lifted = 0.0
    start_velocity = 0.0

    def weight(self, x):
        return (self.weighing + self.lifted * x) * GRAVITY

    def own_start(self, x):
        return []

    def own_rates(self, target, pressure, x, velocity, own):
        return []

    def seen(self, command):
        """Pieces (start, end, value, slope) of the command that the valve sees."""
        times = np.arange(len(command)) * SAMPLE_TIME
        slopes = np.diff(command) / SAMPLE_TIME
        return [(t, t + SAMPLE_TIME, u, s) for t, u, s in zip(times[:-1], command[:-1], slopes)]

    def pressure_rate(self, target, pressure, x, own):
        return VALVE_BANDWIDTH * (target - pressure)

    def rate(self, target, pressure, x, velocity, own):
        return self.pressure_rate(target, pressure, x, own)

    def static_force(self, pressure, x, own):
        return pressure * VIRTUAL_AREA_1000.area(x) + VIRTUAL_AREA_1000.elastic_force(x)

    def force(self, pressure, x, velocity, own):
        return self.static_force(pressure, x, own) - DAMPING * velocity

    def readings(self, x, force, own):
        """Of the position sensor at the samples, from all states there."""
        return x


class Creep(Plant):
    own_scales = 0.1, 0.1

    def own_start(self, x):
        self.relaxed = x
        return [0.0, 0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(0.1 * (x - self.relaxed) - own[0]) / 1.5, (0.05 * (x - self.relaxed) - own[1]) / 8.0]

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x - own[0] - own[1], own)


class UnevenCreep(Plant):
    """One element; it takes twice as long to come back as to give way."""

    own_scales = (0.1,)

    def own_start(self, x):
        self.relaxed = x
        return [0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        aim, drift = 0.1 * (x - self.relaxed), own[0]
        grows = aim >= drift if drift > 0 else aim <= drift
        return [(aim - drift) / (1.5 if grows or drift == 0 else 3.0)]

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x - own[0], own)


class KnownCreep(Plant):
    """Settled at the start from the rest length, with coefficients that were identified halfway."""

    own_scales = (0.1,)

    def own_start(self, x):
        return [0.1 * x]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(0.1 * x - own[0]) / 1.5]

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x - own[0] + 0.05 * x, own)


class SpectrumCreep(Plant):
    """Six elements whose shares in 12 % grow as their times to the power of 0.3, from the rest length, settled for 6.93 s."""

    own_scales = (0.1,) * 6
    times = np.geomspace(0.2, 300, 6)
    shares = 0.12 * times**0.3 / np.sum(times**0.3)

    def own_start(self, x):
        return self.shares * x * (1 - np.exp(-10 * np.log(2) / self.times))

    def own_rates(self, target, pressure, x, velocity, own):
        return (self.shares * x - own) / self.times

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x - np.sum(own), own)


class PullCreep(Plant):
    """A share of what the pressure pulled on the mean of the last seconds comes on top, less that of the start."""

    own_scales = (1e3,)

    def own_start(self, x):
        self.at_start = VALVE_GAIN * STAIRS[0] * VIRTUAL_AREA_1000.area(x)
        return [self.at_start]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(pressure * VIRTUAL_AREA_1000.area(x) - own[0]) / 2.5]

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x, own) + 0.2 * (own[0] - self.at_start)


class UnevenPullCreep(PullCreep):
    """It takes three times as long to lose what it gained."""

    def own_rates(self, target, pressure, x, velocity, own):
        lack = pressure * VIRTUAL_AREA_1000.area(x) - own[0]
        return [lack / (2.5 if lack > 0 else 7.5)]


class KnownPullCreep(UnevenPullCreep):
    """With coefficients that were identified after all drift."""

    def static_force(self, pressure, x, own):
        return Plant.static_force(self, pressure, x, own) - 0.2 * (pressure * VIRTUAL_AREA_1000.area(x) - own[0])


class PressureCreep(Plant):
    """A braid that goes on widening under the pressure, by 9 mm and 4 mm at 2 bar, settled at the start and half of that known."""

    own_scales = 0.01, 0.01

    def own_start(self, x):
        pressure = VALVE_GAIN * STAIRS[0]
        return [9e-3 * pressure / 2e5, 4e-3 * pressure / 2e5]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(9e-3 * pressure / 2e5 - own[0]) / 1.5, (4e-3 * pressure / 2e5 - own[1]) / 8.0]

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x - own[0] - own[1] + 6.5e-3 * pressure / 2e5, own)


class Relaxation(Plant):
    """Springs to points that follow the muscle's end as dashpots let them: a standard linear solid of two times."""

    own_scales = 0.1, 0.1

    def own_start(self, x):
        return [x, x]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(x - own[0]) / 1.5, (x - own[1]) / 8.0]

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x, own) - 1500.0 * (x - own[0]) - 600.0 * (x - own[1])


class ActivatedRelaxation(Relaxation):
    """Eyring's dashpots, which yield as the hyperbolic sine of their stress."""

    def own_rates(self, target, pressure, x, velocity, own):
        return [np.sinh(120 * (x - point)) / 120 / time for point, time in zip(own, (1.5, 8.0), strict=True)]


class Resonance(Plant):
    own_scales = (1e6,)

    def own_start(self, x):
        return [0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [25.0**2 * (target - pressure) - 2 * 0.35 * 25.0 * own[0]]

    def pressure_rate(self, target, pressure, x, own):
        return own[0]


class Regulator(Plant):
    """Proportional and integral; own is the integral part."""

    own_scales = (1e6,)

    def own_start(self, x):
        return [0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [25.0**2 * (target - pressure)]

    def pressure_rate(self, target, pressure, x, own):
        return own[0] + 17.5 * (target - pressure)


class SlowRegulator(Regulator):
    """Mostly proportional: it overshoots without ringing."""

    own_scales = (1e5,)

    def own_rates(self, target, pressure, x, velocity, own):
        return [25.0 * (target - pressure)]

    def pressure_rate(self, target, pressure, x, own):
        return own[0] + 15.0 * (target - pressure)


class UnevenResonance(Resonance):
    """Damped one and a half times as much while the pressure falls."""

    def own_rates(self, target, pressure, x, velocity, own):
        damping_ratio = 0.35 if own[0] > 0 else 0.525
        return [25.0**2 * (target - pressure) - 2 * damping_ratio * 25.0 * own[0]]


class SlowerWhenShort(Plant):
    def pressure_rate(self, target, pressure, x, own):
        return (target - pressure) / (1 / VALVE_BANDWIDTH + 0.03 * (1 + 7 * x))


class SlowNearTarget(Plant):
    """A pilot that opens little for small errors: half of what is added there is gone at 0.15 bar."""

    def pressure_rate(self, target, pressure, x, own):
        error = target - pressure
        return error / (1 / VALVE_BANDWIDTH + 0.03 + 0.06 / (1 + abs(error) / 0.15e5))


class SlowTail(Plant):
    """A stage that is adjusted slowly gives the last 15 % of the way."""

    own_scales = (1e5,)

    def own_start(self, x):
        return [VALVE_GAIN * STAIRS[0]]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(target - own[0]) / 0.8]

    def pressure_rate(self, target, pressure, x, own):
        return VALVE_BANDWIDTH * (0.85 * target + 0.15 * own[0] - pressure)


class DeadTime(Plant):
    DELAY = 0.0373

    def seen(self, command):
        pieces = super().seen(command)
        end, first = pieces[-1][1], command[0]
        late = [(t0 + self.DELAY, min(t1 + self.DELAY, end), u, s) for t0, t1, u, s in pieces if t0 + self.DELAY < end]
        return [(0.0, self.DELAY, first, 0.0), *late]


class AveragedPosition(Plant):
    """The sensor shows the mean of the 80 ms that ended 30 ms ago: a difference of the integral of the contraction."""

    own_scales = (1.0,)

    def own_start(self, x):
        return [0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [x]

    def readings(self, x, force, own):
        early = x[0] * SAMPLE_TIME * np.arange(-11, 0)
        integral = np.concatenate([early, own[:, 0]])
        return (integral[8:-3] - integral[:-11]) / (8 * SAMPLE_TIME)


class FilteredPosition(AveragedPosition):
    """The same of what a filter of first order shows; own are its output and the integral of that."""

    own_scales = 0.1, 1.0

    def own_start(self, x):
        return [x, 0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(x - own[0]) / 0.05, own[0]]

    def readings(self, x, force, own):
        return super().readings(x, force, own[:, 1:])


class FilteringPosition(Plant):
    """The sensor shows the output of a filter of first order."""

    own_scales = (0.1,)

    def own_start(self, x):
        return [x]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(x - own[0]) / 0.05]

    def readings(self, x, force, own):
        return own[:, 0]


class UnevenDeadTime(Plant):
    """Falling commands come later: of the command as it was at two times the larger counts."""

    DELAYS = 0.0373, 0.05595

    def seen(self, command):
        pieces = super().seen(command)
        times = np.array([0.0, *(t1 for _, t1, _, _ in pieces)])
        late = lambda t: [np.interp(t - delay, times, command) for delay in self.DELAYS]
        cuts = sorted({*times, *(t + d for t in times for d in self.DELAYS if t + d < times[-1])})
        cuts = [a for a, b in zip(cuts[:-1], cuts[1:]) if b - a > 1e-12] + [times[-1]]
        result = []
        for a, b in zip(cuts[:-1], cuts[1:]):
            (one_a, other_a), (one_b, other_b) = late(a), late(b)
            ahead_a, ahead_b = one_a - other_a, one_b - other_b
            middle = a + (b - a) * ahead_a / (ahead_a - ahead_b) if ahead_a * ahead_b < 0 else b
            for start, end in ((a, middle), (middle, b)):
                if end > start:
                    which = int(np.argmax(late((start + end) / 2)))
                    u0, u1 = (late(t)[which] for t in (start, end))
                    result.append((start, end, u0, (u1 - u0) / (end - start)))
        return result


class Play(Plant):
    def __init__(self, half=0.11, growth=0.0):
        self.half, self.growth = half, growth

    def seen(self, command):
        """Every straight piece is cut where the gap closes: there the position begins or ends to follow."""
        position, result = command[0], []
        for t0, t1, u, s in super().seen(command):
            cuts = [t0, t1]
            if s != 0:
                met = ((position + sign * self.half) / (1 - sign * self.growth) for sign in (-1, 1))
                cuts += [t for t in (t0 + (command - u) / s for command in met) if t0 < t < t1]
            for a, b in zip(sorted(cuts)[:-1], sorted(cuts)[1:]):
                middle = u + s * ((a + b) / 2 - t0)
                held = abs(middle - position) <= self.half + self.growth * middle + 1e-12
                follows = 1 - np.sign(s) * self.growth
                at = lambda t: (u + s * (t - t0)) * follows - np.sign(s) * self.half
                result.append((a, b, position, 0.0) if held else (a, b, at(a), s * follows))
                position = position if held else at(b)
        return result


class SpreadPlay(Plant):
    """The mean of plays of five widths."""

    def seen(self, command):
        each = [Play(share * 0.11).seen(command) for share in (0.2, 0.6, 1.0, 1.4, 1.8)]
        cuts = sorted({cut for pieces in each for piece in pieces for cut in piece[:2]})
        result = []
        for a, b in zip(cuts[:-1], cuts[1:]):
            now = [next(piece for piece in pieces if piece[0] <= (a + b) / 2 <= piece[1]) for pieces in each]
            result.append((a, b, np.mean([u + s * (a - t0) for t0, _, u, s in now]), np.mean([s for *_, s in now])))
        return result


class Stiction(Plant):
    THRESHOLD = 0.17
    JUMP_TIME = 0.0

    def seen(self, command):
        stuck, result = command[0], []
        for t0, t1, u, s in super().seen(command):
            t = t0
            while s != 0:
                jump = t0 + (stuck + np.sign(s) * self.THRESHOLD - u) / s + self.JUMP_TIME
                if jump >= t1:
                    break
                result.append((t, jump, stuck, 0.0))
                stuck, t = u + s * (jump - t0), jump
            result.append((t, t1, stuck, 0.0))
        return result


class LateStiction(Stiction):
    """Having broken loose, the pilot takes its time to come to where the command is by then."""

    JUMP_TIME = 0.01


class Sliding(Plant):
    """Choudhury's pilot with a band of 0.2 V and a slip jump of 0.12 V, exact on lines: sticks where the command turns or rests."""

    def seen(self, command):
        short, slides, stuck, result = 0.04, 0, command[0], []
        for t0, t1, u, s in super().seen(command):
            loose, sign = t0, np.sign(s)
            if sign == 0:
                loose = t1
            elif sign != slides:
                loose = np.clip(t0 + (stuck + sign * (short + 0.12) - u) / s, t0, t1)
            at = lambda t: u + s * (t - t0) - sign * short
            slides = sign if loose < t1 else 0
            result += [(t0, loose, stuck, 0.0), (loose, t1, at(loose), s)]
            stuck = at(t1) if slides else stuck
        return result


class Overlap(Plant):
    """Nothing flows up to an error of 6 kPa, all that is wanted from 9 kPa on, in between the line from one to the other."""

    def pressure_rate(self, target, pressure, x, own):
        error = target - pressure
        return VALVE_BANDWIDTH * np.sign(error) * np.interp(abs(error), [0, 6e3, 9e3, 1e6], [0, 0, 9e3, 1e6])


class UnlikePorts(Plant):
    """As with an overlap of 6 kPa, but that a port for emptying opens from 15 kPa on."""

    def pressure_rate(self, target, pressure, x, own):
        error = target - pressure
        overlap = 6e3 if error > 0 else 15e3
        beyond = np.interp(abs(error), [0, overlap, 1.5 * overlap, 1e6], [0, 0, 1.5 * overlap, 1e6])
        return VALVE_BANDWIDTH * np.sign(error) * beyond


class RoundedPorts(Plant):
    """An overlap of 6 kPa behind the branch z of the hyperbola z (z - |e| + 6 kPa) = (2 kPa)^2, less where that begins."""

    def pressure_rate(self, target, pressure, x, own):
        error = target - pressure
        branch = lambda size: max(np.roots([1.0, 6.0 - size, -4.0]).real)
        return VALVE_BANDWIDTH * np.sign(error) * 1e3 * (branch(abs(error) / 1e3) - branch(0.0))


class RestingRegulator(Plant):
    """Begins where the error has been above 8 kPa, and ends where it has been below 1.2 kPa, for ln 2 times 4 ms; both takes 4 ms."""

    own_scales = (1.0, 1.0)

    def own_start(self, x):
        return [-1.0, 0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        error, doubt = abs(target - pressure), np.sign(own[0])
        wanted = np.select([error > 8e3, error < 1.2e3], [1.0, -1.0], doubt)
        return [(wanted - own[0]) / 4e-3, (np.heaviside(own[0], 0.0) - own[1]) / 4e-3]

    def pressure_rate(self, target, pressure, x, own):
        return VALVE_BANDWIDTH * own[1] * (target - pressure)


class FlowLimit(Plant):
    def pressure_rate(self, target, pressure, x, own):
        wanted = VALVE_BANDWIDTH * (target - pressure)
        filling, emptying = 1.2e5 / (1 + 3 * x), 0.8e5 * (0.6 + 0.4 * (pressure + AMBIENT) / 3e5) / (1 + 3 * x)
        most = filling if wanted > 0 else emptying
        return wanted / (1 + abs(wanted / most) ** 4) ** 0.25


class Nozzle(Plant):
    """ISO 6358 from a supply of 4 bar, both ways, with a critical ratio of 0.4; isothermal, in a muscle that grows."""

    def pressure_rate(self, target, pressure, x, own):
        def flow(upstream, downstream):
            ratio = downstream / upstream
            return upstream * (1.0 if ratio < 0.4 else np.sqrt(1 - ((ratio - 0.4) / 0.6) ** 2)) / (1 + 3 * x)

        inside = pressure + AMBIENT
        filling, emptying = 1.2e5 * flow(4e5 + AMBIENT, inside) / (4e5 + AMBIENT), 0.8e5 * flow(inside, AMBIENT) / 3e5
        wanted = VALVE_BANDWIDTH * (target - pressure)
        return wanted / (1 + abs(wanted / (filling if wanted > 0 else emptying)) ** 4) ** 0.25


class MovingVolume(Plant):
    """Air of polytropic exponent 1.2 in a muscle that grows: the valve gives p V^1.2 at most so much; what it lacks the motion takes."""

    def rate(self, target, pressure, x, velocity, own):
        volume, slope = 1 + 8 * x * (1 - 1.5 * x), 8 * (1 - 3 * x)
        power = (pressure + AMBIENT) * volume**1.2
        needed = VALVE_BANDWIDTH * (target - pressure) * volume**1.2 + 1.2 * power * slope / volume * velocity
        most = (1.2e5 if needed > 0 else 0.8e5) * volume**0.2
        gained = needed / (1 + abs(needed / most) ** 4) ** 0.25
        return gained / volume**1.2 - 1.2 * (pressure + AMBIENT) * slope / volume * velocity


class Leakage(Plant):
    def pressure_rate(self, target, pressure, x, own):
        ratio = AMBIENT / (pressure + AMBIENT)
        psi = 1.0 if ratio < 0.3 else np.sqrt(1 - ((ratio - 0.3) / 0.7) ** 2)
        hole = (pressure + AMBIENT) * psi * pressure / (pressure + 500.0)
        leak = 0.8 * (0.6 * pressure + 0.4 * hole) / (1 + 4 * x)
        return VALVE_BANDWIDTH * (target - pressure) - leak


class Tear(Plant):
    """A hole that the growing girth opens."""

    def pressure_rate(self, target, pressure, x, own):
        return VALVE_BANDWIDTH * (target - pressure) - (0.6 + 9 * x) * pressure


class Crack(Plant):
    """It opens beyond 60 mm of contraction."""

    def pressure_rate(self, target, pressure, x, own):
        return VALVE_BANDWIDTH * (target - pressure) - (0.05 + 25 * max(x - 0.06, 0.0)) * pressure


class LiftingSeal(Plant):
    """Tight up to 0.9 bar."""

    def pressure_rate(self, target, pressure, x, own):
        return VALVE_BANDWIDTH * (target - pressure) - 0.8 * max(pressure - 0.9e5, 0.0) / (1 + 4 * x)


class ShutAtRest(Plant):
    """The valve shuts when its command has differed little, of late, from the mean of what it was of late; air is lost always."""

    own_scales = 1e5, 1e5

    def own_start(self, x):
        return [VALVE_GAIN * STAIRS[0], 0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(target - own[0]) / 0.1, (abs(target - own[0]) - own[1]) / 0.1]

    def pressure_rate(self, target, pressure, x, own):
        is_open = np.interp(own[1], [500, 1000], [0, 1])
        return is_open * VALVE_BANDWIDTH * (target - pressure) - 0.2 * pressure


class SmallTank(Plant):
    """A tank of 1.85 bar, four times as large as the muscle, is filled again within 2.5 s."""

    own_scales = (1e5,)

    def own_start(self, x):
        return [1.85e5]

    def own_rates(self, target, pressure, x, velocity, own):
        filling = max(min(target, own[0]) - pressure, 0.0)
        return [(1.85e5 - own[0]) / 2.5 - 4.0 * filling]

    def pressure_rate(self, target, pressure, x, own):
        return VALVE_BANDWIDTH * (min(target, own[0]) - pressure)


class SoftCeiling(Plant):
    """A supply of 1.9 bar that falls short by and by."""

    def pressure_rate(self, target, pressure, x, own):
        given = 1 / ((1 / target) ** 7 + (1 / 1.9e5) ** 7) ** (1 / 7)
        return VALVE_BANDWIDTH * (given - pressure)


class Timed(Plant):
    """The own state is the time."""

    own_scales = (1.0,)

    def own_start(self, x):
        return [0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [1.0]


class TwoSwitches(Timed):
    """A supply that falls from 1.9 by 0.3 bar within 3 s, and is back within 1 s; half way down at the start."""

    def pressure_rate(self, target, pressure, x, own):
        supply = np.interp((own[0] + 1.5) % 4.0, [0.0, 3.0, 4.0], [1.9e5, 1.6e5, 1.9e5])
        return VALVE_BANDWIDTH * (min(target, supply) - pressure)


class SwingingZero(Timed):
    """A valve 0.12 V off, and 30 % more or less of it in 8.5 s."""

    def pressure_rate(self, target, pressure, x, own):
        volts = 0.12 + 0.036 * np.sin(2 * np.pi / 8.5 * own[0] + 0.7)
        return VALVE_BANDWIDTH * (target + VALVE_GAIN * volts - pressure)


class ShiftingZero(Timed):
    """A position sensor 4 mm off that slips back by 2.4 mm from 1.9 s to 2.5 s."""

    def readings(self, x, force, own):
        return x + np.interp(own[:, 0], [1.9, 2.5], [4e-3, 1.6e-3])


class WarmingScale(Timed):
    """A position sensor that shows 5 % less than there is, and 8 % less at first."""

    def readings(self, x, force, own):
        return x * (0.95 - 0.03 * np.exp(-own[:, 0] / 2.0))


class BentValve(Plant):
    """4 % more pressure at 2 V, 1 % less for each volt more, and another 3.6 % less at twice that."""

    def rate(self, target, pressure, x, velocity, own):
        volts = target / VALVE_GAIN
        gain = 1.04 - 0.01 * (volts - 2) - 0.012 * (volts**2 / 4 - 1)
        return super().rate(target * gain, pressure, x, velocity, own)


class WarmByWork(Plant):
    """Warmed by the power of the pressure's pull; 10 W would make it 2 % stronger for good and the membrane 3 % softer."""

    own_scales = (0.1,)

    def own_start(self, x):
        return [0.0]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(abs(pressure * VIRTUAL_AREA_1000.area(x) * velocity) / 10 - own[0]) / 4.0]

    def static_force(self, pressure, x, own):
        pull, membrane = pressure * VIRTUAL_AREA_1000.area(x), VIRTUAL_AREA_1000.elastic_force(x)
        return (1 + 0.02 * own[0]) * pull + (1 - 0.03 * own[0]) * membrane


class WarmByWay(WarmByWork):
    """The same by its way instead of its work for three quarters: 0.1 m/s would do as much as 10 W."""

    def own_rates(self, target, pressure, x, velocity, own):
        power = abs(pressure * VIRTUAL_AREA_1000.area(x) * velocity)
        return [(0.25 * power / 10 + 0.75 * abs(velocity) / 0.1 - own[0]) / 4.0]


class WarmCoil(Timed):
    """The valve loses 7 % of its gain as its coil warms up within 4 s, a third of that within 9 s."""

    def pressure_rate(self, target, pressure, x, own):
        lost = 0.07 * (1 - 2 / 3 * np.exp(-own[0] / 4.0) - 1 / 3 * np.exp(-own[0] / 9.0))
        return VALVE_BANDWIDTH * ((1 - lost) * target - pressure)


class GrowingMuscle(Timed):
    """Its rest length grows by 6 mm as it warms up within 4 s."""

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x + 6e-3 * (1 - np.exp(-own[0] / 4.0)), own)


class SlowStart(Plant):
    """Two lags in a row, 30 % of both over at the start."""

    own_scales = 0.1, 0.1

    def own_start(self, x):
        return [0.3, 0.3]

    def own_rates(self, target, pressure, x, velocity, own):
        return [(1 - own[0]) / 6.0, (own[0] - own[1]) / 3.0]

    def static_force(self, pressure, x, own):
        pull, membrane = pressure * VIRTUAL_AREA_1000.area(x), VIRTUAL_AREA_1000.elastic_force(x)
        return (1 + 0.05 * own[1]) * pull + (1 - 0.1 * own[1]) * membrane


class StifferEnd(Plant):
    def static_force(self, pressure, x, own):
        fung = 30 * (np.exp(x / 0.125) - 1)
        return super().static_force(pressure, x, own) - fung * (1 + 0.3 * (x / 0.1 - 1) ** 2)


class WrongBore(Plant):
    """8 % stronger threads, 4 % more membrane."""

    def static_force(self, pressure, x, own):
        return 1.08 * pressure * VIRTUAL_AREA_1000.area(x) + 1.04 * VIRTUAL_AREA_1000.elastic_force(x)


class StretchingThreads(Plant):
    """6 % stronger at 400 N, and less so the more they are pulled: a cubic of the force."""

    def static_force(self, pressure, x, own):
        force = super().static_force(pressure, x, own)
        return 1.06 * force - 0.02 * force * (force / 400 - 1) - 0.012 * force * ((force / 400) ** 2 - 1)


class StiffEnds(Plant):
    """The middle of the braid contracts more, and the membrane along its whole length a quarter of that more."""

    def static_force(self, pressure, x, own):
        braid = x * (1 + 0.06 + 0.1 * np.exp(-pressure / 1e5))
        membrane = x + 0.25 * (braid - x)
        return pressure * VIRTUAL_AREA_1000.area(braid) + VIRTUAL_AREA_1000.elastic_force(membrane)


class Counterweight(Plant):
    """3 kg on the other side of a pulley: they take from the weight and add to what moves."""

    weighing, moving = MASS - 3.0, MASS + 3.0


class Chain(Plant):
    """A chain of 12 kg/m that is lifted from the floor."""

    lifted = 12.0


class TaperedEnds(Plant):
    """Of the pull of the pressure 18 % are missing at full length, and 37 % of that after 40 mm."""

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x, own) - 0.18 * np.exp(-x / 0.04) * pressure * VIRTUAL_AREA_1000.area(x)


class Rope(Plant):
    """A rope of so many N/m between muscle and load, with a damper in N s/m from 10 N on, slack where it would push.

    The muscle has 1 N s/m more for its own motion relative to the load. The own state is the stretch, below zero the slack.
    """

    own_scales = (0.01,)
    stiffness, damper = 15e3, 7.5

    def own_start(self, x):
        pressure = VALVE_GAIN * THROWS[0]
        surplus = lambda stretch: Plant.static_force(self, pressure, x + stretch, []) - self.stiffness * max(stretch, 0)
        return [brentq(surplus, -0.3, 0.3, xtol=1e-16, rtol=1e-15)]

    def loss(self, stretch):
        return self.damper * np.clip(self.stiffness * stretch / 10, 0, 1)

    def own_rates(self, target, pressure, x, velocity, own):
        muscle = Plant.static_force(self, pressure, x + own[0], []) - DAMPING * velocity
        return [(muscle - self.stiffness * max(own[0], 0)) / (DAMPING + 1 + self.loss(own[0]))]

    def force(self, pressure, x, velocity, own):
        (rate,) = self.own_rates(None, pressure, x, velocity, own)
        return self.stiffness * max(own[0], 0) + self.loss(own[0]) * rate


class Wire(Rope):
    """Stiffness over damping leaves the muscle 3 ms to follow."""

    stiffness, damper = 2e5, 2e5 * 3e-3 - DAMPING


class SeriesElasticity(Plant):
    def readings(self, x, force, own):
        grown = (force + 25) ** 0.85 - 25**0.85
        return x - 8e-6 * 400 * grown / (425**0.85 - 25**0.85)


class LaidRope(Plant):
    def readings(self, x, force, own):
        return x - 2e-3 * np.log1p(force / 160) / np.log1p(400 / 160)


class Threshold(Plant):
    def static_force(self, pressure, x, own):
        pull = max(super().static_force(pressure, x, own), 0) / 400
        fade = 0.7e5 * (1 + 0.3 * pull)
        lost = 0.1e5 * (1 - np.exp(-pressure / 0.5e5)) + 0.4e5 * np.exp(-((pressure / fade) ** 1.5))
        return super().static_force(pressure - lost * np.exp(-3 * x) * (1 + 0.2 * pull), x, own)


class Contact(Plant):
    def static_force(self, pressure, x, own):
        return super().static_force(pressure - pressure / (1 + (pressure / 0.4e5) ** 2.4) * np.exp(-2 * x), x, own)


class Friction(Plant):
    own_scales = 1.0, 1.0

    def own_start(self, x):
        return [0.2, 0.2]

    def own_rates(self, target, pressure, x, velocity, own):
        def rate(z, way):
            return velocity / way * (1 - (0.7 * np.sign(velocity * z) + 0.3) * abs(z) ** 1.6)

        return [rate(own[0], 3e-3), rate(own[1], 1.2e-2)]

    def static_force(self, pressure, x, own):
        return super().static_force(pressure, x, own) - (12 + 6e-5 * pressure) * (0.7 * own[0] + 0.3 * own[1])

    def force(self, pressure, x, velocity, own):
        stribeck = (12 + 6e-5 * pressure) * (0.7 * own[0] + 0.3 * own[1]) * 0.2 * np.exp(-((velocity / 0.02) ** 2))
        return super().force(pressure, x, velocity, own) - stribeck


# A smoothing velocity of 2 mm/s acts beside the least one of 0.2 mm/s.
SMOOTHING = np.hypot(2e-3, 2e-4)


class DirectFriction(Plant):
    """Coulomb's law without a memory, its step rounded."""

    def force(self, pressure, x, velocity, own):
        return super().force(pressure, x, velocity, own) - (9 + 8e-5 * pressure) * np.tanh(velocity / SMOOTHING)


class SinkingFriction(DirectFriction):
    """The same of a load that still sinks at the start, held by 60 % of the friction."""

    start_velocity = SMOOTHING * np.arctanh(-0.6)


class CordFriction(Plant):
    """Coulomb's law without a memory; a part goes with the pull, as of a cord around a bolt, and all of it with the way."""

    def force(self, pressure, x, velocity, own):
        pull = super().force(pressure, x, velocity, own)
        return pull - (9 + 0.04 * abs(pull)) * (1 - 0.6 * (x / 0.1 - 1)) * np.tanh(velocity / SMOOTHING)


class ThinningDamping(Plant):
    """Eyring: sinh(25 s/m F/B) is 25 s/m times the velocity."""

    def force(self, pressure, x, velocity, own):
        damping = 150.0 if velocity > 0 else 320.0
        rate = np.log(25 * velocity + np.sqrt(1 + (25 * velocity) ** 2)) / 25
        return super().force(pressure, x, velocity, own) - damping * rate


STAIRS = staircase([0.8, 1.5, 2.0, 1.2], 1.2)
THROWS = staircase([2.13, 1.25, 1.9, 1.1], 1.2)
RAMPS = ramps([(0, 1.0), (0.3, 1.0), (1.5, 2.0), (2.0, 2.0), (2.6, 1.4), (3.0, 1.9), (3.6, 1.2), (4.4, 1.3), (5, 1.3)])


@dataclass(frozen=True)
class Case:
    name: str
    plant: Plant
    command: np.ndarray = field(repr=False)


CASES = [
    Case("creep", Creep(), STAIRS),
    Case("uneven_creep", UnevenCreep(), STAIRS),
    Case("known_creep", KnownCreep(), STAIRS),
    Case("spectrum_creep", SpectrumCreep(), STAIRS),
    Case("pull_creep", PullCreep(), STAIRS),
    Case("uneven_pull_creep", UnevenPullCreep(), STAIRS),
    Case("known_pull_creep", KnownPullCreep(), STAIRS),
    Case("pressure_creep", PressureCreep(), STAIRS),
    Case("relaxation", Relaxation(), STAIRS),
    Case("activated_relaxation", ActivatedRelaxation(), STAIRS),
    Case("regulator", Regulator(), STAIRS),
    Case("slow_regulator", SlowRegulator(), STAIRS),
    Case("slower_when_short", SlowerWhenShort(), STAIRS),
    Case("slow_near_target", SlowNearTarget(), STAIRS),
    Case("slow_tail", SlowTail(), STAIRS),
    Case("uneven_dead_time", UnevenDeadTime(), RAMPS),
    Case("averaged_position", AveragedPosition(), RAMPS),
    Case("filtered_position", FilteredPosition(), RAMPS),
    Case("filtering_position", FilteringPosition(), RAMPS),
    Case("resonance", Resonance(), STAIRS),
    Case("uneven_resonance", UnevenResonance(), STAIRS),
    Case("dead_time", DeadTime(), RAMPS),
    Case("play", Play(), RAMPS),
    Case("spread_play", SpreadPlay(), RAMPS),
    Case("growing_play", Play(0.04, 0.06), RAMPS),
    Case("stiction", Stiction(), RAMPS),
    Case("late_stiction", LateStiction(), RAMPS),
    Case("sliding", Sliding(), ramps([(0, 1.0), (0.3, 1.0), (1.2, 1.7), (1.6, 1.7), (2.2, 2.1), (2.8, 1.4), (4, 1.7), (5, 1.7)])),
    Case("overlap", Overlap(), STAIRS),
    Case("unlike_ports", UnlikePorts(), STAIRS),
    Case("rounded_ports", RoundedPorts(), STAIRS),
    Case("resting_regulator", RestingRegulator(), RAMPS),
    Case("flow_limit", FlowLimit(), STAIRS),
    Case("nozzle", Nozzle(), STAIRS),
    Case("moving_volume", MovingVolume(), STAIRS),
    Case("leakage", Leakage(), STAIRS),
    Case("tear", Tear(), STAIRS),
    Case("crack", Crack(), STAIRS),
    Case("lifting_seal", LiftingSeal(), STAIRS),
    Case("shut_at_rest", ShutAtRest(), STAIRS),
    Case("small_tank", SmallTank(), STAIRS),
    Case("soft_ceiling", SoftCeiling(), STAIRS),
    Case("two_switches", TwoSwitches(), STAIRS),
    Case("swinging_zero", SwingingZero(), STAIRS),
    Case("shifting_zero", ShiftingZero(), STAIRS),
    Case("warming_scale", WarmingScale(), STAIRS),
    Case("bent_valve", BentValve(), RAMPS),
    Case("warm_by_work", WarmByWork(), STAIRS),
    Case("warm_by_way", WarmByWay(), STAIRS),
    Case("warm_coil", WarmCoil(), STAIRS),
    Case("growing_muscle", GrowingMuscle(), STAIRS),
    Case("stiffer_end", StifferEnd(), STAIRS),
    Case("slow_start", SlowStart(), STAIRS),
    Case("wrong_bore", WrongBore(), STAIRS),
    Case("stretching_threads", StretchingThreads(), STAIRS),
    Case("stiff_ends", StiffEnds(), STAIRS),
    Case("counterweight", Counterweight(), STAIRS),
    Case("chain", Chain(), STAIRS),
    Case("series_elasticity", SeriesElasticity(), RAMPS),
    Case("tapered_ends", TaperedEnds(), STAIRS),
    Case("rope", Rope(), THROWS),
    Case("wire", Wire(), THROWS),
    Case("laid_rope", LaidRope(), RAMPS),
    Case("threshold", Threshold(), STAIRS),
    Case("contact", Contact(), STAIRS),
    Case("thinning_damping", ThinningDamping(), RAMPS),
    Case("friction", Friction(), RAMPS),
    Case("direct_friction", DirectFriction(), RAMPS),
    Case("sinking_friction", SinkingFriction(), RAMPS),
    Case("cord_friction", CordFriction(), RAMPS),
]


def start(case):
    """The load hangs in balance at the pressure that the first command asks for."""
    pressure, plant = VALVE_GAIN * case.command[0], case.plant
    surplus = lambda x: plant.force(pressure, x, plant.start_velocity, plant.own_start(x)) - plant.weight(x)
    x = brentq(surplus, 0.0, 0.22, xtol=1e-15, rtol=1e-15)
    return np.array([pressure, x, plant.start_velocity, *plant.own_start(x)])


def solve(case):
    """States at the samples."""
    plant, state = case.plant, start(case)
    scales = np.array([1e5, 0.1, 0.1, *plant.own_scales])
    end = (len(case.command) - 1) * SAMPLE_TIME
    samples = np.arange(len(case.command)) * SAMPLE_TIME
    states, next_sample = [state], 1

    def derivative(t, state, t0, value, slope):
        pressure, x, velocity, *own = state
        target = VALVE_GAIN * (value + slope * (t - t0))
        push = (plant.force(pressure, x, velocity, own) - plant.weight(x)) / (plant.moving + plant.lifted * x)
        own_rates = plant.own_rates(target, pressure, x, velocity, own)
        return [plant.rate(target, pressure, x, velocity, own), velocity, push, *own_rates]

    for t0, t1, value, slope in plant.seen(case.command):
        # Samples within the piece are stops, too.
        stops = [t0, *samples[(samples > t0 + 1e-9) & (samples < t1 - 1e-9)], min(t1, end)]
        for a, b in zip(stops[:-1], stops[1:]):
            if b - a > 1e-12:
                piece = solve_ivp(derivative, (a, b), state, "DOP853", args=(t0, value, slope), max_step=5e-3,
                                  rtol=TOLERANCE, atol=TOLERANCE * scales * 1e-2)
                state = piece.y[:, -1]
            if next_sample < len(samples) and abs(b - samples[next_sample]) < 1e-9:
                states.append(state)
                next_sample += 1
    assert len(states) == len(case.command)
    return np.array(states)


def main():
    for case in CASES:
        rows, states = [], solve(case)
        for time, command, state in zip(np.arange(len(case.command)) * SAMPLE_TIME, case.command, states):
            pressure, x, velocity, *own = state
            assert 0 < x < 0.25, f"{case.name}: contraction {x} m"
            force = case.plant.force(pressure, x, velocity, own)
            rows.append([time, command, pressure, x, velocity, force, MASS])
        rows = np.array(rows)
        rows[:, 3] = case.plant.readings(rows[:, 3], rows[:, 5], states[:, 3:])
        path = Path(__file__).parent / f"effect_{case.name}.csv"
        np.savetxt(path, rows, "%.12g", ",", header=HEADER, comments="")
        print(f"{path.name}: {len(rows)} samples")


if __name__ == "__main__":
    main()
