//! What a picture must show, whatever it looks like.

mod common;

use common::{BEHIND, ahead, count, plain, sheet, splash, taken};
use pellicle::Mesh;
use pellicle_render::{
    Background, Bars, Bounds, Camera, Color, Error, Framing, Image, Layer, Lens, Paint, Radius, Samples, Scalars,
    Scene, Settings, Shading, Spheres, Surface, Wireframe, draw,
};

const RED: Color = Color([200, 0, 0]);
const GREEN: Color = Color([0, 200, 0]);

fn layers<'a>(layers: impl IntoIterator<Item = Layer<'a>>) -> Scene<'a> {
    Scene { layers: layers.into_iter().collect() }
}

fn flat(mesh: &Mesh) -> Surface<'_> {
    Surface { shading: Shading::Flat, ..Surface::new(mesh) }
}

#[test]
fn same_bytes_for_every_number_of_threads() {
    let (particles, mesh) = splash();
    let speeds: Vec<f32> = particles.velocities.iter().map(|v| v[1]).collect();
    let bare = Mesh { normals: Vec::new(), ..mesh };
    let spheres = Spheres {
        paint: Paint::Scalars(Scalars::new("speed", &speeds)),
        ..Spheres::new(&particles.positions, f64::from(particles.radius))
    };
    let wired = Surface { wireframe: Some(Wireframe { fade: 0.0, ..Wireframe::default() }), ..Surface::new(&bare) };
    let scene = layers([Layer::Mesh(wired), Layer::Spheres(spheres)]);
    let png = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| taken(&scene, &Settings::new(333, 217)).encode_png().unwrap())
    };
    let one = png(1);
    assert!(one == png(2) && one == png(7));
}

#[test]
fn triangles_that_share_edges_leave_no_gap() {
    let mesh = sheet(23, 2.5);
    let scene = layers([Layer::Mesh(flat(&mesh))]);
    for samples in [Samples::One, Samples::Four, Samples::Eight, Samples::Sixteen] {
        for lens in [Lens::Orthographic { height: 2.0 }, Lens::Perspective { angle: 20.0 }] {
            let settings = Settings { samples, ..plain(150, 150) };
            let image = draw(&scene, &Camera { lens, up: [0.3, 1.0, 0.0], ..ahead() }, &settings).unwrap();
            // Only red and blue come from behind: any gap would let magenta through a blue sheet.
            assert!(image.pixels().chunks(3).all(|p| p[0] < p[1] && p[1] < p[2]), "{samples:?} {lens:?}");
        }
    }
}

#[test]
fn an_edge_through_samples_belongs_to_one_of_its_triangles() {
    // Corners, hence edges and diagonals, at the middles of pixels.
    let mut mesh = sheet(16, 1.0);
    for (i, v) in (0u16..).zip(&mut mesh.vertices) {
        let place = |k: u16| (f32::from(k) * 4.0 + 0.5) / 32.0 - 1.0;
        *v = [place(i % 17), place(i / 17), 0.0];
    }
    let settings = Settings { samples: Samples::One, ..plain(64, 64) };
    for up in [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]] {
        let image = draw(&layers([Layer::Mesh(flat(&mesh))]), &Camera { up, ..ahead() }, &settings).unwrap();
        let gaps =
            (1..63).flat_map(|y| (1..63).map(move |x| (x, y))).filter(|&(x, y)| image.pixel(x, y) == Some(BEHIND));
        assert_eq!(gaps.count(), 0, "{up:?}");
    }
}

#[test]
fn a_sheet_covers_its_share_of_the_picture() {
    let mesh = sheet(5, 0.5);
    let settings = Settings { samples: Samples::Sixteen, ..plain(101, 101) };
    let image = draw(&layers([Layer::Mesh(flat(&mesh))]), &ahead(), &settings).unwrap();
    let free = count(&image, BEHIND);
    // 50.5 pixels a side; border pixels are mixed.
    assert!((101 * 101 - 52 * 52..=101 * 101 - 50 * 50).contains(&free), "{free}");
}

