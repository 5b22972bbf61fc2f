//! Fuzzes the readers of `.extxyz`.
#![no_main]

pellicle_fuzz::target!();
