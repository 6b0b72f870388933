//! A comparison as files: `comparison.json`, `report.html` and a table in Markdown.

use super::assess::{Assessed, ClassErrors};
use super::claims::{self, Claim, Verdict, full_scale};
use super::cross::{Cross, Transfer};
use super::errors::{classes, contraction, force, levels, pressure};
use super::isometric::Relation;
use super::{Comparison, OnMuscle};
use crate::identification::points::{Branch, Point, thinned};
use crate::identification::structure::{forces, model_name};
use crate::package::render;
use minijinja::context;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Isometric curves of a figure, as in thesis figure 4.23.
const ISOMETRIC: usize = 5;
/// Points of a modelled curve.
const SMOOTH: usize = 60;
/// Lines of equal force in a map.
const CONTOURS: usize = 8;
/// Most points of a muscle that a figure shows.
const MOST_POINTS: usize = 1500;

/// All files of a comparison, as paths in `folder` with their bytes.
pub fn files(found: &Comparison, folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    vec![
        (folder.join("comparison.json"), format!("{:#}\n", to_json(found)).into_bytes()),
        (folder.join("comparison.md"), markdown(found).into_bytes()),
        (folder.join("report.html"), html(found).into_bytes()),
    ]
}

/// `comparison.json`.
pub fn to_json(found: &Comparison) -> Value {
    let muscle = |muscle: &OnMuscle| {
        json!({
            "name": muscle.name,
            "points": muscle.points.all.len(),
            "effective_points": muscle.effective,
            "from": muscle.points.sources,
            "full_scale_force": full_scale(muscle),
            "models": muscle.models.iter().map(|model| of_model(model, muscle.effective)).collect::<Vec<_>>(),
            "claims": claims::on_muscle(muscle),
            "notes": muscle.points.notes,
        })
    };
    json!({
        "muscles": found.muscles.iter().map(muscle).collect::<Vec<_>>(),
        "cross_validation": found.cross,
        "claims": cross_claims(found),
    })
}

fn of_model(model: &Assessed, effective: f64) -> Value {
    let fitted = &model.fitted;
    let criteria = model.criteria(effective);
    let values =
        fitted.structure.free.iter().zip(&fitted.values).zip(&fitted.half_widths).map(|((free, value), half)| {
            let (low, high) = (half.map(|half| value - half), half.map(|half| value + half));
            (
                free.variable.name.to_owned(),
                json!({ "value": value, "low": low, "high": high, "unit": free.variable.unit.symbol }),
            )
        });
    json!({
        "model": model_name(fitted.structure.model), "label": fitted.structure.label(), "braid": fitted.structure.braid,
        "errors": model.errors, "r_squared": model.determination, "below_1_bar": model.low, "from_1_bar": model.high,
        "by_pressure": model.by_pressure, "by_load": model.by_load,
        "held_out": model.held_out, "held_out_rms": model.held_out_rms(), "parameter_count": model.count(),
        "aicc": criteria.map(|c| c[0]), "bic": criteria.map(|c| c[1]),
        "parameters": values.collect::<Map<_, _>>(), "held": fitted.structure.held,
    })
}

/// The claim about cross-validation, for every pair of muscles.
fn cross_claims(found: &Comparison) -> Vec<Claim> {
    pairs(found)
        .into_iter()
        .flat_map(|(one, other)| {
            [Transfer::AsTheyAre, Transfer::Normalised].map(|how| claims::keeps_a_sign(&found.cross, one, other, how))
        })
        .flatten()
        .collect()
}

/// The thesis' claims, one row each, with a verdict per muscle.
fn summary(found: &Comparison) -> (Vec<String>, Vec<Vec<String>>) {
    let all: Vec<Vec<Claim>> = found.muscles.iter().map(claims::on_muscle).collect();
    let names = found.muscles.iter().map(|muscle| muscle.name.clone());
    let header = std::iter::once("claim of the thesis".to_owned()).chain(names).collect();
    let row = |claim: &Claim| {
        let of = |claims: &Vec<Claim>| {
            claims.iter().find(|other| other.claim == claim.claim).map_or("–", |other| word(other.verdict)).to_owned()
        };
        std::iter::once(claim.claim.to_owned()).chain(all.iter().map(of)).collect()
    };
    (header, all.first().into_iter().flatten().map(row).collect())
}

