//! The reference trajectory of the contraction.

use crate::Result;
use crate::model::{Clock, Documentation, System};
use crate::parameters::Parameters;

crate::variables::variables! {
    /// From one contraction to another with limited velocity and acceleration.
    ///
    /// # Model
    /// Trapezoidal velocity: accelerate at a until v is reached, cruise, decelerate at a. A way shorter than v²/a
    /// never reaches v: the profile is then a triangle.
    ///
    /// # Reference
    /// Thesis section 5.4 (the interpolator of the closed loop).
    pub struct Reference in "reference." as Tunable {
        /// Contraction before the motion
        start: f64 = 0.0, METRE, (-1.0..=5.0);
        /// Contraction after the motion
        target: f64 = 0.15, METRE, (-1.0..=5.0);
        /// Largest velocity of the motion
        velocity: f64 = 0.03, METRE_PER_SECOND, (1e-6..=100.0);
        /// Acceleration and deceleration of the motion
        acceleration: f64 = 0.05, METRE_PER_SECOND2, (1e-6..=1e4);
        /// Time at which the motion begins
        start_time: f64 = 0.0, SECOND, (0.0..=1e6);
    }
}

impl Reference {
    /// Duration of the motion in s.
    pub fn duration(&self) -> f64 {
        let (way, cruise) = self.way_and_cruise_velocity();
        if way == 0.0 { 0.0 } else { way / cruise + cruise / self.acceleration }
    }

    fn way_and_cruise_velocity(&self) -> (f64, f64) {
        let way = (self.target - self.start).abs();
        (way, self.velocity.min((way * self.acceleration).sqrt()))
    }

    /// Setpoint and its first two derivatives at a time in s.
    pub fn at(&self, time: f64) -> Setpoint {
        let (way, cruise) = self.way_and_cruise_velocity();
        let (a, duration, since) = (self.acceleration, self.duration(), time - self.start_time);
        if since >= duration {
            return Setpoint { setpoint: self.target, ..Setpoint::default() };
        }
        let ramp = cruise / a;
        let (position, velocity, acceleration) = if since < 0.0 {
            (0.0, 0.0, 0.0)
        } else if since < ramp {
            (0.5 * a * since * since, a * since, a)
        } else if since < duration - ramp {
            (cruise * (since - 0.5 * ramp), cruise, 0.0)
        } else {
            let left = duration - since;
            (way - 0.5 * a * left * left, a * left, -a)
        };
        let direction = (self.target - self.start).signum();
        Setpoint {
            setpoint: self.start + direction * position,
            setpoint_velocity: direction * velocity,
            setpoint_acceleration: direction * acceleration,
        }
    }
}

crate::variables::signals! {
    /// Setpoint of the contraction.
    pub struct Setpoint in "" as Output {
        /// Reference of the contraction
        setpoint: METRE;
        /// First derivative of the setpoint
        setpoint_velocity: METRE_PER_SECOND;
        /// Second derivative of the setpoint
        setpoint_acceleration: METRE_PER_SECOND2;
    }
}

crate::variables::signals! {
    /// A trajectory takes no inputs.
    pub struct NoInputs in "" as Input {}
}

/// The reference trajectory as a model.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceTrajectory;

impl System for ReferenceTrajectory {
    const NAME: &'static str = "ReferenceTrajectory";
    const DESCRIPTION: &'static str = "Reference of the contraction with limited velocity and acceleration";
    const DOCUMENTATION: Documentation = Documentation {
        equation: "From start to target with at most velocity and acceleration: accelerate, cruise, decelerate, \
                   beginning at start_time.",
        limits: "The acceleration jumps; the setpoint and its velocity do not.",
        source: "Thesis section 5.4.",
    };
    const GROUPS: &'static [&'static str] = &["reference"];
    const OWN_GROUP: Option<&'static str> = Some("reference");
    const FEEDTHROUGH: &'static [(&'static str, &'static [&'static str])] = &[];
    const INITIAL_INPUTS: &'static [&'static str] = &[];
    const STATE_NAMES: &'static [&'static str] = &[];
    type Inputs = NoInputs;
    type Outputs = Setpoint;
    type State = [f64; 0];
    type Memory = ();
    const SCALE: [f64; 0] = [];

    fn initial_state(_: &Parameters, _: &NoInputs) -> Result<[f64; 0]> {
        Ok([])
    }
    fn rates(_: &Parameters, _: &NoInputs, _: &[f64; 0], _: &mut [f64; 0]) {}
    fn outputs(parameters: &Parameters, clock: Clock, _: &NoInputs, _: &[f64; 0], (): &()) -> Setpoint {
        parameters.reference.at(clock.time)
    }
    fn output_rates(parameters: &Parameters, time: f64) -> Option<Setpoint> {
        let Setpoint { setpoint_velocity, setpoint_acceleration, .. } = parameters.reference.at(time);
        Some(Setpoint {
            setpoint: setpoint_velocity,
            setpoint_velocity: setpoint_acceleration,
            setpoint_acceleration: 0.0,
        })
    }
    fn left_range(_: &Parameters, _: &Self::Inputs, _: &[f64; 0]) -> Option<&'static str> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_setpoint() {
        let cases = [(0.0, 0.15, 0.03, 0.05), (0.2, 0.05, 0.05, 0.05), (0.0, 0.01, 0.5, 0.2)];
        for (start, target, velocity, acceleration) in cases {
            let reference = Reference { start, target, velocity, acceleration, start_time: 0.5 };
            let h = 1e-6;
            for k in 0..1000 {
                let t = 0.0037 + f64::from(k) * 0.01;
                let (before, now, after) = (reference.at(t - h), reference.at(t), reference.at(t + h));
                let velocity = (after.setpoint - before.setpoint) / (2.0 * h);
                let slope = (after.setpoint_velocity - before.setpoint_velocity) / (2.0 * h);
                assert!((velocity - now.setpoint_velocity).abs() < 1e-8);
                assert!((slope - now.setpoint_acceleration).abs() < 1e-6);
                assert!(now.setpoint_velocity.abs() <= reference.velocity + 1e-15);
            }
            assert_eq!(reference.at(0.5 + reference.duration()).setpoint, target);
        }
    }

    #[test]
    fn no_way_is_no_motion() {
        let rest = Reference { target: 0.0, ..Reference::default() };
        assert_eq!(rest.at(1.0), Setpoint::default());
    }
}
