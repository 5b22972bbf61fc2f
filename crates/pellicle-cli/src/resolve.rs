//! The command line as meant: `MeshArgs` as typed become a `MeshJob` that needs no further decision but those that the
//! data make (the radius when it is not given, which attributes there are).

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pellicle::{Band, Lanes, Params, Tetrahedra, Walls};
use pellicle_io::{AttributeChoice, ParticleAttribute, Particles, RawType, ReadOptions, Up};

use crate::args::{BandArg, CellArg, FrameArgs, InputArgs, MeshArgs, Switch};
use crate::choose::crop::Crop;
use crate::choose::expression::Expression;
use crate::choose::transform::SCALED;
use crate::choose::{Choice, Invalid};
use crate::failure::Failure;
use crate::field;
use crate::finish::{Finishing, Of};
use crate::machine;
use crate::sequence::range::FrameRange;
use crate::sequence::shard::Shard;
use crate::walls;

/// All that `mesh` was asked to do, but for the list of frames.
#[derive(Debug)]
pub struct MeshJob {
    /// Where the particles come from and the meshes go.
    pub files: Files,
    /// Particle radius in world units, if it was given.
    pub radius: Option<f64>,
    /// Everything that decides the surface, but for the radius.
    pub params: Params,
    /// The attribute with each particle's own radius.
    pub radius_attribute: Option<String>,
    /// Tetrahedra in place of marching cubes.
    pub tetrahedra: Option<Tetrahedra>,
    /// What is done to the mesh.
    pub finishing: Finishing,
    /// Walls that the surface is cut at, and how they are told.
    pub walls: Option<Arc<Walls>>,
    /// A line each.
    pub walls_record: Vec<String>,
    /// How to read particles.
    pub read: ReadOptions,
    /// Which particles.
    pub choice: Choice,
    /// What is carried to the vertices.
    pub carry: AttributeChoice,
    /// Whether they get the surface's speed along its normal, too.
    pub normal_velocity: bool,
    /// The axis that points up.
    pub up: Up,
    /// Threads of the pool.
    pub threads: NonZeroUsize,
    /// Whether frames whose mesh is there are left out.
    pub skip_existing: bool,
    /// Seconds to wait for more frames.
    pub watch: Option<f64>,
}

/// Names of inputs and outputs, and which frames.
#[derive(Debug, Clone)]
pub struct Files {
    /// Files, folders, patterns.
    pub inputs: Vec<PathBuf>,
    /// As typed.
    pub output: Option<PathBuf>,
    /// The extension of outputs that are not named.
    pub extension: &'static str,
    /// Further outputs of each frame.
    pub png: Option<PathBuf>,
    /// And more.
    pub spray: Option<PathBuf>,
    /// Which frames of a pattern.
    pub frames: Option<FrameRange>,
    /// Which part of the frames is made here.
    pub shard: Option<Shard>,
}

impl Files {
    /// Judges what can be judged by itself.
    pub fn resolve(
        inputs: &[PathBuf],
        output: Option<&PathBuf>,
        extension: &'static str,
        frames: &FrameArgs,
    ) -> Result<Self, Failure> {
        if inputs.is_empty() {
            return Err(Failure::Usage("no input is named (name particle files, a folder, or a pattern)".into()));
        }
        Ok(Self {
            inputs: inputs.to_vec(),
            output: output.cloned(),
            extension,
            png: None,
            spray: None,
            frames: option("--frames", frames.frames.as_deref(), FrameRange::parse)?,
            shard: option("--shard", frames.shard.as_deref(), str::parse)?,
        })
    }
}

/// How to read and which particles, as meant; `otherwise` is what becomes of invalid positions that are not dropped.
pub fn selection(
    args: &InputArgs,
    carry: AttributeChoice,
    otherwise: Invalid,
) -> Result<(ReadOptions, Choice), Failure> {
    let filter = option("--where", args.condition.as_deref(), Expression::parse)?;
    let crop = args.crop.as_deref().map(Crop::parse).transpose();
    let crop = crop.map_err(|error| Failure::Usage(format!("--crop: {error}")))?;
    let invalid = if args.drop_invalid { Invalid::Drop } else { otherwise };
    let choice = Choice { scale: args.scale, invalid, crop, filter };
    let read = ReadOptions {
        attributes: carry,
        also: choice.names(),
        array: args.array.clone(),
        frame: args.step.unwrap_or(0),
        raw: args.raw.map_or(RawType::Auto, RawType::from),
    };
    Ok((read, choice))
}

fn option<T, E: std::fmt::Display>(
    name: &str,
    text: Option<&str>,
    parse: impl Fn(&str) -> Result<T, E>,
) -> Result<Option<T>, Failure> {
    text.map(|text| parse(text).map_err(|error| Failure::Usage(format!("{name}: {error}")))).transpose()
}

