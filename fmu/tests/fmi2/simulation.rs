//! Steps, derivatives, and what happens when the model cannot go on.

use crate::host::{Api, Fmu, call};
use sinew::parameters::Parameters;
use sinew_fmu::log::Status;
use std::ptr;

const END: f64 = 2.0;

/// Ends of the steps from 0 to `END`: at multiples of the step, or uneven where it is zero.
fn grid(step: f64) -> Vec<f64> {
    let uneven = |k: u32| 0.01 * f64::from(k) + 0.004 * (1.7 * f64::from(k)).sin();
    match step {
        0.0 => (1..(END * 100.0) as u32).map(uneven).chain([END]).collect(),
        _ => (1..=(END / step).round() as u32).map(|k| f64::from(k) * step).collect(),
    }
}

/// Outputs at the end, after `before_step` was called before each step with its start and length.
fn outputs_after(steps: &[f64], mut before_step: impl FnMut(&mut Fmu, f64, f64)) -> Vec<f64> {
    let mut parameters = Parameters::default();
    parameters.set("initial.gauge_pressure", 2e5).unwrap();
    let mut fmu = Fmu::start("PneumaticMuscle", &parameters);
    let mut time = 0.0;
    for &end in steps {
        before_step(&mut fmu, time, end - time);
        assert_eq!(fmu.step(time, end - time), Status::Ok, "{}", fmu.last_message());
        time = end;
    }
    fmu.outputs()
}

fn assert_close(values: &[f64], expected: &[f64], tolerance: f64) {
    for (value, expected) in values.iter().zip(expected) {
        // Velocities end near zero: the usual size of 0.1 m/s is then what counts.
        assert!((value - expected).abs() <= tolerance * expected.abs().max(0.1), "{value} is not {expected}");
    }
}

#[test]
fn the_result_does_not_depend_on_the_step_while_inputs_are_held() {
    let held = |step| outputs_after(&grid(step), |fmu, _, _| assert_eq!(fmu.set("valve.command", 3.0), Status::Ok));
    let expected = held(1e-4);
    for step in [1e-3, 1e-2, 0.0] {
        assert_close(&held(step), &expected, 1e-6);
    }
}

#[test]
fn the_result_does_not_depend_on_the_step_while_inputs_are_interpolated() {
    let ramp = |step| {
        outputs_after(&grid(step), |fmu, time, _| {
            fmu.set("valve.command", 2.0 + 0.5 * time);
            assert_eq!(fmu.set_slope("valve.command", 0.5), Status::Ok);
        })
    };
    let expected = ramp(1e-4);
    for step in [1e-3, 1e-2, 0.0] {
        assert_close(&ramp(step), &expected, 1e-6);
    }
}

#[test]
fn an_interpolated_input_arrives_where_the_slope_leads_and_stays() {
    let mut fmu = Fmu::start("PneumaticMuscle", &Parameters::default());
    fmu.set_slope("valve.command", 10.0);
    fmu.step(0.0, 0.1);
    assert_eq!(fmu.get("valve.command"), 1.0);
    fmu.step(0.1, 0.1);
    assert_eq!(fmu.get("valve.command"), 1.0);
}

#[test]
fn derivatives_of_outputs_are_differences_in_time() {
    let mut fmu = Fmu::start("PneumaticMuscle", &Parameters::default());
    fmu.set("valve.command", 3.0);
    fmu.step(0.0, 0.05);
    let names = ["muscle.contraction", "muscle.contraction_velocity", "muscle.gauge_pressure", "muscle.force"];
    let (before, slopes, h) = (names.map(|name| fmu.get(name)), names.map(|name| fmu.slope(name)), 1e-6);
    fmu.step(0.05, h);
    for ((name, before), slope) in names.into_iter().zip(before).zip(slopes) {
        let difference = (fmu.get(name) - before) / h;
        assert!((slope - difference).abs() <= 1e-3 * difference.abs(), "{name}: {slope} is not {difference}");
    }
}

