//! Shows: particles that move, for roads that make a surface every frame.
//!
//! Source: Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008, section 7, names the shows and says how
//! many particles they have, how far a particle's field reaches, and from its tables follows how large their surfaces are.
//! The motion is ours, and as simple as will do: nothing here is a simulation of a fluid.
//!
//! Lengths are in units where a particle's field reaches [`SUPPORT`] = 3; with the paper's threshold [`ISO`] = 0.2 a
//! particle alone is a ball of radius 1. y is up. [`FRAMES`] frames are a show's length, though it can be run on.
//!
//! Same seed, same bytes, as for all scenes. Frame k is reached by k steps from the first and in no other way.

mod blob;
mod explosion;
mod fountain;
mod monster;
#[cfg(test)]
mod tests;

use blob::Blob;
use explosion::Explosion;
use fountain::Fountain;
use monster::Monster;

/// Radius beyond which a particle's field is 0.
pub const SUPPORT: f32 = 3.0;

/// Isovalue of the field Σ strength · (1 − d²/[`SUPPORT`]²)²/4.
pub const ISO: f32 = 0.2;

/// Frames of a show.
pub const FRAMES: usize = 300;

/// Particles of one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Balls {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// What each particle's field is multiplied with; 1 for an ordinary one. As many as positions.
    pub strengths: Vec<f32>,
    /// Where on a limb each particle sits: of the monster as many as positions, else none.
    pub limbs: Vec<Limb>,
}

/// A particle's place on a limb, from which texture coordinates are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limb {
    /// Unit vector across the limb: where the angle around it starts.
    pub side: [f32; 3],
    /// Unit vector across the limb and [`side`](Self::side): where the angle is a quarter turn.
    pub up: [f32; 3],
    /// How far along the limb, in lengths of the world.
    pub along: f32,
}

/// What is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Show {
    /// A jet of water that breaks into spray; 20 particles a frame, up to 3000.
    Fountain,
    /// 100 particles that hang together, stretch, part and meet.
    Blob,
    /// 1000 particles: a packed ball that flies apart until all are alone.
    Explosion,
    /// 250 particles that grow tentacles, form a ball, coat a wall, burst and reassemble.
    Monster,
}

impl Show {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Fountain, Self::Blob, Self::Explosion, Self::Monster];

    /// In lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fountain => "fountain",
            Self::Blob => "blob",
            Self::Explosion => "explosion",
            Self::Monster => "monster",
        }
    }
}

/// A show at one of its frames.
///
/// ```
/// use pellicle_scenes::{Play, Show};
///
/// let mut play = Play::new(Show::Fountain, 1);
/// while play.frame() < 149 {
///     play.step();
/// }
/// assert_eq!(play.balls().positions.len(), 3000);
/// ```
#[derive(Debug, Clone)]
pub struct Play {
    actor: Actor,
    frame: usize,
    balls: Balls,
}

#[derive(Debug, Clone)]
enum Actor {
    Fountain(Fountain),
    Blob(Box<Blob>),
    Explosion(Explosion),
    Monster(Monster),
}

impl Play {
    /// At frame 0.
    pub fn new(show: Show, seed: u64) -> Self {
        let actor = match show {
            Show::Fountain => Actor::Fountain(Fountain::new(seed)),
            Show::Blob => Actor::Blob(Box::new(Blob::new(seed))),
            Show::Explosion => Actor::Explosion(Explosion::new(seed)),
            Show::Monster => Actor::Monster(Monster::new(seed)),
        };
        let mut play = Self { actor, frame: 0, balls: Balls::default() };
        play.place();
        play
    }

    /// The number of this frame.
    pub fn frame(&self) -> usize {
        self.frame
    }

    /// The particles of this frame.
    pub fn balls(&self) -> &Balls {
        &self.balls
    }

    /// Goes on to the next frame.
    pub fn step(&mut self) {
        self.frame += 1;
        match &mut self.actor {
            Actor::Fountain(fountain) => fountain.step(),
            Actor::Blob(blob) => blob.step(),
            Actor::Explosion(explosion) => explosion.step(),
            Actor::Monster(monster) => monster.step(),
        }
        self.place();
    }

    fn place(&mut self) {
        let Balls { positions, strengths, limbs } = &mut self.balls;
        positions.clear();
        let places = match &self.actor {
            Actor::Fountain(fountain) => fountain.places(),
            Actor::Blob(blob) => blob.places(),
            Actor::Explosion(explosion) => explosion.places(),
            Actor::Monster(monster) => monster.places(),
        };
        positions.extend(places.iter().map(|p| p.map(|x| x as f32)));
        strengths.clear();
        if let Actor::Monster(monster) = &self.actor {
            monster.limbs(limbs, strengths);
        } else {
            strengths.resize(positions.len(), 1.0);
        }
    }
}
