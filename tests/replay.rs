//! A replay of what a simulated experiment recorded gives back what the experiment did, whatever effect was in it.

use sinew::effects::{Description, Effects};
use sinew::measurement::{Recording, Signal};
use sinew::model::Simulator;
use sinew::parameters::Parameters;
use sinew::plant::{ActuatorInputs, PneumaticActuator, PneumaticMuscle, steady_pressure};
use sinew::simulation::replay;
use std::fmt::Write;
use std::path::Path;

const STEP: f64 = 5e-3;
const SAMPLES: usize = 1600;
const AT_REST: usize = 20;

/// An effect in one of its forms with all its refinements.
fn with_effect(effect: &Description, form: usize) -> Parameters {
    let mut parameters = Parameters::default();
    for (name, starts) in effect.all_forms().nth(form).unwrap().iter().chain(effect.refinements) {
        parameters.set(name, starts[0]).unwrap();
    }
    parameters
}

/// At rest at first: a replay starts from the mean of the first pressures.
fn command(k: usize) -> f64 {
    1.6 + 0.6 * (1.9 * STEP * k.saturating_sub(AT_REST) as f64).sin()
}

fn parse(text: &str) -> Recording {
    Recording::parse(text.as_bytes(), Path::new("simulated.csv"), &[]).unwrap()
}

/// Largest difference of a signal from what a replay gives, but for the end, where a delay has nothing to show yet.
fn difference(parameters: &Parameters, recording: &Recording, signal: Signal) -> f64 {
    let replayed = replay(parameters, recording).unwrap();
    let (simulated, measured) = (replayed.get(signal).unwrap(), recording.get(signal).unwrap());
    largest_difference(&measured[..SAMPLES - 20], simulated)
}

fn largest_difference(some: &[f64], others: &[f64]) -> f64 {
    some.iter().zip(others).fold(0.0, |largest, (one, other)| (one - other).abs().max(largest))
}

/// Every effect, in every form.
fn cases() -> impl Iterator<Item = (&'static Description, Parameters)> {
    Effects::DESCRIPTIONS
        .iter()
        .flat_map(|effect| (0..effect.all_forms().count()).map(move |form| (effect, with_effect(effect, form))))
}

#[test]
fn a_hanging_load_is_replayed() {
    for (effect, mut parameters) in cases() {
        let mut text = "time [s],command [V],gauge_pressure [Pa],contraction [m],force [N],load_mass [kg]\n".to_owned();
        parameters.initial.gauge_pressure = steady_pressure(&parameters, command(0), 0.05);
        let mut muscle = Simulator::<PneumaticMuscle>::new(parameters);
        muscle.inputs.command = command(0);
        muscle.initialize(0.0).unwrap();
        for k in 0..SAMPLES {
            let (time, out) = (STEP * k as f64, muscle.outputs());
            let (p, x, force) = (out.measured_gauge_pressure, out.measured_contraction, out.measured_force);
            writeln!(text, "{time},{},{p},{x},{force},20", command(k)).unwrap();
            muscle.inputs.command = command(k);
            muscle.slopes.command = (command(k + 1) - command(k)) / STEP;
            muscle.advance(STEP).unwrap();
        }
        let recording = parse(&text);
        for (signal, close) in [(Signal::GaugePressure, 150.0), (Signal::Contraction, 2e-4), (Signal::Force, 0.4)] {
            let difference = difference(&parameters, &recording, signal);
            assert!(difference < close, "{} {signal:?} {difference}", effect.name);
        }
    }
}

/// Where a command rests, a replay takes samples from within longer steps: it comes to the same as from sample to sample.
#[test]
fn a_command_that_rests_is_replayed_as_one_that_does_not() {
    let stairs = |k: usize| 1.2 + 0.35 * ((k / 150) as f64 * 2.1).sin();
    for (effect, parameters) in cases() {
        let replayed = |off: f64| {
            let mut text = "time [s],command [V],gauge_pressure [Pa],contraction [m],load_mass [kg]\n".to_owned();
            for k in 0..SAMPLES {
                let command = stairs(k) + if k % 2 == 0 { off } else { 0.0 };
                writeln!(text, "{},{command},120000,0.1,20", STEP * k as f64).unwrap();
            }
            replay(&parameters, &parse(&text)).unwrap()
        };
        let (long, short) = (replayed(0.0), replayed(1e-13));
        for (signal, close) in [(Signal::GaugePressure, 0.2), (Signal::Contraction, 2e-7), (Signal::Force, 1e-3)] {
            let difference = largest_difference(long.get(signal).unwrap(), short.get(signal).unwrap());
            assert!(difference < close, "{} {signal:?} {difference}", effect.name);
        }
    }
}

#[test]
fn a_prescribed_motion_is_replayed() {
    // At rest at first, too, and gently out of it: a limited flow lets the pressure follow the motion.
    let motion = |time: f64| {
        let since = (time - STEP * AT_REST as f64).max(0.0);
        let gone = 1.0 - (-since).exp();
        let phase = 2.3 * (since - gone);
        (0.09 - 0.04 * phase.cos(), 0.04 * 2.3 * gone * phase.sin())
    };
    for (effect, mut parameters) in cases().filter(|(effect, _)| !effect.of_load) {
        let header = "gauge_pressure [Pa],contraction [m],force [N]\n";
        let (mut with_command, mut without) = (format!("time [s],command [V],{header}"), format!("time [s],{header}"));
        parameters.initial.gauge_pressure = steady_pressure(&parameters, command(0), motion(0.0).0);
        let mut muscle = Simulator::<PneumaticActuator>::new(parameters);
        let inputs = |k: usize| {
            let (contraction, contraction_velocity) = motion(STEP * k as f64);
            ActuatorInputs { command: command(k), contraction, contraction_velocity }
        };
        muscle.inputs = inputs(0);
        muscle.initialize(0.0).unwrap();
        for k in 0..SAMPLES {
            muscle.inputs = inputs(k);
            let (time, out) = (STEP * k as f64, muscle.outputs());
            let row = format!("{},{},{}", out.measured_gauge_pressure, out.measured_contraction, out.measured_force);
            writeln!(with_command, "{time},{},{row}", command(k)).unwrap();
            writeln!(without, "{time},{row}").unwrap();
            let (now, next) = (inputs(k), inputs(k + 1));
            muscle.slopes = ActuatorInputs {
                command: (next.command - now.command) / STEP,
                contraction: (next.contraction - now.contraction) / STEP,
                contraction_velocity: (next.contraction_velocity - now.contraction_velocity) / STEP,
            };
            muscle.advance(STEP).unwrap();
        }
        for (text, close) in [(with_command, 1.5), (without, 0.6)] {
            let difference = difference(&parameters, &parse(&text), Signal::Force);
            assert!(difference < close, "{} {difference} N", effect.name);
        }
    }
}

#[test]
fn a_motion_beyond_the_threads_is_refused_with_its_file() {
    let rows = (0..200).fold("time [s],command [V],contraction [m],force [N]\n".to_owned(), |mut text, k| {
        writeln!(text, "{},{},{},300", STEP * f64::from(k), 1.5, -0.02 - 1e-3 * f64::from(k)).unwrap();
        text
    });
    for preset in ["dmsp-40-1000", "dmsp-40-1000/improved-mckibben"] {
        let refused = replay(&Parameters::load(preset).unwrap(), &parse(&rows)).unwrap_err().to_string();
        assert!(refused.contains("simulated.csv") && refused.contains("muscle.contraction"), "{refused}");
    }
}
