//! How the shared library is linked.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // A host may unload an FMU while its threads still hold Rust's thread-local data; it then stays mapped instead.
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete");
    }
}
