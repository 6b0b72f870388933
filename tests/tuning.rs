//! The tuning of the controller: its linearisation, its margins, and what the loop does with the gains.

use sinew::GRAVITY;
use sinew::closed_loop::{LIMIT_CYCLE, SETTLED, Unknown, cases, outcome, outcomes, random_plants, unknown_plants};
use sinew::controller::{ControllerInputs, PidFeedForward, can_hold};
use sinew::model::Simulator;
use sinew::muscle::ForceModelName;
use sinew::parameters::Parameters;
use sinew::plant::{PneumaticMuscle, holding_pressure};
use sinew::tuning::linear::{LinearPlant, Margins, closed_loop_poles, roots, step_response};
use sinew::tuning::{OperatingPoint, Placement, SENSITIVITY_BOUND, Tuning, files, operating_points, tune, uncertain};
use std::path::Path;
use std::sync::LazyLock;

const PRESETS: [&str; 2] = ["dmsp-40-1000", "dmsp-40-290"];
const LOADS: [f64; 3] = [20.0, 40.0, 80.0];

fn preset(name: &str) -> Parameters {
    Parameters::preset(name).unwrap()
}

static TUNINGS: LazyLock<Vec<Tuning>> =
    LazyLock::new(|| PRESETS.iter().map(|name| tune(&preset(name), &LOADS).unwrap()).collect());

#[test]
fn roots_are_those_of_a_product() {
    // (s + 1)(s + 200)(s² + 2 s + 26)
    let polynomial = [5200.0, 5626.0, 628.0, 203.0, 1.0];
    let found = roots(&polynomial);
    assert_eq!(found.len(), 4);
    for (re, im) in [(-200.0, 0.0), (-1.0, -5.0), (-1.0, 0.0), (-1.0, 5.0)] {
        // Their order is that of rounding: three real parts are equal.
        let near = found.iter().filter(|root| (root.re - re).abs() < 1e-8 && (root.im - im).abs() < 1e-8);
        assert_eq!(near.count(), 1, "{re} {im}: {found:?}");
    }
}

