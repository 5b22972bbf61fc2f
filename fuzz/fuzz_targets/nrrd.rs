//! Fuzzes the readers of `.nrrd`.
#![no_main]

pellicle_fuzz::target!();
