//! A plug-in with the id RustHopper-v5.

mod hopper;

mjenv::plugin!(hopper::Hopper);
