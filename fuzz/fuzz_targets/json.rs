//! Fuzzes the readers of `.json`.
#![no_main]

pellicle_fuzz::target!();
