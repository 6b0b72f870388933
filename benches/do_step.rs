//! Cost of a step of 1 ms through the C interface of the FMU library, against the same model called in Rust.
//!
//! Once the step alone, once what a master does around it: set the command, step, get all outputs. One iteration is 1 ms of
//! simulated time, so 1 ms divided by the time of an iteration is the speed in multiples of real time.

use criterion::{Criterion, criterion_group, criterion_main};
use libloading::{Library, Symbol};
use sinew::model::Simulator;
use sinew::model_description::guid;
use sinew::models::models;
use sinew::package::EMBEDDED_LIBRARY;
use sinew::parameters::Parameters;
use sinew::plant::PneumaticMuscle;
use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::hint::black_box;

type Component = *mut c_void;
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    c_int,
    c_int,
) -> Component;
type Plain = unsafe extern "C" fn(Component) -> c_int;
type Setup = unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> c_int;
type SetReal = unsafe extern "C" fn(Component, *const c_uint, usize, *const f64) -> c_int;
type GetReal = unsafe extern "C" fn(Component, *const c_uint, usize, *mut f64) -> c_int;
type DoStep = unsafe extern "C" fn(Component, f64, f64, c_int) -> c_int;

/// The callbacks of FMI 2.0; none is needed.
#[repr(C)]
struct Callbacks([*const c_void; 5]);

const STEP: f64 = 1e-3;

/// A command in V that never rests.
fn command(k: u64) -> f64 {
    1.0 + (k % 2000) as f64 * 1e-3
}

fn in_rust(criterion: &mut Criterion) {
    let mut muscle = Simulator::<PneumaticMuscle>::new(Parameters::default());
    muscle.parameters.initial.gauge_pressure = 1e5;
    muscle.initialize(0.0).unwrap();
    muscle.inputs.command = 1.5;
    criterion.bench_function("1 ms step, in Rust", |bencher| bencher.iter(|| muscle.advance(STEP).unwrap()));
    let mut k = 0;
    criterion.bench_function("1 ms set, step, get, in Rust", |bencher| {
        bencher.iter(|| {
            muscle.inputs.command = command(k);
            muscle.advance(STEP).unwrap();
            k += 1;
            black_box(muscle.outputs())
        });
    });
}

fn through_fmi(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("library");
    std::fs::write(&file, EMBEDDED_LIBRARY).unwrap();
    std::fs::write(folder.path().join("parameters.toml"), Parameters::default().to_toml()).unwrap();
    let text = |text: &str| CString::new(text).unwrap();
    let guid = text(&guid(models()[0].interface()));
    let resources = text(&format!("file://{}", folder.path().display()));
    // SAFETY: the library is the one that was just built; the types are those of the FMI 2.0 headers.
    unsafe {
        let library = Library::new(&file).unwrap();
        let instantiate: Symbol<Instantiate> = library.get(b"fmi2Instantiate").unwrap();
        let setup: Symbol<Setup> = library.get(b"fmi2SetupExperiment").unwrap();
        let enter: Symbol<Plain> = library.get(b"fmi2EnterInitializationMode").unwrap();
        let exit: Symbol<Plain> = library.get(b"fmi2ExitInitializationMode").unwrap();
        let set: Symbol<SetReal> = library.get(b"fmi2SetReal").unwrap();
        let get: Symbol<GetReal> = library.get(b"fmi2GetReal").unwrap();
        let do_step: Symbol<DoStep> = library.get(b"fmi2DoStep").unwrap();
        let callbacks = Callbacks([std::ptr::null(); 5]);
        let name = text("bench");
        let muscle = instantiate(name.as_ptr(), 1, guid.as_ptr(), resources.as_ptr(), &callbacks, 0, 0);
        assert!(!muscle.is_null());
        let interface = models()[0].interface();
        let pressure = interface.variables.iter().position(|v| v.name == "initial.gauge_pressure").unwrap();
        assert_eq!(setup(muscle, 0, 0.0, 0.0, 0, 0.0) + set(muscle, &(pressure as c_uint), 1, &1e5), 0);
        assert_eq!(enter(muscle) + exit(muscle), 0);
        let outputs: Vec<c_uint> = (2..10).collect();
        let mut values = [0.0; 8];
        let mut k = 0;
        assert_eq!(set(muscle, &0, 1, &1.5), 0);
        criterion.bench_function("1 ms step, through FMI", |bencher| {
            bencher.iter(|| {
                assert_eq!(do_step(muscle, k as f64 * STEP, STEP, 0), 0);
                k += 1;
            });
        });
        criterion.bench_function("1 ms set, step, get, through FMI", |bencher| {
            bencher.iter(|| {
                let status = set(muscle, &0, 1, &command(k))
                    + do_step(muscle, k as f64 * STEP, STEP, 0)
                    + get(muscle, outputs.as_ptr(), outputs.len(), values.as_mut_ptr());
                assert_eq!(status, 0);
                k += 1;
                black_box(values)
            });
        });
    }
}

criterion_group!(benches, in_rust, through_fmi);
criterion_main!(benches);
