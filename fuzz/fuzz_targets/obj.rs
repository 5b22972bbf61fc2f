//! Fuzzes the readers of `.obj`.
#![no_main]

pellicle_fuzz::target!();
