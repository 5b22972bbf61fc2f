//! Fuzzes the readers of `.vtp`.
#![no_main]

pellicle_fuzz::target!();
