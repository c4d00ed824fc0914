//! Lets the program find libmjenv wherever it is started from.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", std::env::var("DEP_MJENV_RUST_LIBDIR").unwrap());
}
