//! Steps an FMU with the crate `fmi` and prints what comes out:
//! `importer MODEL.fmu STEP_SIZE STEPS [NAME=VALUE]… NAME…`.
//!
//! `NAME=VALUE` is set before the initialisation; the other names become columns of the CSV on stdout, behind `time`.
//! Numbers are written with all their digits.

use fmi::fmi2::import::Fmi2Import;
use fmi::fmi2::instance::{CoSimulation, Common, InstanceCS};
use fmi::traits::FmiImport;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, step_size, steps, names @ ..] = arguments.as_slice() else {
        return Err("usage: importer MODEL.fmu STEP_SIZE STEPS [NAME=VALUE]... NAME...".into());
    };
    let import: Fmi2Import = fmi::import::from_path(path)?;
    let (starts, outputs): (Vec<&str>, Vec<&str>) =
        names.iter().map(String::as_str).partition(|name| name.contains('='));
    let mut instance = import.instantiate_cs("importer", false, true)?;
    set_starts(&import, &mut instance, &starts)?;
    instance.setup_experiment(None, 0.0, None)?;
    instance.enter_initialization_mode()?;
    instance.exit_initialization_mode()?;
    print_steps(&import, &mut instance, step_size.parse()?, steps.parse()?, &outputs)?;
    instance.terminate()?;
    Ok(())
}

fn value_reference(import: &Fmi2Import, name: &str) -> Result<u32, Box<dyn Error>> {
    Ok(import.model_description().model_variable_by_name(name)?.value_reference)
}

fn set_starts(import: &Fmi2Import, instance: &mut InstanceCS, starts: &[&str]) -> Result<(), Box<dyn Error>> {
    for (name, value) in starts.iter().filter_map(|start| start.split_once('=')) {
        instance.set_real(&[value_reference(import, name)?], &[value.parse()?])?;
    }
    Ok(())
}

fn print_steps(
    import: &Fmi2Import,
    instance: &mut InstanceCS,
    step_size: f64,
    steps: u32,
    outputs: &[&str],
) -> Result<(), Box<dyn Error>> {
    let references = outputs.iter().map(|name| value_reference(import, name)).collect::<Result<Vec<_>, _>>()?;
    let mut values = vec![0.0; references.len()];
    println!("time,{}", outputs.join(","));
    for step in 0..=steps {
        instance.get_real(&references, &mut values)?;
        let time = f64::from(step) * step_size;
        let row: Vec<String> = std::iter::once(&time).chain(&values).map(|value| format!("{value:?}")).collect();
        println!("{}", row.join(","));
        if step < steps {
            instance.do_step(time, step_size, true)?;
        }
    }
    Ok(())
}
