//! `pellicle-bench akinci-2012`: tables 1 to 8 and figures 4 and 6 of Akinci et al. 2012 on frames like the paper's, beside its
//! numbers. `--json` prints one object a row, `--search` how the rivals' sizes were chosen, `--quick` one run in place of three,
//! `--large FILE RADIUS` adds a frame of one's own to tables 1, 2, 5 and 6 (cell r), `--threads N` is the larger number of threads.
//!
//! | method | |
//! |---|---|
//! | scatter | particles add themselves to a grid, block by block, one thread: [`scatter`]; in tables *one grid*, all of it at once |
//! | gather | every node of the grid collects its particles, found by Z-index: [`gather`] |
//! | ours | road A with its default band, the same mesh as every node gives; in the table *band* with the paper's |
//!
//! The rivals use pellicle's field code and lanes, and its road for volumes to make triangles. Each run begins without memory: the
//! fastest of three counts, particles in memory to mesh in memory. `field` is all until the samples are there, sorting included;
//! bytes are the most that a counting allocator saw, without the mesh. Lengths are in r, the spacing: twice the particle radius.
//!
//! Each rival's mesh is compared with ours, and the farthest vertex told. Sums in another order round otherwise, so a node whose
//! value is nearly the isovalue may change sides: its vertices are counted apart.
//!
//! Source: Akinci, Ihmsen, Akinci, Teschner, Parallel surface reconstruction for particle-based fluids, 2012, section 5.

mod compare;
mod gather;
mod grid;
mod handlers;
mod measure;
mod paper;
mod report;
mod scatter;
mod scenes;
mod search;
#[cfg(test)]
mod tests;

use pellicle::{Band, Params, ScalarField, SolenthalerParams};

use measure::{Method, Taken, measure};
use report::{Row, Sink};
use scenes::{DAM, Scene};

/// Vertices in a thousand that may be where the other mesh has none: signs that rounding decides.
const ASTRAY: f64 = 1.0;

/// Runs the verb.
pub fn run(words: &[String]) -> Result<(), String> {
    let (mut sink, mut search, mut runs, mut large) = (Sink::Text, false, 3, None);
    let mut threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let mut next = || words.next().ok_or_else(|| format!("{word} what?"));
        match word.as_str() {
            "--json" => sink = Sink::Json,
            "--search" => search = true,
            "--quick" => runs = 1,
            "--threads" => threads = next()?.parse().map_err(|_| "--threads: a number")?,
            "--large" => {
                let (file, radius) = (next()?.into(), next()?.parse().map_err(|_| "--large: a file and a radius")?);
                large = Some(Scene { name: "large", file, radius });
            }
            other => return Err(format!("{other}: --json, --search, --quick, --threads N or --large FILE RADIUS")),
        }
    }
    let bench = Bench { sink, runs, threads };
    if search {
        return search::run(&bench, large);
    }
    let scenes = scenes::all();
    bench.scenes(&scenes, large.as_ref())?;
    let dam = scenes.iter().find(|scene| scene.name == DAM).ok_or("no dam break")?;
    bench.methods(dam)?;
    bench.fields(dam)?;
    bench.bands(dam)?;
    bench.supports(dam)?;
    bench.scaling(dam)
}

/// What is measured with.
pub struct Bench {
    pub sink: Sink,
    pub runs: usize,
    pub threads: usize,
}

/// Solenthaler's field, the paper's choice.
pub fn solenthaler() -> ScalarField {
    ScalarField::Solenthaler(SolenthalerParams::default())
}

fn anisotropic() -> Result<ScalarField, String> {
    ScalarField::from_name("anisotropic").ok_or_else(|| "no anisotropic field".into())
}

/// Parameters for a cell so many spacings wide.
pub fn params(scene: &Scene, field: ScalarField, cell: f64) -> Params {
    Params { cell_size: 2.0 * cell, ..Params::with_field(scene.radius, field) }
}