const SIGN_HEADER: [&str; 3] = ["muscles", "coefficients as they are", "normalised"];

/// Pairs of muscles, and whether the error of `improved-mckibben` keeps a sign between them.
fn sign_rows(found: &Comparison) -> Vec<Vec<String>> {
    let row = |(one, other): (&str, &str)| {
        let verdict = |how| Some(word(claims::keeps_a_sign(&found.cross, one, other, how)?.verdict).to_owned());
        Some(vec![format!("{one}, {other}"), verdict(Transfer::AsTheyAre)?, verdict(Transfer::Normalised)?])
    };
    pairs(found).into_iter().filter_map(row).collect()
}

fn pairs(found: &Comparison) -> Vec<(&str, &str)> {
    let names: Vec<&str> = found.muscles.iter().map(|muscle| muscle.name.as_str()).collect();
    names.iter().enumerate().flat_map(|(k, one)| names[k + 1..].iter().map(|other| (*one, *other))).collect()
}

/// A word for a verdict.
fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Confirmed => "confirmed",
        Verdict::Refuted => "refuted",
        Verdict::Open => "open",
    }
}

/// The cells of a model in the table of a muscle: those of [`HEADER`].
fn cells(model: &Assessed, full: f64, effective: f64, best: Option<f64>) -> Vec<String> {
    let newton = |value: f64| if value.is_finite() { format!("{value:.1}") } else { "–".to_owned() };
    let percent = |errors: Option<super::errors::Errors>| {
        errors.map_or("–".to_owned(), |errors| format!("{:.1}", 100.0 * errors.relative))
    };
    let criterion =
        model.criteria(effective).zip(best).map_or("–".to_owned(), |(c, best)| format!("{:.0}", c[0] - best));
    let held_out = |model: &Assessed, wanted: fn(&str) -> bool| {
        model.held_out.iter().find(|held| wanted(held.blocks)).map_or("–".to_owned(), |held| newton(held.rms))
    };
    vec![
        model.fitted.structure.label(),
        model.count().to_string(),
        newton(model.errors.rms),
        format!("{:.1}", 100.0 * model.errors.rms / full),
        newton(model.errors.max),
        percent(Some(model.errors)),
        percent(model.low),
        percent(model.high),
        held_out(model, |blocks| blocks == "pressure"),
        held_out(model, |blocks| blocks != "pressure"),
        criterion,
    ]
}

const HEADER: [&str; 11] = [
    "model",
    "fitted",
    "rms [N]",
    "of full scale [%]",
    "max [N]",
    "relative [%]",
    "below 1 bar [%]",
    "from 1 bar [%]",
    "pressures held out, rms [N]",
    "loads or contractions held out, rms [N]",
    "ΔAICc",
];

fn rows(muscle: &OnMuscle) -> Vec<Vec<String>> {
    let criteria = muscle.models.iter().filter_map(|model| model.criteria(muscle.effective));
    let best = criteria.map(|c| c[0]).min_by(f64::total_cmp);
    let full = full_scale(muscle);
    muscle.models.iter().map(|model| cells(model, full, muscle.effective, best)).collect()
}

/// The rows of a muscle for a terminal, with the header.
pub fn table_of(muscle: &OnMuscle) -> Vec<Vec<String>> {
    std::iter::once(HEADER.map(str::to_owned).to_vec()).chain(rows(muscle)).collect()
}

