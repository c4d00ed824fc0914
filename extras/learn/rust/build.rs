//! Links libmjenv-learn, which is in the folder of libmjenv. If mjenv-sys has built libmjenv, builds it there.

use std::env;
use std::path::PathBuf;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let dir = PathBuf::from(env::var_os("DEP_MJENV_RUST_LIBDIR").expect("mjenv's build script sets it"));
    if dir.as_os_str().is_empty() {
        return; // docs.rs, which compiles Rust only
    }
    let file = dir.join("libmjenv-learn.so");
    if dir.join("CMakeCache.txt").exists() && !file.exists() {
        let jobs = env::var("NUM_JOBS").unwrap_or_else(|_| "1".to_string());
        let mut build = Command::new("cmake");
        build.arg("--build").arg(&dir).args(["--target", "mjenv_learn", "--parallel", &jobs]);
        assert!(build.status().map_or(false, |status| status.success()), "{build:?} failed");
    }
    assert!(file.exists(), "{file:?} is missing: install or build libmjenv with its learner");
    println!("cargo:rerun-if-changed={}", file.display());
    println!("cargo:rustc-link-search=native={}", dir.display());
    println!("cargo:rustc-link-lib=dylib=mjenv-learn");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", dir.display()); // of this package's tests
}