/// The rivals, each with the sizes that suit it best: the fastest that `--search` found.
pub fn rivals(field: ScalarField, cell: f64) -> [Method; 2] {
    let is_fine = cell < 0.75;
    match field {
        ScalarField::Anisotropic(_) => [
            Method::Scatter { cell: 0.5, block: Some(32) },
            Method::Gather { cell: 0.5, brick: if is_fine { 8 } else { 4 }, thin: true },
        ],
        _ => [
            Method::Scatter { cell: if is_fine { 0.5 } else { 1.0 }, block: Some(32) },
            Method::Gather { cell: 1.0, brick: 8, thin: true },
        ],
    }
}

/// The scatter approach as the paper has it, all sums at once, with the cell that suits it best.
const ONE_GRID: Method = Method::Scatter { cell: 0.5, block: None };

impl Bench {
    /// Tables 1, 2, 5, 6.
    fn scenes(&self, scenes: &[Scene], large: Option<&Scene>) -> Result<(), String> {
        for (table, cell) in [("5", 1.0), ("6", 0.5)] {
            self.sink.title(&format!("Tables 1, 2 and {table}: Solenthaler, cell {cell} r"));
            self.sink.scene_head();
            for scene in scenes.iter().chain(large.filter(|_| cell == 1.0)) {
                let positions = scene.read()?;
                let params = params(scene, solenthaler(), cell);
                let one = measure(Method::Ours(Band::Auto), &positions, &params, 1, self.runs)?;
                let many = measure(Method::Ours(Band::Auto), &positions, &params, self.threads, self.runs)?;
                let paper = measure(Method::Ours(Band::Paper), &positions, &params, self.threads, self.runs)?;
                let whole = measure::grid_nodes(&positions, &params);
                self.sink.scene(table, scene.name, cell, self.threads, positions.len(), whole, [&one, &many, &paper]);
            }
        }
        Ok(())
    }

    /// Tables 3 and 4, and the same at cell 2r.
    fn methods(&self, dam: &Scene) -> Result<(), String> {
        let positions = dam.read()?;
        for (table, cell) in [("3", 1.0), ("4", 0.5), ("cell 2r", 2.0)] {
            self.sink.title(&format!("Table {table}: Solenthaler, {}, cell {cell} r", dam.name));
            let theirs = match table {
                "3" => &paper::METHODS[0][..],
                "4" => &paper::METHODS[1],
                _ => &[],
            };
            self.compare(table, dam, &positions, solenthaler(), cell, theirs)?;
            let params = params(dam, solenthaler(), cell);
            let taken = measure(ONE_GRID, &positions, &params, 1, self.runs)?;
            let table = format!("{table}, one grid");
            let row = self.row(&table, dam, solenthaler(), cell, 1, ONE_GRID, &taken);
            self.sink.row(&row, taken.seconds(), None, None);
        }
        Ok(())
    }

    /// Tables 7 and 8.
    fn fields(&self, dam: &Scene) -> Result<(), String> {
        let positions = dam.read()?;
        for (i, (table, field)) in [("7", solenthaler()), ("8", anisotropic()?)].into_iter().enumerate() {
            self.sink.title(&format!("Table {table}: {}, {}, cell 0.5 r", field.name(), dam.name));
            self.compare(table, dam, &positions, field, 0.5, &paper::FIELDS[i])?;
        }
        Ok(())
    }

