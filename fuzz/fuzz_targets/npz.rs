//! Fuzzes the readers of `.npz`.
#![no_main]

pellicle_fuzz::target!();
