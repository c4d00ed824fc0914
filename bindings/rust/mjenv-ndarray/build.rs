//! Adds libmjenv's folder to the run path of this package's tests.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let dir = std::env::var("DEP_MJENV_RUST_LIBDIR").expect("mjenv's build script sets it");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{dir}");
}
