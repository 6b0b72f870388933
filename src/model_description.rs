//! The XML description of a model (`modelDescription.xml`) and its GUID, both from the model's [`Interface`].

use crate::model::{Interface, ModelVariable};
use crate::parameters::Parameters;
use crate::variables::{Kind, Role, Unit, Variable};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::io;
use uuid::Uuid;

/// Namespace of the GUIDs: they are UUIDs of version 5 in it.
const NAMESPACE: Uuid = Uuid::from_u128(0x7e0c_51a6_3b7d_4d0e_9d0f_5a1e_77a1_0001);

/// The names of the FMI functions' log categories, with a line on each.
pub const LOG_CATEGORIES: &[(&str, &str)] = &[
    ("logStatusWarning", "Something may not be as intended"),
    ("logStatusError", "A call was refused or failed"),
    ("logStatusFatal", "The instance can no longer be used"),
    ("logEvents", "Calls that change the state of the instance"),
];

/// GUID of a model: a hash of its whole description with the default start values.
///
/// Exported parameters do not change it: the extended and the nominal FMU are the same binary. Any change of a
/// variable, unit, bound, dependency or text does.
pub fn guid(interface: &Interface) -> String {
    let text = to_xml(interface, &Parameters::default(), "");
    format!("{{{}}}", Uuid::new_v5(&NAMESPACE, text.as_bytes()))
}

/// The description of a model with the values of `parameters` as start values, ready to be written to a file.
pub fn model_description(interface: &Interface, parameters: &Parameters) -> String {
    to_xml(interface, parameters, &guid(interface))
}

type Attributes<'a> = Vec<(&'a str, String)>;
type Xml = Writer<Vec<u8>>;

fn to_xml(interface: &Interface, parameters: &Parameters, guid: &str) -> String {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    write_document(&mut xml, interface, parameters, guid).expect("a Vec takes every write");
    let mut text = String::from_utf8(xml.into_inner()).expect("only UTF-8 was written");
    text.push('\n');
    text
}

fn write_document(xml: &mut Xml, interface: &Interface, parameters: &Parameters, guid: &str) -> io::Result<()> {
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let attributes = [
        ("fmiVersion", "2.0"),
        ("modelName", interface.name),
        ("guid", guid),
        ("description", interface.description),
        ("author", "Sinew"),
        ("version", env!("CARGO_PKG_VERSION")),
        ("license", "MIT"),
        ("generationTool", concat!("Sinew ", env!("CARGO_PKG_VERSION"))),
        ("variableNamingConvention", "structured"),
        ("numberOfEventIndicators", "0"),
    ];
    xml.create_element("fmiModelDescription").with_attributes(attributes).write_inner_content(|xml| {
        write_capabilities(xml, interface)?;
        write_units(xml, interface)?;
        write_types(xml, interface)?;
        element_with(xml, "LogCategories", |xml| {
            LOG_CATEGORIES.iter().try_for_each(|(name, description)| {
                element(xml, "Category", vec![("name", (*name).into()), ("description", (*description).into())])
            })
        })?;
        let experiment = vec![("startTime", "0"), ("stopTime", "10"), ("stepSize", "0.001")];
        element(xml, "DefaultExperiment", experiment.into_iter().map(|(k, v)| (k, v.to_owned())).collect())?;
        element_with(xml, "ModelVariables", |xml| write_variables(xml, interface, parameters))?;
        element_with(xml, "ModelStructure", |xml| write_structure(xml, interface))
    })?;
    Ok(())
}

fn element(xml: &mut Xml, name: &str, attributes: Attributes) -> io::Result<()> {
    let attributes = attributes.iter().map(|(key, value)| (*key, value.as_str()));
    xml.create_element(name).with_attributes(attributes).write_empty()?;
    Ok(())
}

fn element_with(xml: &mut Xml, name: &str, content: impl FnOnce(&mut Xml) -> io::Result<()>) -> io::Result<()> {
    xml.create_element(name).write_inner_content(content)?;
    Ok(())
}

/// What the library can do; every flag here is tested on the binary.
fn write_capabilities(xml: &mut Xml, interface: &Interface) -> io::Result<()> {
    let attributes = [
        ("modelIdentifier", interface.name),
        ("needsExecutionTool", "false"),
        ("canHandleVariableCommunicationStepSize", "true"),
        ("canInterpolateInputs", "true"),
        ("maxOutputDerivativeOrder", "1"),
        ("canRunAsynchronuously", "false"),
        ("canBeInstantiatedOnlyOncePerProcess", "false"),
        ("canNotUseMemoryManagementFunctions", "true"),
        ("canGetAndSetFMUstate", "true"),
        ("canSerializeFMUstate", "true"),
        ("providesDirectionalDerivative", "true"),
    ];
    element(xml, "CoSimulation", attributes.into_iter().map(|(k, v)| (k, v.to_owned())).collect())
}

/// The units that the variables use, each once, in order of first use.
fn used_units(interface: &Interface) -> Vec<&'static Unit> {
    let mut units: Vec<&'static Unit> = Vec::new();
    for variable in real_variables(interface) {
        if !units.contains(&&variable.declaration.unit) {
            units.push(&variable.declaration.unit);
        }
    }
    units
}

fn real_variables(interface: &Interface) -> impl Iterator<Item = &ModelVariable> {
    interface.variables.iter().filter(|variable| matches!(variable.declaration.kind, Kind::Real))
}

