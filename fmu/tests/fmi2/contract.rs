//! What a host must not do, and what it is told when it does.

use crate::calls::{Host, any_call};
use crate::host::{Api, Fmu, Messages, call, callbacks, interface, resources, uri};
use proptest::collection::vec;
use proptest::prelude::*;
use sinew::model_description::guid;
use sinew::models::models;
use sinew::parameters::Parameters;
use sinew_fmu::fmi2::{fmi2CallbackFunctions, fmi2FreeInstance, fmi2Instantiate, fmi2String, fmi2Type};
use sinew_fmu::log::Status;
use std::ffi::{CStr, CString};
use std::ptr;

/// What `fmi2Instantiate` says when it returns null.
fn refused(name: Option<&CStr>, kind: fmi2Type, guid: Option<&str>, location: Option<&str>) -> String {
    let messages = Messages::default();
    let owned = |text: Option<&str>| text.map(|text| CString::new(text).unwrap());
    let pointer = |text: &Option<CString>| text.as_ref().map_or(ptr::null(), |text| text.as_ptr());
    let (guid, location) = (owned(guid), owned(location));
    let name = name.map_or(ptr::null(), CStr::as_ptr);
    // SAFETY: all pointers are null or good for the length of the call.
    let component =
        unsafe { fmi2Instantiate(name, kind, pointer(&guid), pointer(&location), &callbacks(&messages), 0, 0) };
    assert!(component.is_null());
    let (status, category, text) = messages.take().remove(0);
    assert_eq!((status, category.as_str()), (Status::Error, "logStatusError"));
    text
}

#[test]
fn a_bad_start_is_refused_with_a_sentence() {
    let good_guid = guid(interface("PneumaticMuscle"));
    let folder = resources(&Parameters::default());
    let (name, guid, location) = (Some(c"muscle"), Some(good_guid.as_str()), uri(&folder));
    let location = Some(location.as_str());

    assert_eq!(
        refused(name, 0, guid, location),
        "fmi2Instantiate: this FMU is for co-simulation, not for model exchange"
    );
    assert_eq!(refused(name, 1, None, location), "fmi2Instantiate: `fmuGUID` is a null pointer");
    assert_eq!(refused(name, 1, guid, None), "fmi2Instantiate: `fmuResourceLocation` is a null pointer");
    assert_eq!(
        refused(name, 1, Some("{8c4e810f-3df3-4a00-8276-176fa3c9f9e0}"), location),
        "fmi2Instantiate: no model in this library has the GUID `{8c4e810f-3df3-4a00-8276-176fa3c9f9e0}`: \
         modelDescription.xml and the library do not belong together"
    );
    assert_eq!(
        refused(name, 1, guid, Some("http://example.org/100%s")),
        "fmi2Instantiate: the resource location `http://example.org/100%s` is not a folder: it must be a file: URI"
    );
    let text = refused(name, 1, guid, Some("file:///nowhere"));
    assert!(text.starts_with("fmi2Instantiate: /nowhere/parameters.toml: "), "{text}");
    std::fs::write(folder.path().join("parameters.toml"), "[load]\nmass = -3").unwrap();
    let text = refused(name, 1, guid, location);
    assert!(text.ends_with("`load.mass` is -3 kg, allowed is 0.001 to 100000 kg"), "{text}");
}

#[test]
fn an_instance_needs_a_name_and_callbacks_but_no_logger() {
    let folder = resources(&Parameters::default());
    let guid = CString::new(guid(interface("PneumaticMuscle"))).unwrap();
    let location = CString::new(uri(&folder)).unwrap();
    let instantiate = |name: fmi2String, functions: *const fmi2CallbackFunctions| {
        // SAFETY: all pointers are null or good for the length of the call.
        unsafe { fmi2Instantiate(name, 1, guid.as_ptr(), location.as_ptr(), functions, 0, 1) }
    };
    let messages = Messages::default();
    let silent = fmi2CallbackFunctions { logger: None, ..callbacks(&messages) };
    assert!(instantiate(c"muscle".as_ptr(), ptr::null()).is_null());
    assert!(instantiate(ptr::null(), &silent).is_null());
    assert!(instantiate(c"".as_ptr(), &silent).is_null());
    let component = instantiate(c"muscle".as_ptr(), &silent);
    assert!(!component.is_null());
    // SAFETY: the component came from this library and is not used again; null is fine.
    unsafe {
        fmi2FreeInstance(component);
        fmi2FreeInstance(ptr::null_mut());
    }
}

