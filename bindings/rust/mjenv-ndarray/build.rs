//! Makes this package's tests find libmjenv at run time.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", std::env::var("DEP_MJENV_RUST_LIBDIR").expect("mjenv tells it"));
}
