//! Fuzzes the readers of `.bgeo`.
#![no_main]

pellicle_fuzz::target!();
