//! Fuzzes the readers of `.nii`.
#![no_main]

pellicle_fuzz::target!();
