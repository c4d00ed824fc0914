//! Declarations of libmjenv's C interface, generated from its headers.
//! The headers have their comments. The crate `mjenv` is a safe interface to them.
//!
//! The build script looks for the library in the folder that `MJENV_LIB_DIR` names, then asks pkg-config for `mjenv`.
//! If both fail it builds the library with CMake, from the sources in the crate or in the checkout that the crate is
//! part of. It passes the library's folder to the build scripts of dependents as `DEP_MJENV_LIBDIR`. With the feature
//! `mujoco4` the library is `libmjenv-mujoco4`, the same on MuJoCo 4.0, which pkg-config knows as `mjenv-mujoco4`. Without
//! the feature `library` the build script does nothing, because plug-ins do not link with the library.

#[rustfmt::skip]
#[allow(non_camel_case_types)]
mod bindings;

pub use bindings::*;

#[cfg(all(test, feature = "library"))]
mod tests {
    #[test]
    fn the_library_has_the_abi_of_the_header() {
        assert_eq!(unsafe { super::mjenv_abi_version() }, super::MJENV_ABI_VERSION);
    }
}
