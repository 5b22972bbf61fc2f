//! Fuzzes the readers of `.vti`.
#![no_main]

pellicle_fuzz::target!();
