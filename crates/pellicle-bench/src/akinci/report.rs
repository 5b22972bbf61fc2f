//! The tables, as text and as JSON.

use serde_json::json;

use super::{
    compare::Difference,
    measure::{Method, Taken},
    paper,
};

/// What is printed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sink {
    Text,
    Json,
}

/// One method on one frame.
pub struct Row<'a> {
    pub table: &'a str,
    pub scene: &'static str,
    pub method: Method,
    pub field: &'static str,
    /// In spacings.
    pub cell: f64,
    pub threads: usize,
    pub taken: &'a Taken,
}

impl Row<'_> {
    fn json(&self) -> serde_json::Value {
        json!({
            "table": self.table,
            "scene": self.scene,
            "method": self.method.name(),
            "field": self.field,
            "cell": self.cell,
            "threads": self.threads,
            "field_s": self.taken.field_s,
            "triangulation_s": self.taken.triangulation_s,
            "peak_bytes": self.taken.bytes,
            "triangles": self.taken.triangles,
        })
    }
}

impl Sink {
    pub fn title(self, title: &str) {
        if self == Self::Text {
            println!("\n{title}");
        }
    }

    pub fn head(self) {
        if self == Self::Text {
            println!(
                "{:<10} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9}   {:<28} | paper: field s, triangles s, MB",
                "method", "threads", "field ms", "tri. ms", "MB", "triangles", "speed-up", "farthest, cells; astray"
            );
        }
    }

    /// What a rival takes with some size.
    pub fn size(self, row: &Row<'_>) {
        let taken = row.taken;
        if self == Self::Json {
            let mut json = row.json();
            json["size"] = format!("{:?}", row.method).into();
            return println!("{json}");
        }
        let (ms, mb) = (1e3 * taken.seconds(), taken.bytes as f64 / 1e6);
        println!(
            "{}, cell {} r, {:?}, {} threads: {ms:.0} ms, {mb:.1} MB",
            row.field, row.cell, row.method, row.threads
        );
    }

    /// One row; `base` is what the first one of the table took.
    pub fn row(self, row: &Row<'_>, base: f64, difference: Option<Difference>, theirs: Option<paper::Cost>) {
        let taken = row.taken;
        if self == Self::Json {
            return println!("{}", row.json());
        }
        let difference = difference.map_or(String::new(), |d| format!("{:.1e}; {}", d.farthest, d.astray));
        let theirs =
            theirs.map_or(String::new(), |[field, triangles, mb]| format!(" | {field:>6} {triangles:>6} {mb:>6}"));
        let name = match row.method {
            Method::Ours(_) if row.table.starts_with("band") => row.table,
            Method::Scatter { block: None, .. } => "  one grid",
            method => method.name(),
        };
        println!(
            "{name:<10} {:>7} {:>9.1} {:>9.1} {:>9.1} {:>9} {:>8.2}x   {difference:<28}{theirs}",
            row.threads,
            1e3 * taken.field_s,
            1e3 * taken.triangulation_s,
            taken.bytes as f64 / 1e6,
            taken.triangles,
            base / taken.seconds(),
        );
    }

    pub fn scene_head(self) {
        if self == Self::Text {
            println!(
                "{:<12} {:>9} {:>7} {:>7} {:>9} {:>8} {:>8} {:>8} {:>8} {:>7}",
                "scene", "particles", "surf. p", "surf. n", "triangles", "t_sp ms", "1 thread", "N", "tri. ms", "MB"
            );
        }
    }

    /// A row of tables 1, 2 and 5 or 6: ours on one thread, on many, with the paper's band on many; the grid has `nodes`.
    #[expect(clippy::too_many_arguments, reason = "one for each column")]
    pub fn scene(
        self,
        table: &str,
        scene: &'static str,
        cell: f64,
        threads: usize,
        particles: usize,
        nodes: usize,
        [one, many, band]: [&Taken; 3],
    ) {
        let (finding, surface_particles, surface_nodes) = band.surface;
        let shares = [surface_particles as f64 / particles as f64, surface_nodes as f64 / nodes as f64];
        if self == Self::Json {
            for (threads, taken) in [(1, one), (threads, many)] {
                let method = Method::Ours(pellicle::Band::Auto);
                let row = Row { table, scene, method, field: "solenthaler", cell, threads, taken };
                println!("{}", row.json());
            }
            let (one, two) = (if cell == 1.0 { "1, cell r" } else { "1, cell r/2" }, "2");
            for table in [one, two] {
                let method = Method::Ours(pellicle::Band::Paper);
                let row = Row { table, scene, method, field: "solenthaler", cell, threads, taken: band };
                let mut row = row.json();
                row["particles"] = particles.into();
                row["surface_particles_share"] = shares[0].into();
                row["surface_nodes_share"] = shares[1].into();
                row["surface_particles_s"] = finding.into();
                println!("{row}");
            }
            return;
        }
        let line = |name: &str, particles: f64, shares: [f64; 2], triangles: f64, ms: [f64; 4], mb: f64| {
            println!(
                "{name:<12} {particles:>8.0}k {:>6.1}% {:>6.1}% {triangles:>8.0}k {:>8.0} {:>8.0} {:>8.0} {:>8.1} {mb:>7.1}",
                100.0 * shares[0],
                100.0 * shares[1],
                ms[0],
                ms[1],
                ms[2],
                ms[3],
            );
        };
        let ms = [finding, one.field_s, many.field_s, many.triangulation_s].map(|s| 1e3 * s);
        line(scene, particles as f64 / 1e3, shares, many.triangles as f64 / 1e3, ms, many.bytes as f64 / 1e6);
        if let Some(theirs) = paper::SCENES.iter().find(|theirs| theirs.name == scene) {
            let i = usize::from(cell < 1.0);
            let [one, six, triangles, mb] = theirs.cost[i];
            let ms = [theirs.finding, 1e3 * one, 1e3 * six, 1e3 * triangles];
            let shares = [theirs.surface_particles, theirs.surface_nodes[i]];
            line("  the paper", theirs.particles, shares, theirs.triangles[i], ms, mb);
        }
    }
}
