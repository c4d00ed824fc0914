//! Makes this package's tests find libmjenv at run time, and tells dependents where it is.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let dir = std::env::var("DEP_MJENV_LIBDIR").expect("mjenv-sys tells where libmjenv is");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{dir}");
    println!("cargo:libdir={dir}");
}
