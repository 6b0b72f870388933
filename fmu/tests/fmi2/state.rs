//! Saving, restoring, resetting.

use crate::host::{Api, Fmu, call};
use sinew::parameters::Parameters;
use sinew_fmu::fmi2::{fmi2Byte, fmi2FMUstate};
use sinew_fmu::log::Status;
use std::ptr;

/// Friction, so that the muscle remembers more than pressure and motion.
fn with_friction() -> Parameters {
    let mut parameters = Parameters::default();
    parameters.set("friction_hysteresis.half_width", 40.0).unwrap();
    parameters
}

/// Uneven steps with changing inputs, and all outputs on the way.
fn run(fmu: &mut Fmu, steps: std::ops::Range<u32>) -> Vec<Vec<f64>> {
    let time = |k: u32| 0.007 * f64::from(k) + 0.003 * f64::from(k % 3);
    let on_the_way = steps.map(|k| {
        fmu.set("valve.command", 2.0 + (0.3 * f64::from(k)).sin());
        fmu.set_slope("valve.command", 0.5);
        assert_eq!(fmu.step(time(k), time(k + 1) - time(k)), Status::Ok, "{}", fmu.last_message());
        fmu.outputs()
    });
    on_the_way.collect()
}

fn save(fmu: &Fmu) -> fmi2FMUstate {
    let mut state = ptr::null_mut();
    assert_eq!(call!(fmu, fmi2GetFMUstate, &mut state), Status::Ok);
    state
}

fn serialize(fmu: &Fmu, state: fmi2FMUstate) -> Vec<fmi2Byte> {
    let mut size = 0;
    assert_eq!(call!(fmu, fmi2SerializedFMUstateSize, state, &mut size), Status::Ok);
    let mut bytes = vec![0; size];
    assert_eq!(call!(fmu, fmi2SerializeFMUstate, state, bytes.as_mut_ptr(), size), Status::Ok);
    bytes
}

fn deserialize(fmu: &Fmu, bytes: &[fmi2Byte]) -> Result<fmi2FMUstate, String> {
    let mut state = ptr::null_mut();
    match call!(fmu, fmi2DeSerializeFMUstate, bytes.as_ptr(), bytes.len(), &mut state) {
        Status::Ok => Ok(state),
        _ => Err(fmu.last_message()),
    }
}

fn free(fmu: &Fmu, mut state: fmi2FMUstate) {
    assert_eq!(call!(fmu, fmi2FreeFMUstate, &mut state), Status::Ok);
    assert!(state.is_null());
    assert_eq!(call!(fmu, fmi2FreeFMUstate, &mut state), Status::Ok);
}

#[test]
fn a_restored_run_repeats_bit_for_bit() {
    let mut fmu = Fmu::start("PneumaticMuscle", &with_friction());
    run(&mut fmu, 0..100);
    let state = save(&fmu);
    let first = run(&mut fmu, 100..300);
    assert_eq!(call!(fmu, fmi2SetFMUstate, state), Status::Ok);
    assert_eq!(run(&mut fmu, 100..300), first);
    free(&fmu, state);
}

#[test]
fn another_instance_continues_from_the_bytes() {
    let mut fmu = Fmu::start("PneumaticMuscle", &with_friction());
    run(&mut fmu, 0..100);
    assert_eq!(fmu.set("load.mass", 30.0), Status::Ok);
    let state = save(&fmu);
    let bytes = serialize(&fmu, state);
    let first = run(&mut fmu, 100..300);
    free(&fmu, state);

    let mut other = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    let state = deserialize(&other, &bytes).unwrap();
    assert_eq!(call!(other, fmi2SetFMUstate, state), Status::Ok);
    assert_eq!(other.get("load.mass"), 30.0);
    assert_eq!(run(&mut other, 100..300), first);
    free(&other, state);
}