/// One sentence on the best model of a muscle.
pub fn headline(muscle: &OnMuscle) -> String {
    muscle.models.first().map_or_else(String::new, |best| {
        let share = 100.0 * best.errors.rms / full_scale(muscle);
        if best.held_out_rms().is_infinite() {
            return format!(
                "{}: no model can be trusted: the points allow none to be left out, by which {} would be judged; fitted to all, {:.1} N rms or \
                 {share:.1} % of full scale.",
                muscle.name, best.fitted.structure.label(), best.errors.rms
            );
        }
        format!(
            "{}: best on pressures that the fit did not see is {}, {:.1} N rms there; fitted to all, {:.1} N rms or {share:.1} % of full scale.",
            muscle.name, best.fitted.structure.label(), best.held_out_rms(), best.errors.rms
        )
    })
}

const INTRODUCTION: &str = "\
# Force models compared

Every model is fitted to all points of a muscle, with outliers counted little. \"Braid fitted\": thread length and turns were fitted
too; otherwise they are as given. *Relative* is the mean absolute error over the mean absolute force. *Held out*: whole pressures,
and whole loads or contractions, are left out of the fit in turn, the first and the last of them excepted; a dash where the rest
cannot tell the parameters. The order is that of the error on pressures left out. ΔAICc counts independent points only and is zero
for the best. A number of fitted parameters near that of the levels of contraction is no knowledge of what lies between them.

";

/// The comparison as Markdown.
pub fn markdown(found: &Comparison) -> String {
    let mut text = INTRODUCTION.to_owned();
    let (header, rows_of_claims) = summary(found);
    if found.muscles.len() > 1 && !rows_of_claims.is_empty() {
        let _ = writeln!(text, "## What the thesis claims, muscle by muscle\n");
        write_table(&mut text, &header.iter().map(String::as_str).collect::<Vec<_>>(), &rows_of_claims);
    }
    for muscle in &found.muscles {
        let _ = writeln!(text, "## {}\n\n{}\n", muscle.name, headline(muscle));
        let _ = writeln!(text, "{}.\n", muscle.points.notes.join("; "));
        write_table(&mut text, &HEADER, &rows(muscle));
        for claim in claims::on_muscle(muscle) {
            let _ = writeln!(text, "- {} **{}.** {}", claim.claim, capital(word(claim.verdict)), claim.because);
        }
        text.push('\n');
    }
    if !found.cross.is_empty() {
        let _ = writeln!(text, "## Parameters of one muscle on the points of another\n");
        let signs = sign_rows(found);
        if signs.is_empty() {
            write_table(&mut text, &CROSS_HEADER, &cross_rows(found));
        } else {
            let _ = writeln!(text, "{SIGN}\n");
            write_table(&mut text, &SIGN_HEADER, &signs);
            let own: Vec<Vec<String>> =
                cross_rows(found).into_iter().filter(|row| row[0] == "improved-mckibben").collect();
            write_table(&mut text, &CROSS_HEADER, &own);
        }
    }
    // Names of files are no markup.
    text.replace('&', "&amp;").replace('<', "&lt;")
}

