//! Fuzzes the readers of `.stl`.
#![no_main]

pellicle_fuzz::target!();
