//! One FMU by the names of its variables.

use crate::Result;
use fmi::fmi2::import::Fmi2Import;
use fmi::fmi2::instance::{CoSimulation, Common, InstanceCS};
use fmi::traits::FmiImport;
use std::io::Cursor;

/// An instance of an FMU.
pub struct Component {
    pub name: String,
    import: Fmi2Import,
    instance: InstanceCS,
}

impl Component {
    /// Instantiates an FMU from its bytes.
    pub fn new(name: &str, fmu: &[u8]) -> Result<Self> {
        let import: Fmi2Import = fmi::import::new(Cursor::new(fmu))?;
        let instance = import.instantiate_cs(name, false, true)?;
        Ok(Self { name: name.to_owned(), import, instance })
    }

    fn reference(&self, variable: &str) -> Result<u32> {
        Ok(self.import.model_description().model_variable_by_name(variable)?.value_reference)
    }

    pub fn get(&mut self, variable: &str) -> Result<f64> {
        let mut value = [0.0];
        self.instance.get_real(&[self.reference(variable)?], &mut value)?;
        Ok(value[0])
    }

    pub fn set(&mut self, variable: &str, value: f64) -> Result<()> {
        self.instance.set_real(&[self.reference(variable)?], &[value])?;
        Ok(())
    }

    pub fn enter_initialization(&mut self) -> Result<()> {
        self.instance.setup_experiment(None, 0.0, None)?;
        self.instance.enter_initialization_mode()?;
        Ok(())
    }

    pub fn exit_initialization(&mut self) -> Result<()> {
        self.instance.exit_initialization_mode()?;
        Ok(())
    }

    pub fn step(&mut self, time: f64, step_size: f64) -> Result<()> {
        self.instance.do_step(time, step_size, true)?;
        Ok(())
    }
}
