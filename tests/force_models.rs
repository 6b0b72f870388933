//! Every force model against an independent implementation, its own volume, its limits, and in simulation.

use sinew::GRAVITY;
use sinew::measurement::{Recording, Signal};
use sinew::muscle::{ForceModelName, ForceModels, Muscle};
use sinew::parameters::Parameters;
use sinew::plant::{equilibrium, holding_pressure};
use sinew::simulation::replay;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

const MUSCLES: [&str; 2] = ["dmsp-40-1000", "dmsp-40-290"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// Both muscles with every force model, and the name of each.
fn all() -> impl Iterator<Item = (String, Parameters)> {
    let names = MUSCLES
        .into_iter()
        .flat_map(|muscle| ForceModelName::CHOICES.iter().map(move |choice| format!("{muscle}/{}", choice.name)));
    names.map(|name| (name.clone(), Parameters::preset(&name).unwrap()))
}

/// The stroke in steps of 1 %, from stretched to beyond what a FESTO muscle reaches.
fn stroke(muscle: &Muscle) -> impl Iterator<Item = f64> + use<> {
    let rest = muscle.rest_length;
    (-3..=30).map(move |percent| 0.01 * f64::from(percent) * rest)
}

#[test]
fn every_file_of_a_model_has_its_entry() {
    let files = std::fs::read_dir(root().join("src/muscle")).unwrap();
    let names = files.map(|file| file.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned());
    let mut names: Vec<_> = names.filter(|name| name != "mod").collect();
    let mut listed = ForceModels::GROUPS.to_vec();
    names.sort();
    listed.sort_unstable();
    assert_eq!(names, listed);
    for (choice, group) in ForceModelName::CHOICES.iter().zip(ForceModels::GROUPS) {
        assert_eq!(choice.name.replace('-', "_"), *group);
    }
}

#[test]
fn forces_agree_with_an_independent_implementation() {
    let path = root().join("tests/reference/force_models.csv");
    // Largest difference and full scale of each preset.
    let mut worst = BTreeMap::<String, (f64, f64)>::new();
    for row in csv::Reader::from_path(path).unwrap().records() {
        let row = row.unwrap();
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        let Parameters { muscle, force_models, .. } = Parameters::preset(&row[0]).unwrap();
        let force = force_models.moving_force(&muscle, number(1), number(2), number(3));
        let (difference, scale) = worst.entry(row[0].to_owned()).or_default();
        *difference = difference.max((force - number(4)).abs());
        *scale = scale.max(number(4).abs());
    }
    assert_eq!(worst.len(), all().count());
    for (name, (difference, scale)) in worst {
        println!("{name}: {:.1e} of full scale, {scale:.0} N", difference / scale);
        assert!(difference < 1e-9 * scale, "{name}: {difference} N of {scale} N");
    }
}

#[test]
fn the_virtual_area_is_what_the_force_gains_with_pressure() {
    for (name, Parameters { muscle, force_models, .. }) in all() {
        for x in stroke(&muscle) {
            // Away from where k and q have corners.
            for p in [0.2e5, 0.61e5, 0.93e5, 1.13e5, 2.4e5, 5e5] {
                let force = |p: f64| force_models.force(&muscle, p, x);
                let difference = (force(p + 1.0) - force(p - 1.0)) / 2.0;
                let area = force_models.virtual_area(&muscle, p, x);
                let close = 1e-6 * (area.abs() + 1e-3);
                assert!((area - difference).abs() < close, "{name} at {p} Pa, {x} m: {area} {difference}");
            }
        }
    }
}

/// Length and volume of a muscle, over something that changes with the contraction.
type Shape = fn(&Muscle, &ForceModels, f64) -> (f64, f64);

fn cylinder(muscle: &Muscle, _: &ForceModels, x: f64) -> (f64, f64) {
    (muscle.rest_length - x, muscle.volume(x))
}

/// Over the length of the middle, which begins shorter than the muscle by its cones.
fn with_cones(muscle: &Muscle, models: &ForceModels, x: f64) -> (f64, f64) {
    let (side, end) = (models.frustum_ends.end_length, models.frustum_ends.end_diameter);
    let height = |diameter: f64| (side * side - (0.5 * (diameter - end)).powi(2)).sqrt();
    let rest = muscle.rest_length - 2.0 * height(muscle.diameter(0.0));
    let share = rest / muscle.rest_length;
    let middle = rest - x;
    let diameter = ((share * muscle.thread_length).powi(2) - middle * middle).sqrt() / (PI * share * muscle.turns);
    let cone = PI / 12.0 * height(diameter) * (diameter * diameter + diameter * end + end * end);
    (middle + 2.0 * height(diameter), PI / 4.0 * diameter * diameter * middle + 2.0 * cone)
}

fn with_caps(muscle: &Muscle, models: &ForceModels, x: f64) -> (f64, f64) {
    let length = muscle.rest_length - x;
    let angle = (length / muscle.thread_length).acos();
    let beyond = 0.5 * (muscle.diameter(x) - models.rounded_ends.end_diameter);
    let sphere = beyond / (2.0 * angle.sin().powi(2));
    let caps = 2.0 * PI / 3.0 * (3.0 * sphere - beyond) * beyond.powi(2);
    (length, muscle.volume(x) - 2.0 * PI * beyond.powi(3) / angle.tan() + caps)
}

fn barrel(muscle: &Muscle, models: &ForceModels, x: f64) -> (f64, f64) {
    let (length, end, middle) = (muscle.rest_length - x, models.variable_diameter.end_diameter, muscle.diameter(x));
    (length, PI * length / 60.0 * (3.0 * end * end + 4.0 * end * middle + 8.0 * middle * middle))
}

#[test]
fn a_geometric_model_pulls_by_its_change_of_volume() {
    let shapes: [(&str, Shape); 6] = [
        ("mckibben", cylinder),
        ("improved-mckibben", cylinder),
        ("mooney-rivlin", cylinder),
        ("frustum-ends", with_cones),
        ("rounded-ends", with_caps),
        ("variable-diameter", barrel),
    ];
    for base in MUSCLES {
        for (model, shape) in shapes {
            let Parameters { muscle, force_models, .. } = Parameters::preset(&format!("{base}/{model}")).unwrap();
            for x in stroke(&muscle) {
                let h = 1e-5 * muscle.rest_length;
                let [(longer, less), (length, _), (shorter, more)] =
                    [x - h, x, x + h].map(|x| shape(&muscle, &force_models, x));
                let change = -(more - less) / (shorter - longer);
                let p = 2.5e5;
                let contraction = muscle.rest_length - length;
                let elastic = force_models.elastic_force(&muscle, contraction);
                let force = force_models.force(&muscle, p, contraction);
                let close = 1e-6 * p * muscle.rest_length * 1e-2;
                assert!(
                    (force - elastic - p * change).abs() < close,
                    "{base}/{model} at {x}: {force} {elastic} {change}"
                );
            }
        }
    }
}

#[test]
fn the_rubber_of_mooney_and_rivlin_gives_back_its_energy() {
    for base in MUSCLES {
        let Parameters { muscle, force_models, .. } = Parameters::preset(&format!("{base}/mooney-rivlin")).unwrap();
        let rubber = force_models.mooney_rivlin;
        let energy = |x: f64| {
            let (along, around) = (1.0 - x / muscle.rest_length, muscle.diameter(x) / muscle.diameter(0.0));
            let through = 1.0 / (along * around);
            let sum = |power: i32| along.powi(power) + around.powi(power) + through.powi(power) - 3.0;
            let volume = PI * muscle.diameter(0.0) * muscle.rest_length * rubber.membrane_thickness;
            volume * (rubber.c10 * sum(2) + rubber.c01 * sum(-2))
        };
        for x in stroke(&muscle) {
            let h = 1e-5 * muscle.rest_length;
            // What shortening stores is missing in the pull.
            let force = -(energy(x + h) - energy(x - h)) / (2.0 * h);
            let elastic = force_models.elastic_force(&muscle, x);
            assert!((elastic - force).abs() < 1e-6 * force.abs() + 1e-3, "{base} at {x}: {elastic} {force}");
            assert!(x * elastic <= 0.0, "the bladder drives the muscle at {x}");
        }
    }
}

#[test]
fn limits_are_as_they_must_be() {
    for (name, Parameters { muscle, force_models, .. }) in all() {
        for x in stroke(&muscle) {
            let unpressurised = force_models.pressure_force(&muscle, 0.0, x);
            assert!(unpressurised.abs() < 1e-9, "{name}: {unpressurised} N of no pressure at {x} m");
            for p in [0.0, 0.7e5, 3e5] {
                assert!(force_models.force(&muscle, p, x).is_finite(), "{name} at {p}, {x}");
                assert_eq!(force_models.resistance(&muscle, p, x, 0.0), 0.0, "{name} resists rest");
                for v in [-0.1, -1e-3, 1e-3, 0.1] {
                    assert!(v * force_models.resistance(&muscle, p, x, v) >= 0.0, "{name} gains energy from motion");
                }
            }
        }
        // No membrane of a braid is strained at rest.
        if ["mckibben", "mooney", "tondu", "ends", "variable"].iter().any(|part| name.contains(part)) {
            assert!(force_models.elastic_force(&muscle, 0.0).abs() < 1e-6, "{name}");
        }
        // At 3 bar every muscle pulls at rest length, less and less, and not at all beyond 45 %.
        let force = |share: f64| force_models.force(&muscle, 3e5, share * muscle.rest_length);
        assert!(force(0.0) > 1e3 && force(0.02) < force(0.0) && force(0.45) < force(0.02), "{name}");
    }
}

#[test]
fn the_pull_of_tondu_and_lopez_ends_where_its_coefficients_say() {
    for base in MUSCLES {
        for (model, k_at) in [
            ("tondu-lopez", (|_, _| 1.0) as fn(&ForceModels, f64) -> f64),
            ("tondu-lopez-k", |all, p| all.tondu_lopez_k.k_0 + all.tondu_lopez_k.k_per_pressure * p),
            ("tondu-lopez-kq", |all, p| if p <= 0.5e5 { all.tondu_lopez_kq.low_k } else { all.tondu_lopez_kq.high_k }),
        ] {
            let Parameters { muscle, force_models, .. } = Parameters::preset(&format!("{base}/{model}")).unwrap();
            for p in [0.5e5, 1e5, 3e5] {
                let end = (1.0 - (3.7698_f64 / 8.3095).sqrt()) / k_at(&force_models, p) * muscle.rest_length;
                let (force, at_rest) = (force_models.force(&muscle, p, end), force_models.force(&muscle, p, 0.0));
                assert!(force.abs() < 1e-12 * at_rest, "{base}/{model} at {p}: {force}");
            }
        }
    }
}

#[test]
fn tondu_and_lopez_with_the_angle_of_the_braid_is_an_ideal_muscle() {
    for base in MUSCLES {
        let mut parameters = Parameters::preset(&format!("{base}/tondu-lopez")).unwrap();
        let ideal = Parameters::preset(&format!("{base}/mckibben")).unwrap();
        let angle = (ideal.muscle.rest_length / ideal.muscle.thread_length).acos();
        parameters.set("tondu_lopez.alpha", 3.0 / angle.tan().powi(2)).unwrap();
        parameters.set("tondu_lopez.beta", 1.0 / angle.sin().powi(2)).unwrap();
        for x in stroke(&ideal.muscle) {
            let [one, other] = [&parameters, &ideal].map(|all| all.force_models.force(&all.muscle, 3e5, x));
            assert!((one - other).abs() < 1e-8, "{base} at {x}: {one} {other}");
        }
    }
}

#[test]
fn the_two_points_of_k_and_q_are_met() {
    let Parameters { muscle, force_models, .. } = Parameters::preset("dmsp-40-1000/tondu-lopez-kq").unwrap();
    let model = force_models.tondu_lopez_kq;
    for (p, k, q) in [(0.5e5, model.low_k, model.low_q), (1e5, model.high_k, model.high_q)] {
        let reach =
            (0..=100_000).map(|step| 1e-6 * f64::from(step)).find(|x| force_models.force(&muscle, p, *x) <= 0.0);
        let found = model.two_points(&muscle, p, force_models.force(&muscle, p, 0.0), reach.unwrap());
        assert!((found.0 - k).abs() < 1e-3 * k && (found.1 - q).abs() < 1e-12, "{found:?}");
    }
}

#[test]
fn the_spring_has_no_jump_between_its_ranges() {
    for base in MUSCLES {
        let Parameters { muscle, force_models, .. } = Parameters::preset(&format!("{base}/spring")).unwrap();
        let spring = force_models.spring;
        for x in stroke(&muscle) {
            for p in [spring.blend_start, spring.blend_end] {
                let of = |p: f64| (force_models.force(&muscle, p, x), force_models.virtual_area(&muscle, p, x));
                let ((below, area_below), (above, area_above)) = (of(p - 1e-3), of(p + 1e-3));
                assert!((below - above).abs() < 1e-2 && (area_below - area_above).abs() < 1e-6, "{base} {p} {x}");
            }
        }
    }
}

#[test]
fn a_holding_pressure_holds() {
    for (name, parameters) in all() {
        let Parameters { muscle, force_models, .. } = &parameters;
        for p in [0.3e5, 0.9e5, 1.1e5, 2e5, 4.5e5] {
            for share in [0.0, 0.02, 0.05, 0.1, 0.15] {
                let x = share * muscle.rest_length;
                let weight = force_models.force(muscle, p, x);
                if weight <= 0.0 || force_models.virtual_area(muscle, p, x) <= 0.0 {
                    continue;
                }
                let found = holding_pressure(&parameters, x, weight);
                let pull = force_models.force(muscle, found, x);
                let holds = found > 0.0 && (pull - weight).abs() < 1e-9 * weight.max(1.0);
                assert!(holds, "{name} at {p} Pa, {x} m: {found} Pa, {pull} N");
            }
        }
    }
}

#[test]
fn a_load_hangs_from_every_model_where_its_preset_starts() {
    for (name, all) in all() {
        let hanging = equilibrium(&all, all.initial.gauge_pressure, all.load.mass * GRAVITY);
        let x = hanging.unwrap_or_else(|| panic!("{name}: no equilibrium"));
        assert!(x > -0.1 * all.muscle.rest_length && x < 0.36 * all.muscle.rest_length, "{name}: {x}");
    }
}

#[test]
fn a_recording_is_replayed_with_every_model() {
    let whole = Recording::read(&root().join("data/nominal_40kg.csv"), &[]).unwrap();
    for (name, parameters) in all() {
        let replayed = replay(&parameters, &whole).unwrap();
        let (contraction, force) = (replayed.get(Signal::Contraction).unwrap(), replayed.get(Signal::Force).unwrap());
        let within = |x: &f64| x.abs() < 0.4 * parameters.muscle.rest_length;
        assert!(contraction.iter().all(within) && force.iter().all(|f| (f - 392.4).abs() < 400.0), "{name}");
    }
}
