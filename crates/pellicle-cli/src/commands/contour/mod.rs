//! `contour IN...`: volumes of files to surfaces in files.
//!
//! The samples stay in the type of the file. Of several isovalues each surface goes to a file of its own, whose name ends in
//! `_V`; of labels ([`labels`]) in `_LABEL`. A volume that memory holds is looked at once for all of them ([`whole`]); a larger one is read layer by layer, twice for
//! each ([`stream`]), and gives the same bytes.

mod labels;
mod output;
mod stream;
mod whole;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pellicle::post::snap::Nodes;
use pellicle::{Border, ContourParams, Level, Tetrahedra, VertexNormals, Walls};
use pellicle_io::{Up, VolumeHeader};

use crate::args::{ContourArgs, MethodArg};
use crate::batch::{self, Made};
use crate::choose::crop::Crop;
use crate::clock::StageClock;
use crate::console::Console;
use crate::failure::Failure;
use crate::finish::{Finishing, Of};
use crate::interrupt;
use crate::machine;
use crate::plan::{Absent, Frame, Plan};
use crate::resolve::Files;
use crate::sequence::output::is_done;
use crate::surface::method_name;
use crate::target::Target;
use crate::values::{IsoValue, Labels, show_argument, show_bytes, show_number};
use crate::volume::statistics::Statistics;
use crate::volume::{Block, Selection};
use crate::walls::{self, Wall};
use output::suffixed;
pub use whole::view;

/// One of the surfaces of a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    /// At the isovalue of this number.
    Iso(usize),
    /// Of this label.
    Label(i128),
}

/// How cells become triangles.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Method {
    Cubes(Level),
    Tetrahedra(Tetrahedra),
}

/// All that `contour` was asked to do, but for the list of frames.
struct Job<'a> {
    selection: Selection,
    isos: &'a [IsoValue],
    labels: Option<&'a Labels>,
    method: Method,
    border: Border,
    keeps_largest: bool,
    finishing: Finishing,
    walls: Option<Arc<Walls>>,
    walls_record: Vec<String>,
    up: Up,
    metres_per_unit: Option<f64>,
    params: ContourParams,
    max_memory: Option<u64>,
    console: &'a Console,
}

/// The work on one frame.
struct Task<'a> {
    job: &'a Job<'a>,
    frame: &'a Frame,
    header: VolumeHeader,
    /// What is kept of it.
    block: Block,
    budget: Budget<'a>,
    clock: StageClock,
}

/// Runs the verb.
pub fn run(args: &ContourArgs, console: &Console) -> Result<(), Failure> {
    interrupt::listen();
    let job = Job::resolve(args, console)?;
    let mut files = Files::resolve(&args.input, args.output.as_ref(), "ply", &args.frames)?;
    files.png.clone_from(&args.png);
    let plan = Plan::new(&files, Absent::Refuse, console)?;
    // What is wrong with the command line is known before the first file is read.
    for frame in plan.single.iter().chain(plan.frames.first()) {
        Target::new(frame.output.clone())?;
        job.finishing.check_format(&frame.output)?;
    }
    let first = plan.single.as_ref().or(plan.whole.first());
    if job.isos.is_empty()
        && job.labels.is_none()
        && let Some(frame) = first
    {
        return Err(job.without_isovalue(&frame.input));
    }
    let skips = args.frames.skip_existing;
    if skips && matches!(job.labels, Some(Labels::All)) {
        let what =
            "--skip-existing: which files --labels all makes is not known before the volume is read (name the labels)";
        return Err(Failure::Usage(what.into()));
    }
    let threads = args.machine.threads.unwrap_or_else(machine::default_threads);
    machine::thread_pool(threads)?
        .install(|| batch::run(&plan, |frame| skips && job.is_done(frame), console, |frame| job.contour(frame)))
}

