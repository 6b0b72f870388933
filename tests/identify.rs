//! Force models from recordings: points, what they tell, parameters within their intervals, bars on the thesis' muscles.

use sinew::comparison::assess::Assessed;
use sinew::comparison::isometric::Relation;
use sinew::identification::fit::{Start, fit};
use sinew::identification::points::{Branch, Point, Points, Source};
use sinew::identification::structure::{Braid, Structure, all_models, forces, model_name};
use sinew::identification::{identify, report};
use sinew::measurement::{Recording, read_all};
use sinew::muscle::ForceModelName;
use sinew::parameters::Parameters;
use std::path::{Path, PathBuf};

fn recording(path: &str) -> Vec<Recording> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(path);
    read_all(&[path], &[]).unwrap()
}

fn parse(text: &str) -> Vec<Recording> {
    vec![Recording::parse(text.as_bytes(), &PathBuf::from("r.csv"), &[]).unwrap()]
}

/// Normal numbers from a seed (xorshift and Box and Muller).
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    move || (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}

/// Points on a grid of pressures and contraction ratios, resting or, for models that resist motion, moving to and fro.
fn grid(muscle: &Parameters) -> Vec<Point> {
    let mut points = Vec::new();
    for i in 0..12 {
        for k in 0..12 {
            points.push(Point {
                recording: 0,
                line: 0,
                gauge_pressure: 2e4 + 4.5e4 * f64::from(i),
                contraction: muscle.muscle.rest_length * 0.018 * f64::from(k),
                contraction_velocity: if (i + k) % 2 == 0 { 0.05 } else { -0.03 },
                force: 0.0,
                branch: Branch::Unknown,
            });
        }
    }
    points
}

