//! The command line as meant: `MeshArgs` as typed become a `MeshJob` that needs no further decision but those that the
//! data make (the radius when it is not given, which attributes there are).

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use pellicle::{Band, Lanes, Params};
use pellicle_io::AttributeChoice;

use crate::args::{BandArg, MeshArgs, Switch};
use crate::failure::Failure;
use crate::machine;
use crate::target::Target;

/// All that `mesh` was asked to do.
#[derive(Debug)]
pub struct MeshJob {
    /// The particle file.
    pub input: PathBuf,
    /// Where the mesh goes.
    pub target: Target,
    /// Particle radius in world units, if it was given.
    pub radius: Option<f64>,
    /// Everything that decides the surface, but for the radius.
    pub params: Params,
    /// What is carried to the vertices.
    pub carry: AttributeChoice,
    /// Whether particles with positions that are not finite are left out; otherwise they are errors.
    pub drop_invalid: bool,
    /// Threads of the pool.
    pub threads: NonZeroUsize,
}

impl MeshJob {
    /// Works out what was meant. Looks at file names, not into files.
    pub fn resolve(args: &MeshArgs) -> Result<Self, Failure> {
        let output = args.output.clone().unwrap_or_else(|| default_output(&args.input));
        let target = Target::new(output)?;
        if same_file(&args.input, target.path()) {
            return Err(Failure::Usage(format!(
                "{}: the mesh would overwrite its particles (choose another file with -o)",
                args.input.display()
            )));
        }
        Ok(Self {
            input: args.input.clone(),
            target,
            radius: args.surface.radius,
            params: params(args, machine::lanes_from_environment()?),
            carry: args.attributes.clone().unwrap_or(AttributeChoice::Velocity),
            drop_invalid: args.drop_invalid,
            threads: args.threads.unwrap_or_else(machine::default_threads),
        })
    }
}

fn params(args: &MeshArgs, lanes: Lanes) -> Params {
    let surface = &args.surface;
    Params {
        // 1 until the data have said it.
        particle_radius: surface.radius.unwrap_or(1.0),
        smoothing_length: surface.smoothing_length,
        cell_size: surface.cell,
        iso: surface.threshold,
        band: match surface.band {
            BandArg::Auto => Band::Auto,
            BandArg::Full => Band::Full,
        },
        normals: args.normals == Switch::On,
        max_memory: args.max_memory,
        lanes,
    }
}

/// IN with the extension `.ply`, in place of `.bgeo.gz` as of `.bgeo`; `IN_surface.ply` where that would be IN.
fn default_output(input: &Path) -> PathBuf {
    let is_compressed = input.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    let output = if is_compressed { input.with_extension("") } else { input.to_owned() }.with_extension("ply");
    if output != input {
        return output;
    }
    let mut name = OsString::from(input.file_stem().unwrap_or_default());
    name.push("_surface.ply");
    input.with_file_name(name)
}

/// Whether both names lead to one file, also through links and `..`.
pub fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
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
        assert_eq!(job.target.path(), Path::new("run/frame.10.ply"));
        assert_eq!(job.radius, None);
        assert_eq!(job.params, Params::new(1.0), "the defaults of the command are those of the library");
        assert_eq!(job.carry, AttributeChoice::Velocity);
        assert!(!job.drop_invalid);
    }

    #[test]
    fn every_option_arrives() {
        let line = "pellicle mesh a.xyz -o b.obj -r 0.1 -l 1.5 -c 0.75 -t 0.4 --band full --attributes all \
                    --normals on --threads 3 --max-memory 2K --drop-invalid";
        let job = resolve(line).unwrap_or_else(|e| panic!("{e}"));
        let expected = Params {
            particle_radius: 0.1,
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
        assert!(job.drop_invalid);
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
    fn the_input_is_never_the_output() {
        assert_eq!(default_output(Path::new("d/a.1.bgeo.gz")), Path::new("d/a.1.ply"));
        assert_eq!(default_output(Path::new("d/a")), Path::new("d/a.ply"));
        assert_eq!(default_output(Path::new("d/a.ply")), Path::new("d/a_surface.ply"));
        assert!(matches!(resolve("pellicle mesh a.ply -o a.ply"), Err(Failure::Usage(_))));
    }

    #[test]
    fn an_output_format_that_cannot_be_written_is_a_usage_error() {
        for name in ["b.csv", "b", "b.xyz"] {
            assert!(matches!(resolve(&format!("pellicle mesh a.xyz -o {name}")), Err(Failure::Usage(_))), "{name}");
        }
    }
}
