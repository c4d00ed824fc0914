//! Declarations of libmjenv's C interface, generated from its headers.
//! The headers have their comments. The crate `mjenv` is a safe interface to them.
//!
//! The documentation of that crate says how the build script finds the library, whose folder it passes to the build
//! scripts of dependents as `DEP_MJENV_LIBDIR`.

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
