//! The thesis reproduced: what chapters 3 to 5 print beside what comes out here, with a verdict on each.
//!
//! `thesis.toml` holds what is printed, and only that; [`quantities`] and [`equations`] compute, [`figures`] draws, and
//! the verdict follows from comparing. [`files`] writes it down as `thesis.md`.

pub mod equations;
pub mod figures;
mod page;
pub mod quantities;

pub use page::{files, to_json};

use crate::Result;
use quantities::{Basis, Quantity};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A printed number agrees where it is off by less than this share, unless its entry says otherwise.
const WITHIN: f64 = 0.01;

/// What became of something printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It comes out.
    Holds,
    /// Something else comes out.
    Corrected,
    /// What it would take is not in the thesis.
    NotReproducible,
}

impl Verdict {
    /// All, in the order of the document.
    pub const ALL: [Self; 3] = [Self::Holds, Self::Corrected, Self::NotReproducible];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Corrected => "corrected",
            Self::NotReproducible => "not reproducible",
        }
    }
}

/// What is printed, as in `thesis.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thesis {
    /// What a hurried reader should know, line by line.
    pub in_short: Vec<String>,
    /// Sections of the document.
    pub section: Vec<Section>,
}

/// A section of the document.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Its title.
    pub title: String,
    /// What a reader should know first.
    pub text: String,
    /// What is printed there.
    #[serde(default)]
    pub item: Vec<Item>,
    /// Figures that are drawn: file name and caption.
    #[serde(default)]
    pub figure: Vec<(String, String)>,
}

/// Something printed: a formula, numbers, or a statement.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// Numbers of its equations, tables and figures, or its section.
    pub at: String,
    /// What it is about.
    pub what: String,
    /// Unit in which it is shown.
    #[serde(default)]
    pub unit: String,
    /// Number of a formula of [`equations`], which is evaluated as printed and as it should be.
    pub equation: Option<String>,
    /// Printed numbers.
    #[serde(default)]
    pub values: Vec<Value>,
    /// Share by which a number may be off.
    pub within: Option<f64>,
    /// A printed statement, where there is no number.
    pub says: Option<String>,
    /// What bears it out.
    pub quantity: Option<Quantity>,
    /// Smallest value with which the statement holds, in the unit shown.
    pub at_least: Option<f64>,
    /// Largest.
    pub at_most: Option<f64>,
    /// Whether a number that differs may do so because the measurements that it was made from are not printed.
    #[serde(default)]
    pub lost: bool,
    /// Why it holds no longer, or cannot be reproduced; or what to know about it.
    pub reason: Option<String>,
}

impl Item {
    /// Share by which a number may be off.
    pub fn within(&self) -> f64 {
        self.within.unwrap_or(WITHIN)
    }
}

/// A printed number.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Value {
    /// What it is called, where there are several.
    #[serde(default)]
    pub name: String,
    /// The number, in the unit shown, or what follows from printed ones.
    pub printed: Printed,
    /// What it is compared with.
    pub quantity: Quantity,
}

/// A number, or what follows from printed numbers that a preset holds.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub enum Printed {
    /// As printed.
    Number(f64),
    /// Computed from what is printed.
    From(Quantity),
}

/// A number beside what comes out, in the unit shown.
#[derive(Debug, Clone, Serialize)]
pub struct Compared {
    /// What it is called.
    pub name: String,
    /// As printed; none for a statement.
    pub printed: Option<f64>,
    /// As computed.
    pub computed: f64,
}

impl Compared {
    /// By which share the printed number is off.
    pub fn off(&self) -> f64 {
        self.printed.map_or(0.0, |printed| (printed - self.computed).abs() / self.computed.abs())
    }
}

/// An item with its verdict.
#[derive(Debug, Clone)]
pub struct Judged {
    /// What is printed.
    pub item: Item,
    /// The numbers.
    pub numbers: Vec<Compared>,
    /// What became of it.
    pub verdict: Verdict,
}

/// All sections with their items judged, and the figures: file name and SVG.
#[derive(Debug)]
pub struct Reproduction {
    /// What a hurried reader should know.
    pub in_short: Vec<String>,
    /// Section after section.
    pub sections: Vec<(Section, Vec<Judged>)>,
    /// Figures.
    pub figures: Vec<(String, String)>,
}

/// What is printed.
pub fn thesis() -> Thesis {
    toml::from_str(include_str!("thesis.toml")).expect("the file is part of the program")
}

/// Recomputes everything; `done` is told of each section.
///
/// # Errors
/// Those of the fits and simulations.
pub fn reproduce(done: &(dyn Fn(&str) + Sync)) -> Result<Reproduction> {
    let basis = Basis::new()?;
    let of_section = |section: Section| {
        let judged = section.item.par_iter().map(|item| judge(item, &basis)).collect::<Result<Vec<_>>>()?;
        done(&section.title);
        Ok((section, judged))
    };
    let Thesis { in_short, section } = thesis();
    let sections = section.into_iter().map(of_section).collect::<Result<Vec<_>>>()?;
    let names: Vec<&String> = sections.iter().flat_map(|(section, _)| &section.figure).map(|(name, _)| name).collect();
    let drawn = names.par_iter().map(|name| Ok(((*name).clone(), figures::draw(name, &basis)?)));
    let figures = drawn.collect::<Result<Vec<_>>>()?;
    Ok(Reproduction { in_short, sections, figures })
}

/// How many sections [`reproduce`] tells of.
pub fn pieces() -> usize {
    thesis().section.len()
}

/// Size of a unit of a table, SI.
fn size(unit: &str) -> f64 {
    match unit {
        "%" | "cm" => 1e-2,
        "mm" => 1e-3,
        "mm²" => 1e-6,
        "°" => 1_f64.to_radians(),
        "Hz" => std::f64::consts::TAU,
        "bar" => 1e5,
        "GPa" => 1e9,
        "MPa" => 1e6,
        _ => 1.0,
    }
}

fn judge(item: &Item, basis: &Basis) -> Result<Judged> {
    let size = size(&item.unit);
    let mut numbers = Vec::new();
    if let Some([printed, computed]) = item.equation.as_deref().map(equations::both) {
        numbers.push(Compared { name: String::new(), printed: Some(printed / size), computed: computed / size });
    }
    for Value { name, printed, quantity } in &item.values {
        let printed = match printed {
            Printed::Number(number) => *number,
            Printed::From(quantity) => basis.value(quantity)? / size,
        };
        let computed = basis.value(quantity)? / size;
        numbers.push(Compared { name: name.clone(), printed: Some(printed), computed });
    }
    if let Some(quantity) = &item.quantity {
        numbers.push(Compared { name: String::new(), printed: None, computed: basis.value(quantity)? / size });
    }
    let low = item.at_least.unwrap_or(f64::NEG_INFINITY);
    let high = item.at_most.unwrap_or(f64::INFINITY);
    let agrees = |number: &Compared| match number.printed {
        Some(_) => number.off() <= item.within(),
        None => (low..=high).contains(&number.computed),
    };
    let verdict = if numbers.is_empty() {
        Verdict::NotReproducible
    } else if numbers.iter().all(agrees) {
        Verdict::Holds
    } else if item.lost {
        Verdict::NotReproducible
    } else {
        Verdict::Corrected
    };
    Ok(Judged { item: item.clone(), numbers, verdict })
}
