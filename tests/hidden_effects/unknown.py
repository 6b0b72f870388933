"""Effects that are in no library, so that no name is the right answer.

Forms as in effects.py. None is an effect of the library in disguise: each depends on something that no library effect
depends on (a place, the time, an oscillation, a signal that should have no say), or hits a signal that it leaves alone.
"""

import numpy as np
from scipy.signal import bilinear, lfilter

from effects import Form, either_sign, play, smoothed
from plant import GRAVITY, STEP, STORE_EVERY

# --- Mechanics --------------------------------------------------------------------------------------------------------


class LooseBracket(Form):
    """The position sensor's bracket gives way, the more the higher the pull."""

    @staticmethod
    def sizes(random, severity):
        return {"half": severity * random.uniform(1.5e-3, 5e-3)}

    def show(self, time, p, x, force):
        followed = play(x / self.half, np.ones(len(self.half)))
        slack = x / self.half - followed
        return p, x - self.half * slack * np.clip(force / 400, 0, 1.5), force


class GuideSpot(Form):
    """A rough spot on the guide rail."""

    @staticmethod
    def sizes(random, severity):
        place = {"where": random.uniform(0.08, 0.14), "width": random.uniform(0.006, 0.012)}
        return {"grip": severity * random.uniform(60, 150), **place}

    def act(self, now):
        x, v = now.x[self.at], now.v[self.at]
        bump = np.exp(-(((x - self.where) / self.width) ** 2))
        now.force[self.at] -= self.grip * bump * np.tanh(v / 5e-3)


class MainsHum(Form):
    """Hum on the force sensor, modulated; sampling folds it to any frequency."""

    @staticmethod
    def sizes(random, severity):
        return {"newton": severity * random.uniform(8, 30), "modulation": random.uniform(0.05, 0.4)}

    def show(self, time, p, x, force):
        t = time[:, None]
        hum = np.sin(2 * np.pi * 49.97 * t) * (1 + 0.8 * np.sin(2 * np.pi * self.modulation * t))
        return p, x, force + self.newton * hum


class RubberStop(Form):
    """Something elastic takes part of the load from some contraction on."""

    @staticmethod
    def sizes(random, severity):
        return {"stiffness": severity * random.uniform(1500, 4000), "where": random.uniform(0.08, 0.12)}

    def act(self, now):
        x = now.x[self.at]
        now.external[self.at] = -self.stiffness * np.maximum(x - self.where, 0) ** 1.3 / 0.05**0.3


class CoarseConverter(Form):
    """The converter behind the recorded command has few bits."""

    @staticmethod
    def sizes(random, severity):
        return {"volts": severity * random.uniform(0.1, 0.3)}

    def drive(self, command):
        return self.volts * np.floor(command / self.volts)


class Pendulum(Form):
    """The load swings: its pull varies at twice the frequency of the swing."""

    @staticmethod
    def sizes(random, severity):
        swing = {"angle": np.sqrt(severity) * random.uniform(0.25, 0.45), "frequency": random.uniform(0.35, 0.7)}
        return {**swing, "decay": random.uniform(20, 60)}

    def act(self, now):
        t = max(now.time, 0.0)
        angle = self.angle * np.exp(-t / self.decay)
        swing = angle**2 * (0.25 - 0.75 * np.cos(4 * np.pi * self.frequency * t))
        now.external[self.at] = -now.mass[self.at] * GRAVITY * swing * (now.time > 0)


class BreathingFrame(Form):
    """The frame of the position sensor warms and cools with the room's ventilation."""

    @staticmethod
    def sizes(random, severity):
        return {"metre": severity * random.uniform(1.5e-3, 5e-3), "period": random.uniform(9, 20)}

    def show(self, time, p, x, force):
        phase = 2 * np.pi * time[:, None] / self.period
        return p, x + self.metre * (np.sin(phase) + 0.3 * np.sin(2 * phase + 1)), force


class CompressorCycle(Form):
    """The valve lets part of the supply's saw-tooth through."""

    @staticmethod
    def sizes(random, severity):
        return {"share": severity * random.uniform(0.03, 0.08), "period": random.uniform(2.5, 7)}

    def drive(self, command):
        cycle = (STEP * np.arange(len(command))[:, None] / self.period) % 1
        return command * (1 + self.share * (np.where(cycle < 0.2, 5 * cycle, 1.25 * (1 - cycle)) - 0.5))


