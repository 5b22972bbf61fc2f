//! Fuzzes the readers of `.xyz`.
#![no_main]

pellicle_fuzz::target!();