#[test]
fn parameters_lie_within_their_intervals() {
    const DRAWS: u64 = 200;
    let mut missed = Vec::new();
    for model in all_models() {
        let truth = Parameters::preset(&format!("dmsp-40-1000/{}", model_name(model))).unwrap();
        let mut points = grid(&truth);
        let exact = forces(&truth, &points);
        let sigma = 5.0;
        let structure = Structure::of(model, Braid::Given, &truth, &points);
        let mut hits = vec![0_u64; structure.free.len()];
        for draw in 0..DRAWS {
            let mut normal = noise(1000 * draw + model as u64);
            points.iter_mut().zip(&exact).for_each(|(point, force)| point.force = force + sigma * normal());
            let values: Vec<f64> = structure.free.iter().map(|p| p.given).collect();
            let found = fit(&structure, &points, Start::Near(&values));
            for (k, (value, half)) in found.values.iter().zip(&found.half_widths).enumerate() {
                // At a bound there is no interval: the bound must be the truth's side of it.
                let near = half.map_or(f64::INFINITY, |half| half);
                hits[k] += u64::from((value - structure.free[k].given).abs() <= near);
            }
        }
        for (parameter, hits) in structure.free.iter().zip(hits) {
            println!("{:<36} {:5.1} %", parameter.variable.name, 100.0 * hits as f64 / DRAWS as f64);
            if 10 * hits < 9 * DRAWS {
                missed.push(format!("{}: within its interval in {hits} of {DRAWS}", parameter.variable.name));
            }
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}

/// Where the thesis' own numbers hold.
fn in_range(point: &Point) -> bool {
    (1e5..=4.5e5).contains(&point.gauge_pressure) && (90.0..=820.0).contains(&point.force)
}

/// The reconstructed isotonic points that are shipped.
fn reconstructed(length: &str) -> (Parameters, Vec<Point>) {
    let given = Parameters::preset(&format!("dmsp-40-{length}")).unwrap();
    let points = Points::of(&recording(&format!("reconstructed/dmsp_40_{length}_reconstructed.csv")), 10).unwrap();
    (given, points.all.into_iter().filter(in_range).collect())
}

/// The same muscle at evenly spaced contractions from rest on, pressure by pressure, as `tests/reference/improved_mckibben.py`
/// has it; so many that their number does not matter.
fn isobaric(given: &Parameters, reach: f64) -> Vec<Point> {
    let place = |i: i32, k: i32| Point {
        gauge_pressure: 1e5 + 0.5e5 * f64::from(i),
        contraction: reach * f64::from(k) / 399.0,
        contraction_velocity: 0.0,
        ..grid(given)[0]
    };
    let mut points: Vec<Point> = (0..8).flat_map(|i| (0..400).map(move |k| (i, k))).map(|(i, k)| place(i, k)).collect();
    let exact = forces(given, &points);
    points.iter_mut().zip(exact).for_each(|(point, force)| point.force = force);
    points.retain(in_range);
    points
}

#[test]
fn elasticity_repairs_the_plain_model_on_the_reconstructed_muscles() {
    for (length, reach, bar, printed) in [("1000", 0.24, 50.0, 695.0), ("290", 0.071, 75.0, 946.0)] {
        let (given, isotonic) = reconstructed(length);
        let rms = |model, braid, points: &[Point]| Assessed::of(model, braid, &given, points).errors.rms;
        let (plain, improved) = (ForceModelName::McKibben, ForceModelName::ImprovedMcKibben);
        // With the braid as given, where the presets were identified.
        let isobaric = isobaric(&given, reach);
        let [ideal, elastic] = [plain, improved].map(|model| rms(model, Braid::Given, &isobaric));
        println!("{length}, isobaric: mckibben {ideal:.1} N, improved-mckibben {elastic:.1} N");
        assert!((ideal / printed - 1.0).abs() < 0.05, "{length}: {ideal} N beside {printed} N");
        assert!(elastic <= bar, "{length}: {elastic} N");
        // As `sinew identify` does with the file. With the braid as given no cubic modulus comes below 54.4 N and 144.9 N
        // there: the cubic cannot follow the short muscle where a load stretches it.
        let [ideal, elastic] = [plain, improved].map(|model| rms(model, Braid::Given, &isotonic));
        let fitted = rms(improved, Braid::Fitted, &isotonic);
        println!(
            "{length}, isotonic: mckibben {ideal:.1} N, improved-mckibben {elastic:.1} N, braid fitted {fitted:.1} N"
        );
        assert!(fitted <= bar, "{length}: {fitted} N");
        assert!(elastic < 0.2 * ideal, "{length}: {elastic} N");
    }
}

#[test]
fn outliers_are_named_and_do_little_harm() {
    let mut text = "time [s],contraction [mm],gauge_pressure [bar],force [N]\n".to_owned();
    let truth = Parameters::default();
    let mut normal = noise(7);
    let points = grid(&truth);
    let exact =
        forces(&Parameters { muscle: sinew::muscle::Muscle { damping: 0.0, ..truth.muscle }, ..truth }, &points);
    for (k, (point, force)) in points.iter().zip(exact).enumerate() {
        let wrong = if k % 29 == 5 { 2000.0 } else { 0.0 };
        let (x, p) = (1e3 * point.contraction, point.gauge_pressure / 1e5);
        text += &format!("{k},{x:.6},{p:.6},{:.6}\n", force + wrong + normal());
    }
    let found = identify(&parse(&text), &truth, Some(ForceModelName::VirtualArea), Braid::Given).unwrap();
    let area = found.parameters.get("virtual_area.area_0").unwrap();
    assert!((area / 0.0091 - 1.0).abs() < 0.01, "{area}");
    let json = report::to_json(&found);
    let outliers = json["outliers"].as_array().unwrap();
    assert_eq!(outliers.len(), 5, "{outliers:?}");
    let lines: Vec<u64> = outliers.iter().map(|o| o["line"].as_u64().unwrap()).collect();
    // Row 5 stands in line 7: the header is line 1.
    assert!(lines.contains(&7) && lines.iter().all(|line| (line - 7) % 29 == 0), "{lines:?}");
}

#[test]
fn only_the_product_of_modulus_and_thickness_is_told() {
    let found = identify(
        &recording("real/map/festo_dmsp_40.csv"),
        &Parameters::load(&format!("{}/data/real/map/festo_dmsp_40.toml", env!("CARGO_MANIFEST_DIR"))).unwrap(),
        Some(ForceModelName::ImprovedMcKibben),
        Braid::Fitted,
    )
    .unwrap();
    let held: Vec<&str> = found.found.fitted.structure.held.iter().map(|held| held.name).collect();
    assert_eq!(held, ["improved_mckibben.membrane_thickness"]);
    let said = report::sentences(&found).join("\n");
    assert!(said.contains("only in combination with improved_mckibben.modulus_0"), "{said}");
    assert!(found.found.errors.rms < 0.05 * 6000.0);
}

#[test]
fn plateaus_are_found_and_motion_is_said() {
    // Ten steps of 2 s: a ramp of 0.5 s, then rest.
    let muscle = Parameters::default();
    let mut text = "time [s],contraction [mm],gauge_pressure [bar],force [N]\n".to_owned();
    for k in 0..4000 {
        let time = 0.005 * f64::from(k);
        let level = (time / 2.0).floor() + ((time % 2.0) / 0.5).min(1.0);
        let (p, x) = (0.4 * level, 0.02 * level);
        let force = muscle.force_models.force(&muscle.muscle, 1e5 * p, x);
        text += &format!("{time},{},{p},{force}\n", 1e3 * x);
    }
    let recordings = parse(&text);
    let points = Points::of(&recordings, 8).unwrap();
    assert_eq!(points.sources, [Source::Plateaus]);
    assert_eq!(points.all.len(), 10);
    for (k, point) in points.all.iter().enumerate() {
        assert!((point.gauge_pressure - 4e4 * (k + 1) as f64).abs() < 200.0, "{point:?}");
        assert_eq!(point.branch, Branch::Shortening);
    }
    let moving = Points::of(&recordings, 50).unwrap();
    assert!(moving.in_motion());
    assert!(moving.notes.iter().any(|note| note.contains("in motion")), "{:?}", moving.notes);
}

#[test]
fn a_load_alone_tells_the_force() {
    let found = identify(
        &recording("nominal_40kg.csv"),
        &Parameters::default(),
        Some(ForceModelName::VirtualArea),
        Braid::Given,
    )
    .unwrap();
    assert!(found.found.errors.relative < 0.02, "{:?}", found.found.errors);
    let damping = found.parameters.get("muscle.damping").unwrap();
    assert!((60.0..100.0).contains(&damping), "{damping}");
}

#[test]
fn isometric_curves_interpolate_and_never_extrapolate() {
    let (given, points) = reconstructed("1000");
    let relation = Relation::of(&points, None);
    let x = 0.15;
    let curve = relation.isometric(x);
    assert!(curve.len() >= 4, "{curve:?}");
    for (pressure, force) in curve {
        let exact = given.force_models.force(&given.muscle, pressure, x);
        assert!((force - exact).abs() < 0.05 * 820.0, "{pressure} Pa: {force} N, {exact} N");
    }
    assert!(relation.isometric(0.5).is_empty() && relation.isometric(-0.2).is_empty());
}

#[test]
fn written_parameters_read_back() {
    let given = Parameters::default();
    let found = identify(&recording("nominal_40kg.csv"), &given, None, Braid::Fitted).unwrap();
    let text = report::to_toml(&found);
    let mut read = Parameters::default();
    read.apply_toml(&text, "parameters.toml").unwrap();
    assert_eq!(read, found.parameters);
    assert!(text.contains("; fitted, "), "{text}");
    assert_eq!(text, report::to_toml(&identify(&recording("nominal_40kg.csv"), &given, None, Braid::Fitted).unwrap()));
}

#[test]
fn no_model_is_praised_where_nothing_could_be_left_out() {
    let model = Some(ForceModelName::VirtualArea);
    let mut found = identify(&recording("nominal_40kg.csv"), &Parameters::default(), model, Braid::Given).unwrap();
    found.rivals = ["virtual-area", "spring"].map(|name| (name.to_owned(), f64::INFINITY)).into();
    let said = report::sentences(&found).join("\n");
    let expected =
        "No model can be trusted: the points allow none to be left out, by which virtual-area would be judged.";
    assert!(said.contains(expected) && !said.contains(" inf "), "{said}");
}