#[test]
fn linearisation_is_that_of_the_closed_form() {
    for (name, area, elastic) in [
        ("dmsp-40-1000", [0.0091, -0.0266], [-113.29, -8808.9, 5.2111e4, -1.0067e5]),
        ("dmsp-40-290", [0.0106, -0.1213], [-443.99, -2.9035e4, 7.3168e5, -6.19051e6]),
    ] {
        let parameters = preset(name);
        for OperatingPoint { mass, contraction: x } in operating_points(&parameters, &LOADS) {
            let plant = OperatingPoint { mass, contraction: x }.plant(&parameters);
            let a = area[0] + area[1] * x;
            let force = elastic[0] + x * (elastic[1] + x * (elastic[2] + x * elastic[3]));
            let pressure = (mass * GRAVITY - force) / a;
            let stiffness = -(pressure * area[1] + elastic[1] + x * (2.0 * elastic[2] + x * 3.0 * elastic[3]));
            let bandwidth = 2.5 * std::f64::consts::TAU;
            let wanted = [
                [-bandwidth, 0.0, 0.0],
                [0.0, 0.0, 1.0],
                [a / mass, -stiffness / mass, -parameters.muscle.damping / mass],
            ];
            for (is, should) in plant.rates.iter().flatten().zip(wanted.iter().flatten()) {
                assert!((is - should).abs() <= 1e-6 * should.abs() + 1e-9, "{name}, {mass} kg, {x} m: {is} {should}");
            }
            assert!((plant.input / (bandwidth * 1e5) - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn linear_and_full_plant_answer_a_small_step_alike() {
    let mut parameters = preset("dmsp-40-1000/improved-mckibben");
    parameters.load.mass = 40.0;
    parameters.initial.gauge_pressure = holding_pressure(&parameters, 0.1, 40.0 * GRAVITY);
    let mut muscle = Simulator::<PneumaticMuscle>::new(parameters);
    muscle.initialize(0.0).unwrap();
    let start = muscle.outputs().contraction;
    let plant = LinearPlant::at(&parameters, start);
    let step = 1e-4;
    muscle.inputs.command = parameters.initial.gauge_pressure / parameters.valve.gain + step;
    let times: Vec<f64> = (1..=200).map(|k| 0.01 * f64::from(k)).collect();
    let linear = step_response(&[plant.gain()], &plant.denominator(), &times);
    let largest = linear.iter().fold(0.0_f64, |largest, way| largest.max(way.abs()));
    for way in linear {
        muscle.advance(0.01).unwrap();
        let full = (muscle.outputs().contraction - start) / step;
        assert!((full - way).abs() < 1e-3 * largest, "{full} {way}");
    }
}

#[test]
fn poles_are_where_they_were_placed() {
    let parameters = preset("dmsp-40-1000");
    let plant = OperatingPoint { mass: 40.0, contraction: 0.1 }.plant(&parameters);
    let placement = Placement { natural_frequency: 9.0, damping_ratio: 0.3, other_product: 20.0 };
    let mut controller = placement.controller(&plant, &parameters.controller);
    controller.filter_time_constant = 1e-5;
    let poles = closed_loop_poles(&plant, &controller, 1.0);
    let wanted = nalgebra::Complex::new(-2.7, 9.0 * (1.0_f64 - 0.09).sqrt());
    let nearest = poles.iter().map(|pole| (pole - wanted).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 0.01, "{poles:?}");
}

#[test]
fn gains_of_the_presets_are_the_tuned_ones() {
    for (name, tuning) in PRESETS.iter().zip(TUNINGS.iter()) {
        let (is, tuned) = (preset(name).controller, tuning.parameters.controller);
        println!("{name}: {tuned:?}");
        let near = |is: f64, tuned: f64, scale: f64| (is - tuned).abs() < 0.05 * scale;
        assert!(near(is.integral_gain, tuned.integral_gain, tuned.integral_gain));
        assert!(near(is.derivative_gain, tuned.derivative_gain, tuned.derivative_gain));
        // Small in what it does: its share of the command at the resonance.
        let plant = tuning.design.plant(&preset(name));
        let share = tuned.derivative_gain * plant.natural_frequency();
        assert!(near(is.proportional_gain, tuned.proportional_gain, share));
    }
}

#[test]
fn no_plant_exceeds_the_bound() {
    for (name, tuning) in PRESETS.iter().zip(TUNINGS.iter()) {
        for parameters in [tuning.parameters, preset(name)] {
            let mut peak = 0.0_f64;
            for point in operating_points(&parameters, &LOADS) {
                for plant in uncertain(&parameters, &point) {
                    let margins = Margins::of(&plant, &parameters.controller);
                    assert!(margins.is_stable(), "{name}, {point:?}");
                    peak = peak.max(margins.sensitivity);
                }
            }
            println!("{name}: sensitivity peak {peak:.3}");
            assert!(peak < 1.01 * SENSITIVITY_BOUND);
        }
    }
}

/// The gains of the other force models are tuned ones, too: `presets/gains.toml`.
#[test]
fn gains_of_every_force_model_hold_what_the_muscle_can_hold() {
    let mut peak = 0.0_f64;
    for muscle in PRESETS {
        for model in ForceModelName::CHOICES.iter().map(|choice| choice.name) {
            // No gains hold 80 kg on this short spring over the whole range.
            if (muscle, model) == ("dmsp-40-290", "spring") {
                continue;
            }
            let parameters = preset(&format!("{muscle}/{model}"));
            for point in operating_points(&parameters, &LOADS) {
                let mut loaded = parameters;
                loaded.load.mass = point.mass;
                if can_hold(&loaded, point.contraction) {
                    let margins = Margins::of(&point.plant(&parameters), &parameters.controller);
                    assert!(margins.is_stable(), "{muscle}/{model}, {point:?}");
                    peak = peak.max(margins.sensitivity);
                }
            }
        }
    }
    println!("sensitivity peak on the known plants, over all force models: {peak:.3}");
    assert!(peak < 1.01 * SENSITIVITY_BOUND);
    let printed = |name: &str| preset(name).controller;
    assert_eq!(printed("dmsp-40-1000/thesis/mckibben"), printed("dmsp-40-1000/thesis"));
}

#[test]
fn margins_are_where_the_loop_becomes_unstable() {
    for tuning in TUNINGS.iter() {
        let (parameters, controller) = (&tuning.parameters, &tuning.parameters.controller);
        for point in operating_points(parameters, &LOADS) {
            let plant = point.plant(parameters);
            let margins = Margins::of(&plant, controller);
            let stable = |plant: &LinearPlant, factor: f64| {
                closed_loop_poles(plant, controller, factor).iter().all(|pole| pole.re < 0.0)
            };
            assert!(
                stable(&plant, 0.99 * margins.gain) && !stable(&plant, 1.01 * margins.gain),
                "{point:?} {margins:?}"
            );
            // Beyond that the dead time is longer than Padé of second order describes.
            if margins.delay * margins.peak_frequency < 1.0 {
                let late = |share: f64| plant.delayed(share * margins.delay);
                assert!(stable(&late(0.97), 1.0) && !stable(&late(1.03), 1.0), "{point:?} {margins:?}");
            }
        }
    }
}

#[test]
fn what_cannot_be_tuned_is_said() {
    // An ideal McKibben muscle whose membrane pushes it out of every position.
    let mut parameters = preset("dmsp-40-1000");
    parameters.force_models.virtual_area.elastic_1 = 2e4;
    let message = tune(&parameters, &LOADS).unwrap_err().to_string();
    assert!(message.contains("holds no position"), "{message}");
}

#[test]
fn what_cannot_be_held_is_left_out_of_the_tuning() {
    let parameters = preset("dmsp-40-1000");
    for (mass, expected) in [(1e9, "`load.mass` is 1000000000 kg"), (1e5, "holds 100000 kg nowhere")] {
        let message = tune(&parameters, &[20.0, mass]).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    // At 20 cm this load needs more than the 10 V that the controller may give.
    let tuning = tune(&parameters, &[400.0]).unwrap();
    assert_eq!((tuning.margins.len() + tuning.out_of_reach, tuning.out_of_reach > 0), (7, true));
    let furthest = tuning.margins.iter().map(|m| m.point.contraction).fold(0.0, f64::max);
    assert!(holding_pressure(&parameters, furthest, 400.0 * GRAVITY) <= 1e6);
    // This model holds these loads in the first third of the range only.
    let tuning = tune(&preset("dmsp-40-1000/tondu-lopez-kq"), &LOADS).unwrap();
    assert!(tuning.out_of_reach > 0 && tuning.gain_of_scheduling() >= 1.0);
}

#[test]
fn dry_friction_of_the_force_model_is_not_taken_for_damping() {
    for muscle in PRESETS {
        let mut parameters = preset(&format!("{muscle}/tondu-lopez-friction"));
        let case = cases().into_iter().find(|case| case.muscle == muscle).unwrap();
        let slipping = OperatingPoint { mass: case.mass, contraction: 0.02 }.plant(&parameters);
        parameters.force_models.tondu_lopez_friction.friction = 0.0;
        let without = OperatingPoint { mass: case.mass, contraction: 0.02 }.plant(&parameters);
        assert!((slipping.rates[2][2] / without.rates[2][2] - 1.0).abs() < 1e-3, "{slipping:?} {without:?}");
        let tuned = tune(&preset(&format!("{muscle}/tondu-lopez-friction")), &LOADS).unwrap().parameters;
        let outcome = outcome(&tuned, &case, &Unknown::default()).unwrap();
        println!("{muscle}: {:?} {outcome:?}", tuned.controller);
        // The integral hunts about a load that sticks by itself; that is no instability.
        assert!(outcome.left < SETTLED && outcome.largest_error < 3e-3, "{outcome:?}");
    }
}

#[test]
fn an_extended_muscle_is_tuned_as_it_is() {
    for (effect, values) in [
        ("series_elasticity", &[("load_compliance", 5e-6)][..]),
        ("valve_lag", &[("second_time_constant", 0.05)]),
        ("valve_resonance", &[("natural_frequency", 30.0), ("damping_ratio", 0.5)]),
        ("leakage", &[("rate", 0.3)]),
        ("viscous_damping", &[("contraction", 200.0), ("extension", 200.0)]),
    ] {
        let mut parameters = preset("dmsp-40-1000");
        values.iter().for_each(|(name, value)| parameters.set(&format!("{effect}.{name}"), *value).unwrap());
        let tuning = tune(&parameters, &LOADS).unwrap_or_else(|refused| panic!("{effect}: {refused}"));
        for case in cases().into_iter().filter(|case| case.muscle == "dmsp-40-1000") {
            let outcome = outcome(&tuning.parameters, &case, &Unknown::default()).unwrap();
            println!("{effect}, {} kg: {outcome:?}", case.mass);
            assert!(outcome.left < SETTLED && outcome.swing < LIMIT_CYCLE, "{effect}, {} kg: {outcome:?}", case.mass);
        }
    }
}

#[test]
fn the_tuned_loop_meets_the_bar_in_all_18_cases() {
    let outcomes = outcomes(Parameters::preset, &Unknown::default()).unwrap();
    let worst = outcomes.iter().map(|outcome| outcome.largest_error).fold(0.0, f64::max);
    println!("worst error {:.3} mm", 1e3 * worst);
    assert!(worst < 0.5e-3 && outcomes.iter().all(|outcome| outcome.holds()));
}

#[test]
fn the_tuned_loop_holds_on_plants_that_it_does_not_know() {
    let together = unknown_plants().into_iter().filter(|(name, _)| name.starts_with("all together"));
    for (name, unknown) in together {
        for outcome in outcomes(Parameters::preset, &unknown).unwrap() {
            assert!(outcome.left < SETTLED && outcome.swing < LIMIT_CYCLE, "{name}: {outcome:?}");
        }
    }
}

#[test]
fn a_limit_cycle_and_a_lost_plant_are_seen() {
    let wild = |gain: f64| {
        move |muscle: &'static str| {
            let mut parameters = Parameters::preset(muscle)?;
            parameters.controller.integral_gain *= gain;
            Ok(parameters)
        }
    };
    let held = |gain: f64| outcomes(wild(gain), &Unknown::default()).unwrap().iter().filter(|o| o.holds()).count();
    assert_eq!((held(1.0), held(20.0)), (18, 0));
}

#[test]
fn same_input_same_bytes() {
    let parameters = preset("dmsp-40-1000");
    let made = |tuning: &Tuning| files(tuning, &parameters, "dmsp-40-1000", Path::new("out"));
    assert_eq!(made(&TUNINGS[0]), made(&tune(&parameters, &LOADS).unwrap()));
    let random = || random_plants(6, Parameters::preset).unwrap();
    assert_eq!(random(), random());
}

/// The controller at rest at 10 cm with 40 kg, fed what `contraction` gives for a time and a command.
fn controller(sample_time: f64, change: fn(&mut Parameters)) -> Simulator<PidFeedForward> {
    let mut parameters = preset("dmsp-40-1000");
    parameters.load.mass = 40.0;
    parameters.initial.gauge_pressure = holding_pressure(&parameters, 0.1, 40.0 * GRAVITY);
    parameters.sampling.sample_time = sample_time;
    change(&mut parameters);
    let mut controller = Simulator::<PidFeedForward>::new(parameters);
    controller.inputs.setpoint = 0.1;
    controller.inputs.measured_contraction = 0.1;
    controller
}

#[test]
fn it_starts_without_a_bump() {
    for sample_time in [0.0, 0.01] {
        // Weight and elastic force not fed forward, and the sensor 3 mm off: the integral makes up for it.
        let mut controller = controller(sample_time, |p| (p.feed_forward.gravity, p.feed_forward.elastic) = (0.3, 0.0));
        controller.inputs.measured_contraction = 0.097;
        controller.initialize(0.0).unwrap();
        let wanted = controller.parameters.initial.gauge_pressure / controller.parameters.valve.gain;
        assert!((controller.outputs().command - wanted).abs() < 1e-12);
    }
    // A motion that begins at once is fed forward from the first command on.
    let mut moving = controller(0.0, |_| ());
    moving.inputs.setpoint_acceleration = 0.05;
    moving.initialize(0.0).unwrap();
    let wanted = moving.parameters.initial.gauge_pressure / moving.parameters.valve.gain;
    assert!(moving.outputs().command > wanted + 1e-3);
}

/// Whichever force model is chosen: the pressure that is fed forward pulls as the reference needs, by the model's own
/// force, and the valve that gets the command has that pressure.
#[test]
fn the_feed_forward_inverts_every_force_model() {
    for (name, muscle) in PRESETS.iter().flat_map(|muscle| {
        ForceModelName::CHOICES.iter().map(move |choice| (format!("{muscle}/{}", choice.name), muscle))
    }) {
        let stroke = if *muscle == PRESETS[0] { 0.12 } else { 0.035 };
        let mut parameters = preset(&name);
        parameters.load.mass = 40.0;
        let fed = |x: f64, v: f64, a: f64, lag: f64, elastic: f64| {
            let mut parameters = parameters;
            (parameters.feed_forward.valve_lag, parameters.feed_forward.elastic) = (lag, elastic);
            let mut controller = Simulator::<PidFeedForward>::new(parameters);
            controller.initialize(0.0).unwrap();
            controller.inputs = ControllerInputs {
                setpoint: x,
                setpoint_velocity: v,
                setpoint_acceleration: a,
                measured_contraction: x,
            };
            controller.outputs().feed_forward
        };
        let Parameters { muscle, force_models, valve, .. } = parameters;
        let mut reached = 0;
        for x in [0.1, 0.3, 0.5, 0.7, 1.0].map(|share| share * stroke) {
            let pressure = valve.gain * fed(x, 0.03, 0.05, 0.0, 1.0);
            if pressure >= valve.gain * parameters.controller.maximum_command {
                continue; // only `tondu-lopez-kq`, which cannot hold this load there
            }
            reached += 1;
            let wanted = 40.0 * (GRAVITY + 0.05) + muscle.damping * 0.03;
            let pull = force_models.force(&muscle, pressure, x);
            assert!((pull - wanted).abs() < 1e-6 * wanted, "{name} at {x} m: {pull} N instead of {wanted} N");
            // Without the elastic part it is the pull of the pressure alone.
            let pressure = valve.gain * fed(x, 0.03, 0.05, 0.0, 0.0);
            let of_pressure = force_models.pressure_force(&muscle, pressure, x);
            assert!((of_pressure - wanted).abs() < 1e-6 * wanted, "{name} at {x} m: {of_pressure} N");
            // The valve's lag: one more time constant ahead along the reference, here at constant velocity.
            let (v, h) = (0.03, 1e-3);
            let along = |time: f64| fed(x + v * time, v, 0.0, 0.0, 1.0);
            let slope = (8.0 * (along(h) - along(-h)) - (along(2.0 * h) - along(-2.0 * h))) / (12.0 * h);
            let led = along(0.0) + slope / valve.bandwidth;
            assert!((fed(x, v, 0.0, 1.0, 1.0) - led).abs() < 1e-6, "{name} at {x} m");
        }
        assert!(reached >= if name.ends_with("kq") { 1 } else { 5 }, "{name}: {reached}");
    }
}

#[test]
fn a_setpoint_out_of_reach_asks_for_the_highest_pressure_and_is_forgotten() {
    let mut controller = controller(0.0, |_| ());
    let mut muscle = Simulator::<PneumaticMuscle>::new(controller.parameters);
    muscle.initialize(0.0).unwrap();
    controller.initialize(0.0).unwrap();
    let mut left = 0.0_f64;
    for k in 0..20_000 {
        // Beyond 34 cm the area of this muscle is negative, so that pressure would push.
        let setpoint = if k < 8000 { 0.5 } else { 0.1 };
        let measured_contraction = muscle.outputs().contraction;
        controller.inputs = ControllerInputs { setpoint, measured_contraction, ..ControllerInputs::default() };
        let outputs = controller.outputs();
        muscle.inputs.command = outputs.command;
        assert!(k >= 8000 || outputs.feed_forward == 10.0, "{outputs:?}");
        controller.advance(1e-3).unwrap();
        muscle.advance(1e-3).unwrap();
        if k >= 13_000 {
            left = left.max((muscle.outputs().contraction - 0.1).abs());
        }
    }
    println!("{:.3} mm left 5 s after a setpoint out of reach", 1e3 * left);
    assert!(left < 1e-3);
}

#[test]
fn a_limited_command_does_not_wind_up() {
    for sample_time in [0.0, 0.005] {
        let mut controller = controller(sample_time, |p| p.controller.maximum_command = 1.8);
        let mut muscle = Simulator::<PneumaticMuscle>::new(controller.parameters);
        muscle.initialize(0.0).unwrap();
        controller.initialize(0.0).unwrap();
        let (mut at_limit, mut left) = (0, 0.0_f64);
        for k in 0..15_000 {
            // For ten seconds the setpoint is out of reach; then it comes back.
            let setpoint = if k < 10_000 { 0.18 } else { 0.1 };
            let measured_contraction = muscle.outputs().contraction;
            controller.inputs = ControllerInputs { setpoint, measured_contraction, ..ControllerInputs::default() };
            muscle.inputs.command = controller.outputs().command;
            at_limit += usize::from(k < 10_000 && muscle.inputs.command >= 1.8);
            controller.advance(1e-3).unwrap();
            muscle.advance(1e-3).unwrap();
            if k >= 13_000 {
                left = left.max((muscle.outputs().contraction - 0.1).abs());
            }
        }
        println!("sample time {sample_time} s: {at_limit} ms at the limit, {:.3} mm left 3 s after it", 1e3 * left);
        assert!(at_limit > 9000 && left < 1e-3);
    }
}

#[test]
fn fast_sampling_comes_to_the_continuous_controller() {
    let command_at_the_end = |sample_time: f64| {
        let mut controller = controller(sample_time, |_| ());
        controller.initialize(0.0).unwrap();
        for k in 0..100 {
            let time = 0.01 * f64::from(k);
            controller.inputs.measured_contraction = 0.1 + 1e-3 * time.sin();
            controller.slopes.measured_contraction = 1e-3 * ((time + 0.01).sin() - time.sin()) / 0.01;
            controller.advance(0.01).unwrap();
        }
        controller.outputs().command
    };
    let continuous = command_at_the_end(0.0);
    let off = [1e-3, 1e-4].map(|sample_time| (command_at_the_end(sample_time) - continuous).abs());
    println!("off by {off:?} V at 1 ms and 0.1 ms");
    assert!(off[0] < 1e-4 && off[1] < 0.2 * off[0]);
}
