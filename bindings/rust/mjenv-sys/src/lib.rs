//! Declarations of libmjenv's C interface, generated from its header; the crate `mjenv` wraps them safely.
//!
//! The build script takes the library from the folder `MJENV_LIB_DIR`, from pkg-config's `mjenv`, or builds it with
//! CMake from the sources that the crate carries or the checkout that it is part of. It tells the build scripts of dependents the library's folder
//! as `DEP_MJENV_LIBDIR`.

#[rustfmt::skip]
#[allow(non_camel_case_types, rustdoc::broken_intra_doc_links)]
mod bindings;

pub use bindings::*;

#[cfg(test)]
mod tests {
    #[test]
    fn the_library_has_the_abi_of_the_header() {
        assert_eq!(unsafe { super::mjenv_abi_version() }, super::MJENV_ABI_VERSION);
    }
}