impl<'a> Job<'a> {
    fn resolve(args: &'a ContourArgs, console: &'a Console) -> Result<Self, Failure> {
        if let Some(png) = &args.png
            && !png.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
        {
            return Err(Failure::Usage(format!("--png {}: pictures are written as .png", png.display())));
        }
        if args.finish.wall.iter().any(|wall| matches!(wall, Wall::Mesh { .. })) {
            let what = "--wall: surfaces of volumes are cut at planes and boxes; meshes are for particles";
            return Err(Failure::Usage(what.into()));
        }
        let crop = args.crop.as_deref().map(Crop::parse).transpose();
        let crop = crop.map_err(|error| Failure::Usage(format!("--crop: {error}")))?;
        let selection = Selection::new(&args.from, args.array.as_ref(), args.step);
        let method = Method::from(args.surface.method);
        let normals = VertexNormals::from(args.surface.normals);
        if let (Method::Tetrahedra(_), VertexNormals::Gradient | VertexNormals::Faces) = (method, normals) {
            let what =
                "--normals: of volumes they come with marching cubes only (--method classic, consistent, topological)";
            return Err(Failure::Usage(what.into()));
        }
        let level = if let Method::Cubes(level) = method { level } else { Level::default() };
        Ok(Self {
            selection: Selection { crop, scale: args.scale, ..selection },
            isos: args.surface.iso.as_ref().map_or(&[][..], |isos| &isos.0),
            labels: args.surface.labels.as_ref(),
            method,
            border: if args.surface.open { Border::Open } else { Border::Closed },
            keeps_largest: args.surface.largest,
            finishing: Finishing::new(&args.finish, Of::Volume)?,
            walls: walls::build(&args.finish.wall)?,
            walls_record: walls::record(&args.finish.wall),
            up: args.up.into(),
            metres_per_unit: args.metres_per_unit,
            params: ContourParams { level, normals, lanes: machine::lanes_from_environment()?, max_memory: None },
            max_memory: args.machine.max_memory,
            console,
        })
    }

    fn has_normals(&self) -> bool {
        self.params.normals != VertexNormals::Off
    }

    /// Whether the surface of a frame can be written without being in memory as a whole.
    fn is_piecewise(&self, frame: &Frame) -> bool {
        !self.keeps_largest && self.finishing.is_nothing() && self.walls.is_none() && frame.png.is_none()
    }

    /// An error that tells which isovalue to try.
    fn without_isovalue(&self, input: &Path) -> Failure {
        let open = || self.selection.open(input);
        let found = match Statistics::of_file(&open) {
            Ok(found) => found,
            Err(failure) => return failure,
        };
        let file = show_argument(input);
        Failure::Usage(match (found.range, found.suggestion) {
            (Some([low, high]), Some(value)) => format!(
                "no isovalue is given; the values go from {} to {} (try --iso {}; pellicle info {file} tells more)",
                show_number(low),
                show_number(high),
                show_number(value)
            ),
            (Some([low, _]), None) => {
                format!("no isovalue is given, and all values are {}: there is no surface", show_number(low))
            }
            (None, _) => "no isovalue is given, and there are no values but NaN".into(),
        })
    }

    /// Whether all files of a frame are there and not older than the volume.
    fn is_done(&self, frame: &Frame) -> bool {
        let isos = (0..self.isos.len()).map(Part::Iso);
        let labels = match self.labels {
            Some(Labels::Some(labels)) => labels.as_slice(),
            _ => &[],
        };
        let mut parts = isos.chain(labels.iter().copied().map(Part::Label));
        parts.all(|part| is_done(&frame.input, &self.named(&frame.output, part)))
    }

    /// Makes the surfaces of a frame.
    fn contour(&self, frame: &Frame) -> Result<Made, Failure> {
        let clock = StageClock::start();
        let outputs = (0..self.isos.len()).map(|number| Target::new(self.named(&frame.output, Part::Iso(number))));
        let outputs = outputs.collect::<Result<Vec<_>, _>>()?;
        for output in &outputs {
            output.check()?;
        }
        clock.begin("read");
        let file = self.selection.open(&frame.input)?;
        let block = self.selection.block(file.header(), &frame.input)?;
        let budget = Budget::new(self.max_memory, &frame.input);
        let task = Task { job: self, frame, header: file.header().clone(), block, budget, clock };
        let (surfaces, is_streamed) = if let Some(labels) = self.labels {
            (task.labels(file, labels)?, false)
        } else if let Some(surfaces) = task.whole(file, &outputs)? {
            (surfaces, false)
        } else {
            (task.stream(&outputs)?, true)
        };
        let (line, report) = (task.line(&surfaces, is_streamed), task.report(&surfaces, is_streamed));
        for (name, time) in &task.clock.stages() {
            self.console.detail(format_args!("  {name:<8}{:9.1} ms", 1e3 * time.as_secs_f64()));
        }
        Ok(Made { line, report })
    }

