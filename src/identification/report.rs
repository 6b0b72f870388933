//! An identification as files: `parameters.toml`, `identification.json` and plots.

use super::Identification;
use super::points::{Branch, Point};
use super::structure::model_name;
use crate::comparison::errors::{classes, contraction, force, levels, pressure};
use crate::plot::{Curve, scatter};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Residuals beyond so many robust standard deviations are named.
const FAR: f64 = 5.0;
/// More than this share of points far off is no matter of outliers.
const MANY: f64 = 0.05;
/// Most outliers that are listed.
const LISTED: usize = 50;

/// All files of an identification, as paths in `folder` with their bytes.
pub fn files(found: &Identification, folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![
        ("parameters.toml".to_owned(), to_toml(found)),
        ("identification.json".to_owned(), format!("{:#}\n", to_json(found))),
    ];
    files.extend(plots(found));
    files.into_iter().map(|(name, text)| (folder.join(name), text.into_bytes())).collect()
}

/// What was found in a few sentences.
pub fn sentences(found: &Identification) -> Vec<String> {
    let (all, fitted) = (&found.found, &found.found.fitted);
    let errors = &all.errors;
    let mut said = vec![format!(
        "{}: {:.1} N rms, {:.1} N at most, {:.1} % of the force, R² {:.4}, at {} points worth {:.0} independent ones.",
        fitted.structure.label(),
        errors.rms,
        errors.max,
        100.0 * errors.relative,
        all.determination,
        errors.points,
        fitted.effective
    )];
    for held in &all.held_out {
        said.push(format!(
            "{:.1} N rms on points that the fit did not see, every inner {} left out once.",
            held.rms, held.blocks
        ));
    }
    match found.rivals.first() {
        Some((label, best)) if best.is_infinite() => said.push(format!(
            "No model can be trusted: the points allow none to be left out, by which {label} would be judged."
        )),
        Some((_, best)) => {
            let next = found.rivals.get(1).filter(|(_, rms)| rms.is_finite());
            let next = next.map_or(String::new(), |(label, rms)| format!("; next is {label} with {rms:.1} N"));
            said.push(format!(
                "It is the model of {} with the smallest held-out error, {best:.1} N{next}.",
                found.rivals.len()
            ));
        }
        None => {}
    }
    said.extend(
        fitted
            .structure
            .held
            .iter()
            .map(|held| format!("`{}` is held at {:?}: {}.", held.name, held.value, held.reason)),
    );
    if !found.points.in_motion() {
        let damping = found.parameters.muscle.damping;
        let swings = if damping == 0.0 { "; without any, a load swings for ever" } else { "" };
        said.push(format!("`muscle.damping` stays at {damping:?} N s/m, points at rest do not tell it{swings}."));
    }
    for k in at_bounds(found) {
        let parameter = &fitted.structure.free[k];
        said.push(format!("`{}` stopped at its bound {:?}: no interval.", parameter.variable.name, fitted.values[k]));
    }
    for direction in &fitted.weak {
        let names: Vec<&str> = direction.iter().map(|(k, _)| fitted.structure.free[*k].variable.name).collect();
        let names = names.join(", ");
        let sentence =
            format!("The points hardly tell {names} apart: use them together, and look at no single one of them.");
        if !said.contains(&sentence) {
            said.push(sentence);
        }
    }
    let far = outliers(found);
    let share = far.len() as f64 / errors.points as f64;
    if share > MANY {
        said.push(format!(
            "{:.0} % of the points lie far off: the model misses them, they are no outliers.",
            100.0 * share
        ));
    } else {
        let named = |k: &usize| place(found, *k);
        let list: Vec<String> = far.iter().take(5).map(named).collect();
        if !list.is_empty() {
            let word = if far.len() == 1 { "outlier" } else { "outliers" };
            said.push(format!("{} {word}, counted little: {}.", far.len(), list.join("; ")));
        }
    }
    said
}

