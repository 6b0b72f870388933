//! The thesis reproduced: the document is that of today, complete, and says nothing that the numbers do not.

use sinew::parameters::Parameters;
use sinew::reproduction::equations::both;
use sinew::reproduction::quantities::Basis;
use sinew::reproduction::{Printed, Reproduction, Verdict, files, reproduce, thesis};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::LazyLock;

static FOUND: LazyLock<Reproduction> = LazyLock::new(|| reproduce(&|_| ()).unwrap());

#[test]
fn the_document_is_that_of_today() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let today = files(&FOUND, &docs);
    for (path, bytes) in &today {
        if std::env::var_os("SINEW_UPDATE").is_some() {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
        let committed = std::fs::read(path).unwrap_or_default();
        assert!(committed == *bytes, "{}: run SINEW_UPDATE=1 cargo test --test reproduce", path.display());
    }
    let drawn = std::fs::read_dir(docs.join("thesis")).unwrap().count();
    assert_eq!(drawn, today.len() - 1, "docs/thesis holds figures of another day");
}

/// Numbers such as 4.12 in a text: "Figs. 4.12, 4.14–4.16".
fn numbers(text: &str) -> Vec<(u32, u32)> {
    let mut all = Vec::new();
    for part in text.split(|c: char| !c.is_ascii_digit() && c != '.' && c != '–') {
        let ends: Vec<(u32, u32)> = part.split('–').filter_map(number).collect();
        match ends.as_slice() {
            [first, last] => all.extend((first.1..=last.1).map(|k| (first.0, k))),
            other => all.extend(other),
        }
    }
    all
}

fn number(text: &str) -> Option<(u32, u32)> {
    let (chapter, number) = text.trim_matches('.').split_once('.')?;
    Some((chapter.parse().ok()?, number.parse().ok()?))
}

#[test]
fn every_table_and_figure_of_chapters_4_and_5_has_its_verdict() {
    let (mut figures, mut tables) = (BTreeSet::new(), BTreeSet::new());
    for item in thesis().section.iter().flat_map(|section| &section.item) {
        // "Eq. 4.6, Fig. 4.24" and "Table 4.4, Figs. 4.50, 4.51": a word holds until the next.
        let mut of = "";
        for word in item.at.split_whitespace() {
            match word {
                "Fig." | "Figs." | "Table" | "Tables" | "Eq." | "Eqs." => of = word,
                _ if of.starts_with("Fig") => figures.extend(numbers(word)),
                _ if of.starts_with("Table") => tables.extend(numbers(word)),
                _ => {}
            }
        }
    }
    let missing = |there: &BTreeSet<(u32, u32)>, chapter, last| -> Vec<(u32, u32)> {
        (1..=last).map(|k| (chapter, k)).filter(|number| !there.contains(number)).collect()
    };
    assert_eq!(missing(&figures, 4, 58), []);
    assert_eq!(missing(&figures, 5, 21), []);
    assert_eq!(missing(&tables, 4, 5), []);
    assert_eq!(missing(&tables, 5, 1), []);
}

#[test]
fn whatever_does_not_hold_says_why() {
    for judged in FOUND.sections.iter().flat_map(|(_, items)| items) {
        let (item, verdict) = (&judged.item, judged.verdict);
        assert!(verdict == Verdict::Holds || item.reason.is_some(), "{}, {}: {verdict:?}", item.at, item.what);
        assert!(judged.numbers.iter().all(|n| n.computed.is_finite()), "{}, {}", item.at, item.what);
        // A statement has a bound; a number needs none.
        let statement = item.quantity.is_some();
        assert_eq!(statement, item.says.is_some(), "{}, {}", item.at, item.what);
        assert_eq!(statement, item.at_least.is_some() || item.at_most.is_some(), "{}, {}", item.at, item.what);
    }
}

