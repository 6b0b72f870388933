//! Runs FMUs with the crate `fmi` and prints what comes out:
//! `importer MODEL.fmu STEP_SIZE STEPS [NAME=VALUE]… NAME…` or
//! `importer SYSTEM.ssp STEP_SIZE STEPS [--zero-first-inputs] COMPONENT.NAME…`.
//!
//! `NAME=VALUE` is set before the initialisation; the other names become columns of the CSV on stdout, behind `time`.
//! Numbers are written with all their digits.

mod component;
mod system;

use component::Component;
use std::error::Error;
use system::System;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, step_size, steps, names @ ..] = arguments.as_slice() else {
        return Err("usage: importer MODEL.fmu|SYSTEM.ssp STEP_SIZE STEPS [OPTION]... NAME...".into());
    };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (step_size, steps) = (step_size.parse()?, steps.parse()?);
    if path.ends_with(".ssp") {
        run_system(path, step_size, steps, &names)
    } else {
        run_fmu(path, step_size, steps, &names)
    }
}

fn run_fmu(path: &str, step_size: f64, steps: u32, names: &[&str]) -> Result<()> {
    let mut fmu = Component::new("importer", &std::fs::read(path)?)?;
    let (starts, outputs): (Vec<&str>, Vec<&str>) = names.iter().partition(|name| name.contains('='));
    for (name, value) in starts.iter().filter_map(|start| start.split_once('=')) {
        fmu.set(name, value.parse()?)?;
    }
    fmu.enter_initialization()?;
    fmu.exit_initialization()?;
    println!("time,{}", outputs.join(","));
    for step in 0..=steps {
        let time = f64::from(step) * step_size;
        print_row(time, outputs.iter().map(|name| fmu.get(name)))?;
        if step < steps {
            fmu.step(time, step_size)?;
        }
    }
    Ok(())
}

fn run_system(path: &str, step_size: f64, steps: u32, names: &[&str]) -> Result<()> {
    let (options, outputs): (Vec<&str>, Vec<&str>) = names.iter().partition(|name| name.starts_with("--"));
    let first_inputs_are_zero = match options.as_slice() {
        [] => false,
        ["--zero-first-inputs"] => true,
        _ => return Err(format!("unknown options {options:?}").into()),
    };
    let mut system = System::open(path)?;
    system.initialize(first_inputs_are_zero)?;
    println!("time,{}", outputs.join(","));
    for step in 0..=steps {
        let time = f64::from(step) * step_size;
        print_row(time, outputs.iter().map(|name| system.get(name)))?;
        if step < steps {
            system.step(time, step_size)?;
        }
    }
    Ok(())
}

fn print_row(time: f64, values: impl Iterator<Item = Result<f64>>) -> Result<()> {
    let values = values.collect::<Result<Vec<_>>>()?;
    let row: Vec<String> = std::iter::once(&time).chain(&values).map(|value| format!("{value:?}")).collect();
    println!("{}", row.join(","));
    Ok(())
}