/// Positions of points far off, farthest first.
fn outliers(found: &Identification) -> Vec<usize> {
    let fitted = &found.found.fitted;
    let mut far: Vec<usize> =
        (0..fitted.residuals.len()).filter(|&k| fitted.residuals[k].abs() > FAR * fitted.scale).collect();
    far.sort_by(|a, b| fitted.residuals[*b].abs().total_cmp(&fitted.residuals[*a].abs()));
    far
}

fn place(found: &Identification, k: usize) -> String {
    let point = &found.points.all[k];
    let (name, residual) = (&found.recordings[point.recording], found.found.fitted.residuals[k]);
    format!("{name} line {} ({residual:+.1} N)", point.line)
}

fn at_bounds(found: &Identification) -> Vec<usize> {
    let widths = &found.found.fitted.half_widths;
    (0..widths.len()).filter(|&k| widths[k].is_none()).collect()
}

/// `parameters.toml`: all parameters, fitted ones with their intervals.
pub fn to_toml(found: &Identification) -> String {
    let fitted = &found.found.fitted;
    let mut text = format!("# Identified from {}.\n", found.recordings.join(", "));
    sentences(found).iter().for_each(|line| {
        let _ = writeln!(text, "# {line}");
    });
    let _ = writeln!(text, "# Intervals hold 95 %.\n");
    let mut group = String::new();
    for line in found.parameters.to_toml().lines() {
        if let Some(name) = line.strip_prefix('[') {
            name.trim_end_matches(']').clone_into(&mut group);
        }
        let key = line.split(" = ").next().unwrap_or_default();
        let name = format!("{group}.{key}");
        let free = fitted.structure.free.iter().position(|p| p.variable.name == name);
        let held = fitted.structure.held.iter().find(|held| held.name == name);
        let remark = match (free, held) {
            (Some(k), _) => fitted.half_widths[k].map_or("; fitted, at its bound".to_owned(), |half| {
                format!("; fitted, {:.6e} to {:.6e}", fitted.values[k] - half, fitted.values[k] + half)
            }),
            (None, Some(held)) => format!("; held: {}", held.reason),
            (None, None) => String::new(),
        };
        let _ = writeln!(text, "{line}{remark}");
    }
    text
}

/// `identification.json`.
pub fn to_json(found: &Identification) -> Value {
    let (all, fitted) = (&found.found, &found.found.fitted);
    let parameter = |k: usize| {
        let (p, value, half) = (&fitted.structure.free[k], fitted.values[k], fitted.half_widths[k]);
        let entry = json!({
            "value": value, "low": half.map(|half| value - half), "high": half.map(|half| value + half),
            "unit": p.variable.unit.symbol, "at_bound": half.is_none(), "linear": k < fitted.structure.linear,
        });
        (p.variable.name.to_owned(), entry)
    };
    let direction = |shares: &Vec<(usize, f64)>| -> Map<String, Value> {
        shares.iter().map(|(k, share)| (fitted.structure.free[*k].variable.name.to_owned(), json!(share))).collect()
    };
    let outlier = |k: usize| {
        let point = &found.points.all[k];
        json!({
            "recording": found.recordings[point.recording], "line": point.line, "residual": fitted.residuals[k],
            "weight": fitted.weights[k],
        })
    };
    json!({
        "model": model_name(fitted.structure.model),
        "braid": fitted.structure.braid,
        "recordings": found.recordings,
        "points": { "count": found.points.all.len(), "effective": fitted.effective, "from": found.points.sources },
        "parameters": (0..fitted.values.len()).map(parameter).collect::<Map<_, _>>(),
        "held": fitted.structure.held,
        "identifiability": {
            "singular_values": fitted.singular_values,
            "hardly_told": fitted.weak.iter().map(direction).collect::<Vec<_>>(),
        },
        "errors": {
            "all": all.errors, "r_squared": all.determination, "below_1_bar": all.low, "from_1_bar": all.high,
            "by_pressure": all.by_pressure, "by_load": all.by_load, "held_out": all.held_out, "robust_sigma": fitted.scale,
        },
        "outliers": outliers(found).into_iter().take(LISTED).map(outlier).collect::<Vec<_>>(),
        "rivals": found.rivals.iter().map(|(label, rms)| json!({ "model": label, "held_out_rms": rms })).collect::<Vec<_>>(),
        "ended": format!("{:?}", fitted.ended),
        "notes": found.notes,
    })
}

