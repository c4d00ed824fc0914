//! Tests of the safe interface. Expected numbers are Gymnasium's, out of tests/golden.

mod allocation;
mod golden;
mod misuse;
mod options;
mod pictures;
mod pipeline;
mod refusals;
mod relay;
mod replay;
mod rows;
mod schema;
mod state;
mod threads;
mod vectors;
