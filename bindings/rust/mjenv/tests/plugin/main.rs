//! Builds a plug-in as a user does, without libmjenv, and loads it.

#[path = "../tasks/equal.rs"]
mod equal;

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use mjenv::ErrorKind;

const OWN: &str = "RustHopper-v5";

fn build() -> PathBuf {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plugin");
    let status = Command::new(env!("CARGO"))
        .args(["build", "--offline", "--release", "--quiet", "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/plugin/hopper/Cargo.toml"))
        .arg("--target-dir")
        .arg(&target)
        .env_remove("LD_LIBRARY_PATH")
        .env_remove("RUSTFLAGS")
        // The folder does not exist, so a build that looked for the library would fail.
        .env("MJENV_LIB_DIR", "/mjenv is not here")
        .status()
        .unwrap();
    assert!(status.success());
    target.join("release/libhopper.so")
}

#[test]
fn a_plug_in_does_not_link_the_library_and_equals_the_built_in_task() {
    let plugin = build();
    let contains = |bytes: &[u8], text: &[u8]| bytes.windows(text.len()).any(|part| part == text);
    let bytes = fs::read(&plugin).unwrap();
    assert!(contains(&bytes, b"mjenv_tasks"));
    assert!(!contains(&bytes, b"libmjenv.so"));
    assert!(!contains(&bytes, b"mjenv_register_task"));

    assert_eq!(mjenv::spec(OWN).unwrap_err().kind(), ErrorKind::Name);
    mjenv::load_tasks(&plugin).unwrap();
    mjenv::load_tasks(&plugin).unwrap();
    assert_eq!(mjenv::ids().filter(|&id| id == OWN).count(), 1);

    equal::descriptions(OWN);
    equal::one_thread(OWN);
    equal::two_threads(OWN);
    equal::five_threads(OWN);
    equal::changed_options(OWN);
    equal::states(OWN);
}

#[test]
fn other_files_are_refused() {
    let error = mjenv::load_tasks("/does not exist.so").unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Task);
    assert!(error.message().contains("No such file"), "{error}");
    let error = mjenv::load_tasks(env::current_exe().unwrap()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Task);
    let error = mjenv::load_tasks("a\0b").unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Argument);
}
