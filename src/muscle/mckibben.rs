use super::{ForceModel, Muscle};
use crate::variables::{Declared, Variable};
use std::f64::consts::PI;

/// Ideal McKibben muscle: a braid of inextensible threads, a cylinder at every length, and nothing else.
///
/// # Model
/// F = −p dV/dL = p (3L² − b²) / (4πn²): L is the length, b `muscle.thread_length`, n `muscle.turns`. There is no
/// elastic force, and no parameter beside the braid's.
///
/// # In the data
/// Far too strong for a FESTO muscle, whose membrane and threads resist both shortening and widening: the missing force
/// depends on the contraction alone, and is there at zero pressure. Loads of several masses, or a force sensor, show it.
///
/// # Validity
/// Cylinder without ends, threads without friction, a bladder without stiffness; L ≤ b. Without pressure it holds
/// nothing, so that a load can hang from it only under pressure; the presets start at 1 bar. The pull ends at
/// L = b/√3, where the threads lie at 54.7° to the axis, and pushes beyond.
///
/// # Reference
/// C.-P. Chou and B. Hannaford (1996), Measurement and modeling of McKibben pneumatic artificial muscles,
/// doi 10.1109/70.481753; thesis eqs. 3.4–3.7 and 4.15. Deviation: the sign of b² in eq. 4.15 (printed +) and the factor of
/// cos² θ in eqs. 3.7 and 4.14 (printed 1 in place of 3) are those of −dV/dL of eq. 3.6.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct McKibben;

impl Declared for McKibben {
    fn visit(&self, _see: &mut dyn FnMut(&'static Variable, f64)) {}
    fn visit_mut(&mut self, _change: &mut dyn FnMut(&'static Variable, f64) -> f64) {}
}

impl ForceModel for McKibben {
    fn virtual_area(&self, muscle: &Muscle, _gauge_pressure: f64, contraction: f64) -> f64 {
        let length = muscle.rest_length - contraction;
        (3.0 * length.powi(2) - muscle.thread_length.powi(2)) / (4.0 * PI * muscle.turns.powi(2))
    }

    fn elastic_force(&self, _muscle: &Muscle, _contraction: f64) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Parameters;

    const PRESETS: [&str; 2] = ["dmsp-40-1000", "dmsp-40-290"];

    fn of(preset: &str, model: &str) -> Parameters {
        Parameters::preset(&format!("{preset}/{model}")).unwrap()
    }

    #[test]
    fn the_area_is_the_change_of_volume() {
        for preset in PRESETS {
            let Parameters { muscle, force_models, .. } = of(preset, "mckibben");
            for k in -5..30 {
                let (x, h) = (muscle.rest_length * 0.012 * f64::from(k), 1e-5 * muscle.rest_length);
                // x = L0 - L, hence dx = -dL.
                let difference = (muscle.volume(x + h) - muscle.volume(x - h)) / (2.0 * h);
                let area = force_models.virtual_area(&muscle, 1e5, x);
                assert!((area - difference).abs() < 1e-8, "{preset} at {x}: {area} {difference}");
            }
        }
    }

    #[test]
    fn limits_are_those_of_a_braid() {
        for preset in PRESETS {
            let Parameters { muscle, force_models, .. } = of(preset, "mckibben");
            let force = |p: f64, x: f64| force_models.force(&muscle, p, x);
            let (b, bore) = (muscle.thread_length, |x: f64| PI / 4.0 * muscle.diameter(x).powi(2));
            assert_eq!(force(0.0, 0.1 * muscle.rest_length), 0.0, "no pressure, no force");
            assert!(force(3e5, muscle.rest_length - b / 3.0_f64.sqrt()).abs() < 1e-9, "no pull at the magic angle");
            // Straight threads: F = p b² / (2πn²).
            let straight = 3e5 * b.powi(2) / (2.0 * PI * muscle.turns.powi(2));
            assert!((force(3e5, muscle.rest_length - b) - straight).abs() < 1e-9 * straight);
            // Chou and Hannaford's form at rest: F = p π D0²/4 (3/tan² θ0 − 1/sin² θ0) (thesis eq. 3.11).
            let angle = (muscle.rest_length / b).acos();
            let at_rest = 3e5 * bore(0.0) * (3.0 / angle.tan().powi(2) - 1.0 / angle.sin().powi(2));
            assert!((force(3e5, 0.0) - at_rest).abs() < 1e-9 * at_rest);
        }
    }

    #[test]
    fn it_is_the_improved_model_without_its_membrane() {
        for preset in PRESETS {
            let ideal = of(preset, "mckibben");
            let mut improved = of(preset, "improved-mckibben");
            (0..4).for_each(|k| improved.set(&format!("improved_mckibben.modulus_{k}"), 0.0).unwrap());
            for k in 0..30 {
                let (p, x) = (2e4 * f64::from(k), 0.01 * ideal.muscle.rest_length * f64::from(k));
                let [a, b] = [ideal, improved].map(|all| all.force_models.force(&all.muscle, p, x));
                assert_eq!(a, b, "{preset} at {p} Pa, {x} m");
            }
        }
    }

    #[test]
    fn a_load_hangs_from_it_where_a_preset_starts() {
        for preset in PRESETS {
            let all = of(preset, "mckibben");
            let x =
                crate::plant::equilibrium(&all, all.initial.gauge_pressure, all.load.mass * crate::GRAVITY).unwrap();
            assert!(x > 0.2 * all.muscle.rest_length && x < 0.36 * all.muscle.rest_length, "{preset}: {x}");
        }
    }
}
