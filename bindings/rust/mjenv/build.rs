//! Adds libmjenv's folder to the run path of this package's tests, and passes the folder on to dependents. Without the
//! feature `library` there is no folder.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let dir = std::env::var("DEP_MJENV_LIBDIR").expect("mjenv-sys's build script sets it");
    if !dir.is_empty() {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{dir}");
    }
    println!("cargo:libdir={dir}");
}
