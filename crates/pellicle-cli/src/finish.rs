//! `--smooth`, `--decimate` and `--keep`: what is done to a mesh once it is there, shared by the verbs that make one.

use std::path::Path;

use pellicle::Mesh;
use pellicle::post::Finish;
use pellicle::post::clamp::Bounds;
use pellicle::post::components::{Cavities, Keep};
use pellicle::post::decimate::Target;
use pellicle::post::smooth::{Filter, Smoothing};

use crate::args::FinishArgs;
use crate::choose::crop::Crop;
use crate::failure::Failure;

/// What `--smooth` asks for; what is not said depends on what the mesh is made of.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Smooth {
    iterations: Option<usize>,
    strength: Option<f32>,
    filter: Option<Filter>,
    /// Whether spray and thin films are spared.
    weights: Option<bool>,
    snap: Option<bool>,
    normals: Option<usize>,
}

/// `iterations=25,strength=1,filter=laplacian,weights=on,snap=on,normals=10`, or some of it, or nothing.
pub fn parse_smooth(text: &str) -> Result<Smooth, String> {
    let mut smooth = Smooth::default();
    each_setting(text, "iterations, strength, filter, weights, snap, normals", |key, value| {
        match key {
            "iterations" => smooth.iterations = Some(whole(value)?),
            "strength" => smooth.strength = Some(share(value)?),
            "filter" => smooth.filter = Some(filter(value)?),
            "weights" => smooth.weights = Some(switch(value)?),
            "snap" => smooth.snap = Some(switch(value)?),
            "normals" => smooth.normals = Some(whole(value)?),
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    Ok(smooth)
}

/// `largest=N,volume=V,cavities=on|off`, or some of it.
pub fn parse_keep(text: &str) -> Result<Keep, String> {
    let mut keep = Keep::default();
    each_setting(text, "largest, volume, cavities", |key, value| {
        match key {
            "largest" => keep.largest = Some(whole(value)?),
            "volume" => keep.min_volume = volume(value)?,
            "cavities" => keep.cavities = if switch(value)? { Cavities::Keep } else { Cavities::Fill },
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    Ok(keep)
}

/// A share of the triangles, `error=X` or `triangles=N`, or nothing.
pub fn parse_decimate(text: &str) -> Result<Target, String> {
    const FORMS: &str = "a share of the triangles from 0 to 1, error=LENGTH or triangles=N";
    let target = match text.split_once('=') {
        None if text.is_empty() => Some(Target::default()),
        None => text.parse().ok().filter(|share| (0.0..=1.0).contains(share)).map(Target::Share),
        Some(("error", length)) => length.parse().ok().filter(|x: &f64| x.is_finite() && *x >= 0.0).map(Target::Error),
        Some(("triangles", count)) => count.parse().ok().map(Target::Triangles),
        Some(_) => None,
    };
    target.ok_or_else(|| format!("must be {FORMS}"))
}

/// The box of `--clamp`.
fn bounds(words: &[String]) -> Result<Bounds, Failure> {
    let [min, max] = Crop::parse(words).map_err(|error| Failure::Usage(format!("--clamp: {error}")))?.corners();
    if (0..3).any(|a| min[a] == max[a]) {
        return Err(Failure::Usage("--clamp: the box is flat, so nothing is in it".into()));
    }
    Ok(Bounds { min, max })
}

/// Calls `take` with every KEY=VALUE of a list; `false` says that there is no such key.
fn each_setting(
    text: &str,
    keys: &str,
    mut take: impl FnMut(&str, &str) -> Result<bool, String>,
) -> Result<(), String> {
    for setting in text.split(',').map(str::trim).filter(|setting| !setting.is_empty()) {
        let Some((key, value)) = setting.split_once('=') else {
            return Err(format!("'{setting}' is no KEY=VALUE; keys are {keys}"));
        };
        if !take(key.trim(), value.trim()).map_err(|must| format!("{key} = {value}: must be {must}"))? {
            return Err(format!("there is no '{key}'; keys are {keys}"));
        }
    }
    Ok(())
}

fn whole(value: &str) -> Result<usize, String> {
    const MOST: usize = 10_000;
    value.parse().ok().filter(|n| *n <= MOST).ok_or_else(|| format!("a whole number from 0 to {MOST}"))
}

fn share(value: &str) -> Result<f32, String> {
    value.parse().ok().filter(|v| (0.0..=1.0).contains(v)).ok_or_else(|| "a number from 0 to 1".into())
}

fn volume(value: &str) -> Result<f64, String> {
    let volume = value.parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0);
    volume.ok_or_else(|| "a volume in cubic world units, 0 or greater".into())
}

fn filter(value: &str) -> Result<Filter, String> {
    match value {
        "laplacian" => Ok(Filter::Laplacian),
        "taubin" => Ok(Filter::Taubin),
        _ => Err("laplacian or taubin".into()),
    }
}

fn switch(value: &str) -> Result<bool, String> {
    match value {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("on or off".into()),
    }
}

/// What a mesh is made of, on which defaults depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// Particles: smoothing goes by how crowded they are.
    Particles,
    /// A volume: there are no weights, so the filter keeps the volume.
    Volume,
}

/// What is to be done in all.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Finishing {
    /// For the mesh.
    pub finish: Finish,
    /// Whether smoothing goes by how crowded the particles are.
    pub weighted: bool,
    /// Whether triangles are paired to quads in the end.
    pub quads: bool,
}

impl Finishing {
    /// Whether the mesh is written as it comes.
    pub fn is_nothing(&self) -> bool {
        self.finish.is_nothing() && !self.quads
    }

    /// Bytes needed besides the mesh, at the most.
    pub fn memory(&self, mesh: &Mesh) -> u64 {
        /// Sides, pairs and who is in which, of a triangle.
        const PAIRING: u64 = 130;
        let pairing = if self.quads { PAIRING * mesh.triangles.len() as u64 } else { 0 };
        pairing.max(if self.finish.is_nothing() { 0 } else { self.finish.memory(mesh) })
    }

    /// Whether the file can hold what is asked for, from its name alone.
    ///
    /// # Errors
    /// Quads for a format of triangles.
    pub fn check_format(&self, path: &Path) -> Result<(), Failure> {
        if self.quads {
            pellicle_io::check_quad_format(path).map_err(|error| Failure::Usage(format!("--quads: {error}")))?;
        }
        Ok(())
    }

    /// As meant.
    ///
    /// # Errors
    /// Weights where there are no particles, a strength with which the filter is not stable, a box without inside.
    pub fn new(args: &FinishArgs, of: Of) -> Result<Self, Failure> {
        let clamp = args.clamp.as_deref().map(bounds).transpose()?;
        let finish =
            Finish { keep: args.keep.unwrap_or_default(), decimate: args.decimate, clamp, ..Finish::default() };
        let Some(smooth) = args.smooth else {
            return Ok(Self { finish, weighted: false, quads: args.quads });
        };
        if of == Of::Volume && smooth.weights == Some(true) {
            let what = "--smooth=weights=on: weights go by how crowded particles are, and a volume has none";
            return Err(Failure::Usage(what.into()));
        }
        let usual = if of == Of::Volume { Smoothing::keeping_volume() } else { Smoothing::default() };
        let filter = smooth.filter.unwrap_or(usual.filter);
        let gentle = if filter == Filter::Taubin { Smoothing::keeping_volume() } else { Smoothing::default() };
        let smoothing = Smoothing {
            iterations: smooth.iterations.unwrap_or(usual.iterations),
            strength: smooth.strength.unwrap_or(gentle.strength),
            filter,
        };
        if filter == Filter::Taubin && smoothing.strength > Filter::MOST_TAUBIN {
            let most = Filter::MOST_TAUBIN;
            let what = format!("--smooth=strength={}: at most {most} with filter=taubin", smoothing.strength);
            return Err(Failure::Usage(what));
        }
        let weighted = of == Of::Particles && smooth.weights.unwrap_or(true) && smoothing.iterations > 0;
        let (snap, normals) = (smooth.snap.unwrap_or(true), smooth.normals.unwrap_or(10));
        let finish = Finish { snap, smoothing: Some(smoothing), normals: Some(normals), ..finish };
        Ok(Self { finish, weighted, quads: args.quads })
    }

    /// For the output's header; `None` where nothing is done.
    pub fn record(&self) -> Option<String> {
        if self.is_nothing() {
            return None;
        }
        let Finish { keep, snap, smoothing, decimate, normals, clamp } = self.finish;
        let on = |is_on| if is_on { "on" } else { "off" };
        let mut words = vec!["finish".to_owned()];
        if keep != Keep::default() {
            words.push(format!("keep volume={} cavities={}", keep.min_volume, on(keep.cavities == Cavities::Keep)));
            words.extend(keep.largest.map(|n| format!("largest={n}")));
        }
        if let Some(Smoothing { iterations, strength, filter }) = smoothing {
            // Laplacian goes without saying, as it always did.
            let filter = if filter == Filter::Taubin { " filter=taubin" } else { "" };
            words.push(format!(
                "smooth iterations={iterations} strength={strength}{filter} weights={} snap={}",
                on(self.weighted),
                on(snap)
            ));
        }
        words.extend(decimate.map(|target| match target {
            Target::Share(share) => format!("decimate {share}"),
            Target::Error(error) => format!("decimate error={error}"),
            Target::Triangles(count) => format!("decimate triangles={count}"),
        }));
        words.extend(normals.map(|n| format!("normals={n}")));
        words.extend(clamp.map(|Bounds { min, max }| format!("clamp {min:?} to {max:?}")));
        words.extend(self.quads.then(|| "quads".to_owned()));
        Some(words.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_arrive_and_the_rest_is_the_default() {
        assert_eq!(parse_smooth(""), Ok(Smooth::default()));
        let args = FinishArgs {
            smooth: Some(parse_smooth("iterations=5, weights=off,snap=off,strength=0.5,normals=0").unwrap()),
            decimate: Some(parse_decimate("error=0.5").unwrap()),
            keep: Some(parse_keep("largest=2,volume=0.1,cavities=off").unwrap()),
            clamp: Some(vec!["0,-1,-".into(), "1,2,3".into()]),
            ..FinishArgs::default()
        };
        let found = Finishing::new(&args, Of::Particles).unwrap_or_else(|e| panic!("{e}"));
        let keep = Keep { largest: Some(2), min_volume: 0.1, cavities: Cavities::Fill };
        let smoothing = Some(Smoothing { iterations: 5, strength: 0.5, filter: Filter::Laplacian });
        let clamp = Some(Bounds { min: [0.0, -1.0, f64::NEG_INFINITY], max: [1.0, 2.0, 3.0] });
        let decimate = Some(Target::Error(0.5));
        assert_eq!(found.finish, Finish { keep, snap: false, smoothing, decimate, normals: Some(0), clamp });
        assert!(!found.weighted && found.record().is_some());
        let nothing = Finishing::new(&FinishArgs::default(), Of::Volume).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(nothing, Finishing::default());
        assert_eq!(Finishing::default().record(), None);
    }

    #[test]
    fn volumes_are_smoothed_without_weights_and_keep_their_size() {
        let of = |text: &str, of| {
            let smooth = Some(parse_smooth(text).unwrap());
            Finishing::new(&FinishArgs { smooth, ..FinishArgs::default() }, of)
        };
        let volume = of("", Of::Volume).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(volume.finish.smoothing, Some(Smoothing::keeping_volume()));
        assert!(!volume.weighted);
        let particles = of("filter=taubin", Of::Particles).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(particles.finish.smoothing, Some(Smoothing::keeping_volume()));
        assert!(particles.weighted);
        let plain = of("filter=laplacian", Of::Volume).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(plain.finish.smoothing, Some(Smoothing::default()));
        assert!(of("weights=on", Of::Volume).is_err() && of("strength=0.9", Of::Volume).is_err());
    }

    #[test]
    fn what_means_nothing_is_told() {
        for (text, told) in [
            ("iteration=3", "there is no"),
            ("iterations=-1", "whole number"),
            ("snap", "KEY=VALUE"),
            ("weights=1", "on or off"),
        ] {
            assert!(parse_smooth(text).unwrap_err().contains(told), "{text}");
        }
        assert_eq!(parse_decimate(""), Ok(Target::Share(0.25)));
        assert_eq!(parse_decimate("0.1"), Ok(Target::Share(0.1)));
        assert_eq!(parse_decimate("triangles=500"), Ok(Target::Triangles(500)));
        for wrong in ["1.5", "x", "error=-1", "error=nan", "triangles=0.5", "share=0.5"] {
            assert!(parse_decimate(wrong).unwrap_err().contains("share of the triangles"), "{wrong}");
        }
        assert!(parse_keep("volume=nan").is_err() && parse_keep("largest=x").is_err());
    }
}
