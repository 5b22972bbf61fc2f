//! Scenes and assertions, written once and stamped onto every field, road and backend.
//!
//! A *scene* ([`scenes`], [`cavities`]) is particles with parameters, and what is known of their surface. A *subject*
//! ([`Subject`]) is one way to make a mesh: which vector unit, how many threads, whole or in chunks, with how much memory.
//! [`check`] lets a subject mesh a scene, judges the mesh by what is known, and compares its bytes with those of the
//! [reference](Subject::reference): one thread, every node evaluated, all memory. [`conformance!`] stamps all scenes onto
//! a subject, one test each.
//!
//! A new field or road is a new kind of subject; a new scene is one line in [`conformance!`].

pub mod allocations;
pub mod cavities;
mod data;
mod judge;
mod nearby;
pub mod scenes;
mod subject;

pub use data::{particle_file, raw_particles};
pub use judge::{Defect, check, closed, must, same_bytes};
pub use nearby::lonely;
pub use pellicle_scenes::Random;
pub use scenes::{Known, Scene};
pub use subject::{Delivery, Memory, Subject, in_pool};

/// Says on standard output that a test cannot run, in the form that the tally of `cargo xtask test` counts.
pub fn skip(reason: &str) {
    println!("SKIPPED: {reason}");
}

/// Stamps every scene onto each subject: `conformance! { name => subject, … }` makes a module of tests for each.
#[macro_export]
macro_rules! conformance {
    ($($name:ident => $subject:expr,)*) => { $(
        mod $name {
            $crate::conformance! { @scenes $subject;
                none one two_touching two_apart coincident_pair coincident_hundred ball torus shell sheet slab_at_nodes
                far_from_the_origin negative_coordinates stray_particle
            }
        }
    )* };
    (@scenes $subject:expr; $($scene:ident)*) => { $(
        #[test]
        fn $scene() {
            use super::*;
            $crate::must($crate::check(&$crate::scenes::$scene(), &$subject));
        }
    )* };
}
