//! Fuzzes the readers of `.bi4`.
#![no_main]

pellicle_fuzz::target!();