impl MeshJob {
    /// Works out what was meant. Looks at file names, not into files.
    pub fn resolve(args: &MeshArgs) -> Result<Self, Failure> {
        let (carry, normal_velocity) = made_of(args.attributes.clone().unwrap_or(AttributeChoice::Velocity));
        let (mut read, choice) = selection(&args.from, carry.clone(), Invalid::Refuse)?;
        read.also.extend(args.surface.radius_attribute.clone().filter(|name| !read.also.contains(name)));
        if normal_velocity && !read.also.iter().any(|name| name == VELOCITY) {
            read.also.push(VELOCITY.into());
        }
        let mut files = Files::resolve(&args.input, args.output.as_ref(), "ply", &args.frames)?;
        files.png.clone_from(&args.png);
        files.spray.clone_from(&args.spray);
        if let Some(png) = &files.png
            && !png.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
        {
            return Err(Failure::Usage(format!("--png {}: pictures are written as .png", png.display())));
        }
        if let Some(spray) = &files.spray {
            pellicle_io::check_particle_format(spray).map_err(|error| Failure::Usage(format!("--spray {error}")))?;
        }
        if !args.finish.wall.is_empty() && args.surface.method != CellArg::Cubes {
            return Err(Failure::Usage("--wall: walls cut marching cubes only (leave out --method)".into()));
        }
        if !args.finish.wall.is_empty() && args.surface.band == BandArg::Paper {
            let why = "--wall: where a wall cuts the fluid no surface particle tells of it (leave out --band paper)";
            return Err(Failure::Usage(why.into()));
        }
        Ok(Self {
            files,
            radius: args.surface.radius,
            params: params(args, machine::lanes_from_environment()?)?,
            radius_attribute: args.surface.radius_attribute.clone(),
            tetrahedra: match args.surface.method {
                CellArg::Cubes => None,
                CellArg::Tetra5 => Some(Tetrahedra::Five),
                CellArg::Tetra6 => Some(Tetrahedra::Six),
                CellArg::Bcc => Some(Tetrahedra::BodyCentred),
                CellArg::Simplex => Some(Tetrahedra::Simplex),
                CellArg::Regularised => Some(Tetrahedra::Regularised),
            },
            finishing: Finishing::new(&args.finish, Of::Particles)?,
            walls: walls::build(&args.finish.wall)?,
            walls_record: walls::record(&args.finish.wall),
            read,
            choice,
            carry,
            normal_velocity,
            up: args.from.up.into(),
            threads: args.machine.threads.unwrap_or_else(machine::default_threads),
            skip_existing: args.frames.skip_existing,
            watch: args.watch.watch,
        })
    }

    /// Leaves out attributes that were read for the choice of particles only, or for their radius; returns the latter.
    ///
    /// # Errors
    /// An attribute of radii with more than one component.
    pub fn keep_carried(&self, particles: &mut Particles, path: &Path) -> Result<Option<Vec<f32>>, Failure> {
        let radii = self.radius_attribute.as_ref().and_then(|name| particles.attribute(name));
        let radii = match radii {
            Some(found) if found.components == 1 => {
                // Radii are lengths, whatever their name.
                let is_scaled = SCALED.contains(&found.name.as_str());
                let factor = self.choice.scale.filter(|_| !is_scaled).unwrap_or(1.0);
                Some(found.to_f32().iter().map(|&r| (f64::from(r) * factor) as f32).collect())
            }
            Some(found) => {
                let what =
                    format_args!("--radius-attribute {}: has {} components, not 1", found.name, found.components);
                return Err(Failure::file(path, what));
            }
            None => None,
        };
        if self.normal_velocity && particles.attribute(VELOCITY).is_none_or(|found| found.components != 3) {
            let what =
                format_args!("--attributes {NORMAL_VELOCITY}: made of the particles' velocity, and there is none");
            return Err(Failure::file(path, what));
        }
        let also = self.normal_velocity.then_some(VELOCITY);
        if !self.read.also.is_empty() {
            let is_kept = |a: &ParticleAttribute| self.carry.wants(&a.name, a.components) || also == Some(&a.name[..]);
            particles.attributes.retain(is_kept);
        }
        Ok(radii)
    }
}

/// The attribute that is not in files but made of the velocity.
pub const NORMAL_VELOCITY: &str = "normal_velocity";
const VELOCITY: &str = "velocity";

/// What is to be read of a choice, and whether the speed along the normal is in it.
fn made_of(choice: AttributeChoice) -> (AttributeChoice, bool) {
    match choice {
        AttributeChoice::Names(mut names) if names.iter().any(|name| name == NORMAL_VELOCITY) => {
            names.retain(|name| name != NORMAL_VELOCITY);
            (if names.is_empty() { AttributeChoice::None } else { AttributeChoice::Names(names) }, true)
        }
        choice => (choice, false),
    }
}

/// Leaves out attributes that were read because of `also` alone.
pub fn keep_carried(carry: &AttributeChoice, also: &[String], particles: &mut Particles) {
    if !also.is_empty() {
        particles.attributes.retain(|attribute| carry.wants(&attribute.name, attribute.components));
    }
}

