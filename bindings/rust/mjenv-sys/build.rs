//! Finds libmjenv or builds it, and tells cargo in which folder it is. With the feature `mujoco4` it is libmjenv-mujoco4.

use std::env;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

const SOURCES: [&str; 6] = ["CMakeLists.txt", "assets", "capi", "cmake", "core", "extras"];
const NEEDS: &str =
    "building libmjenv needs CMake 3.22, make or ninja and a C++17 compiler, and in a checkout what tools/setup build \
    installs on Debian 12; or set MJENV_LIB_DIR to the folder of a library that is built";

const ON_MUJOCO4: bool = cfg!(feature = "mujoco4");
/// The library's name for the linker and for pkg-config.
const NAME: &str = if ON_MUJOCO4 { "mjenv-mujoco4" } else { "mjenv" };

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // docs.rs compiles Rust only, and does not link. Plug-ins do not link with the library.
    if env::var_os("DOCS_RS").is_some() || !cfg!(feature = "library") {
        println!("cargo:libdir=");
        return;
    }
    for name in ["MJENV_LIB_DIR", "MJENV_MUJOCO", "PKG_CONFIG", "PKG_CONFIG_PATH", "CMAKE_GENERATOR"] {
        println!("cargo:rerun-if-env-changed={name}");
    }
    let dir = given().or_else(installed).unwrap_or_else(built);
    let dir = dir.display();
    println!("cargo:rustc-link-search=native={dir}");
    println!("cargo:rustc-link-lib=dylib={NAME}");
    // Cargo applies this argument to the tests of this package alone. Dependents read the folder from DEP_MJENV_LIBDIR
    // and add it to the run path of their own programs.
    println!("cargo:rustc-link-arg=-Wl,-rpath,{dir}");
    println!("cargo:libdir={dir}");
}

fn file() -> String {
    format!("lib{NAME}.so")
}

fn given() -> Option<PathBuf> {
    let dir = PathBuf::from(env::var_os("MJENV_LIB_DIR")?);
    if !dir.is_absolute() {
        panic!("MJENV_LIB_DIR is {dir:?}: it must be an absolute path");
    }
    if !dir.join(file()).exists() {
        panic!("MJENV_LIB_DIR is {dir:?}: it must be the path of a folder with {}", file());
    }
    println!("cargo:rerun-if-changed={}", dir.join(file()).display());
    Some(dir)
}

fn installed() -> Option<PathBuf> {
    let part = |name: &str| env::var(name).expect("cargo sets it");
    let (major, minor) = (part("CARGO_PKG_VERSION_MAJOR"), part("CARGO_PKG_VERSION_MINOR"));
    let program = env::var_os("PKG_CONFIG").unwrap_or_else(|| "pkg-config".into());
    let output =
        Command::new(program).args(["--variable=libdir", &format!("{NAME} >= {major}.{minor}")]).output().ok()?;
    if !output.status.success() {
        return None;
    }
    let dir = PathBuf::from(String::from_utf8(output.stdout).ok()?.trim_end());
    if !dir.join(file()).exists() {
        println!("cargo:warning=pkg-config names {dir:?}, but {} is not there: building it", file());
        return None;
    }
    Some(dir)
}

fn built() -> PathBuf {
    let here = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    // A released crate carries the sources. Otherwise the crate is part of a checkout.
    let root = [here.join("libmjenv"), here.join("../../..")]
        .into_iter()
        .find(|root| root.join("capi/include/mjenv/mjenv.h").exists())
        .unwrap_or_else(|| {
            panic!(
                "{} was not found: MJENV_LIB_DIR is not set, pkg-config does not know {NAME}, and {here:?} does not \
                 contain the sources",
                file()
            )
        });
    for source in SOURCES {
        println!("cargo:rerun-if-changed={}", root.join(source).display());
    }
    let dir = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("build");
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(&root).arg("-B").arg(&dir);
    if env::var_os("CMAKE_GENERATOR").is_none() && Command::new("ninja").arg("--version").output().is_ok() {
        configure.arg("-GNinja");
    }
    if ON_MUJOCO4 {
        let mut option = OsString::from("-DMJENV_ENGINE=");
        option.push(mujoco4());
        configure.arg(option);
    }
    run(&mut configure);
    let jobs = env::var("NUM_JOBS").unwrap_or_else(|_| "1".to_string());
    run(Command::new("cmake").arg("--build").arg(&dir).args(["--parallel", &jobs, "--target", "mjenv"]));
    dir
}

/// The folder of MuJoCo 4.0 that belongs to the library that MJENV_MUJOCO names: of an unpacked official release, whose
/// folder `lib` has the library, or `mujoco` of the Python packages.
fn mujoco4() -> PathBuf {
    let library = PathBuf::from(env::var_os("MJENV_MUJOCO").unwrap_or_else(|| {
        panic!(
            "{} was not found, and building it needs MuJoCo 4.0's headers: set MJENV_MUJOCO to the path of its \
             libmujoco.so.4.0.x, or MJENV_LIB_DIR to the folder of a library that is built",
            file()
        )
    }));
    let folder = library.parent().expect("a file is in a folder");
    let release = folder.parent().filter(|_| folder.ends_with("lib"));
    release.unwrap_or(folder).to_path_buf()
}

fn run(command: &mut Command) {
    match command.status() {
        Ok(status) if status.success() => {}
        Ok(status) => panic!("{command:?} failed ({status}), see its output; {NEEDS}"),
        Err(error) => panic!("{command:?} cannot be run ({error}); {NEEDS}"),
    }
}