/// Checks a partial derivative against a difference of `fmi2GetReal` after `fmi2SetReal`.
fn check_partial_derivative(fmu: &mut Fmu, output: &str, known: &str, change: f64) {
    let here = fmu.get(known);
    let mut output_at = |value| {
        assert_eq!(fmu.set(known, value), Status::Ok);
        fmu.get(output)
    };
    let difference = (output_at(here + change) - output_at(here - change)) / (2.0 * change);
    output_at(here);
    let derivative = fmu.partial_derivative(output, known);
    let size = difference.abs().max(1e-6);
    assert!((derivative - difference).abs() <= 1e-4 * size, "d{output}/d{known}: {derivative} is not {difference}");
}

#[test]
fn directional_derivatives_are_differences() {
    let mut fmu = Fmu::start("PneumaticActuator", &Parameters::default());
    fmu.set("valve.command", 3.0);
    fmu.set("muscle.contraction", 0.1);
    fmu.step(0.0, 0.3);
    for known in ["muscle.contraction", "muscle.contraction_velocity", "valve.command", "muscle.damping"] {
        for output in ["muscle.force", "measured.contraction", "muscle.gauge_pressure"] {
            check_partial_derivative(&mut fmu, output, known, 1e-4);
        }
    }

    let mut fmu = Fmu::start("PidFeedForward", &Parameters::default());
    fmu.set("setpoint", 0.1);
    fmu.set("measured_contraction", 0.099);
    for known in ["setpoint", "setpoint_velocity", "setpoint_acceleration", "measured_contraction"] {
        for output in ["command", "feed_forward", "control_error"] {
            check_partial_derivative(&mut fmu, output, known, 1e-5);
        }
    }
}

#[test]
fn a_direction_adds_up_its_partial_derivatives() {
    let mut fmu = Fmu::start("PneumaticActuator", &Parameters::default());
    fmu.set("muscle.contraction", 0.1);
    let knowns = ["muscle.contraction", "muscle.contraction_velocity"];
    let references = knowns.map(|name| fmu.reference(name));
    let (output, changes, mut change) = (fmu.reference("muscle.force"), [0.5, -2.0], 0.0);
    let status =
        call!(fmu, fmi2GetDirectionalDerivative, &output, 1, references.as_ptr(), 2, changes.as_ptr(), &mut change);
    assert_eq!(status, Status::Ok);
    let partial = knowns.map(|name| fmu.partial_derivative("muscle.force", name));
    assert_eq!(change, 0.5 * partial[0] - 2.0 * partial[1]);
}

#[test]
fn at_the_start_the_equilibrium_follows_the_parameters() {
    let mut fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    assert_eq!(call!(fmu, fmi2SetupExperiment, 0, 0.0, 0.0, 0, 0.0), Status::Ok);
    assert_eq!(call!(fmu, fmi2EnterInitializationMode), Status::Ok);
    fmu.set("initial.gauge_pressure", 2e5);
    check_partial_derivative(&mut fmu, "muscle.contraction", "load.mass", 1e-2);
    check_partial_derivative(&mut fmu, "muscle.contraction", "initial.gauge_pressure", 100.0);
}