#[test]
fn a_null_component_is_an_error_everywhere() {
    let mut nobody = Fmu {
        api: Api::linked(),
        component: ptr::null_mut(),
        messages: Box::default(),
        interface: interface("PneumaticMuscle"),
    };
    assert_eq!(nobody.set("valve.command", 1.0), Status::Error);
    assert_eq!(nobody.try_get("muscle.force"), Err(Status::Error));
    assert_eq!(nobody.step(0.0, 1.0), Status::Error);
    assert_eq!(call!(nobody, fmi2Reset), Status::Error);
    assert_eq!(call!(nobody, fmi2GetFMUstate, &mut ptr::null_mut()), Status::Error);
}

#[test]
fn it_says_which_fmi_it_is() {
    let api = Api::linked();
    // SAFETY: both return static texts.
    let (version, platform) =
        unsafe { (CStr::from_ptr((api.fmi2GetVersion)()), CStr::from_ptr((api.fmi2GetTypesPlatform)())) };
    assert_eq!((version, platform), (c"2.0", c"default"));
}

#[test]
fn calls_out_of_order_are_refused_and_harm_nothing() {
    let mut fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    assert_eq!(fmu.step(0.0, 0.1), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2DoStep: not allowed while the instance is not initialized");
    assert_eq!(fmu.try_get("muscle.force"), Err(Status::Error));
    assert_eq!(call!(fmu, fmi2ExitInitializationMode), Status::Error);
    assert_eq!(call!(fmu, fmi2Terminate), Status::Error);
    assert_eq!(call!(fmu, fmi2GetRealStatus, 2, &mut 0.0), Status::Error);

    assert_eq!(call!(fmu, fmi2EnterInitializationMode), Status::Ok);
    assert_eq!(call!(fmu, fmi2EnterInitializationMode), Status::Error);
    assert_eq!(call!(fmu, fmi2SetupExperiment, 0, 0.0, 0.0, 0, 0.0), Status::Error);
    assert_eq!(fmu.step(0.0, 0.1), Status::Error);
    assert_eq!(call!(fmu, fmi2ExitInitializationMode), Status::Ok);

    assert_eq!(call!(fmu, fmi2ExitInitializationMode), Status::Error);
    assert_eq!(call!(fmu, fmi2CancelStep), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2CancelStep: no step is in progress");
    assert_eq!(fmu.step(0.0, 0.1), Status::Ok);

    assert_eq!(call!(fmu, fmi2Terminate), Status::Ok);
    assert_eq!(fmu.step(0.1, 0.1), Status::Error);
    assert_eq!(fmu.set("valve.command", 1.0), Status::Error);
    assert!(fmu.get("muscle.force") > 0.0);
}

#[test]
fn experiments_that_cannot_be_are_refused() {
    let fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    let setup = |tolerance, start, stop| call!(fmu, fmi2SetupExperiment, 1, tolerance, start, 1, stop);
    for (tolerance, start, stop, expected) in [
        (1e-4, f64::NAN, 1.0, "`startTime` cannot be NaN"),
        (1e-4, 0.0, f64::NAN, "`stopTime` cannot be NaN"),
        (1e-4, 1.0, 0.5, "`stopTime` cannot be 0.5"),
        (-1.0, 0.0, 1.0, "`tolerance` cannot be -1"),
    ] {
        assert_eq!(setup(tolerance, start, stop), Status::Error);
        assert_eq!(fmu.last_message(), format!("fmi2SetupExperiment: {expected}"));
    }
    assert_eq!(setup(1e-4, -5.0, 5.0), Status::Ok);
}

#[test]
fn steps_that_cannot_be_are_refused_and_harm_nothing() {
    let mut fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    assert_eq!(call!(fmu, fmi2SetupExperiment, 0, 0.0, 0.0, 1, 0.3), Status::Ok);
    assert_eq!(call!(fmu, fmi2EnterInitializationMode), Status::Ok);
    assert_eq!(call!(fmu, fmi2ExitInitializationMode), Status::Ok);
    for (from, step, expected) in [
        (0.0, 0.0, "the communication step must be longer than zero, not 0 s"),
        (0.0, -0.1, "the communication step must be longer than zero, not -0.1 s"),
        (0.0, f64::NAN, "the communication step must be longer than zero, not NaN s"),
        (0.0, f64::INFINITY, "the communication step must be longer than zero, not inf s"),
        (0.1, 0.1, "the step starts at 0.1 s, but the instance is at 0 s"),
        (f64::NAN, 0.1, "the step starts at NaN s, but the instance is at 0 s"),
        (0.0, 0.4, "the step ends at 0.4 s, beyond the stop time 0.3 s"),
    ] {
        assert_eq!(fmu.step(from, step), Status::Error);
        assert_eq!(fmu.last_message(), format!("fmi2DoStep: {expected}"));
    }
    // 0.1 + 0.1 + 0.1 is a little more than 0.3.
    for from in [0.0, 0.1, 0.1 + 0.1] {
        assert_eq!(fmu.step(from, 0.1), Status::Ok);
    }
}

#[test]
fn values_that_cannot_be_are_refused_by_name_and_none_of_the_call_is_set() {
    let mut fmu = Fmu::start("PneumaticMuscle", &Parameters::default());
    let before = fmu.outputs();
    let mass = fmu.reference("load.mass");
    for (name, value, expected) in [
        ("valve.command", f64::NAN, "`valve.command` is NaN; it must be a finite number"),
        ("load.mass", f64::INFINITY, "`load.mass` is inf kg, allowed is 0.001 to 100000 kg"),
        ("load.mass", 0.0, "`load.mass` is 0 kg, allowed is 0.001 to 100000 kg"),
        ("muscle.force", 1.0, "`muscle.force` is not an input or a parameter"),
        (
            "initial.gauge_pressure",
            1e5,
            "`initial.gauge_pressure` can only be set before the end of the initialization",
        ),
        ("muscle.force_model", 1.0, "`muscle.force_model` is of type Integer, not Real"),
    ] {
        let references = [mass, fmu.reference(name)];
        assert_eq!(call!(fmu, fmi2SetReal, references.as_ptr(), 2, [30.0, value].as_ptr()), Status::Error);
        assert_eq!(fmu.last_message(), format!("fmi2SetReal: {expected}"));
        assert_eq!(fmu.get("load.mass"), 20.0);
    }
    assert_eq!(call!(fmu, fmi2SetReal, &100_000, 1, &1.0), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2SetReal: there is no variable with value reference 100000");
    assert_eq!(call!(fmu, fmi2GetReal, &100_000, 1, &mut 1.0), Status::Error);
    assert_eq!(fmu.outputs(), before);
    assert_eq!(fmu.step(0.0, 0.1), Status::Ok);
}

#[test]
fn pointers_are_only_needed_where_there_is_something_to_pass() {
    let fmu = Fmu::start("PneumaticMuscle", &Parameters::default());
    assert_eq!(call!(fmu, fmi2GetReal, ptr::null(), 0, ptr::null_mut()), Status::Ok);
    assert_eq!(call!(fmu, fmi2SetString, ptr::null(), 0, ptr::null()), Status::Ok);
    assert_eq!(call!(fmu, fmi2GetReal, ptr::null(), 1, &mut 0.0), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2GetReal: `vr` is a null pointer");
    assert_eq!(call!(fmu, fmi2SetReal, &0, 1, ptr::null()), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2SetReal: `value` is a null pointer");
    assert_eq!(call!(fmu, fmi2GetFMUstate, ptr::null_mut()), Status::Error);
    assert_eq!(call!(fmu, fmi2GetRealStatus, 2, ptr::null_mut()), Status::Error);
}

#[test]
fn the_force_model_is_an_enumeration_that_is_fixed_at_the_start() {
    let mut fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    let (force_model, mass) = (fmu.reference("muscle.force_model"), fmu.reference("load.mass"));
    assert_eq!(call!(fmu, fmi2SetInteger, &force_model, 1, &99), Status::Error);
    assert_eq!(call!(fmu, fmi2SetInteger, &mass, 1, &30), Status::Error);
    assert_eq!(call!(fmu, fmi2SetBoolean, &mass, 1, &1), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2SetBoolean: `load.mass` is of type Real, not Boolean");
    assert_eq!(call!(fmu, fmi2SetInteger, &force_model, 1, &2), Status::Ok);
    fmu.initialize();
    let mut read = 0;
    assert_eq!(call!(fmu, fmi2GetInteger, &force_model, 1, &mut read), Status::Ok);
    assert_eq!(read, 2);
    assert_eq!(call!(fmu, fmi2SetInteger, &force_model, 1, &1), Status::Error);
    let virtual_area = Fmu::start("PneumaticMuscle", &Parameters::default());
    assert_ne!(fmu.get("muscle.contraction"), virtual_area.get("muscle.contraction"));
}

#[test]
fn derivatives_have_one_order_and_the_right_causality() {
    let mut fmu = Fmu::start("PneumaticMuscle", &Parameters::default());
    let (command, force) = (fmu.reference("valve.command"), fmu.reference("muscle.force"));
    assert_eq!(call!(fmu, fmi2SetRealInputDerivatives, &command, 1, &2, &0.0), Status::Error);
    assert_eq!(
        fmu.last_message(),
        "fmi2SetRealInputDerivatives: `valve.command` has derivatives of order 1 only, not 2"
    );
    assert_eq!(call!(fmu, fmi2GetRealOutputDerivatives, &force, 1, &2, &mut 0.0), Status::Error);
    assert_eq!(fmu.set_slope("muscle.force", 1.0), Status::Error);
    assert_eq!(fmu.last_message(), "fmi2SetRealInputDerivatives: `muscle.force` is not an input");
    assert_eq!(fmu.set_slope("valve.command", f64::NAN), Status::Error);
    assert_eq!(call!(fmu, fmi2GetRealOutputDerivatives, &command, 1, &1, &mut 0.0), Status::Error);
    let derivative =
        |unknown: &u32, known: &u32| call!(fmu, fmi2GetDirectionalDerivative, unknown, 1, known, 1, &1.0, &mut 0.0);
    assert_eq!(derivative(&command, &command), Status::Error);
    assert_eq!(derivative(&force, &force), Status::Error);
    assert_eq!(derivative(&force, &command), Status::Ok);
}

#[test]
fn a_status_that_does_not_exist_is_discarded() {
    let fmu = Fmu::start("PneumaticMuscle", &Parameters::default());
    assert_eq!(call!(fmu, fmi2GetStringStatus, 1, &mut ptr::null()), Status::Discard);
    assert_eq!(call!(fmu, fmi2GetIntegerStatus, 0, &mut 0), Status::Discard);
    assert_eq!(call!(fmu, fmi2GetStatus, 7, &mut Status::Ok), Status::Discard);
    assert_eq!(fmu.last_message(), "fmi2GetStatus: there is no status of kind 7 to report here");
}

#[test]
fn the_logger_hears_events_when_it_wants_to() {
    let mut fmu = Fmu::instantiate(Api::linked(), "PneumaticMuscle", &Parameters::default());
    fmu.initialize();
    let texts: Vec<_> =
        fmu.messages.take().into_iter().map(|(_, category, text)| format!("{category} {text}")).collect();
    assert_eq!(
        texts,
        [
            "logEvents fmi2EnterInitializationMode: the instance is now in initialization mode",
            "logEvents fmi2ExitInitializationMode: the instance is now ready for a step",
        ]
    );
    assert_eq!(call!(fmu, fmi2SetDebugLogging, 1, 1, &c"logNoise".as_ptr()), Status::Warning);
    assert_eq!(call!(fmu, fmi2SetDebugLogging, 1, 1, &ptr::null()), Status::Error);
    assert_eq!(call!(fmu, fmi2SetDebugLogging, 1, 1, &c"logStatusWarning".as_ptr()), Status::Ok);
    fmu.messages.take();
    assert_eq!(call!(fmu, fmi2Terminate), Status::Ok);
    assert_eq!(fmu.last_message(), "");
    assert_eq!(fmu.step(0.0, 1.0), Status::Error);
    assert_ne!(fmu.last_message(), "");
}

proptest! {
    #[test]
    fn no_calls_in_any_order_break_an_instance(model in 0..4_usize, calls in vec(any_call(), 1..80)) {
        let mut host = Host::new(Api::linked(), models()[model].interface().name);
        calls.iter().for_each(|call| host.apply(call));
    }
}
