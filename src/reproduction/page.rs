//! `thesis.md` with its figures, and JSON.

use super::{Compared, Judged, Reproduction, Verdict};
use crate::package::short;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const INTRODUCTION: &str = "# The thesis, reproduced

Written by `sinew reproduce --out docs`; do not edit.

What the master thesis “Comparative Assessment and Improvement of Pneumatic Artificial Muscles Modelling”, Politecnico di Milano, prints in
chapters 3 to 5, beside what comes out here. *Holds*: the same comes out. *Corrected*: something else does; the section says what,
and why. *Not reproducible*: it takes measurements or numbers that are not printed. The thesis' own measurements are lost; points
that stand for them are **reconstructed** from its virtual-area models, and say so.
";

/// All files, as paths in `folder` with their bytes.
pub fn files(found: &Reproduction, folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![(folder.join("thesis.md"), page(found).into_bytes())];
    for (name, svg) in &found.figures {
        files.push((folder.join("thesis").join(name), svg.clone().into_bytes()));
    }
    files
}

/// Everything for machines, in the units that the document shows.
pub fn to_json(found: &Reproduction) -> Value {
    let item = |judged: &Judged| {
        let item = &judged.item;
        json!({
            "at": item.at, "what": item.what, "says": item.says, "unit": item.unit, "numbers": judged.numbers,
            "verdict": judged.verdict, "reason": item.reason,
        })
    };
    let section = |(section, items): &(super::Section, Vec<Judged>)| json!({ "title": section.title, "items": items.iter().map(item).collect::<Vec<_>>() });
    json!({ "sections": found.sections.iter().map(section).collect::<Vec<_>>() })
}

fn page(found: &Reproduction) -> String {
    let mut text = INTRODUCTION.to_owned();
    let all = || found.sections.iter().flat_map(|(_, items)| items);
    let count = |verdict: Verdict| all().filter(|judged| judged.verdict == verdict).count();
    let [holds, corrected, lost] = Verdict::ALL.map(count);
    text += "\n## In short\n\n";
    found.in_short.iter().for_each(|line| text += &format!("- {line}\n"));
    let _ = write!(
        text,
        "\n## Summary\n\n{holds} hold, {corrected} are corrected, {lost} are not reproducible. A printed number holds where it is off by \
         less than 1 %, or what stands behind ±; a statement where the bound behind it is kept.\n\n\
         | | | printed | computed | verdict |\n|---|---|---|---|---|\n"
    );
    for (section, items) in &found.sections {
        let _ = writeln!(text, "| **[{}](#{})** | | | | |", section.title, anchor(&section.title));
        items.iter().for_each(|judged| text += &row(judged));
    }
    for (section, items) in &found.sections {
        let _ = write!(text, "\n## {}\n\n{}\n", section.title, section.text.trim());
        for judged in items.iter().filter(|judged| judged.numbers.len() > 1) {
            text += &several(judged);
        }
        text += &reasons(items);
        for (file, caption) in &section.figure {
            let _ = write!(text, "\n{caption}:\n\n![{caption}](thesis/{file})\n");
        }
    }
    text
}

/// The anchor of a heading, as GitHub makes it.
fn anchor(title: &str) -> String {
    let kept = title.to_lowercase().replace(' ', "-");
    kept.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect()
}

/// A number with its unit.
fn number(value: f64, unit: &str) -> String {
    let text = if value.is_finite() { short(value).replace('-', "−") } else { "none".to_owned() };
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}

/// What is printed in an item with one number, and how much it may be off.
fn printed(judged: &Judged, value: Option<f64>) -> String {
    let item = &judged.item;
    let Some(value) = value else {
        let bounds = match (item.at_least, item.at_most) {
            (Some(low), Some(high)) => format!("{} … {}", number(low, ""), number(high, &item.unit)),
            (Some(low), None) => format!("≥ {}", number(low, &item.unit)),
            (None, Some(high)) => format!("≤ {}", number(high, &item.unit)),
            (None, None) => String::new(),
        };
        return format!("{} ({bounds})", item.says.as_deref().unwrap_or_default());
    };
    number(value, &item.unit) + &tolerance(judged)
}

fn tolerance(judged: &Judged) -> String {
    judged.item.within.map_or(String::new(), |share| format!(" ± {} %", short(100.0 * share)))
}

fn row(judged: &Judged) -> String {
    let item = &judged.item;
    let (printed, computed) = match judged.numbers.as_slice() {
        [] => (String::new(), String::new()),
        [only] => (printed(judged, only.printed), number(only.computed, &item.unit)),
        several => {
            let worst = several.iter().map(Compared::off).fold(0.0, f64::max);
            let off = if worst < 10.0 {
                format!("off by up to {} %", short(100.0 * worst))
            } else {
                "off by orders of magnitude".to_owned()
            };
            (format!("{} numbers{}", several.len(), tolerance(judged)), off)
        }
    };
    let verdict = match judged.verdict {
        Verdict::Holds => "holds".to_owned(),
        other => format!("**{}**", other.words()),
    };
    format!("| {} | {} | {printed} | {computed} | {verdict} |\n", item.at, item.what)
}

/// The table of an item with several numbers.
fn several(judged: &Judged) -> String {
    let item = &judged.item;
    let mut text = format!("\n{}, {}:\n\n| | printed | computed |\n|---|---:|---:|\n", item.at, item.what);
    for Compared { name, printed, computed } in &judged.numbers {
        let printed = printed.map_or(String::new(), |printed| number(printed, ""));
        let _ = writeln!(text, "| {name} | {printed} | {} |", number(*computed, ""));
    }
    text
}

fn reasons(items: &[Judged]) -> String {
    let mut text = String::new();
    for judged in items {
        if let Some(reason) = &judged.item.reason {
            let (item, verdict) = (&judged.item, judged.verdict.words());
            let _ = writeln!(
                text,
                "{}- **{}**, {}: {verdict}. {reason}",
                if text.is_empty() { "\n" } else { "" },
                item.at,
                item.what
            );
        }
    }
    text
}
