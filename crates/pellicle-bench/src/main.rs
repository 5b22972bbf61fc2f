//! Measurements that are programs, not stages: `pellicle-bench VERB …`. Each verb is one file, and says what it prints.

mod akinci;
mod contour;
mod convergence;
mod draw_order;
mod fields;
mod flicker;
mod rivals;
mod roads;
mod rosenberg;
mod sinks;
mod surface_nets;
mod tetrahedra;
mod walk;

/// Counts bytes, so that tables can tell memory.
#[global_allocator]
static ALLOCATOR: pellicle_conformance::allocations::Counting = pellicle_conformance::allocations::Counting;

/// A measurement: takes its arguments in words.
type Run = fn(&[String]) -> Result<(), String>;

/// What can be measured: the verb, its arguments, and the function.
const VERBS: &[(&str, &str, Run)] = &[
    ("akinci-2012", "[--json] [--search] [--quick] [--threads N] [--large FILE RADIUS]", akinci::run),
    ("contour", "FILE TYPE NX NY NZ ISO THREADS REPEATS [LEVEL]", contour::run),
    ("convergence", "", convergence::run),
    ("tetrahedra", "[--json] [--of NAME] [--scan FILE ISO]", tetrahedra::run),
    ("walk", "", walk::run),
    ("draw-order", "[--json]", draw_order::run),
    ("fields", "flatness|cost", fields::run),
    ("flicker", "[FILE RADIUS] [--field NAME] [--json]", flicker::run),
    ("roads", "[SCENE [CELLS]] [--json] [--stages]", roads::run),
    ("rosenberg-2008", "[--json] [--search]", rosenberg::run),
    ("sinks", "FILE TYPE NX NY NZ ISO THREADS REPEATS", sinks::run),
    ("surface-nets", "FILE TYPE NX NY NZ ISO REPEATS", surface_nets::run),
];

fn main() -> std::process::ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let verb = words.first().and_then(|word| VERBS.iter().find(|verb| verb.0 == word));
    let Some((_, _, run)) = verb else {
        for (verb, arguments, _) in VERBS {
            eprintln!("pellicle-bench {verb} {arguments}");
        }
        return 2.into();
    };
    match run(&words[1..]) {
        Ok(()) => 0.into(),
        Err(error) => {
            eprintln!("error: {error}");
            1.into()
        }
    }
}