#[test]
fn outsides_are_seen_from_where_triangles_wind_counter_clockwise() {
    let mesh = sheet(2, 2.0);
    let paint = Paint::Sides { outside: GREEN, inside: RED };
    let scene = layers([Layer::Mesh(Surface { paint, ..Surface::new(&mesh) })]);
    let middle = |z: f64| {
        let image = draw(&scene, &Camera { eye: [0.0, 0.0, z], ..ahead() }, &plain(9, 9)).unwrap();
        image.pixel(4, 4).unwrap().0
    };
    let (front, back) = (middle(3.0), middle(-3.0));
    assert!(front[1] / 2 > front[0] && back[0] / 2 > back[1], "{front:?} {back:?}");
}

#[test]
fn from_inside_a_closed_mesh_there_is_no_way_out() {
    let ball = pellicle::reconstruct(&[[0.0f32; 3]], &pellicle::Params::new(1.0)).unwrap();
    let scene = layers([Layer::Mesh(Surface { paint: Paint::CHECK, ..Surface::new(&ball) })]);
    for (target, angle) in [([0.3, 0.2, 1.0], 30.0), ([1.0, 0.0, 0.1], 120.0), ([0.0, -1.0, 0.0], 165.0)] {
        let camera = Camera { eye: [0.1, -0.2, 0.05], target, up: [0.0, 1.0, 0.0], lens: Lens::Perspective { angle } };
        let image = draw(&scene, &camera, &plain(160, 90)).unwrap();
        assert!(image.pixels().chunks(3).all(|p| p != BEHIND.0 && p[0] > p[1] + 20), "{target:?}");
    }
}

#[test]
fn a_floor_that_passes_below_and_behind_the_eye_fills_the_lower_half() {
    let mut floor = sheet(1, 1e6);
    for v in &mut floor.vertices {
        *v = [v[0], -1.0, -v[1]];
    }
    let lens = Lens::Perspective { angle: 60.0 };
    let camera = Camera { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0], lens };
    let image = draw(&layers([Layer::Mesh(flat(&floor))]), &camera, &plain(120, 80)).unwrap();
    for y in 0..80 {
        let free = (0..120).filter(|&x| image.pixel(x, y) == Some(BEHIND)).count();
        assert_eq!(free, if y < 40 { 120 } else { 0 }, "row {y}");
    }
}

#[test]
fn a_triangle_of_any_size_keeps_its_edges() {
    // Below the line y = x / 3. At 1e11 double precision still places it within a tenth of a pixel.
    for size in [1e3f32, 1e8, 1e11] {
        let vertices = vec![[-3.0 * size, -size, 0.0], [3.0 * size, -9.0 * size, 0.0], [3.0 * size, size, 0.0]];
        let mesh = Mesh { vertices, triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let image = draw(&layers([Layer::Mesh(flat(&mesh))]), &ahead(), &plain(90, 90)).unwrap();
        for (x, y) in (0..90).flat_map(|y| (0..90).map(move |x| (x, y))) {
            let above = (45.0 - f64::from(y) - 0.5) - (f64::from(x) + 0.5 - 45.0) / 3.0;
            let free = image.pixel(x, y) == Some(BEHIND);
            assert!(above.abs() < 1.0 || free == (above > 0.0), "{size}: {x} {y}");
        }
    }
}

#[test]
fn far_from_the_worlds_origin_the_picture_is_the_same() {
    let (_, mesh) = splash();
    let lens = Lens::Perspective { angle: 40.0 };
    let camera = Camera { eye: [2.0, 1.5, 3.0], target: [0.0; 3], up: [0.0, 1.0, 0.0], lens };
    let far = 1073741824.0;
    let moved = Mesh { origin: [far, -far, far], ..mesh.clone() };
    let shift = |p: [f64; 3]| [p[0] + far, p[1] - far, p[2] + far];
    let there = Camera { eye: shift(camera.eye), target: shift(camera.target), ..camera };
    let settings = Settings::new(120, 80);
    let here = draw(&Scene::of_mesh(&mesh), &camera, &settings).unwrap();
    assert!(here == draw(&Scene::of_mesh(&moved), &there, &settings).unwrap());
}

#[test]
fn spheres_cut_each_other_and_a_sheet_where_they_should() {
    let (left, right) = ([[-0.3f32, 0.0, 0.0]], [[0.3f32, 0.0, 0.0]]);
    let of = |at, color| Layer::Spheres(Spheres { paint: Paint::Plain(color), ..Spheres::new(at, 0.5) });
    let image = draw(&layers([of(&left, RED), of(&right, GREEN)]), &ahead(), &plain(200, 200)).unwrap();
    for y in 65..135 {
        let (a, b) = (image.pixel(98, y).unwrap().0, image.pixel(101, y).unwrap().0);
        assert!(a[0] / 2 > a[1] && b[1] / 2 > b[0], "row {y}: {a:?} {b:?}");
    }
    // A sheet through the middle of a ball leaves its front half, of radius 0.5: 50 pixels.
    let mesh = sheet(3, 2.0);
    let middle = [[0.0f32; 3]];
    let image = draw(&layers([Layer::Mesh(flat(&mesh)), of(&middle, RED)]), &ahead(), &plain(200, 200)).unwrap();
    let red = image.pixels().chunks(3).filter(|p| p[0] / 2 > p[2]).count() as f64;
    assert!((red - std::f64::consts::PI * 2500.0).abs() < 120.0, "{red}");
}

#[test]
fn of_two_at_the_same_place_the_first_is_seen() {
    let mesh = sheet(4, 2.0);
    let of = |color| Layer::Mesh(Surface { paint: Paint::Plain(color), ..flat(&mesh) });
    let image = draw(&layers([of(RED), of(GREEN)]), &ahead(), &plain(64, 64)).unwrap();
    assert!(image.pixels().chunks(3).all(|p| p[0] / 2 > p[1]));
}

#[test]
fn what_cannot_be_seen_does_no_harm() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let good = sheet(2, 0.5);
    let mut bad = good.clone();
    bad.vertices.extend([[nan, 0.0, 0.0], [inf, 0.0, 0.0], [3e38, -3e38, 3e38]]);
    bad.triangles.extend([[0, 1, 9], [0, 10, 1], [4, 4, 4], [0, 0, 8]]);
    let image = |mesh: &Mesh| draw(&layers([Layer::Mesh(flat(mesh))]), &ahead(), &plain(64, 64)).unwrap();
    assert!(image(&good) == image(&bad));
    bad.triangles.push([0, 2, 11]);
    image(&bad);

    let centres = [[nan, 0.0, 0.0], [0.0, inf, 0.0], [0.0; 3], [0.0; 3]];
    let radii = [1.0, 1.0, nan, -1.0];
    let spheres = Spheres { radius: Radius::Each(&radii), ..Spheres::new(&centres, 1.0) };
    let image = draw(&layers([Layer::Spheres(spheres)]), &ahead(), &plain(32, 32)).unwrap();
    assert_eq!(count(&image, BEHIND), 32 * 32);
}

