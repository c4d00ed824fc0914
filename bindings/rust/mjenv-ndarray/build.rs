//! Adds libmjenv's folder to the run path of this package's tests.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", std::env::var("DEP_MJENV_RUST_LIBDIR").expect("mjenv's build script sets it"));
}