    /// The file of a surface.
    fn named(&self, path: &Path, part: Part) -> PathBuf {
        let is_one_of_several = match part {
            Part::Iso(_) => self.isos.len() > 1,
            Part::Label(_) => !matches!(self.labels, Some(Labels::Some(labels)) if labels.len() == 1),
        };
        if is_one_of_several { suffixed(path, &self.text(part)) } else { path.to_owned() }
    }

    /// What names a surface.
    fn text(&self, part: Part) -> String {
        match part {
            Part::Iso(number) => self.isos[number].text.clone(),
            Part::Label(label) => label.to_string(),
        }
    }

    /// Tells that all values are on one side of the isovalue, so that there is no surface, not even at the border.
    fn tell_nothing(&self, input: &Path, number: usize, range: Option<[f64; 2]>) {
        let range = match range {
            Some([low, high]) => format!("its values go from {} to {}", show_number(low), show_number(high)),
            None => "it has no values but NaN".into(),
        };
        self.console.warn(format!("{}: no surface at {}: {range}", input.display(), self.isos[number].text));
    }
}

impl From<MethodArg> for Method {
    fn from(method: MethodArg) -> Self {
        match method {
            MethodArg::Classic => Self::Cubes(Level::Classic),
            MethodArg::Consistent => Self::Cubes(Level::Consistent),
            MethodArg::Topological => Self::Cubes(Level::Topological),
            MethodArg::Tetra5 => Self::Tetrahedra(Tetrahedra::Five),
            MethodArg::Tetra6 => Self::Tetrahedra(Tetrahedra::Six),
            MethodArg::Bcc => Self::Tetrahedra(Tetrahedra::BodyCentred),
            MethodArg::Simplex => Self::Tetrahedra(Tetrahedra::Simplex),
            MethodArg::Regularised => Self::Tetrahedra(Tetrahedra::Regularised),
        }
    }
}

impl Task<'_> {
    /// The lattice that the mesh is made on.
    fn nodes(&self) -> Nodes {
        use Tetrahedra::{BodyCentred, Regularised, Simplex};
        let has_middles = matches!(self.job.method, Method::Tetrahedra(BodyCentred | Simplex | Regularised));
        let grid = &self.header.grid;
        Nodes { origin: self.block.origin(grid), steps: grid.steps, has_middles }
    }
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::Cubes(Level::Classic) => "classic",
            Self::Cubes(Level::Consistent) => "consistent",
            Self::Cubes(Level::Topological) => "topological",
            Self::Tetrahedra(split) => method_name(split),
        }
    }
}

/// Memory that may be taken.
struct Budget<'a> {
    limit: Option<u64>,
    input: &'a Path,
}

impl<'a> Budget<'a> {
    fn new(limit: Option<u64>, input: &'a Path) -> Self {
        Self { limit: limit.or_else(machine::available_memory), input }
    }

    fn has(&self, needed: u64) -> bool {
        self.limit.is_none_or(|limit| needed <= limit)
    }

    /// What is left beside so much.
    fn left(&self, taken: u64) -> Option<u64> {
        self.limit.map(|limit| limit.saturating_sub(taken))
    }

    /// An error if it does not fit; `why` nothing less will do.
    fn claim(&self, needed: u64, what: &str, why: &str) -> Result<(), Failure> {
        match self.limit {
            Some(limit) if needed > limit => Err(Failure::Memory(format!(
                "{}: {what} need {} of memory, {} are allowed; {why} (raise --max-memory, or take a part by --crop)",
                self.input.display(),
                show_bytes(needed),
                show_bytes(limit)
            ))),
            _ => Ok(()),
        }
    }
}