#[test]
fn a_state_in_initialization_mode_is_complete() {
    let mut fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    assert_eq!(call!(fmu, fmi2SetupExperiment, 0, 0.0, 2.0, 1, 3.0), Status::Ok);
    assert_eq!(call!(fmu, fmi2EnterInitializationMode), Status::Ok);
    assert_eq!(fmu.set("initial.gauge_pressure", 2e5), Status::Ok);
    let state = save(&fmu);
    let at_the_start = fmu.outputs();
    assert_eq!(call!(fmu, fmi2Reset), Status::Ok);
    assert_eq!(call!(fmu, fmi2SetFMUstate, state), Status::Ok);
    assert_eq!(fmu.outputs(), at_the_start);
    assert_eq!(call!(fmu, fmi2ExitInitializationMode), Status::Ok);
    assert_eq!(fmu.step(2.0, 1.5), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2DoStep: the step ends at 3.5 s, beyond the stop time 3 s");
    assert_eq!(fmu.step(2.0, 1.0), Status::Ok);
    free(&fmu, state);
}

#[test]
fn saving_again_uses_the_same_handle() {
    let mut fmu = Fmu::start("PneumaticMuscle", &with_friction());
    let mut state = save(&fmu);
    let handle = state;
    let before = serialize(&fmu, state);
    run(&mut fmu, 0..3);
    assert_eq!(call!(fmu, fmi2GetFMUstate, &mut state), Status::Ok);
    assert_eq!(state, handle);
    assert_ne!(serialize(&fmu, state), before);
    free(&fmu, state);
}

#[test]
fn what_is_no_state_of_this_model_is_refused() {
    let mut fmu = Fmu::start("PneumaticMuscle", &with_friction());
    let other = Fmu::start("PneumaticActuator", &Parameters::default());
    let foreign = save(&other);
    let before = fmu.outputs();
    assert_eq!(call!(fmu, fmi2SetFMUstate, foreign), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2SetFMUstate: the saved state cannot be restored: it is of another model");
    assert_eq!(call!(fmu, fmi2SetFMUstate, ptr::null_mut()), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2SetFMUstate: `FMUstate` is a null pointer");

    let bytes = serialize(&other, foreign);
    let refused = |bytes: &[fmi2Byte]| deserialize(&fmu, bytes).unwrap_err();
    assert!(refused(&bytes).ends_with("it is of another model or version"));
    assert!(refused(&[]).ends_with("it is cut short"));
    assert!(refused(&bytes[1..]).ends_with("it was not written by this FMU"));
    let own = save(&fmu);
    let mut damaged = serialize(&fmu, own);
    damaged[100] ^= 1;
    assert!(refused(&damaged).ends_with("it is damaged"));
    let mut small = [0; 10];
    assert_eq!(call!(fmu, fmi2SerializeFMUstate, own, small.as_mut_ptr(), small.len()), Status::Error);
    assert!(fmu.last_message().ends_with(" bytes, not 10"));

    assert_eq!(fmu.outputs(), before);
    assert_eq!(fmu.step(0.0, 0.01), Status::Ok);
    free(&fmu, own);
    free(&other, foreign);
}

#[test]
fn reset_restores_the_start_values() {
    let mut fmu = Fmu::start("PneumaticMuscle", &with_friction());
    let first = run(&mut fmu, 0..50);
    assert_eq!(fmu.set("load.mass", 50.0), Status::Ok);
    assert_eq!(fmu.set("friction_hysteresis.half_width", 0.0), Status::Ok);
    run(&mut fmu, 50..60);
    assert_eq!(call!(fmu, fmi2Reset), Status::Ok);
    fmu.initialize();
    assert_eq!(fmu.get("load.mass"), 20.0);
    assert_eq!(fmu.get("friction_hysteresis.half_width"), 40.0);
    assert_eq!(fmu.get("valve.command"), 0.0);
    assert_eq!(run(&mut fmu, 0..50), first);
}
