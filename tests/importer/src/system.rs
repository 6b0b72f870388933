//! A flat system of FMUs (SSP 1.0) and a Jacobi master for it.

use crate::Result;
use crate::component::Component;
use roxmltree::{Document, Node};
use std::fs::File;
use std::io::Read;
use zip::ZipArchive;

/// A component, by its place among all, and one of its variables.
type Connector = (usize, String);

/// Instances and what connects them.
pub struct System {
    components: Vec<Component>,
    connections: Vec<(Connector, Connector)>,
}

impl System {
    /// Instantiates the components of an .ssp file and sets the parameters that it gives them.
    pub fn open(path: &str) -> Result<Self> {
        let mut archive = ZipArchive::new(File::open(path)?)?;
        let mut read = |name: &str| -> Result<Vec<u8>> {
            let mut bytes = Vec::new();
            archive.by_name(name)?.read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let text = String::from_utf8(read("SystemStructure.ssd")?)?;
        let document = Document::parse(&text)?;
        let mut system = Self { components: Vec::new(), connections: Vec::new() };
        for node in elements(document.root(), "Component") {
            let mut component = Component::new(attribute(node, "name")?, &read(attribute(node, "source")?)?)?;
            for parameter in elements(node, "Parameter") {
                let value = elements(parameter, "Real").next().ok_or("a parameter that is not real")?;
                component.set(attribute(parameter, "name")?, attribute(value, "value")?.parse()?)?;
            }
            system.components.push(component);
        }
        for node in elements(document.root(), "Connection") {
            let end = |element, connector| -> Result<Connector> {
                Ok((system.place(attribute(node, element)?)?, attribute(node, connector)?.to_owned()))
            };
            system.connections.push((end("startElement", "startConnector")?, end("endElement", "endConnector")?));
        }
        Ok(system)
    }

    fn place(&self, name: &str) -> Result<usize> {
        let found = self.components.iter().position(|component| component.name == name);
        found.ok_or_else(|| format!("no component is called {name}").into())
    }

    /// Reads all connected outputs, then sets all inputs that they lead to.
    fn exchange(&mut self) -> Result<()> {
        let components = &mut self.components;
        let values = self.connections.iter().map(|((from, output), _)| components[*from].get(output));
        let values = values.collect::<Result<Vec<_>>>()?;
        for ((_, (to, input)), value) in self.connections.iter().zip(values) {
            components[*to].set(input, value)?;
        }
        Ok(())
    }

    /// Initialises all components with the values of the connections; where the first inputs are zero, without.
    ///
    /// The initialisation mode exchanges values as often as there are components: as far as the longest way that has
    /// no loop.
    pub fn initialize(&mut self, first_inputs_are_zero: bool) -> Result<()> {
        self.components.iter_mut().try_for_each(Component::enter_initialization)?;
        for (_, (to, input)) in self.connections.iter().filter(|_| first_inputs_are_zero) {
            self.components[*to].set(input, 0.0)?;
        }
        for _ in 0..if first_inputs_are_zero { 0 } else { self.components.len() } {
            self.exchange()?;
        }
        self.components.iter_mut().try_for_each(Component::exit_initialization)
    }

    /// Steps all components, then exchanges their values.
    pub fn step(&mut self, time: f64, step_size: f64) -> Result<()> {
        self.components.iter_mut().try_for_each(|component| component.step(time, step_size))?;
        self.exchange()
    }

    /// The value of `component.variable`.
    pub fn get(&mut self, path: &str) -> Result<f64> {
        let (component, variable) = path.split_once('.').ok_or("a name without a component")?;
        let place = self.place(component)?;
        self.components[place].get(variable)
    }
}

/// The elements of a name below a node, whatever their prefix.
fn elements<'a>(node: Node<'a, 'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.descendants().filter(move |node| node.tag_name().name() == name)
}

fn attribute<'a>(node: Node<'a, 'a>, name: &str) -> Result<&'a str> {
    node.attribute(name).ok_or_else(|| format!("{} has no {name}", node.tag_name().name()).into())
}
