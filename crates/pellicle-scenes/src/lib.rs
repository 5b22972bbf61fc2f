//! Particle scenes that are made, not stored: for demos, tests and benchmarks that need no download.
//!
//! [`splash`] looks like the frame of a fluid simulator: positions, velocities, and one particle radius, half of the rest
//! spacing. y is up, lengths are metres, speeds metres a second.
//!
//! A [`Play`] is what a game would show, frame by frame: a fountain, a blob, an explosion, a monster, in units where a
//! particle's field reaches 3.
//!
//! **Same seed, same bytes.** On every platform by construction, though only x86-64 was run: scenes are computed with
//! `+ − × ÷`, square roots and rounding only, which IEEE 754 rounds in one way everywhere: no `sin` or `powf` of the
//! platform's mathematics library, no fused multiply-add, no hash map with a random key, no threads. Random numbers come
//! from SplitMix64.
//!
//! ```
//! let scene = pellicle_scenes::splash(30_000, 1);
//! assert_eq!(scene.positions.len(), scene.velocities.len());
//! assert_eq!(scene, pellicle_scenes::splash(30_000, 1));
//! ```

mod arithmetic;
mod cloud;
mod random;

pub use random::Random;
mod show;
#[cfg(feature = "skin")]
mod skin;
mod splash;

pub use show::{Balls, FRAMES, ISO, Limb, Play, SUPPORT, Show};
#[cfg(feature = "skin")]
pub use skin::{LimbSkin, Wrap};
pub use splash::splash;

/// Particles of one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Positions in metres.
    pub positions: Vec<[f32; 3]>,
    /// Velocities in metres a second, one per position.
    pub velocities: Vec<[f32; 3]>,
    /// Particle radius in metres: half of the rest spacing.
    pub radius: f32,
}
