//! Fuzzes the readers of `.ply`.
#![no_main]

pellicle_fuzz::target!();
