//! A host of FMUs, small and strict.

use libloading::Library;
use sinew::model::Interface;
use sinew::model_description::guid;
use sinew::models::models;
use sinew::parameters::Parameters;
use sinew_fmu::fmi2::*;
use sinew_fmu::log::Status;
use std::ffi::{CStr, CString, c_void};
use std::ptr;
use std::sync::Mutex;
use tempfile::TempDir;

/// The functions of the standard, as the standard declares them.
macro_rules! api {
    ($($function:ident: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions of an FMU.
        #[allow(non_snake_case)]
        #[derive(Clone, Copy)]
        pub struct Api { $(pub $function: unsafe extern "C" fn($($argument),*) $(-> $result)?,)* }

        impl Api {
            /// Of the library that is linked to this program.
            pub fn linked() -> Self {
                Self { $($function,)* }
            }

            /// Of a shared library, while it is loaded.
            pub fn loaded(library: &Library) -> Self {
                // SAFETY: the names stand for functions of these types in every FMU.
                Self { $($function: *unsafe { library.get(stringify!($function)) }.expect("every function is there"),)* }
            }
        }
    };
}

api! {
    fmi2GetTypesPlatform: fn() -> fmi2String;
    fmi2GetVersion: fn() -> fmi2String;
    fmi2SetDebugLogging: fn(fmi2Component, fmi2Boolean, usize, *const fmi2String) -> Status;
    fmi2Instantiate: fn(
        fmi2String, fmi2Type, fmi2String, fmi2String, *const fmi2CallbackFunctions, fmi2Boolean, fmi2Boolean
    ) -> fmi2Component;
    fmi2FreeInstance: fn(fmi2Component);
    fmi2SetupExperiment: fn(fmi2Component, fmi2Boolean, fmi2Real, fmi2Real, fmi2Boolean, fmi2Real) -> Status;
    fmi2EnterInitializationMode: fn(fmi2Component) -> Status;
    fmi2ExitInitializationMode: fn(fmi2Component) -> Status;
    fmi2Terminate: fn(fmi2Component) -> Status;
    fmi2Reset: fn(fmi2Component) -> Status;
    fmi2GetReal: fn(fmi2Component, *const fmi2ValueReference, usize, *mut fmi2Real) -> Status;
    fmi2GetInteger: fn(fmi2Component, *const fmi2ValueReference, usize, *mut fmi2Integer) -> Status;
    fmi2GetBoolean: fn(fmi2Component, *const fmi2ValueReference, usize, *mut fmi2Boolean) -> Status;
    fmi2GetString: fn(fmi2Component, *const fmi2ValueReference, usize, *mut fmi2String) -> Status;
    fmi2SetReal: fn(fmi2Component, *const fmi2ValueReference, usize, *const fmi2Real) -> Status;
    fmi2SetInteger: fn(fmi2Component, *const fmi2ValueReference, usize, *const fmi2Integer) -> Status;
    fmi2SetBoolean: fn(fmi2Component, *const fmi2ValueReference, usize, *const fmi2Boolean) -> Status;
    fmi2SetString: fn(fmi2Component, *const fmi2ValueReference, usize, *const fmi2String) -> Status;
    fmi2GetFMUstate: fn(fmi2Component, *mut fmi2FMUstate) -> Status;
    fmi2SetFMUstate: fn(fmi2Component, fmi2FMUstate) -> Status;
    fmi2FreeFMUstate: fn(fmi2Component, *mut fmi2FMUstate) -> Status;
    fmi2SerializedFMUstateSize: fn(fmi2Component, fmi2FMUstate, *mut usize) -> Status;
    fmi2SerializeFMUstate: fn(fmi2Component, fmi2FMUstate, *mut fmi2Byte, usize) -> Status;
    fmi2DeSerializeFMUstate: fn(fmi2Component, *const fmi2Byte, usize, *mut fmi2FMUstate) -> Status;
    fmi2GetDirectionalDerivative: fn(
        fmi2Component, *const fmi2ValueReference, usize, *const fmi2ValueReference, usize, *const fmi2Real, *mut fmi2Real
    ) -> Status;
    fmi2SetRealInputDerivatives:
        fn(fmi2Component, *const fmi2ValueReference, usize, *const fmi2Integer, *const fmi2Real) -> Status;
    fmi2GetRealOutputDerivatives:
        fn(fmi2Component, *const fmi2ValueReference, usize, *const fmi2Integer, *mut fmi2Real) -> Status;
    fmi2DoStep: fn(fmi2Component, fmi2Real, fmi2Real, fmi2Boolean) -> Status;
    fmi2CancelStep: fn(fmi2Component) -> Status;
    fmi2GetStatus: fn(fmi2Component, fmi2StatusKind, *mut Status) -> Status;
    fmi2GetRealStatus: fn(fmi2Component, fmi2StatusKind, *mut fmi2Real) -> Status;
    fmi2GetIntegerStatus: fn(fmi2Component, fmi2StatusKind, *mut fmi2Integer) -> Status;
    fmi2GetBooleanStatus: fn(fmi2Component, fmi2StatusKind, *mut fmi2Boolean) -> Status;
    fmi2GetStringStatus: fn(fmi2Component, fmi2StatusKind, *mut fmi2String) -> Status;
}

/// What the logger was told: status, category, text.
pub type Message = (Status, String, String);

/// The environment that the logger gets back.
#[derive(Default)]
pub struct Messages(Mutex<Vec<Message>>);

impl Messages {
    pub fn take(&self) -> Vec<Message> {
        std::mem::take(&mut self.0.lock().unwrap())
    }
}

extern "C" fn listen(
    messages: *mut c_void,
    instance_name: fmi2String,
    status: Status,
    category: fmi2String,
    format: fmi2String,
    text: fmi2String,
) {
    // SAFETY: the library passes texts, one of them for the format, and the environment that it was given.
    let (name, category, format, text) = unsafe {
        (CStr::from_ptr(instance_name), CStr::from_ptr(category), CStr::from_ptr(format), CStr::from_ptr(text))
    };
    assert_eq!((name, format), (c"muscle", c"%s"));
    let message = (status, category.to_str().unwrap().to_owned(), text.to_str().unwrap().to_owned());
    // SAFETY: the environment is the messages of the FMU, which outlive its instance.
    unsafe { &*messages.cast::<Messages>() }.0.lock().unwrap().push(message);
}

/// What a host offers.
pub fn callbacks(messages: &Messages) -> fmi2CallbackFunctions {
    // SAFETY: Rust cannot define a variadic function yet. On all platforms that matter here, a variadic call with one
    // more pointer arrives like a call of a function with one more parameter.
    let logger = unsafe { std::mem::transmute::<*const (), fmi2CallbackLogger>(listen as *const ()) };
    fmi2CallbackFunctions {
        logger: Some(logger),
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: ptr::from_ref(messages).cast_mut().cast(),
    }
}

/// Interface of a model by its name.
pub fn interface(model: &str) -> &'static Interface {
    models().iter().map(|known| known.interface()).find(|interface| interface.name == model).expect("a known model")
}