class TremblingFrame(Form):
    """The post of the position sensor rocks when the load is accelerated; at rest it stands straight."""

    @staticmethod
    def sizes(random, severity):
        post = {"frequency": random.uniform(2.5, 6), "ratio": random.uniform(0.02, 0.06)}
        return {"share": severity * random.uniform(0.15, 0.5), **post}

    def show(self, time, p, x, force):
        return p, x + np.stack([self.rocking(k, column) for k, column in enumerate(x.T)], axis=1), force

    def rocking(self, k, x):
        rate = 2 * np.pi * self.frequency[k]
        shape = [1, 2 * self.ratio[k] * rate, rate**2]
        return lfilter(*bilinear([self.share[k], 0, 0], shape, 1 / (STEP * STORE_EVERY)), x - x[0])


class KinkedHose(Form):
    """From some contraction on the hose is kinked, and air comes and goes slowly."""

    @staticmethod
    def sizes(random, severity):
        return {"slower": severity * random.uniform(3, 9), "where": random.uniform(0.09, 0.13)}

    def aim(self, now):
        kinked = 1 / (1 + np.exp(-(now.x[self.at] - self.where) / 1e-3))
        now.time_constant[self.at] *= 1 + self.slower * kinked


class SideWall(Form):
    """The bulging muscle leans against a wall from some contraction on, and rubs there."""

    @staticmethod
    def sizes(random, severity):
        return {"stiffness": severity * random.uniform(500, 1500), "where": random.uniform(0.08, 0.12)}

    def act(self, now):
        pressed = self.stiffness * np.maximum(now.x[self.at] - self.where, 0)
        now.force[self.at] -= pressed * (0.5 + 0.4 * np.tanh(now.v[self.at] / 5e-3))


class SlippingWheel(Form):
    """The wheel of the position sensor loses some of the way when the load comes down fast."""

    @staticmethod
    def sizes(random, severity):
        return {"share": severity * random.uniform(0.02, 0.06), "speed": random.uniform(0.02, 0.05)}

    def show(self, time, p, x, force):
        v = np.gradient(x, time, axis=0)
        lost = self.share * np.where(v < -self.speed, v, 0)
        return p, x - np.cumsum(lost, axis=0) * time[1], force


class EccentricPulley(Form):
    """A pulley that is not round: the load pulls more or less, by its angle."""

    @staticmethod
    def sizes(random, severity):
        pulley = {"radius": random.uniform(0.012, 0.025), "angle": random.uniform(0, 2 * np.pi)}
        return {"share": severity * random.uniform(0.03, 0.1), **pulley}

    def act(self, now):
        turned = now.x[self.at] / self.radius + self.angle
        now.external[self.at] = self.share * now.mass[self.at] * GRAVITY * np.sin(turned)


class CrossTalk(Form):
    """The line of the command talks into the amplifier of the force sensor."""

    @staticmethod
    def sizes(random, severity):
        return {"newton_per_volt": severity * either_sign(random, 5, 15)}

    def drive(self, command):
        self.heard = command[::STORE_EVERY].copy()
        return command

    def show(self, time, p, x, force):
        return p, x, force + self.newton_per_volt * self.heard[: len(time)]


class DriftingClock(Form):
    """The sensors were logged by another clock than the command, which runs late."""

    @staticmethod
    def sizes(random, severity):
        return {"late": severity * random.uniform(1.5e-3, 6e-3)}

    def show(self, time, p, x, force):
        def later(series):
            columns = [np.interp(time * (1 - e), time, s) for e, s in zip(self.late, series.T, strict=True)]
            return np.stack(columns, axis=1)

        return later(p), later(x), later(force)


class WanderingZero(Form):
    """The zero of the force amplifier wanders with the draught in the room."""

    @staticmethod
    def sizes(random, severity):
        return {"newton": severity * either_sign(random, 8, 25), "period": random.uniform(7, 18)}

    def show(self, time, p, x, force):
        phase = 2 * np.pi * time[:, None] / self.period
        return p, x, force + self.newton * (np.sin(phase) + 0.6 * np.sin(1.618 * phase + 2))


class HuntingValve(Form):
    """The controller inside the valve never comes to rest."""

    @staticmethod
    def sizes(random, severity):
        return {"volts": severity * random.uniform(0.03, 0.1), "frequency": random.uniform(0.7, 2)}

    def drive(self, command):
        t = STEP * np.arange(len(command))[:, None]
        return command + self.volts * np.sin(2 * np.pi * self.frequency * t + 0.8 * np.sin(0.9 * t))


