//! The closed loop as a system of FMUs (`ClosedLoop.ssp`, SSP 1.0).
//!
//! Importers differ in what they honour, so the description keeps to what all of them do: a flat system, the usual name space
//! prefixes, only connected connectors, SI units, and every value of the parameter sets also as the FMU's start value.

use crate::controller::{Controller, can_hold};
use crate::load::Load;
use crate::model::Interface;
use crate::models::models;
use crate::package::{Library, fmu, zip};
use crate::parameters::Parameters;
use crate::simulation::at_rest_on_reference;
use crate::tuning::is_stable;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::io;

/// File name of the system.
pub const FILE_NAME: &str = "ClosedLoop.ssp";

/// A component: its name in the system, its FMU, and the parameters whose values the description repeats.
const COMPONENTS: [(&str, &str, &[&str]); 3] = [
    ("reference", "ReferenceTrajectory", &[]),
    ("controller", "PidFeedForward", &["initial.gauge_pressure", "load.mass"]),
    ("muscle", "PneumaticMuscle", &["initial.gauge_pressure", "load.mass"]),
];

/// Connections: from component and output to component and input.
const CONNECTIONS: [[&str; 4]; 5] = [
    ["reference", "setpoint", "controller", "setpoint"],
    ["reference", "setpoint_velocity", "controller", "setpoint_velocity"],
    ["reference", "setpoint_acceleration", "controller", "setpoint_acceleration"],
    ["muscle", "measured.contraction", "controller", "measured_contraction"],
    ["controller", "command", "muscle", "valve.command"],
];

const NAMESPACES: [(&str, &str); 5] = [
    ("xmlns:ssd", "http://ssp-standard.org/SSP1/SystemStructureDescription"),
    ("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon"),
    ("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues"),
    ("version", "1.0"),
    ("name", "ClosedLoop"),
];

/// The bytes of the system: reference, controller and muscle, the load at rest where the reference starts.
pub fn closed_loop(parameters: &Parameters, libraries: &[Library]) -> Vec<u8> {
    let parameters = at_rest_on_reference(parameters);
    let all = models();
    let mut files = vec![("SystemStructure.ssd".to_owned(), description(&parameters).into_bytes())];
    for (_, fmu_name, _) in COMPONENTS {
        let interface: Option<&Interface> = all.iter().map(|model| model.interface()).find(|i| i.name == fmu_name);
        let interface = interface.expect("components are models");
        files.push((format!("resources/{fmu_name}.fmu"), fmu(interface, &parameters, libraries)));
    }
    zip(&files)
}

/// Why the closed loop will not follow its reference, in words: its load cannot be held where the reference starts or
/// ends, or not by these gains.
pub fn warnings(parameters: &Parameters) -> Vec<String> {
    let Parameters { reference, load: Load { mass }, controller, .. } = parameters;
    let Controller { minimum_command, maximum_command, .. } = controller;
    let problem = |name: &str, contraction: f64| {
        let place = format!("{mass} kg at `{name}`, {contraction} m");
        if !can_hold(parameters, contraction) {
            Some(format!(
                "{FILE_NAME}: from {minimum_command} to {maximum_command} V the muscle cannot hold {place}; choose another contraction or load"
            ))
        } else if !is_stable(parameters, contraction) {
            Some(format!(
                "{FILE_NAME}: with these gains the loop is not stable with {place}; `sinew tune` finds others"
            ))
        } else {
            None
        }
    };
    let ends = [("reference.start", reference.start), ("reference.target", reference.target)];
    ends.into_iter().filter_map(|(name, contraction)| problem(name, contraction)).collect()
}

type Xml = Writer<Vec<u8>>;

fn description(parameters: &Parameters) -> String {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    write_description(&mut xml, parameters).expect("a Vec takes every write");
    let mut text = String::from_utf8(xml.into_inner()).expect("only UTF-8 was written");
    text.push('\n');
    text
}

fn write_description(xml: &mut Xml, parameters: &Parameters) -> io::Result<()> {
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let root = xml.create_element("ssd:SystemStructureDescription").with_attributes(NAMESPACES);
    root.write_inner_content(|xml| {
        let system = xml.create_element("ssd:System").with_attribute(("name", "ClosedLoop"));
        system.write_inner_content(|xml| {
            xml.create_element("ssd:Elements").write_inner_content(|xml| {
                COMPONENTS.iter().try_for_each(|component| write_component(xml, parameters, component))
            })?;
            xml.create_element("ssd:Connections").write_inner_content(|xml| {
                CONNECTIONS.iter().try_for_each(|ends| {
                    let names = ["startElement", "startConnector", "endElement", "endConnector"];
                    let attributes = names.into_iter().zip(ends.iter().copied());
                    xml.create_element("ssd:Connection").with_attributes(attributes).write_empty().map(|_| ())
                })
            })?;
            Ok(())
        })?;
        let experiment = [("startTime", "0"), ("stopTime", "10")];
        xml.create_element("ssd:DefaultExperiment").with_attributes(experiment).write_empty().map(|_| ())
    })?;
    Ok(())
}

fn write_component(
    xml: &mut Xml,
    parameters: &Parameters,
    (name, fmu_name, values): &(&str, &str, &[&str]),
) -> io::Result<()> {
    let source = format!("resources/{fmu_name}.fmu");
    let attributes = [("name", *name), ("type", "application/x-fmu-sharedlibrary"), ("source", &source)];
    xml.create_element("ssd:Component").with_attributes(attributes).write_inner_content(|xml| {
        xml.create_element("ssd:Connectors").write_inner_content(|xml| {
            for [from, output, to, input] in CONNECTIONS {
                for (element, connector, kind) in [(from, output, "output"), (to, input, "input")] {
                    if element == *name {
                        let attributes = [("name", connector), ("kind", kind)];
                        let open = xml.create_element("ssd:Connector").with_attributes(attributes);
                        open.write_inner_content(|xml| xml.create_element("ssc:Real").write_empty().map(|_| ()))?;
                    }
                }
            }
            Ok(())
        })?;
        if values.is_empty() { Ok(()) } else { write_values(xml, parameters, values) }
    })?;
    Ok(())
}

fn write_values(xml: &mut Xml, parameters: &Parameters, names: &[&str]) -> io::Result<()> {
    let write_all = |xml: &mut Xml| -> io::Result<()> {
        names.iter().try_for_each(|name| {
            let value = format!("{:?}", parameters.get(name).expect("a declared name"));
            let open = xml.create_element("ssv:Parameter").with_attribute(("name", *name));
            open.write_inner_content(|xml| {
                xml.create_element("ssv:Real").with_attribute(("value", value.as_str())).write_empty().map(|_| ())
            })
            .map(|_| ())
        })
    };
    xml.create_element("ssd:ParameterBindings").write_inner_content(|xml| {
        xml.create_element("ssd:ParameterBinding").write_inner_content(|xml| {
            xml.create_element("ssd:ParameterValues").write_inner_content(|xml| {
                let set = [("version", "1.0"), ("name", "initialValues")];
                xml.create_element("ssv:ParameterSet").with_attributes(set).write_inner_content(|xml| {
                    xml.create_element("ssv:Parameters").write_inner_content(write_all).map(|_| ())
                })?;
                Ok(())
            })?;
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}
