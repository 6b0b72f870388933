//! What is declared once must hold everywhere: descriptions, dependencies, effects.

use proptest::prelude::*;
use sinew::effects::Effects;
use sinew::model::Model;
use sinew::model_description::model_description;
use sinew::models::models;
use sinew::parameters::Parameters;
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
        for (name, starts) in effect.forms.iter().copied().flatten().chain(effect.refinements) {
            assert!(name.starts_with(effect.name) && names.contains(name), "{name}");
            starts.iter().for_each(|start| Parameters::default().set(name, *start).unwrap());
        }
        let mut switched_on = Parameters::default();
        effect.typical().for_each(|(name, start)| switched_on.set(name, start).unwrap());
        assert_ne!(switched_on, Parameters::default(), "the fit of {} starts at neutral", effect.name);
    }
}

/// A model in the middle of a simulation, with every effect at work.
fn running(model: &mut dyn Model, seed: u32) {
    let mut parameters = Parameters::default();
    for effect in Effects::DESCRIPTIONS {
        effect.typical().for_each(|(name, start)| parameters.set(name, start).unwrap());
    }
    parameters.initial.gauge_pressure = 2e5;
    model.reset(&parameters);
    let inputs = model.interface().inputs;
    for input in 0..inputs {
        let share = f64::from((seed + 37 * u32::try_from(input).unwrap()) % 100) / 100.0;
        model.set(input, model.interface().variables[input].declaration.unit.nominal * (0.3 + share));
    }
    model.initialize(0.0).unwrap();
    model.advance(0.05).unwrap();
}

proptest! {
    /// An output depends on an input at once exactly where the description says so.
    #[test]
    fn dependencies_are_exact(seed in 0_u32..10_000) {
        for mut model in models() {
            running(model.as_mut(), seed);
            let interface = model.interface();
            for output in interface.inputs..interface.inputs + interface.outputs {
                let name = interface.variables[output].name;
                let declared = interface.feedthrough.iter().find(|(of, _)| *of == name).map_or(&[][..], |(_, inputs)| inputs);
                for input in 0..interface.inputs {
                    let depends = model.partial_derivative(output, input, false).abs() > 1e-9;
                    let input_name = interface.variables[input].name;
                    prop_assert_eq!(depends, declared.contains(&input_name), "{} on {}", name, input_name);
                }
            }
        }
    }
}

#[test]
fn neutral_effects_change_nothing_to_the_last_bit() {
    // The nominal model with every shape parameter of an effect moved, but no effect switched on.
    let run = |parameters: &Parameters| {
        let mut model = models().into_iter().next().unwrap();
        model.reset(parameters);
        model.initialize(0.0).unwrap();
        let command = 0;
        (0..500)
            .flat_map(|k| {
                model.set(command, 1.0 + f64::from(k % 100) * 0.01);
                model.advance(0.01).unwrap();
                (2..10).map(|output| model.get(output).to_bits()).collect::<Vec<_>>()
            })
            .collect::<Vec<_>>()
    };
    let nominal = Parameters::default();
    let mut moved = nominal;
    moved.set("friction_hysteresis.presliding_displacement", 0.05).unwrap();
    assert_ne!(nominal, moved);
    assert_eq!(run(&nominal), run(&moved));
}

#[test]
fn every_effect_acts_on_the_plant() {
    for effect in Effects::DESCRIPTIONS {
        let response = |on: bool| {
            let mut parameters = Parameters::default();
            parameters.initial.gauge_pressure = 1e5;
            if on {
                effect.typical().for_each(|(name, start)| parameters.set(name, start).unwrap());
            }
            let mut model = models().into_iter().next().unwrap();
            model.reset(&parameters);
            model.initialize(0.0).unwrap();
            model.set(0, 2.0);
            model.advance(0.2).unwrap();
            (2..10).map(|output| model.get(output)).collect::<Vec<_>>()
        };
        assert_ne!(response(false), response(true), "{}", effect.name);
    }
}