class WarmGas(Form):
    """Air that streams in is warm and cools at the walls, within a second and within several."""

    @staticmethod
    def sizes(random, severity):
        times = {"soon": random.uniform(0.4, 1.5), "late": random.uniform(3, 10)}
        return {"share": severity * random.uniform(0.1, 0.3), "filling": random.uniform(1.0, 1.6), **times}

    def begin(self, now):
        self.above = np.zeros((2, len(self.share)))

    def valve(self, now, before):
        change = now.p[self.at] - before[self.at]
        warmed = self.share * np.where(change > 0, self.filling, 1) * change
        gained = np.stack([0.7 * warmed, 0.3 * warmed]) - STEP * self.above / np.stack([self.soon, self.late])
        self.above += gained
        now.p[self.at] += gained.sum(axis=0)


def kept(seconds):
    """What poles keep from one stored sample to the next."""
    return np.exp(-STEP * STORE_EVERY / seconds)


class HoseToSensor(Form):
    """The pressure sensor sits behind a thin hose of its own."""

    @staticmethod
    def sizes(random, severity):
        return {"seconds": severity * random.uniform(0.03, 0.12)}

    def show(self, time, p, x, force):
        return smoothed(p, kept(self.seconds)), x, force


class SlowAmplifier(Form):
    """The amplifier of the force sensor smoothes what it is given."""

    @staticmethod
    def sizes(random, severity):
        return {"seconds": severity * random.uniform(0.03, 0.15)}

    def show(self, time, p, x, force):
        return p, x, smoothed(force, kept(self.seconds))


class WavyEncoder(Form):
    """The wheel of the encoder is not centred."""

    @staticmethod
    def sizes(random, severity):
        wheel = {"way": random.uniform(0.02, 0.06), "angle": random.uniform(0, 2 * np.pi)}
        return {"metre": severity * random.uniform(0.5e-3, 2e-3), **wheel}

    def show(self, time, p, x, force):
        return p, x + self.metre * np.sin(2 * np.pi * x / self.way + self.angle), force


class FrozenSensor(Form):
    """The position reading stands still now and then, and jumps to where it should be."""

    @staticmethod
    def sizes(random, severity):
        return {"seconds": severity * random.uniform(0.3, 1.2), "every": random.uniform(3, 8)}

    def show(self, time, p, x, force):
        frozen = [self.freezing(k, time, column) for k, column in enumerate(x.T)]
        return p, np.stack(frozen, axis=1), force

    def freezing(self, k, time, x):
        count = np.arange(np.ceil(time[-1] / self.every[k]))
        begins = self.every[k] * (count + 0.618 * count % 1)  # the golden ratio, so that it has no rhythm
        latest = begins[np.maximum(np.searchsorted(begins, time, side="right") - 1, 0)]
        stands = (time >= latest) & (time < latest + self.seconds[k])
        return np.interp(np.where(stands, latest, time), time, x)


class ShakingFloor(Form):
    """A machine beside shakes the load."""

    @staticmethod
    def sizes(random, severity):
        return {"newton": severity * random.uniform(10, 40), "frequency": random.uniform(1.5, 6)}

    def act(self, now):
        t = max(now.time, 0.0)
        now.external[self.at] = self.newton * np.sin(2 * np.pi * self.frequency * t + 0.5 * np.sin(0.7 * t))


class CellHysteresis(Form):
    """A part of the force cell's spring follows with play."""

    @staticmethod
    def sizes(random, severity):
        return {"newton": severity * random.uniform(3, 12)}

    def show(self, time, p, x, force):
        half = self.newton / 0.4
        return p, x, 0.6 * force + 0.4 * half * play(force / half, np.ones(len(half)))


UNKNOWN = {
    "unknown_loose_bracket": [LooseBracket],
    "unknown_guide_spot": [GuideSpot],
    "unknown_mains_hum": [MainsHum],
    "unknown_rubber_stop": [RubberStop],
    "unknown_coarse_converter": [CoarseConverter],
    "unknown_pendulum": [Pendulum],
    "unknown_breathing_frame": [BreathingFrame],
    "unknown_compressor_cycle": [CompressorCycle],
    "unknown_trembling_frame": [TremblingFrame],
    "unknown_kinked_hose": [KinkedHose],
    "unknown_side_wall": [SideWall],
    "unknown_slipping_wheel": [SlippingWheel],
    "unknown_eccentric_pulley": [EccentricPulley],
    "unknown_cross_talk": [CrossTalk],
    "unknown_drifting_clock": [DriftingClock],
    "unknown_wandering_zero": [WanderingZero],
    "unknown_hunting_valve": [HuntingValve],
    "unknown_warm_gas": [WarmGas],
    "unknown_hose_to_sensor": [HoseToSensor],
    "unknown_slow_amplifier": [SlowAmplifier],
    "unknown_wavy_encoder": [WavyEncoder],
    "unknown_frozen_sensor": [FrozenSensor],
    "unknown_shaking_floor": [ShakingFloor],
    "unknown_cell_hysteresis": [CellHysteresis],
}
