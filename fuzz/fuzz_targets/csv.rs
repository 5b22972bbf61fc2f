//! Fuzzes the readers of `.csv`.
#![no_main]

pellicle_fuzz::target!();
