//! Fuzzes the readers of `.pvd`.
#![no_main]

pellicle_fuzz::target!();