/// Folder of resources with these start values.
pub fn resources(parameters: &Parameters) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    std::fs::write(folder.path().join("parameters.toml"), parameters.to_toml()).expect("a written file");
    folder
}

/// `file:` URI of a folder.
pub fn uri(folder: &TempDir) -> String {
    format!("file://{}", folder.path().display())
}

/// One instance, freed at the end of its life. Every method returns the status of the call.
pub struct Fmu {
    pub api: Api,
    pub component: fmi2Component,
    pub messages: Box<Messages>,
    pub interface: &'static Interface,
}

// SAFETY: FMI allows to use an instance in any thread, one at a time.
unsafe impl Send for Fmu {}

impl Drop for Fmu {
    fn drop(&mut self) {
        // SAFETY: the component came from the same library and is not used any more.
        unsafe { (self.api.fmi2FreeInstance)(self.component) };
    }
}

/// The call of a function on the component of an FMU.
macro_rules! call {
    ($fmu:expr, $function:ident $(, $argument:expr)*) => {
        // SAFETY: the component lives, and all pointers are good for the lengths that are passed with them.
        unsafe { ($fmu.api.$function)($fmu.component $(, $argument)*) }
    };
}
pub(crate) use call;

impl Fmu {
    /// An instance that is yet to be initialised, with all log categories.
    pub fn instantiate(api: Api, model: &str, parameters: &Parameters) -> Self {
        let (messages, interface, folder) = (Box::<Messages>::default(), interface(model), resources(parameters));
        let guid = CString::new(guid(interface)).unwrap();
        let location = CString::new(uri(&folder)).unwrap();
        let functions = callbacks(&messages);
        // SAFETY: all pointers are good for the length of the call.
        let component =
            unsafe { (api.fmi2Instantiate)(c"muscle".as_ptr(), 1, guid.as_ptr(), location.as_ptr(), &functions, 0, 1) };
        assert!(!component.is_null(), "{:?}", messages.take());
        Self { api, component, messages, interface }
    }

