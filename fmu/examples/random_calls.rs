//! Ten thousand random calls, always the same, on every model of a shared library; then everything is freed.
//!
//! To be run under a memory checker:
//!
//! ```sh
//! cargo build -p sinew-fmu --lib --example random_calls
//! valgrind --leak-check=full --error-exitcode=1 \
//!     target/debug/examples/random_calls target/debug/libsinew_fmu.so
//! ```

#[path = "../tests/fmi2/calls.rs"]
#[allow(dead_code)]
mod calls;
#[path = "../tests/fmi2/host.rs"]
#[allow(dead_code)]
mod host;

use calls::{Host, any_call};
use host::Api;
use libloading::Library;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use sinew::models::models;

const CALLS: usize = 10_000;
/// Calls after which a host frees its instance and takes a new one.
const CALLS_PER_INSTANCE: usize = 100;

fn main() {
    let path = std::env::args_os().nth(1).expect("the path of the shared library");
    // SAFETY: a library of this project, which runs nothing when it is loaded.
    let library = unsafe { Library::new(path) }.expect("a shared library");
    let api = Api::loaded(&library);
    // What the thread has of its own must be freed with it, too.
    std::thread::spawn(move || call_at_random(api)).join().expect("no panic");
    println!("{CALLS} calls done");
}

fn call_at_random(api: Api) {
    let (models, calls, mut runner) = (models(), any_call(), TestRunner::deterministic());
    for instance in 0..CALLS / CALLS_PER_INSTANCE {
        let mut host = Host::new(api, models[instance % models.len()].interface().name);
        for _ in 0..CALLS_PER_INSTANCE {
            host.apply(&calls.new_tree(&mut runner).expect("a call").current());
        }
    }
}
