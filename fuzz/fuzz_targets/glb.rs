//! Fuzzes the readers of `.glb`.
#![no_main]

pellicle_fuzz::target!();