    /// An instance that is ready for its first step at zero.
    pub fn start(model: &str, parameters: &Parameters) -> Self {
        let mut fmu = Self::instantiate(Api::linked(), model, parameters);
        fmu.initialize();
        fmu
    }

    /// From instantiated to the first step.
    pub fn initialize(&mut self) {
        assert_eq!(call!(self, fmi2SetupExperiment, 0, 0.0, 0.0, 0, 0.0), Status::Ok);
        assert_eq!(call!(self, fmi2EnterInitializationMode), Status::Ok);
        assert_eq!(call!(self, fmi2ExitInitializationMode), Status::Ok);
    }

    /// Value reference of a variable.
    pub fn reference(&self, name: &str) -> u32 {
        self.interface.variables.iter().position(|variable| variable.name == name).expect("a known name") as u32
    }

    /// The last text that the logger was told.
    pub fn last_message(&self) -> String {
        self.messages.take().pop().map(|(_, _, text)| text).unwrap_or_default()
    }

    pub fn try_get(&self, name: &str) -> Result<f64, Status> {
        let mut value = f64::NAN;
        match call!(self, fmi2GetReal, &self.reference(name), 1, &mut value) {
            Status::Ok => Ok(value),
            status => Err(status),
        }
    }

    pub fn get(&self, name: &str) -> f64 {
        self.try_get(name).unwrap_or_else(|_| panic!("{}", self.last_message()))
    }

    pub fn set(&mut self, name: &str, value: f64) -> Status {
        call!(self, fmi2SetReal, &self.reference(name), 1, &value)
    }

    pub fn set_slope(&mut self, name: &str, slope: f64) -> Status {
        call!(self, fmi2SetRealInputDerivatives, &self.reference(name), 1, &1, &slope)
    }

    pub fn slope(&self, name: &str) -> f64 {
        let mut slope = f64::NAN;
        let status = call!(self, fmi2GetRealOutputDerivatives, &self.reference(name), 1, &1, &mut slope);
        assert_eq!(status, Status::Ok, "{}", self.last_message());
        slope
    }

    pub fn partial_derivative(&self, output: &str, known: &str) -> f64 {
        let (output, known, mut change) = (self.reference(output), self.reference(known), f64::NAN);
        let status = call!(self, fmi2GetDirectionalDerivative, &output, 1, &known, 1, &1.0, &mut change);
        assert_eq!(status, Status::Ok, "{}", self.last_message());
        change
    }

    pub fn step(&mut self, from: f64, step: f64) -> Status {
        call!(self, fmi2DoStep, from, step, 0)
    }

    /// All outputs, in order.
    pub fn outputs(&self) -> Vec<f64> {
        let Interface { inputs, outputs, .. } = *self.interface;
        let references: Vec<u32> = (inputs..inputs + outputs).map(|position| position as u32).collect();
        let mut values = vec![f64::NAN; outputs];
        let status = call!(self, fmi2GetReal, references.as_ptr(), outputs, values.as_mut_ptr());
        assert_eq!(status, Status::Ok, "{}", self.last_message());
        values
    }
}
