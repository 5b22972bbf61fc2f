//! Fuzzes the readers of `.vtu`.
#![no_main]

pellicle_fuzz::target!();
