//! Fuzzes the readers of `.vtk`.
#![no_main]

pellicle_fuzz::target!();
