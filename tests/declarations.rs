//! What is declared once must hold everywhere: descriptions, dependencies, effects.

use proptest::prelude::*;
use sinew::effects::{Effects, Freed};
use sinew::model::{Model, Simulator};
use sinew::model_description::model_description;
use sinew::models::models;
use sinew::parameters::Parameters;
use sinew::plant::PneumaticActuator;
use sinew::variables::Declared;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

#[test]
fn committed_descriptions_are_fresh() {
    for model in models() {
        let interface = model.interface();
        let path = root().join("modelDescription").join(format!("{}.xml", interface.name));
        let text = model_description(interface, &Parameters::default());
        if std::env::var_os("SINEW_UPDATE").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(committed == text, "{} is stale: run SINEW_UPDATE=1 cargo test --test declarations", path.display());
    }
}

#[test]
fn every_file_of_an_effect_has_its_entry() {
    let files = std::fs::read_dir(root().join("src/effects")).unwrap();
    let mut names: Vec<_> = files
        .map(|file| file.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .filter(|name| name != "mod")
        .collect();
    let mut listed: Vec<_> = Effects::DESCRIPTIONS.iter().map(|effect| effect.name.to_owned()).collect();
    names.sort();
    listed.sort();
    assert_eq!(names, listed);
}

#[test]
fn names_are_unique_and_defaults_are_allowed() {
    let mut names = std::collections::BTreeSet::new();
    Parameters::default().visit(&mut |variable, value| {
        assert!(names.insert(variable.name), "{} is declared twice", variable.name);
        assert!(!variable.description.is_empty());
        variable.check(value).unwrap();
    });
    for effect in Effects::DESCRIPTIONS {
        for (name, starts) in effect.all_forms().flatten().chain(effect.refinements) {
            assert!(name.starts_with(effect.name) && names.contains(name), "{name}");
            starts.iter().for_each(|start| Parameters::default().set(name, *start).unwrap());
        }
        let mut switched_on = Parameters::default();
        effect.typical().for_each(|(name, start)| switched_on.set(name, start).unwrap());
        assert_ne!(switched_on, Parameters::default(), "the fit of {} starts at neutral", effect.name);
    }
}

/// Every effect at its typical size in every form, and all refinements, so that nothing is neutral.
fn everything_at_work() -> Parameters {
    let mut parameters = Parameters::default();
    for effect in Effects::DESCRIPTIONS {
        for (name, starts) in effect.all_forms().flatten().chain(effect.refinements) {
            parameters.set(name, starts[0]).unwrap();
        }
    }
    parameters.initial.gauge_pressure = 2.5e5; // so that the muscle pulls wherever it is
    parameters
}

/// The parameters with one effect back at its defaults.
fn without(mut parameters: Parameters, effect: &str) -> Parameters {
    let nominal = Parameters::default();
    parameters.visit_mut(&mut |variable, value| {
        if variable.group() == effect { nominal.get(variable.name).unwrap() } else { value }
    });
    parameters
}

/// Puts a model into the middle of a simulation.
fn run(model: &mut dyn Model, parameters: &Parameters, seed: u32) {
    run_from(model, parameters, seed, 0.0);
}

/// The same from a time in s on.
fn run_from(model: &mut dyn Model, parameters: &Parameters, seed: u32, start: f64) {
    model.reset(parameters);
    let inputs = model.interface().inputs;
    for input in 0..inputs {
        let share = f64::from((seed + 37 * u32::try_from(input).unwrap()) % 100) / 100.0;
        model.set(input, model.interface().variables[input].declaration.unit.nominal * (0.3 + share));
    }
    model.initialize(start).unwrap();
    model.advance(0.05).unwrap();
}

proptest! {
    /// An output depends on an input at once exactly where the description says so: with every effect at work, or with
    /// all but the delay of a sensor, which hides a dependency.
    #[test]
    fn dependencies_are_exact(seed in 0_u32..10_000) {
        let all = everything_at_work();
        let undelayed = without(all, "contraction_sensor_delay");
        for mut model in models() {
            let interface = model.interface();
            for output in interface.inputs..interface.inputs + interface.outputs {
                let name = interface.variables[output].name;
                let declared = interface.feedthrough.iter().find(|(of, _)| *of == name).map_or(&[][..], |(_, inputs)| inputs);
                for input in 0..interface.inputs {
                    let depends = [all, undelayed].iter().any(|parameters| {
                        run(model.as_mut(), parameters, seed);
                        model.partial_derivative(output, input, false).abs() > 1e-9
                    });
                    let input_name = interface.variables[input].name;
                    prop_assert_eq!(depends, declared.contains(&input_name), "{} on {}", name, input_name);
                }
            }
        }
    }
}

/// All outputs of a model while its inputs move along straight lines with corners every 40 ms, every 0.2 s;
/// `steps` communication steps from corner to corner.
fn along_lines(model: &mut dyn Model, steps: u32, corners: u32) -> Vec<Vec<f64>> {
    let interface = model.interface();
    let level = |input: usize, corner: u32| {
        let phase = f64::from(corner * (7 + 4 * u32::try_from(input).unwrap()) % 23) / 23.0;
        match interface.variables[input].declaration.unit.symbol {
            "V" => 1.5 + phase,
            "m/s" => 0.2 * (phase - 0.5),
            "m" => 0.05 + 0.05 * phase,
            _ => 10.0 * phase,
        }
    };
    let corner_time = 0.04;
    let span = corner_time / f64::from(steps);
    let mut course = Vec::new();
    for corner in 0..corners {
        for step in 0..steps {
            for input in 0..interface.inputs {
                let (from, to) = (level(input, corner), level(input, corner + 1));
                model.set(input, from + (to - from) * f64::from(step) / f64::from(steps));
                model.set_slope(input, (to - from) / corner_time);
            }
            model.advance(span).unwrap();
        }
        if corner % 5 == 4 {
            let mut outputs = vec![0.0; interface.outputs];
            model.copy_outputs(&mut outputs);
            course.push(outputs);
        }
    }
    course
}

/// The plant with and without load.
fn plants() -> impl Iterator<Item = Box<dyn Model>> {
    models().into_iter().filter(|model| model.interface().name.starts_with("Pneumatic"))
}

/// Everything at work, and a pilot that sticks again at once, or only where the command is slower than some lines.
fn stuck(sliding_speed: f64) -> Parameters {
    let mut parameters = everything_at_work();
    parameters.set("valve_dead_band.play", 0.0).unwrap();
    parameters.set("valve_dead_band.sliding_speed", sliding_speed).unwrap();
    parameters
}

/// Asserts that outputs differ by the errors of the integration only, relative to the largest value of each, since a force may
/// pass through zero.
fn assert_close(expected: &[Vec<f64>], found: &[Vec<f64>], which: &str) {
    let largest = |output: usize| expected.iter().map(|outputs| outputs[output].abs()).fold(1e-2, f64::max);
    for (expected, found) in expected.iter().zip(found) {
        for (output, (expected, found)) in expected.iter().zip(found).enumerate() {
            let close = (expected - found).abs() <= 1e-5 * largest(output);
            assert!(close, "output {output}, {which}: {expected} {found}");
        }
    }
}

#[test]
fn results_do_not_depend_on_the_communication_step() {
    let without_pilot = without(everything_at_work(), "valve_dead_band");
    for parameters in [everything_at_work(), without_pilot, stuck(1e9), stuck(10.0)] {
        for mut model in plants() {
            let mut course = |steps| {
                run(model.as_mut(), &parameters, 50);
                along_lines(model.as_mut(), steps, 50)
            };
            let coarse = course(1);
            for steps in [3, 40] {
                assert_close(&coarse, &course(steps), &format!("{steps} steps"));
            }
        }
    }
}

#[test]
fn results_do_not_depend_on_when_a_simulation_starts() {
    let mut parameters = Parameters::default();
    for (name, value) in [
        ("valve_offset.swing", 0.1),
        ("pressure_sensor_offset.settling", 1e4),
        ("contraction_sensor_offset.shift", 5e-3),
        ("contraction_sensor_offset.shift_time", 1.0),
        ("contraction_sensor_delay.delay", 0.02),
        ("force_sensor_offset.swing", 20.0),
    ] {
        parameters.set(name, value).unwrap();
    }
    for mut model in plants() {
        let mut course = |start: f64| {
            run_from(model.as_mut(), &parameters, 50, start);
            along_lines(model.as_mut(), 3, 50)
        };
        let (from_zero, late) = (course(0.0), course(64.0));
        assert_close(&from_zero, &late, "64 s later");
    }
}

#[test]
fn a_restored_run_goes_on_to_the_last_bit() {
    let each = [everything_at_work(), stuck(1e9)]
        .into_iter()
        .flat_map(|parameters| plants().map(move |model| (parameters, model)));
    for (parameters, mut model) in each {
        run(model.as_mut(), &parameters, 50);
        along_lines(model.as_mut(), 3, 20);
        let saved = model.save();
        let expected = along_lines(model.as_mut(), 3, 20);
        let end = model.save();
        let mut other = plants().find(|other| other.interface().name == model.interface().name).unwrap();
        other.restore(&saved).unwrap();
        assert_eq!(other.save(), saved);
        assert_eq!(along_lines(other.as_mut(), 3, 20), expected);
        assert_eq!(other.save(), end);
    }
}

#[test]
fn a_saved_memory_that_cannot_be_is_refused() {
    for mut model in plants() {
        run(model.as_mut(), &everything_at_work(), 50);
        let saved = model.save();
        let mut quiet = plants().find(|other| other.interface().name == model.interface().name).unwrap();
        let fixed = quiet.save().len();
        assert!(saved.len() > fixed + 10, "nothing is remembered");
        for length in 0..saved.len() {
            quiet.restore(&saved[..length]).unwrap_err();
        }
        // The end of the fixed part: whether there is a pilot, and after its eight numbers that of the pieces.
        let (pilot, pieces) = (fixed - 3, fixed + 6);
        for (position, value) in
            [(pilot, 2.0), (pieces, 1e9), (pieces, 0.5), (pieces, -1.0), (saved.len() - 1, f64::NAN)]
        {
            let mut damaged = saved.clone();
            damaged[position] = value;
            quiet.restore(&damaged).unwrap_err();
        }
        let mut long = saved.clone();
        long.push(0.0);
        quiet.restore(&long).unwrap_err();
    }
}

#[test]
fn a_step_that_fails_leaves_the_memory_as_it_was() {
    let mut model = plants().next().unwrap();
    run(model.as_mut(), &everything_at_work(), 50);
    along_lines(model.as_mut(), 1, 10);
    let before = model.save();
    model.set_slope(1, -1e12); // a load that is thrown upwards
    assert!(model.advance(0.1).is_err());
    model.set_slope(1, 0.0);
    assert_eq!(model.save(), before);
}

#[test]
fn an_extended_plant_starts_at_rest() {
    for effect in Effects::DESCRIPTIONS {
        let mut parameters = Parameters::default();
        effect.typical().for_each(|(name, start)| parameters.set(name, start).unwrap());
        parameters.initial.gauge_pressure = 1e5;
        let mut model = models().into_iter().next().unwrap();
        model.reset(&parameters);
        model.set(0, 1.0);
        model.initialize(0.0).unwrap();
        let start = model.get(2);
        model.advance(1e-3).unwrap();
        assert!((model.get(2) - start).abs() < 1e-6, "{} jumps by {} m", effect.name, model.get(2) - start);
    }
}

/// Parameters with those of effects moved a quarter of the way to a bound, but for those that switch an effect on; and the names of these.
fn with_shapes_moved(nominal: &Parameters) -> (Parameters, Vec<&'static str>) {
    let (mut moved, mut shapes) = (*nominal, Vec::new());
    nominal.visit(&mut |variable, value| {
        if !Effects::DESCRIPTIONS.iter().any(|effect| effect.name == variable.group()) {
            return;
        }
        let bound = if value < variable.max { variable.max } else { variable.min };
        let mut next = moved;
        next.set(variable.name, value + 0.25 * (bound - value)).unwrap();
        if next.effects.are_neutral() {
            moved = next;
            shapes.push(variable.name);
        }
    });
    (moved, shapes)
}

#[test]
fn neutral_effects_change_nothing_to_the_last_bit() {
    // The nominal model with every parameter of an effect moved that does not switch it on.
    let nominal = Parameters::default();
    let (moved, shapes) = with_shapes_moved(&nominal);
    assert!(shapes.len() > 100, "only {shapes:?}");
    assert!(moved.effects.are_neutral());
    // Alone, and beside an effect that is at work, where all hooks are called.
    let at_work = [nominal, moved].map(|mut parameters| {
        parameters.effects.payload_mass.additional_mass = 2.0;
        parameters
    });
    for [one, other] in [[nominal, moved], at_work] {
        for mut model in plants() {
            let mut course = |parameters| {
                run(model.as_mut(), parameters, 50);
                along_lines(model.as_mut(), 2, 100)
            };
            assert_eq!(course(&one), course(&other));
        }
    }
}

#[test]
fn a_correction_without_a_cause_is_neutral_until_it_acts_on_something() {
    let course = |parameters: &Parameters| {
        let mut model = plants().next().unwrap();
        run(model.as_mut(), parameters, 50);
        along_lines(model.as_mut(), 1, 50)
    };
    let mut set = Parameters::default();
    for (name, value) in [("c00", 0.3), ("c12", -0.2), ("first_high", 3.0)] {
        set.set(&format!("unknown_cause.{name}"), value).unwrap();
    }
    assert_eq!(course(&Parameters::default()), course(&set));
    for place in [2.0, 3.0] {
        let mut acting = set;
        acting.set("unknown_cause.acts_on", place).unwrap();
        assert_ne!(course(&set), course(&acting), "{place}");
    }
}

#[test]
fn no_effect_takes_the_pressure_below_ambient() {
    for effect in Effects::DESCRIPTIONS {
        for form in effect.all_forms() {
            let mut parameters = Parameters::default();
            form.iter().for_each(|(name, starts)| parameters.set(name, starts[0]).unwrap());
            let mut model = Simulator::<PneumaticActuator>::new(parameters);
            model.inputs.contraction = 0.05;
            model.inputs.command = 4.0;
            model.initialize(0.0).unwrap();
            model.advance(1.0).unwrap();
            model.inputs.command = 0.0;
            for _ in 0..300 {
                model.advance(0.01).unwrap();
                let pressure = model.outputs().gauge_pressure;
                assert!(pressure > -1.0, "{} in {form:?}: {pressure} Pa", effect.name);
            }
        }
    }
}

#[test]
fn every_form_of_every_effect_acts_on_the_plant() {
    let mut still = Parameters::default();
    still.initial.gauge_pressure = 2e5;
    let course = |parameters: &Parameters| {
        let mut model = plants().next().unwrap();
        run(model.as_mut(), parameters, 50);
        along_lines(model.as_mut(), 1, 50)
    };
    for effect in Effects::DESCRIPTIONS {
        for form in effect.all_forms() {
            let mut on = still;
            form.iter().for_each(|(name, starts)| on.set(name, starts[0]).unwrap());
            assert_ne!(course(&still), course(&on), "{form:?}");
        }
        // A form may be one that a refinement means nothing to.
        for (refinement, starts) in effect.refinements {
            // Some values are those of one of several recordings.
            let acts = |(form, recording): (&[Freed], usize)| {
                let mut with = still;
                with.effects.in_recording(recording);
                form.iter().chain(effect.refinements).for_each(|(name, starts)| with.set(name, starts[0]).unwrap());
                with.set(refinement, starts[0]).unwrap();
                let mut without = with;
                without.set(refinement, Parameters::default().get(refinement).unwrap()).unwrap();
                course(&with) != course(&without)
            };
            let mut ways = effect.forms.iter().flat_map(|form| (1..=3).map(move |recording| (*form, recording)));
            assert!(ways.any(acts), "{refinement}");
        }
    }
}