    /// All methods on one frame.
    fn compare(
        &self,
        table: &str,
        scene: &Scene,
        positions: &[[f32; 3]],
        field: ScalarField,
        cell: f64,
        theirs: &[paper::Row],
    ) -> Result<(), String> {
        let params = params(scene, field, cell);
        let [scatter, gather] = rivals(field, cell);
        let ours = Method::Ours(Band::Auto);
        let reference = measure(ours, positions, &params, 1, self.runs)?;
        let mut base: Option<f64> = None;
        self.sink.head();
        for (method, threads) in [(scatter, 1), (gather, 1), (gather, self.threads), (ours, 1), (ours, self.threads)] {
            let taken = measure(method, positions, &params, threads, self.runs)?;
            let difference = compare::compare(&reference.mesh, &taken.mesh, params.spacing());
            if difference.astray as f64 > ASTRAY / 1e3 * reference.mesh.vertices.len() as f64 {
                return Err(format!("{} found another surface: {difference:?}", method.name()));
            }
            let first = *base.get_or_insert(taken.seconds());
            let six = |row: &&paper::Row| row.method == method.name() && (row.threads > 1) == (threads > 1);
            let row = Row { table, scene: scene.name, method, field: field.name(), cell, threads, taken: &taken };
            self.sink.row(&row, first, Some(difference), theirs.iter().find(six).map(|row| row.cost));
        }
        Ok(())
    }

    /// The paper's band beside the default one.
    fn bands(&self, dam: &Scene) -> Result<(), String> {
        let positions = dam.read()?;
        self.sink.title("Ours with the paper's band, and with every node");
        self.sink.head();
        for cell in [1.0, 0.5] {
            let params = params(dam, solenthaler(), cell);
            let mut base: Option<f64> = None;
            for band in [Band::Full, Band::Paper, Band::Auto] {
                let taken = measure(Method::Ours(band), &positions, &params, 1, self.runs)?;
                let first = *base.get_or_insert(taken.seconds());
                let name = format!("band {}", format!("{band:?}").to_lowercase());
                self.sink.row(
                    &self.row(&name, dam, solenthaler(), cell, 1, Method::Ours(band), &taken),
                    first,
                    None,
                    None,
                );
            }
        }
        Ok(())
    }

    /// Figure 4: influence radii 2r and 4r.
    fn supports(&self, dam: &Scene) -> Result<(), String> {
        let positions = dam.read()?;
        self.sink.title("Figure 4: Solenthaler, influence radius 2 r and 4 r, cell 0.5 r (the paper: 7.5 s and 60 s)");
        self.sink.head();
        let mut base: Option<f64> = None;
        for smoothing_length in [2.0, 4.0] {
            let params = Params { smoothing_length, ..params(dam, solenthaler(), 0.5) };
            let taken = measure(Method::Ours(Band::Auto), &positions, &params, self.threads, self.runs)?;
            let first = *base.get_or_insert(taken.seconds());
            let name = format!("figure 4, {smoothing_length} r");
            let method = Method::Ours(Band::Auto);
            self.sink.row(&self.row(&name, dam, solenthaler(), 0.5, self.threads, method, &taken), first, None, None);
        }
        Ok(())
    }

    /// Figure 6: threads.
    fn scaling(&self, dam: &Scene) -> Result<(), String> {
        let positions = dam.read()?;
        for cell in [1.0, 0.5] {
            self.sink.title(&format!("Figure 6: Solenthaler, {}, cell {cell} r", dam.name));
            self.sink.head();
            let mut base: Option<f64> = None;
            let params = params(dam, solenthaler(), cell);
            let mut threads = 1;
            while threads <= self.threads {
                let taken = measure(Method::Ours(Band::Auto), &positions, &params, threads, self.runs)?;
                let first = *base.get_or_insert(taken.seconds());
                let method = Method::Ours(Band::Auto);
                let row = self.row("figure 6", dam, solenthaler(), cell, threads, method, &taken);
                self.sink.row(&row, first, None, None);
                threads = if threads < 4 { threads + 1 } else { 2 * threads };
            }
        }
        Ok(())
    }

    #[expect(clippy::too_many_arguments, reason = "one for each column")]
    fn row<'a>(
        &self,
        table: &'a str,
        scene: &Scene,
        field: ScalarField,
        cell: f64,
        threads: usize,
        method: Method,
        taken: &'a Taken,
    ) -> Row<'a> {
        Row { table, scene: scene.name, method, field: field.name(), cell, threads, taken }
    }
}
