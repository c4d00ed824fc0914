//! Tests the safe interface. The expected numbers are Gymnasium's, recorded in tests/golden.

mod allocation;
mod asynchronous;
mod golden;
mod halves;
mod misuse;
mod numpy;
mod options;
mod pictures;
mod randomisation;
mod refusals;
mod relay;
mod replay;
mod rows;
mod schema;
mod state;
mod threads;
mod vectors;
mod writes;