/// Model and recordings.
fn title(found: &Identification) -> String {
    let more = if found.recordings.len() > 1 { " and others" } else { "" };
    format!("{} on {}{more}", found.found.fitted.structure.label(), found.recordings[0])
}

/// Measured and modelled force, and what is left of it, as SVG.
fn plots(found: &Identification) -> Vec<(String, String)> {
    let (points, residuals) = (&found.points.all, &found.found.fitted.residuals);
    let label = title(found);
    let over = |of: fn(&Point) -> f64, size: f64| points.iter().map(|p| of(p) / size).collect::<Vec<f64>>();
    let (bars, millimetres) = (over(pressure, 1e5), over(contraction, 1e-3));
    let dots = |x: &[f64]| {
        let split = |branch: Branch| -> (Vec<f64>, Vec<f64>) {
            let of = (0..points.len())
                .filter(|&k| (points[k].branch == Branch::Lengthening) == (branch == Branch::Lengthening));
            of.map(|k| (x[k], residuals[k])).unzip()
        };
        (split(Branch::Shortening), split(Branch::Lengthening))
    };
    let mut all = Vec::new();
    for (name, axis, x) in
        [("pressure", "gauge pressure [bar]", &bars), ("contraction", "contraction [mm]", &millimetres)]
    {
        let ((up_x, up), (down_x, down)) = dots(x);
        let curves = [
            Curve { label: "shortening", x: &up_x, y: &up, color: 1 },
            Curve { label: "lengthening", x: &down_x, y: &down, color: 2 },
        ];
        let title = format!("{label}: measured − modelled force");
        all.push((format!("residual-{name}.svg"), scatter(&title, axis, "residual [N]", &curves, &[])));
    }
    all.push(("force.svg".to_owned(), force_plot(found, &label)));
    all
}

/// Force over contraction, pressure after pressure, or contraction over pressure, load after load.
fn force_plot(found: &Identification, label: &str) -> String {
    let points = &found.points.all;
    let modelled: Vec<f64> =
        points.iter().zip(&found.found.fitted.residuals).map(|(point, residual)| point.force - residual).collect();
    let isotonic = levels(points, force).is_some_and(|levels| 3 * levels.len() <= points.len());
    let (groups, x, axis): (_, fn(&Point) -> f64, _) = if isotonic {
        (classes(points, force), |p| p.gauge_pressure / 1e5, "gauge pressure [bar]")
    } else {
        (classes(points, pressure), |p| p.contraction * 1e3, "contraction [mm]")
    };
    let (mut lines, mut dots) = (Vec::new(), Vec::new());
    for group in &groups {
        let mut members = group.members.clone();
        members.sort_by(|a, b| x(&points[*a]).total_cmp(&x(&points[*b])));
        lines.push(members.iter().map(|&k| (x(&points[k]), modelled[k])).unzip::<_, _, Vec<_>, Vec<_>>());
        dots.push(members.iter().map(|&k| (x(&points[k]), points[k].force)).unzip::<_, _, Vec<_>, Vec<_>>());
    }
    let (dots, lines) = (curves("measured", 0, &dots), curves("modelled", 1, &lines));
    scatter(&format!("{label}: force at the points"), axis, "force [N]", &dots, &lines)
}

/// Curves of one colour under one name.
fn curves<'a>(label: &'a str, color: usize, all: &'a [(Vec<f64>, Vec<f64>)]) -> Vec<Curve<'a>> {
    let named = |k: usize| if k == 0 { label } else { "" };
    all.iter().enumerate().map(|(k, (x, y))| Curve { label: named(k), x, y, color }).collect()
}