fn params(args: &MeshArgs, lanes: Lanes) -> Result<Params, Failure> {
    let surface = &args.surface;
    let field = surface.field.as_deref().map(field::parse).transpose()?.unwrap_or_default();
    let params = Params {
        // 1 until the data have said it.
        particle_radius: surface.radius.unwrap_or(1.0),
        field,
        smoothing_length: surface.smoothing_length.unwrap_or_else(|| field.smoothing_length()),
        cell_size: surface.cell,
        iso: surface.threshold.unwrap_or_else(|| field.iso()),
        band: match surface.band {
            BandArg::Auto => Band::Auto,
            BandArg::Full => Band::Full,
            BandArg::Paper if surface.method != CellArg::Cubes => {
                return Err(Failure::Usage("--band paper is for --method cubes: it knows whole cells only".into()));
            }
            BandArg::Paper => Band::Paper,
        },
        normals: args.normals == Switch::On,
        max_memory: args.machine.max_memory,
        lanes,
    };
    field::check(&params)?;
    Ok(params)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Cli, Verb};

    fn resolve(line: &str) -> Result<MeshJob, Failure> {
        let cli = Cli::try_parse_from(line.split_whitespace()).unwrap_or_else(|e| panic!("{e}"));
        let Verb::Mesh(args) = cli.verb else { panic!("not mesh: {line}") };
        MeshJob::resolve(&args)
    }

    #[test]
    fn the_input_alone_gives_the_documented_defaults() {
        let job = resolve("pellicle mesh run/frame.10.vtk").unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(job.files.inputs, [Path::new("run/frame.10.vtk")]);
        assert_eq!(job.radius, None);
        assert_eq!(job.params, Params::new(1.0), "the defaults of the command are those of the library");
        assert_eq!(job.carry, AttributeChoice::Velocity);
        assert_eq!(job.finishing, Finishing::default());
        assert_eq!(job.read, ReadOptions::default());
        assert!(job.choice.invalid == Invalid::Refuse && job.watch.is_none() && !job.skip_existing);
    }

    #[test]
    fn every_option_arrives() {
        let line = "pellicle mesh a.xyz -o b.obj -r 0.1 -l 1.5 -c 0.75 -t 0.4 --band full --attributes all \
                    --normals on --threads 3 --max-memory 2K --drop-invalid --where type==1 --crop 0,0,0 -,1,2 --scale 2 --up z \
                    --array a --step 3 --raw f64 --frames 1-9 --shard 2/3 --skip-existing --watch=7 --png p.png --spray s.ply \
                    --smooth=iterations=3 --keep largest=1";
        let job = resolve(line).unwrap_or_else(|e| panic!("{e}"));
        let expected = Params {
            particle_radius: 0.1,
            field: pellicle::ScalarField::Sph,
            smoothing_length: 1.5,
            cell_size: 0.75,
            iso: 0.4,
            band: Band::Full,
            normals: true,
            max_memory: Some(2048),
            lanes: Lanes::Auto,
        };
        assert_eq!(job.params, expected);
        assert_eq!(job.radius, Some(0.1));
        assert_eq!(job.carry, AttributeChoice::All);
        assert_eq!(job.threads.get(), 3);
        let read = ReadOptions {
            attributes: AttributeChoice::All,
            also: vec!["type".into()],
            array: Some("a".into()),
            frame: 3,
            raw: RawType::F64,
        };
        assert_eq!(job.read, read);
        assert!(job.choice.invalid == Invalid::Drop && job.choice.crop.is_some() && job.choice.filter.is_some());
        assert_eq!((job.choice.scale, job.up, job.watch, job.skip_existing), (Some(2.0), Up::Z, Some(7.0), true));
        assert_eq!(job.finishing.finish.smoothing.map(|s| s.iterations), Some(3));
        assert_eq!(job.finishing.finish.keep.largest, Some(1));
        assert!(job.files.frames.is_some() && job.files.shard.is_some());
        assert_eq!(job.files.png.as_deref(), Some(Path::new("p.png")));
        assert_eq!(job.files.spray.as_deref(), Some(Path::new("s.ply")));
    }

    #[test]
    fn names_of_splashsurf_are_understood() {
        let line = "pellicle mesh a.xyz --output-file b.ply --particle-radius 0.1 --smoothing-length 1.2 --cube-size 0.8 \
                    --surface-threshold 0.55 --num-threads 2";
        let job = resolve(line).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((job.radius, job.params.smoothing_length), (Some(0.1), 1.2));
        assert_eq!((job.params.cell_size, job.params.iso, job.threads.get()), (0.8, 0.55, 2));
    }

    #[test]
    fn what_cannot_mean_anything_is_a_usage_error() {
        for wrong in [
            "--where type=",
            "--crop 1,2,3 0,0,0",
            "--crop 1,2 3,4,5",
            "--frames 9-x",
            "--shard 4/3",
            "--png a.jpg",
            "--band paper --method tetra5",
        ] {
            let line = format!("pellicle mesh a.xyz {wrong}");
            assert!(matches!(resolve(&line), Err(Failure::Usage(_))), "{wrong}");
        }
    }
}
