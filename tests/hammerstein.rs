//! The Hammerstein model: its basis, a known system found again, and a recording beside the physical model.

use sinew::hammerstein::{Hammerstein, Poles, identify, kautz};
use sinew::measurement::{Recording, read_all};
use sinew::parameters::Parameters;
use std::path::Path;

#[test]
fn kautz_functions_are_orthonormal() {
    for poles in [
        Poles { natural_frequency: 8.0, damping_ratio: 0.2 },
        Poles { natural_frequency: 8.0, damping_ratio: 1.0 },
        Poles { natural_frequency: 3.0, damping_ratio: 1.5 },
    ] {
        let mut impulse = vec![0.0; 6000];
        impulse[0] = 1.0;
        let answers = kautz(poles, 0.01, 3, &impulse);
        for (i, one) in answers.iter().enumerate() {
            for (j, other) in answers.iter().enumerate() {
                let product: f64 = one.iter().zip(other).map(|(a, b)| a * b).sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((product - expected).abs() < 1e-9, "{poles:?} {i} {j}: {product}");
            }
        }
    }
}

#[test]
fn a_known_system_is_found_again() {
    let truth = Hammerstein {
        sampling: 0.01,
        command: [2.0, 1.5],
        polynomial: vec![1.0, -0.3],
        filter: vec![0.002, 0.004],
        poles: Poles { natural_frequency: 7.0, damping_ratio: 0.3 },
        rest: 0.05,
    };
    // Steps between levels in no order.
    let level = |k: usize| 0.5 + 3.0 * (0.618_034 * (k / 60) as f64).fract();
    let command: Vec<f64> = (0..6000).map(level).collect();
    let contraction = truth.simulate(&command);
    let mut text = "time [s],command [V],contraction [m]\n".to_owned();
    for (k, (u, y)) in command.iter().zip(&contraction).enumerate() {
        text += &format!("{:?},{u:?},{y:?}\n", 0.01 * k as f64);
    }
    let text = text.replace("contraction [m]\n", "contraction [m],load_mass [kg]\n");
    let text = text.lines().enumerate().map(|(k, l)| if k == 0 { format!("{l}\n") } else { format!("{l},20\n") });
    let recording = Recording::parse(text.collect::<String>().as_bytes(), Path::new("known.csv"), &[]).unwrap();
    let found = identify(&recording, &Parameters::default()).unwrap();
    println!("{}", found.sentence());
    let [own, _] = found.errors();
    // The poles are those of a grid; the functions of other poles make up for that.
    let range = contraction.iter().copied().fold(f64::NEG_INFINITY, f64::max) - 0.05;
    assert!(own < 0.02 * range, "{own} of {range}");
}

#[test]
fn a_recording_is_followed_beside_the_physical_model() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/nominal_40kg.csv");
    let recordings = read_all(&[path], &[]).unwrap();
    let found = identify(&recordings[0], &Parameters::default()).unwrap();
    println!("{}", found.sentence());
    let [own, physical] = found.errors();
    // The recording is of the physical model with noise: nothing without physics should come nearer.
    assert!(physical < own && own < 0.02, "{own} {physical}");
    assert_eq!(
        found.to_json().to_string(),
        identify(&recordings[0], &Parameters::default()).unwrap().to_json().to_string()
    );
}

#[test]
fn what_is_missing_is_said() {
    let rows: String = (0..20).map(|k| format!("{k},{},20,1e5\n", k % 3)).collect();
    let text = format!("time [s],command [V],load_mass [kg],gauge_pressure [Pa]\n{rows}");
    let recording = Recording::parse(text.as_bytes(), Path::new("r.csv"), &[]).unwrap();
    let said = identify(&recording, &Parameters::default()).unwrap_err().to_string();
    assert!(said.contains("`contraction [m]`"), "{said}");
}

#[test]
fn a_prescribed_motion_is_refused() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/prescribed_motion.csv");
    let recordings = read_all(&[path], &[]).unwrap();
    let refused = identify(&recordings[0], &Parameters::default()).unwrap_err().to_string();
    assert!(refused.contains("load_mass"), "{refused}");
}
