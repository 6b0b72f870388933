//! The shared library itself, loaded and unloaded as hosts do.

use crate::host::{Api, Fmu};
use libloading::Library;
use sinew::parameters::Parameters;
use std::sync::mpsc::channel;

/// The shared library that was built with this test.
fn library() -> Library {
    let name = libloading::library_filename("sinew_fmu");
    let path = std::env::current_exe().unwrap().with_file_name(name);
    // SAFETY: a library of this project, which runs nothing when it is loaded.
    unsafe { Library::new(path) }.expect("the shared library is beside the test")
}

#[test]
fn the_loaded_library_does_what_the_linked_one_does() {
    let library = library();
    let outputs = [Api::loaded(&library), Api::linked()].map(|api| {
        let mut fmu = Fmu::instantiate(api, "PneumaticMuscle", &Parameters::default());
        fmu.initialize();
        fmu.set("valve.command", 2.0);
        fmu.step(0.0, 0.1);
        fmu.outputs()
    });
    assert_eq!(outputs[0], outputs[1]);
}

#[test]
fn a_thread_may_end_after_the_library_was_unloaded() {
    let library = library();
    let api = Api::loaded(&library);
    let (used, wait_for_use) = channel();
    let (unloaded, wait_for_unloading) = channel();
    let thread = std::thread::spawn(move || {
        drop(Fmu::instantiate(api, "PneumaticMuscle", &Parameters::default()));
        used.send(()).unwrap();
        wait_for_unloading.recv().unwrap();
    });
    wait_for_use.recv().unwrap();
    library.close().unwrap();
    unloaded.send(()).unwrap();
    thread.join().unwrap();
}
