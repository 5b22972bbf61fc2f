//! Fuzzes the readers of `.h5`.
#![no_main]

pellicle_fuzz::target!();
