//! Builds the FMU library and hands it to the `sinew` binary, which carries it inside.
//!
//! The library depends on this package without the feature `tool`, so the nested build does not come back here.
//! `SINEW_FMU_LIBRARY=FILE` takes a library that was built elsewhere (an older glibc, say) instead.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=SINEW_FMU_LIBRARY");
    for source in ["src", "fmu", "presets", "build.rs", "Cargo.toml"] {
        println!("cargo::rerun-if-changed={source}");
    }
    if env::var_os("CARGO_FEATURE_TOOL").is_none() {
        return;
    }
    let library = env::var_os("SINEW_FMU_LIBRARY").map_or_else(build_library, PathBuf::from);
    println!("cargo::rerun-if-changed={}", library.display());
    println!("cargo::rustc-env=SINEW_EMBEDDED_LIBRARY={}", absolute(&library).display());
    println!("cargo::rustc-env=SINEW_EMBEDDED_PLATFORM={}", platform());
}

fn variable(name: &str) -> String {
    env::var(name).unwrap_or_else(|_| panic!("cargo sets {name} for build scripts"))
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Name that FMI 2.0 gives to the platform of the target.
fn platform() -> String {
    let system = match variable("CARGO_CFG_TARGET_OS").as_str() {
        "macos" => "darwin".to_owned(),
        "windows" => "win".to_owned(),
        other => other.to_owned(),
    };
    format!("{system}{}", variable("CARGO_CFG_TARGET_POINTER_WIDTH"))
}

fn build_library() -> PathBuf {
    let (target, target_dir) = (variable("TARGET"), Path::new(&variable("OUT_DIR")).join("fmu"));
    let mut cargo = Command::new(variable("CARGO"));
    cargo.args(["build", "--package", "sinew-fmu", "--lib", "--profile", "fmu", "--target", &target, "--target-dir"]);
    cargo.arg(&target_dir);
    // What cargo told this script would reach the nested script too: the feature `tool` would then never end. A wrapper
    // such as that of clippy is for the outer build.
    for (name, _) in env::vars_os() {
        let text = name.to_string_lossy();
        if (text.starts_with("CARGO_") && text != "CARGO_HOME") || text.ends_with("_WRAPPER") {
            cargo.env_remove(&name);
        }
    }
    let status = cargo.status().unwrap_or_else(|error| panic!("cannot run cargo for the FMU library: {error}"));
    assert!(status.success(), "building the FMU library failed; see the messages above");
    let (prefix, suffix) = match variable("CARGO_CFG_TARGET_OS").as_str() {
        "windows" => ("", "dll"),
        "macos" => ("lib", "dylib"),
        _ => ("lib", "so"),
    };
    target_dir.join(target).join("fmu").join(format!("{prefix}sinew_fmu.{suffix}"))
}
