//! `render IN...`: meshes and particles to pictures.

use std::path::{Path, PathBuf};

use pellicle_io::{AttributeChoice, Content, ReadOptions, Up, read_content};
use pellicle_render::{Bounds, draw};
use serde_json::json;

use crate::args::RenderArgs;
use crate::batch::{self, Made};
use crate::choose::{Choice, Invalid};
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt;
use crate::machine;
use crate::picture::{self, Subject};
use crate::plan::{Absent, Frame, Plan, is_done};
use crate::resolve::{Files, selection};
use crate::sequence::pattern::Pattern;

/// All that `render` was asked to do, but for the list of frames.
struct Job<'a> {
    args: &'a RenderArgs,
    read: ReadOptions,
    choice: Choice,
    up: Up,
}

/// Runs the verb.
pub fn run(args: &RenderArgs, console: &Console) -> Result<(), Failure> {
    interrupt::listen();
    let files = Files::resolve(&args.input, args.output.as_ref(), "png", &args.frames)?;
    let (read, choice) = selection(&args.from, AttributeChoice::All, Invalid::Keep)?;
    let job = Job { args, read, choice, up: args.from.up.into() };
    let plan = match args.turntable {
        Some(count) => turntable(&files, count, console)?,
        None => Plan::new(&files, Absent::Refuse, console)?,
    };
    for frame in plan.frames.iter().chain(&plan.single) {
        if !frame.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
            return Err(Failure::Usage(format!("{}: pictures are written as .png", frame.output.display())));
        }
    }
    machine::thread_pool(machine::default_threads())?.install(|| {
        let bounds = job.bounds(&plan)?;
        let subject = match args.turntable {
            Some(_) => plan.frames.first().map(|frame| job.load(frame)).transpose()?,
            None => None,
        };
        let count = plan.frames.len().max(1) as f64;
        batch::run(
            &plan,
            |frame| args.frames.skip_existing && is_done(frame),
            console,
            |frame| match (&subject, frame.number) {
                (Some(subject), Some(number)) => {
                    job.draw(frame, subject, &bounds, Some(360.0 * (number - 1) as f64 / count))
                }
                _ => job.draw(frame, &job.load(frame)?, &bounds, None),
            },
        )
    })?;
    if let Some(line) = film(&plan) {
        console.say(format_args!("A film of them: {line}"));
    }
    Ok(())
}

impl Job<'_> {
    fn load(&self, frame: &Frame) -> Result<Subject, Failure> {
        let options = ReadOptions { frame: frame.step.unwrap_or(self.read.frame), ..self.read.clone() };
        let mut content = read_content(&frame.input, &options)?;
        if let Content::Particles(particles) = &mut content {
            self.choice.apply(particles, &frame.input)?;
        }
        Subject::new(content, &self.args.look, &frame.input)
    }

    /// The box around the first, the middle and the last frame: one camera for all, or the picture would breathe.
    fn bounds(&self, plan: &Plan) -> Result<Bounds, Failure> {
        let all: Vec<&Frame> = plan.single.iter().chain(&plan.whole).collect();
        let mut samples = vec![0, all.len() / 2, all.len().saturating_sub(1)];
        samples.dedup_by_key(|&mut at| all.get(at).map(|frame| (&frame.input, frame.step)));
        let mut bounds = Bounds::EMPTY;
        for at in samples {
            let Some(frame) = all.get(at) else { continue };
            // What is wrong with it is said when its turn comes.
            if let Ok(subject) = self.load(frame) {
                bounds = bounds.union(&subject.scene(&self.args.look).bounds());
            }
        }
        Ok(bounds)
    }

    fn draw(&self, frame: &Frame, subject: &Subject, bounds: &Bounds, angle: Option<f64>) -> Result<Made, Failure> {
        let settings = picture::settings(self.args.size, &self.args.look);
        let scene = subject.scene(&self.args.look);
        let camera = picture::camera(&self.args.camera, self.up, bounds, settings.aspect(), angle);
        let image = camera.and_then(|camera| draw(&scene, &camera, &settings));
        let image = image.map_err(|error| Failure::file(&frame.input, error))?;
        interrupt::check()?;
        picture::save(&image, &frame.output)?;
        let (width, height) = self.args.size;
        Ok(Made {
            line: format!("{} -> {}", frame.input.display(), frame.output.display()),
            report: json!({"width": width, "height": height, "angle": angle}),
        })
    }
}

/// One input, and as many outputs as pictures.
fn turntable(files: &Files, count: u32, console: &Console) -> Result<Plan, Failure> {
    let [input] = files.inputs.as_slice() else {
        return Err(Failure::Usage("--turntable turns one file: name a single one".into()));
    };
    let output = files.output.clone().unwrap_or_else(|| turntable_output(input));
    let Some(pattern) = Pattern::parse(&output)? else {
        return Err(Failure::Usage(format!(
            "{}: --turntable makes {count} pictures: write the name with a place for their number, such as turn_####.png",
            output.display()
        )));
    };
    let single = Files { output: Some(pattern.name(1)), ..files.clone() };
    let plan = Plan::new(&single, Absent::Refuse, console)?;
    let Some(frame) = &plan.single else {
        return Err(Failure::Usage("--turntable turns one file, not a sequence: name a single one".into()));
    };
    let turned = |number| Frame { number: Some(number), output: pattern.name(number), ..frame.clone() };
    let frames = (1..=i64::from(count)).map(turned).collect();
    Ok(plan.around(frames, pattern))
}

fn turntable_output(input: &Path) -> PathBuf {
    let stem = input.file_stem().unwrap_or_default().to_string_lossy();
    input.with_file_name(format!("{stem}_####.png"))
}

/// The command that makes a film of the pictures.
fn film(plan: &Plan) -> Option<String> {
    let pattern = plan.pattern.as_ref()?;
    let first = plan.frames.first()?.number?;
    let film = plan.frames.first()?.output.with_file_name("film.mp4");
    Some(format!(
        "ffmpeg -framerate 24 -start_number {first} -i '{}' -c:v libx264 -pix_fmt yuv420p '{}'",
        pattern.printf(),
        film.display()
    ))
}