const SIGN: &str = "The thesis finds that the error of `improved-mckibben` keeps a sign, opposite in the two directions. At least 80 % of \
the points on one side, and on opposite sides, count as such. The other models are in `comparison.json`.";

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn write_table(text: &mut String, header: &[&str], rows: &[Vec<String>]) {
    let line = |cells: &[&str]| {
        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    *text += &line(header);
    let _ = writeln!(text, "|---|{}", "---:|".repeat(header.len() - 1));
    rows.iter().for_each(|row| *text += &line(&row.iter().map(String::as_str).collect::<Vec<_>>()));
    text.push('\n');
}

const CROSS_HEADER: [&str; 7] =
    ["model", "parameters of", "on", "taken over", "rms [N]", "own rms [N]", "too low at [% of points]"];

fn cross_rows(found: &Comparison) -> Vec<Vec<String>> {
    let row = |cross: &Cross| {
        let how = if cross.transfer == Transfer::Normalised { "normalised" } else { "as they are" };
        let newton = |value: f64| if value.is_finite() { format!("{value:.1}") } else { "–".to_owned() };
        vec![
            cross.model.to_owned(),
            cross.of.clone(),
            cross.on.clone(),
            how.to_owned(),
            newton(cross.errors.rms),
            newton(cross.own_rms),
            format!("{:.0}", 100.0 * cross.too_low),
        ]
    };
    found.cross.iter().map(row).collect()
}

/// `report.html`: one file that opens offline.
pub fn html(found: &Comparison) -> String {
    let muscle = |muscle: &OnMuscle| {
        context! {
            name => muscle.name.clone(),
            headline => headline(muscle),
            notes => muscle.points.notes.clone(),
            rows => rows(muscle),
            models => muscle.models.iter().map(|model| model.fitted.structure.label()).collect::<Vec<_>>(),
            by_pressure => class_rows(muscle, |model| &model.by_pressure, 1e5),
            by_load => class_rows(muscle, |model| &model.by_load, 1.0),
            claims => shown(claims::on_muscle(muscle)),
        }
    };
    let data = json!({ "muscles": found.muscles.iter().map(figures).collect::<Vec<_>>() });
    let page = context! {
        muscles => found.muscles.iter().map(muscle).collect::<Vec<_>>(),
        header => HEADER,
        summary => summary(found),
        sign_header => SIGN_HEADER,
        signs => sign_rows(found),
        cross_header => CROSS_HEADER,
        cross => cross_rows(found),
        claims => shown(cross_claims(found)),
        style => concat!(
            include_str!("../diagnosis/report/vendor/uPlot.min.css"),
            include_str!("../diagnosis/report/page.css"),
            include_str!("page.css")
        ),
        library => include_str!("../diagnosis/report/vendor/uPlot.iife.min.js"),
        script => include_str!("page.js"),
        // Nothing inside can end the script around it.
        data => data.to_string().replace('<', "\\u003c"),
        version => env!("CARGO_PKG_VERSION"),
    };
    render("comparison.html", include_str!("page.html"), &page)
}

fn shown(claims: Vec<Claim>) -> Vec<minijinja::Value> {
    let one =
        |claim: Claim| context! { claim => claim.claim, verdict => word(claim.verdict), because => claim.because };
    claims.into_iter().map(one).collect()
}

/// Rms per class, one row per class and one column per model: the five best.
fn class_rows(muscle: &OnMuscle, of: fn(&Assessed) -> &Vec<ClassErrors>, size: f64) -> Vec<Vec<String>> {
    let Some(first) = muscle.models.first() else { return Vec::new() };
    let row = |k: usize, class: &ClassErrors| {
        let [low, high] = class.class.span.map(|value| value / size);
        let name = if high - low > 0.02 * high.abs() {
            format!("{low:.4} … {high:.4}")
        } else {
            format!("{:.4}", class.class.value / size)
        };
        let mut cells = vec![trimmed(&name), class.errors.points.to_string()];
        cells.extend(muscle.models.iter().take(5).map(|model| format!("{:.1}", of(model)[k].errors.rms)));
        cells
    };
    of(first).iter().enumerate().map(|(k, class)| row(k, class)).collect()
}

/// Numbers without zeros that say nothing.
fn trimmed(text: &str) -> String {
    text.split(' ')
        .map(|part| {
            if part.contains('.') {
                part.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                part.to_owned()
            }
        })
        .collect::<Vec<_>>()
        .join(" ")
}

/// What the figures of a muscle show, in units for people: bar, mm, N.
fn figures(muscle: &OnMuscle) -> Value {
    let all = &muscle.points.all;
    let kept = thinned(all.len(), MOST_POINTS);
    let points: Vec<Point> = kept.iter().map(|&k| all[k]).collect();
    let loads = levels(&points, force).filter(|levels| 3 * levels.len() <= points.len());
    let load_levels: Vec<f64> = loads.iter().flatten().map(|class| class.value).collect();
    let label_of = |classes: Vec<super::errors::Class>| {
        let mut labels = vec![0; points.len()];
        for (k, class) in classes.iter().enumerate() {
            class.members.iter().for_each(|&member| labels[member] = k);
        }
        (labels, classes.into_iter().map(|class| class.value).collect::<Vec<f64>>())
    };
    let (load_of, load_values) = label_of(classes(&points, force));
    let (pressure_of, pressure_values) = label_of(classes(&points, pressure));
    let relation = Relation::of(&points, None);
    let branches = [Branch::Shortening, Branch::Lengthening];
    let in_bar = |pairs: Vec<(f64, f64)>| pairs.into_iter().map(|(p, f)| (p / 1e5, f)).collect::<Vec<_>>();
    // Each branch of a hysteresis where both were measured, or else all points together.
    let by_branch = branches.map(|branch| Relation::of(&points, Some(branch)));
    let both = by_branch.iter().all(|relation| relation.curves.len() > 1);
    let isometric = |x: f64| {
        if both {
            by_branch.iter().map(|relation| in_bar(relation.isometric(x))).collect::<Vec<_>>()
        } else {
            vec![in_bar(relation.isometric(x)), Vec::new()]
        }
    };
    let lengths = relation.contractions(ISOMETRIC);
    let [low, high] = ends(&points, pressure);
    let model = |model: &Assessed| {
        let parameters = &model.fitted.parameters;
        let modelled: Vec<f64> = kept.iter().map(|&k| all[k].force - model.fitted.residuals[k]).collect();
        let grid = |x: f64| -> Vec<Value> {
            let at = |k: usize| low + (high - low) * k as f64 / (SMOOTH - 1) as f64;
            let pairs = (0..SMOOTH).map(|k| {
                let point = Point { gauge_pressure: at(k), contraction: x, contraction_velocity: 0.0, ..points[0] };
                json!([at(k) / 1e5, forces(parameters, &[point])[0]])
            });
            pairs.collect()
        };
        json!({
            "label": model.fitted.structure.label(),
            "modelled": modelled,
            "isometric": lengths.iter().map(|x| grid(*x)).collect::<Vec<_>>(),
            "contours": contours(muscle, model, &points),
        })
    };
    json!({
        "name": muscle.name,
        "isotonic": !load_levels.is_empty(),
        "pressure": points.iter().map(|p| p.gauge_pressure / 1e5).collect::<Vec<_>>(),
        "contraction": points.iter().map(|p| p.contraction * 1e3).collect::<Vec<_>>(),
        "force": points.iter().map(force).collect::<Vec<_>>(),
        "branch": points.iter().map(|p| branches.iter().position(|b| *b == p.branch)).collect::<Vec<_>>(),
        "load_of": load_of, "loads": load_values,
        "pressure_of": pressure_of, "pressures": pressure_values.iter().map(|p| p / 1e5).collect::<Vec<_>>(),
        "lengths": lengths.iter().map(|x| x * 1e3).collect::<Vec<_>>(),
        "isometric": lengths.iter().map(|x| isometric(*x)).collect::<Vec<_>>(),
        "models": muscle.models.iter().map(model).collect::<Vec<_>>(),
    })
}

fn ends(points: &[Point], of: fn(&Point) -> f64) -> [f64; 2] {
    let values = || points.iter().map(of);
    [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
}

/// Lines of equal force over contraction and pressure, within the ranges of the points: force with its line.
fn contours(muscle: &OnMuscle, model: &Assessed, points: &[Point]) -> Vec<Value> {
    let (parameters, full) = (&model.fitted.parameters, full_scale(muscle));
    let ([low, high], [least, most]) = (ends(points, contraction), ends(points, pressure));
    let line = |k: usize| {
        let force = full * (k as f64 + 0.5) / CONTOURS as f64;
        let at = |i: usize| low + (high - low) * i as f64 / (SMOOTH - 1) as f64;
        let place = |i: usize| {
            let pressure = parameters.force_models.holding_pressure(&parameters.muscle, at(i), force);
            let inside = (least..=most).contains(&pressure);
            json!([at(i) * 1e3, inside.then_some(pressure / 1e5)])
        };
        json!({ "force": force, "line": (0..SMOOTH).map(place).collect::<Vec<_>>() })
    };
    (0..CONTOURS).map(line).collect()
}