fn write_units(xml: &mut Xml, interface: &Interface) -> io::Result<()> {
    element_with(xml, "UnitDefinitions", |xml| {
        used_units(interface).into_iter().try_for_each(|unit| {
            let exponents = ["kg", "m", "s", "A", "rad"].into_iter().zip(unit.base).filter(|(_, power)| *power != 0);
            let base: Attributes = exponents.map(|(name, power)| (name, power.to_string())).collect();
            let open = xml.create_element("Unit").with_attribute(("name", unit.symbol));
            open.write_inner_content(|xml| element(xml, "BaseUnit", base)).map(|_| ())
        })
    })
}

fn write_types(xml: &mut Xml, interface: &Interface) -> io::Result<()> {
    element_with(xml, "TypeDefinitions", |xml| {
        for unit in used_units(interface) {
            let attributes = vec![
                ("quantity", unit.quantity.to_owned()),
                ("unit", unit.symbol.to_owned()),
                ("nominal", number(unit.nominal)),
            ];
            let open = xml.create_element("SimpleType").with_attribute(("name", unit.quantity));
            open.write_inner_content(|xml| element(xml, "Real", attributes))?;
        }
        let mut named = std::collections::BTreeSet::new();
        for variable in &interface.variables {
            if let Kind::Enumeration(name, choices) = variable.declaration.kind
                && named.insert(name)
            {
                let open = xml.create_element("SimpleType").with_attribute(("name", name));
                open.write_inner_content(|xml| {
                    element_with(xml, "Enumeration", |xml| {
                        choices.iter().zip(1..).try_for_each(|(choice, value)| {
                            let (name, text) = (choice.name.to_owned(), choice.description.to_owned());
                            element(
                                xml,
                                "Item",
                                vec![("name", name), ("value", value.to_string()), ("description", text)],
                            )
                        })
                    })
                })?;
            }
        }
        Ok(())
    })
}

fn write_variables(xml: &mut Xml, interface: &Interface, parameters: &Parameters) -> io::Result<()> {
    for (reference, variable) in interface.variables.iter().enumerate() {
        let Variable { description, role, .. } = variable.declaration;
        let (causality, variability, initial) = match role {
            Role::Input => ("input", "continuous", None),
            Role::Output => ("output", "continuous", Some("calculated")),
            _ if variable.declaration.is_tunable() => ("parameter", "tunable", Some("exact")),
            _ => ("parameter", "fixed", Some("exact")),
        };
        let reference = reference.to_string();
        let attributes = [
            ("name", variable.name),
            ("valueReference", &reference),
            ("description", description),
            ("causality", causality),
            ("variability", variability),
        ];
        let open = xml.create_element("ScalarVariable").with_attributes(attributes);
        let open = open.with_attributes(initial.map(|initial| ("initial", initial)));
        open.write_inner_content(|xml| write_type(xml, variable, parameters))?;
    }
    Ok(())
}

fn write_type(xml: &mut Xml, variable: &ModelVariable, parameters: &Parameters) -> io::Result<()> {
    let declaration = variable.declaration;
    let start = parameters.find(declaration.name).map_or(variable.default, |(_, value)| value);
    let (element_name, type_name) = match declaration.kind {
        Kind::Real => ("Real", declaration.unit.quantity),
        Kind::Enumeration(name, _) => ("Enumeration", name),
    };
    let mut attributes = vec![("declaredType", type_name.to_owned())];
    if matches!(declaration.kind, Kind::Real) {
        attributes.push(("quantity", declaration.unit.quantity.to_owned()));
        attributes.push(("unit", declaration.unit.symbol.to_owned()));
    }
    for (name, bound) in [("min", declaration.min), ("max", declaration.max)] {
        if bound.is_finite() {
            attributes.push((name, number(bound)));
        }
    }
    if matches!(declaration.kind, Kind::Real) {
        attributes.push(("nominal", number(declaration.unit.nominal)));
    }
    if declaration.role != Role::Output {
        attributes.push(("start", number(start)));
    }
    element(xml, element_name, attributes)
}

/// A number as XML Schema reads it back exactly.
fn number(value: f64) -> String {
    format!("{value:?}").trim_end_matches(".0").to_owned()
}

fn write_structure(xml: &mut Xml, interface: &Interface) -> io::Result<()> {
    let index_of = |name: &str| 1 + interface.variables.iter().position(|v| v.name == name).expect("a declared name");
    let outputs = interface.inputs..interface.inputs + interface.outputs;
    let unknown = |xml: &mut Xml, index: usize, known: Vec<usize>| {
        let listed = known.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
        element(xml, "Unknown", vec![("index", (index + 1).to_string()), ("dependencies", listed)])
    };
    element_with(xml, "Outputs", |xml| {
        outputs.clone().try_for_each(|output| {
            let name = interface.variables[output].name;
            let inputs = interface.feedthrough.iter().find(|(of, _)| *of == name).map_or(&[][..], |(_, inputs)| inputs);
            unknown(xml, output, inputs.iter().map(|input| index_of(input)).collect())
        })
    })?;
    element_with(xml, "InitialUnknowns", |xml| {
        let parameters = interface.inputs + interface.outputs..interface.variables.len();
        let inputs = interface.initial_inputs.iter().map(|input| index_of(input));
        let known: Vec<usize> = inputs.chain(parameters.map(|parameter| parameter + 1)).collect();
        outputs.clone().try_for_each(|output| unknown(xml, output, known.clone()))
    })
}
