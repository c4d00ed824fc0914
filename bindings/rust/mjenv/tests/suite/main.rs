//! Tests the safe interface. The expected numbers are Gymnasium's, recorded in tests/golden.

mod allocation;
mod asynchronous;
#[allow(dead_code)] // the test `plugin` uses all of it
mod equal;
mod golden;
#[path = "../plugin/hopper/src/hopper.rs"]
mod hopper;
mod misuse;
mod options;
mod own_tasks;
mod pictures;
mod refusals;
mod relay;
mod replay;
mod rows;
mod schema;
mod state;
mod threads;
mod vectors;
