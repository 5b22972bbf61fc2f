//! Fuzzes the readers of `.mhd`.
#![no_main]

pellicle_fuzz::target!();
