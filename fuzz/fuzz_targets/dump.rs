//! Fuzzes the readers of `.dump`.
#![no_main]

pellicle_fuzz::target!();
