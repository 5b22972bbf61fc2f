//! Fuzzes the readers of `.npy`.
#![no_main]

pellicle_fuzz::target!();
