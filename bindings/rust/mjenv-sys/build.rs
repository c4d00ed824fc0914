//! Finds libmjenv, or builds it, and tells cargo where it is.

use std::env;
use std::path::PathBuf;
use std::process::Command;

const SOURCES: [&str; 5] = ["CMakeLists.txt", "assets", "capi", "cmake", "core"];
const NEEDS: &str =
    "building libmjenv needs CMake 3.22, make or ninja and a C++17 compiler, and in a checkout what tools/setup build \
    installs on Debian 12; or set MJENV_LIB_DIR to the folder of a libmjenv.so";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // docs.rs compiles nothing but Rust, and links nothing.
    if env::var_os("DOCS_RS").is_some() {
        println!("cargo:libdir=");
        return;
    }
    for name in ["MJENV_LIB_DIR", "PKG_CONFIG", "PKG_CONFIG_PATH", "CMAKE_GENERATOR"] {
        println!("cargo:rerun-if-env-changed={name}");
    }
    let dir = given().or_else(installed).unwrap_or_else(built);
    let dir = dir.display();
    println!("cargo:rustc-link-search=native={dir}");
    println!("cargo:rustc-link-lib=dylib=mjenv");
    // Cargo hands the search path alone to dependents: they put it into their programs as DEP_MJENV_LIBDIR.
    println!("cargo:rustc-link-arg=-Wl,-rpath,{dir}");
    println!("cargo:libdir={dir}");
}

fn given() -> Option<PathBuf> {
    let dir = PathBuf::from(env::var_os("MJENV_LIB_DIR")?);
    let library = dir.join("libmjenv.so");
    if !dir.is_absolute() || !library.exists() {
        panic!("MJENV_LIB_DIR is {dir:?}: it must be the absolute path of a folder with libmjenv.so");
    }
    println!("cargo:rerun-if-changed={}", library.display());
    Some(dir)
}

fn installed() -> Option<PathBuf> {
    let part = |name: &str| env::var(name).expect("cargo sets it");
    let (major, minor) = (part("CARGO_PKG_VERSION_MAJOR"), part("CARGO_PKG_VERSION_MINOR"));
    let program = env::var_os("PKG_CONFIG").unwrap_or_else(|| "pkg-config".into());
    let output =
        Command::new(program).args(["--variable=libdir", &format!("mjenv >= {major}.{minor}")]).output().ok()?;
    if !output.status.success() {
        return None;
    }
    let dir = PathBuf::from(String::from_utf8(output.stdout).ok()?.trim_end());
    if !dir.join("libmjenv.so").exists() {
        println!("cargo:warning=pkg-config's mjenv names {dir:?}, where there is no libmjenv.so: building it instead");
        return None;
    }
    Some(dir)
}

fn built() -> PathBuf {
    let here = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    // The crate of a release carries the sources; else it is part of a checkout.
    let root = [here.join("libmjenv"), here.join("../../..")]
        .into_iter()
        .find(|root| root.join("capi/include/mjenv/mjenv.h").exists())
        .unwrap_or_else(|| {
            panic!(
                "no libmjenv: MJENV_LIB_DIR is not set, pkg-config knows no mjenv, and {here:?} has no sources \
                 of it from which it could be built"
            )
        });
    for source in SOURCES {
        println!("cargo:rerun-if-changed={}", root.join(source).display());
    }
    let dir = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("build");
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(&root).arg("-B").arg(&dir);
    if env::var_os("CMAKE_GENERATOR").is_none() && has_ninja() {
        configure.arg("-GNinja");
    }
    run(&mut configure);
    run(Command::new("cmake").arg("--build").arg(&dir).args(["--target", "mjenv", "--parallel", &jobs()]));
    dir
}

fn has_ninja() -> bool {
    Command::new("ninja").arg("--version").output().is_ok()
}

fn jobs() -> String {
    env::var("NUM_JOBS").unwrap_or_else(|_| "1".to_string())
}

fn run(command: &mut Command) {
    match command.status() {
        Ok(status) if status.success() => {}
        Ok(status) => panic!("{command:?} failed ({status}), see its output; {NEEDS}"),
        Err(error) => panic!("{command:?} cannot be run ({error}); {NEEDS}"),
    }
}