#[test]
fn a_diverged_step_leaves_the_last_good_state() {
    let mut fmu = Fmu::start("PneumaticMuscle", &Parameters::default());
    fmu.set("valve.command", 2.0);
    assert_eq!(fmu.step(0.0, 0.1), Status::Ok);
    let (good, mut state) = (fmu.outputs(), ptr::null_mut());
    assert_eq!(call!(fmu, fmi2GetFMUstate, &mut state), Status::Ok);
    fmu.set("load.external_force", -1e9);
    fmu.messages.take();
    assert_eq!(fmu.step(0.1, 0.1), Status::Discard);
    let (status, category, text) = fmu.messages.take().remove(0);
    assert_eq!((status, category.as_str()), (Status::Discard, "logStatusError"));
    assert!(text.starts_with("fmi2DoStep: the simulation diverged by "), "{text}");
    assert!(text.ends_with("the values of the last good step can still be read"), "{text}");

    assert_eq!(fmu.outputs(), good);
    let (mut time, mut ended, mut last) = (0.0, 1, Status::Ok);
    assert_eq!(call!(fmu, fmi2GetRealStatus, 2, &mut time), Status::Ok);
    assert_eq!(call!(fmu, fmi2GetBooleanStatus, 3, &mut ended), Status::Ok);
    assert_eq!(call!(fmu, fmi2GetStatus, 0, &mut last), Status::Ok);
    assert_eq!((time, ended, last), (0.1, 0, Status::Discard));
    assert_eq!(fmu.step(0.1, 0.1), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2DoStep: not allowed while the instance is stopped by a failed step");

    assert_eq!(call!(fmu, fmi2SetFMUstate, state), Status::Ok);
    assert_eq!(fmu.step(0.1, 0.1), Status::Ok);
    assert_eq!(call!(fmu, fmi2FreeFMUstate, &mut state), Status::Ok);
    assert_eq!(call!(fmu, fmi2Terminate), Status::Ok);
    fmu.outputs();
}

#[test]
fn a_start_that_does_not_exist_can_be_repaired() {
    let mut fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    fmu.set("load.mass", 1e5);
    assert_eq!(call!(fmu, fmi2SetupExperiment, 0, 0.0, 0.0, 0, 0.0), Status::Ok);
    assert_eq!(call!(fmu, fmi2EnterInitializationMode), Status::Ok);
    assert_eq!(fmu.try_get("muscle.contraction"), Err(Status::Error));
    assert!(fmu.last_message().starts_with("fmi2GetReal: no length of the muscle holds 100000 kg"));
    assert_eq!(call!(fmu, fmi2ExitInitializationMode), Status::Error);
    assert_eq!(fmu.set("load.mass", 30.0), Status::Ok);
    assert_eq!(call!(fmu, fmi2ExitInitializationMode), Status::Ok);
    assert_eq!(fmu.step(0.0, 0.1), Status::Ok);
}

#[test]
fn outputs_are_right_in_initialization_mode_and_follow_inputs_at_once() {
    let fmu = Fmu::instantiate(Api::linked(), "ReferenceTrajectory", &Parameters::default());
    assert_eq!(call!(fmu, fmi2SetupExperiment, 0, 0.0, 1.0, 0, 0.0), Status::Ok);
    assert_eq!(call!(fmu, fmi2EnterInitializationMode), Status::Ok);
    assert!(fmu.get("setpoint") > 0.01);

    let mut fmu = Fmu::start("PneumaticActuator", &Parameters::default());
    assert_eq!(fmu.get("measured.contraction"), 0.0);
    fmu.set("muscle.contraction", 0.1);
    assert_eq!(fmu.get("measured.contraction"), 0.1);
}

#[test]
fn the_clock_is_that_of_the_host() {
    let mut fmu = Fmu::start("ReferenceTrajectory", &Parameters::default());
    let (mut time, h) = (0.0, 0.1);
    for k in 1..=10_000_u32 {
        assert_eq!(fmu.step(time, h), Status::Ok, "{}", fmu.last_message());
        time = f64::from(k) * h; // not a running sum, as in many hosts
    }
    let mut reached = 0.0;
    assert_eq!(call!(fmu, fmi2GetRealStatus, 2, &mut reached), Status::Ok);
    assert!((reached - 1000.0).abs() < 1e-12 * 1000.0);
}

#[test]
fn ten_instances_in_several_threads_are_as_one_after_the_other() {
    let run = |index: u32| {
        let mut parameters = Parameters::default();
        parameters.set("load.mass", 20.0 + f64::from(index)).unwrap();
        let mut fmu = Fmu::start("PneumaticMuscle", &parameters);
        fmu.set("valve.command", 2.0);
        (0..300).for_each(|k| assert_eq!(fmu.step(f64::from(k) * 1e-3, 1e-3), Status::Ok));
        fmu.outputs()
    };
    let serial: Vec<_> = (0..10).map(run).collect();
    let parallel: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..10).map(|index| scope.spawn(move || run(index))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(parallel, serial);
}