#[test]
fn automatic_cameras_show_anything() {
    let empty = Mesh::default();
    let point = Mesh { vertices: vec![[5.0, 6.0, 7.0]], ..Mesh::default() };
    let (thin, flat_sheet) = (sheet(1, 1e-20), sheet(1, 1e20));
    for mesh in [&empty, &point, &thin, &flat_sheet] {
        let scene = Scene::of_mesh(mesh);
        for up in [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]] {
            for angle in [Some(30.0), None] {
                let framing = Framing { up, angle, ..Framing::default() };
                let cameras = [framing.fit(&scene.bounds(), 1.5), framing.orbit(&scene.bounds(), 1.5, 40.0)];
                for camera in cameras {
                    let image = draw(&scene, &camera.unwrap(), &plain(60, 40)).unwrap();
                    let seen = 2400 - count(&image, BEHIND);
                    assert!(mesh.triangles.is_empty() == (seen == 0), "{up:?} {angle:?} {seen}");
                }
            }
        }
    }
    assert!(Bounds::EMPTY.is_empty());
}

#[test]
fn lines_show_where_triangles_are_large_and_fade_where_they_are_small() {
    let dark = |n: u32| {
        let mesh = sheet(n, 2.0);
        let of = |wireframe| layers([Layer::Mesh(Surface { wireframe, ..flat(&mesh) })]);
        let sum = |image: Image| image.pixels().iter().map(|&b| u64::from(b)).sum::<u64>() as f64;
        let without = sum(draw(&of(None), &ahead(), &plain(128, 128)).unwrap());
        1.0 - sum(draw(&of(Some(Wireframe::default())), &ahead(), &plain(128, 128)).unwrap()) / without
    };
    let (large, small) = (dark(16), dark(120));
    assert!((0.05..0.4).contains(&large), "{large}");
    assert!(small < 0.03, "{small}");
}

