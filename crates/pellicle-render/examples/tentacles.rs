//! A monster with tentacles and a hide, as a game would make it every frame: particles that know their place on a limb, a
//! skin that turns this into texture coordinates, the engine, and a picture.
//!
//! `cargo run --release -p pellicle-render --example tentacles -- [monster.png] [FRAME]`

use pellicle::realtime::{Engine, Params, Particles};
use pellicle::sink::Shaded;
use pellicle_render::{Color, Framing, Image, Layer, Paint, Scene, Settings, Surface, Texture, draw};
use pellicle_scenes::{ISO, LimbSkin, Play, SUPPORT, Show};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let file = arguments.first().map_or("monster.png", String::as_str);
    let frame = arguments.get(1).map_or(Ok(75), |text| text.parse())?;

    // Particles: where they are, how strong, and where on which limb.
    let mut play = Play::new(Show::Monster, 1);
    (0..frame).for_each(|_| play.step());
    let balls = play.balls();

    // Their surface. `LimbSkin` is an ordinary implementation of `pellicle::realtime::Skin`.
    let params = Params { iso: ISO.into(), ..Params::new(SUPPORT.into(), 0.25) };
    let mut engine = Engine::with_skin(params, LimbSkin::default())?;
    let mut made = Shaded::default();
    engine.skin_mut().take(balls);
    let strengths = Some(&balls.strengths[..]);
    engine.update(Particles { positions: (&balls.positions).into(), reaches: None, strengths }, &mut made)?;

    // Rings along the limbs and stripes around them.
    let image = Image::from_fn(128, 128, |x, y| match (x % 32 < 6, y % 64 < 20) {
        (_, true) => Color([238, 196, 92]),
        (true, false) => Color([60, 26, 74]),
        (false, false) => Color([150, 74, 168]),
    })?;
    let coordinates = made.data.iter().map(|&[turns, along]| [2.0 * turns, along / 3.0]).collect();
    let paint = Paint::Texture(Texture { image: &image, coordinates });
    let scene = Scene { layers: vec![Layer::Mesh(Surface { paint, ..Surface::new(&made.mesh) })] };
    let settings = Settings::new(1280, 960);
    let camera = Framing { azimuth: -30.0, ..Framing::default() }.fit(&scene.bounds(), settings.aspect())?;
    std::fs::write(file, draw(&scene, &camera, &settings)?.encode_png()?)?;
    println!("{file}: {} triangles with a hide", made.mesh.triangles.len());
    Ok(())
}