/// Where a number is printed, the preset that carries it has the same.
#[test]
fn presets_hold_what_is_printed() {
    let carried: [(&str, &str, &[&str]); 8] = [
        ("Eq. 4.6, Fig. 4.24", "dmsp-40-1000", &["virtual_area.area_1", "virtual_area.area_0"]),
        (
            "Eq. 4.8, Fig. 4.25",
            "dmsp-40-1000",
            &["virtual_area.elastic_3", "virtual_area.elastic_2", "virtual_area.elastic_1", "virtual_area.elastic_0"],
        ),
        ("Eq. 4.9, Fig. 4.27", "dmsp-40-290", &["virtual_area.area_1", "virtual_area.area_0"]),
        (
            "Eq. 4.11, Fig. 4.28",
            "dmsp-40-290",
            &["virtual_area.elastic_3", "virtual_area.elastic_2", "virtual_area.elastic_1", "virtual_area.elastic_0"],
        ),
        ("Table 4.1", "dmsp-40-1000", &["spring.high_c3", "spring.high_c2", "spring.high_c1", "spring.high_c0"]),
        ("Table 4.2", "dmsp-40-290", &["spring.high_c3", "spring.high_c2", "spring.high_c1", "spring.high_c0"]),
        ("Table 4.4", "dmsp-40-1000", &["tondu_lopez_kq.low_k", "tondu_lopez_kq.low_q"]),
        (
            "Table 5.1",
            "dmsp-40-1000/thesis",
            &["controller.proportional_gain", "controller.integral_gain", "controller.derivative_gain"],
        ),
    ];
    for (at, preset, names) in carried {
        let parameters = Parameters::preset(preset).unwrap();
        let all = thesis().section.into_iter().flat_map(|section| section.item);
        let printed = |item: &sinew::reproduction::Item| -> Vec<f64> {
            item.values
                .iter()
                .filter_map(|v| if let Printed::Number(number) = v.printed { Some(number) } else { None })
                .collect()
        };
        let item = all.filter(|item| item.at == at).find(|item| !printed(item).is_empty()).expect(at);
        assert_eq!(printed(&item).len(), names.len(), "{at}");
        for (number, name) in printed(&item).iter().zip(names) {
            assert!((parameters.get(name).unwrap() / number - 1.0).abs() < 1e-9, "{at}: {name} is not {number}");
        }
    }
}

#[test]
fn the_printed_area_gives_the_force_and_stroke_that_it_should() {
    let basis = Basis::new().unwrap();
    let [long, short] = &basis.muscles;
    // Section 4.2.3 measured 22 cm at 4.5 bar with 800 N.
    let x = long.contraction(4.5e5, 800.0 / sinew::GRAVITY).unwrap();
    assert!((x - 0.22).abs() < 0.01, "{x}");
    // By hand: A p + b at rest, eqs. 4.6 to 4.11.
    for (muscle, force) in [(long, 0.0091 * 4.5e5 - 113.29), (short, 0.0106 * 4.5e5 - 443.99)] {
        let Parameters { muscle: braid, force_models, .. } = &muscle.printed;
        assert!((force_models.force(braid, 4.5e5, 0.0) - force).abs() < 1e-6);
    }
    // A straight isometric curve has the area as its slope and b as its intercept.
    for muscle in &basis.muscles {
        let Parameters { muscle: braid, force_models, .. } = &muscle.printed;
        for (x, [slope, intercept]) in muscle.isometric_lines() {
            let area = force_models.virtual_area(braid, 1e5, x);
            assert!((slope / area - 1.0).abs() < 0.02, "{x}: {slope} {area}");
            assert!((intercept - force_models.elastic_force(braid, x)).abs() < 20.0, "{x}: {intercept}");
        }
    }
}

#[test]
fn formulas_agree_where_they_are_right_and_only_there() {
    for right in ["3.6", "3.8", "3.11", "3.23", "4.21"] {
        let [printed, used] = both(right);
        assert!((printed / used - 1.0).abs() < 1e-6, "eq. {right}: {printed} {used}");
    }
    for wrong in ["3.2", "3.7", "3.9", "3.10", "3.16", "3.20", "3.24", "3.28", "3.35", "3.36", "3.40", "3.43", "4.13"] {
        let [printed, used] = both(wrong);
        assert!((printed / used - 1.0).abs() > 0.1, "eq. {wrong}: {printed} {used}");
    }
}