#[test]
fn values_have_their_colors_and_what_is_none_is_grey() {
    let mesh = sheet(1, 2.0);
    let color = |values: [f32; 4]| {
        let paint = Paint::Scalars(Scalars::new("x", &values).over([0.0, 1.0]));
        let scene = layers([Layer::Mesh(Surface { paint, ..flat(&mesh) })]);
        draw(&scene, &ahead(), &plain(8, 8)).unwrap().pixel(4, 4).unwrap().0
    };
    let (low, high, none) = (color([0.0; 4]), color([1.0; 4]), color([f32::NAN; 4]));
    assert!(low[2] > low[1] && high[0] > high[2] && high[1] > high[2], "{low:?} {high:?}");
    assert!(none.iter().all(|&b| b.abs_diff(none[0]) < 12), "{none:?}");
    assert_eq!(color([-7.0; 4]), low);
    assert_eq!(color([f32::INFINITY; 4]), high);
}

#[test]
fn a_bar_is_drawn_where_there_is_room() {
    let mesh = sheet(1, 0.1);
    let values = [0.0f32, 1.0, 2.0, 3.0];
    let paint = Paint::Scalars(Scalars::new("depth", &values));
    let scene = layers([Layer::Mesh(Surface { paint, ..flat(&mesh) })]);
    let bar = |width, height| {
        let shown = draw(&scene, &ahead(), &plain(width, height)).unwrap();
        let hidden = draw(&scene, &ahead(), &Settings { bars: Bars::Hidden, ..plain(width, height) }).unwrap();
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .filter(|&(x, y)| shown.pixel(x, y) != hidden.pixel(x, y))
            .count()
    };
    // At least the bar itself: 12 × 220 pixels.
    assert!((2_640..8_000).contains(&bar(640, 400)), "{}", bar(640, 400));
    assert_eq!(bar(40, 40), 0);
}

#[test]
fn what_does_not_fit_is_an_error_that_says_so() {
    let mesh = sheet(1, 1.0);
    let scene = Scene::of_mesh(&mesh);
    for (width, height) in [(0, 10), (10, 0), (16_385, 10), (10, u32::MAX)] {
        let error = draw(&scene, &ahead(), &Settings::new(width, height)).unwrap_err();
        assert!(matches!(error, Error::Size { .. }) && error.to_string().contains("16384"), "{error}");
    }
    let broken = Mesh { triangles: vec![[0, 1, 2], [0, 1, 4]], ..mesh.clone() };
    let error = draw(&Scene::of_mesh(&broken), &ahead(), &plain(8, 8)).unwrap_err();
    assert_eq!(error, Error::Vertex { triangle: 1, vertex: 4, vertices: 4 });
    let broken = Mesh { normals: vec![[0.0; 3]], ..mesh.clone() };
    assert!(matches!(draw(&Scene::of_mesh(&broken), &ahead(), &plain(8, 8)), Err(Error::Length { .. })));
    let paint = Paint::Scalars(Scalars::new("x", &[1.0]));
    let few = layers([Layer::Mesh(Surface { paint, ..Surface::new(&mesh) })]);
    assert!(matches!(draw(&few, &ahead(), &plain(8, 8)), Err(Error::Length { .. })));
    let nothing = Scene::of_spheres(&[[0.0f32; 3]], 0.0);
    assert!(matches!(draw(&nothing, &ahead(), &plain(8, 8)), Err(Error::Parameter { name: "radius", .. })));
    let wide = Image::filled(10_000, 1, BEHIND).unwrap();
    assert!(matches!(wide.beside(&wide), Err(Error::Size { .. })));
}

#[test]
fn png_files_say_what_their_numbers_mean() {
    let bytes = Image::filled(3, 2, Color([1, 2, 3])).unwrap().encode_png().unwrap();
    for chunk in [b"sRGB", b"gAMA"] {
        assert!(bytes.windows(4).any(|w| w == chunk));
    }
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    assert_eq!(pixels, [1, 2, 3].repeat(6));
}

#[test]
fn captions_are_readable_on_light_and_dark() {
    let empty = Scene::default();
    for background in [Background::LIGHT, Background::DARK] {
        let settings = Settings { background, ..Settings::new(300, 100) };
        let without = draw(&empty, &ahead(), &settings).unwrap();
        let caption = Some("Wörter, ½ 漢".to_string());
        let with = draw(&empty, &ahead(), &Settings { caption, ..settings }).unwrap();
        let most = without.pixels().iter().zip(with.pixels()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(most > Some(120), "{background:?} {most:?}");
    }
}
