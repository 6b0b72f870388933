//! The XML description of a model (`modelDescription.xml`) and its GUID, both from the model's [`Interface`].

use crate::model::{Interface, ModelVariable, Registered};
use crate::parameters::Parameters;
use crate::variables::{Declared, Kind, Role, Unit, Variable};
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
