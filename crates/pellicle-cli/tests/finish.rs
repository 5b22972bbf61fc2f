//! What is done to a mesh once it is there, of particles and of volumes.

mod common;

use common::{Folder, cube};

/// Writes a NumPy file of a ball with bumps, a cavity in it and a droplet beside it; greater inside.
fn write_ball(folder: &Folder, name: &str) {
    const N: usize = 40;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({N}, {N}, {N}), }}");
    let header = format!("{header:<117}\n");
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for i in 0..N * N * N {
        let at = [i % N, i / N % N, i / N / N].map(|v| v as f32);
        let from = |centre: [f32; 3]| (0..3).map(|a| (at[a] - centre[a]).powi(2)).sum::<f32>().sqrt();
        let bumps = 0.3 * ((i * 7919 % 101) as f32 / 50.0 - 1.0);
        let ball = (12.0 - from([17.0; 3]) + bumps).min(from([17.0; 3]) - 4.0);
        bytes.extend(ball.max(2.5 - from([34.0; 3])).to_le_bytes());
    }
    std::fs::write(folder.path(name), bytes).unwrap();
}

/// What `check --quality --json` says of a mesh.
fn check(folder: &Folder, name: &str) -> serde_json::Value {
    let run = folder.run(&["check", name, "--quality", "--json"]).expect(0);
    serde_json::from_str(&run.stdout).unwrap()
}

#[test]
fn volumes_are_smoothed_chosen_and_decimated_and_keep_their_size() {
    let folder = Folder::new();
    write_ball(&folder, "ball.npy");
    folder.run(&["contour", "ball.npy", "--iso", "0", "-o", "plain.ply"]).expect(0);
    let plain = check(&folder, "plain.ply");
    let (volume, triangles) = (plain["signed_volume"].as_f64().unwrap(), plain["triangles"].as_u64().unwrap());
    assert_eq!(plain["components"], 3);

    let all = ["--smooth", "--decimate=0.3", "--keep", "largest=1,cavities=off"];
    folder.run(&[&["contour", "ball.npy", "--iso", "0", "-o", "done.ply"], &all[..]].concat()).expect(0);
    let done = check(&folder, "done.ply");
    assert_eq!((&done["closed_manifold"], &done["components"]), (&true.into(), &1.into()));
    assert!(done["triangles"].as_u64().unwrap() < triangles / 3);
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 12.0f64.powi(3);
    let found = done["signed_volume"].as_f64().unwrap();
    assert!((found / ball - 1.0).abs() < 0.02, "{found} {ball} {volume}");
    let text = std::fs::read(folder.path("done.ply")).unwrap();
    let header = String::from_utf8_lossy(&text[..1000]).into_owned();
    assert!(header.contains("filter=taubin weights=off") && header.contains("property float nx"), "{header}");

    // The same bytes for any number of threads and where the volume goes layer by layer.
    for more in [&["--threads", "3"][..], &["--max-memory", "24M"]] {
        let line = [&["contour", "ball.npy", "--iso", "0", "-o", "again.ply"], &all[..], more].concat();
        folder.run(&line).expect(0);
        assert!(std::fs::read(folder.path("again.ply")).unwrap() == text, "{more:?}");
    }
    let run = folder.run(&["contour", "ball.npy", "--iso", "0", "--smooth=weights=on"]).expect(2);
    assert!(run.stderr.contains("a volume has none"), "{}", run.stderr);
}

#[test]
fn finishing_that_does_not_fit_is_refused_with_the_number() {
    let folder = Folder::new();
    folder.write_xyz("cube.xyz", &cube(12));
    write_ball(&folder, "ball.npy");
    for line in [&["mesh", "cube.xyz", "-r", "0.5"][..], &["contour", "ball.npy", "--iso", "0"]] {
        let run = folder.run(&[line, &["--smooth", "--max-memory", "600K"]].concat()).expect(1);
        assert!(run.stderr.contains("memory"), "{}", run.stderr);
    }
}

#[test]
fn surfaces_are_cut_at_a_box_and_closed_on_its_faces() {
    let folder = Folder::new();
    folder.write_xyz("cube.xyz", &cube(9));
    write_ball(&folder, "ball.npy");
    let cases = [
        (&["mesh", "cube.xyz", "-r", "0.5"][..], ["1.1,1.2,-", "5.37,4,6.5"], None),
        (&["contour", "ball.npy", "--iso", "0"], ["5,10,16.7", "-,-,17.3"], None),
        // Full of fluid: the box itself.
        (&["mesh", "cube.xyz", "-r", "0.5"], ["2,2,2", "3.5,4.25,5"], Some(1.5 * 2.25 * 3.0)),
    ];
    for (line, [min, max], volume) in cases {
        let make = |name: &str, more: &[&str]| {
            let clamp = ["--smooth", "--clamp", min, max, "-o", name];
            folder.run(&[line, &clamp, more].concat()).expect(0);
            std::fs::read(folder.path(name)).unwrap()
        };
        let one = make("one.ply", &["--threads", "1"]);
        assert!(one == make("two.ply", &["--threads", "3"]), "{line:?}");
        let report = check(&folder, "one.ply");
        assert_eq!(report["closed_manifold"], true, "{line:?}");
        let found = report["signed_volume"].as_f64().unwrap();
        match volume {
            Some(volume) => assert!((found - volume).abs() < 1e-5 * volume, "{found}"),
            None => assert!(found > 1.0),
        }
    }
    for (min, max, told) in
        [("0,0,0", "1,0,1", "flat"), ("0,0,2", "1,1,1", "MIN is above MAX"), ("0,0", "1,1,1", "--clamp")]
    {
        let run = folder.run(&["mesh", "cube.xyz", "--clamp", min, max]).expect(2);
        assert!(run.stderr.contains(told), "{}", run.stderr);
    }
}

#[test]
fn the_contact_with_walls_is_flat() {
    let folder = Folder::new();
    folder.write_xyz("cube.xyz", &cube(9));
    write_ball(&folder, "ball.npy");
    // A box as a solid, from the command itself: the surface of a volume, cut to a box.
    let solid = ["contour", "ball.npy", "--iso", "0", "--clamp", "15,15,9", "20,20,15", "-o", "solid.stl"];
    folder.run(&solid).expect(0);
    folder
        .run(&["contour", "ball.npy", "--iso", "0", "--clamp", "5.5,5.5,3", "8,8,5", "--scale", "0.4", "-o", "s.ply"])
        .expect(0);
    let cases = [
        (&["mesh", "cube.xyz", "-r", "0.5"][..], &["--wall", "plane=0,0,1,-0.4", "--wall", "plane=1,0,0,-0.4"][..]),
        (&["mesh", "cube.xyz", "-r", "0.5"], &["--wall", "box=-0.5,-0.5,-0.5,8.5,8.5,20"]),
        (&["mesh", "cube.xyz", "-r", "0.5"], &["--wall", "s.ply"]),
        (&["mesh", "cube.xyz", "-r", "0.5"], &["--wall", "outside=s.ply", "--smooth"]),
        (&["contour", "ball.npy", "--iso", "0"], &["--wall", "plane=1,1,0,33", "--smooth"]),
    ];
    for (line, walls) in cases {
        let make = |name: &str, more: &[&str]| {
            folder.run(&[line, walls, &["-o", name], more].concat()).expect(0);
            std::fs::read(folder.path(name)).unwrap()
        };
        let one = make("one.ply", &["--threads", "1"]);
        assert!(one == make("two.ply", &["--threads", "3"]), "{walls:?}");
        let report = check(&folder, "one.ply");
        assert_eq!(report["closed_manifold"], true, "{walls:?}");
        assert!(report["triangles"].as_u64().unwrap() > 100, "{walls:?}");
    }
    let run = folder.run(&["mesh", "cube.xyz", "--wall", "absent.stl"]).expect(1);
    assert!(run.stderr.contains("absent.stl"), "{}", run.stderr);
    folder.run(&["contour", "ball.npy", "--iso", "0", "--wall", "solid.stl"]).expect(2);
    folder.run(&["mesh", "cube.xyz", "--wall", "plane=1,2"]).expect(2);
    folder.run(&["mesh", "cube.xyz", "--wall", "plane=0,1,0,0", "--method", "tetra5"]).expect(2);
}

/// What is put back on a wall stays in the box of `--clamp`.
#[test]
fn walls_and_a_box_together_leave_nothing_beyond_either() {
    let folder = Folder::new();
    folder.write_xyz("cube.xyz", &cube(9));
    let line = ["mesh", "cube.xyz", "-r", "0.5", "--wall", "plane=0.1,0.05,1,-0.4", "--smooth"];
    let clamp = ["--clamp", "1.1,1.2,-", "5.37,6.03,4", "-o", "both.ply"];
    folder.run(&[&line[..], &clamp].concat()).expect(0);
    let report = check(&folder, "both.ply");
    assert_eq!(report["closed_manifold"], true);
    let mesh = pellicle_io::read_mesh(&folder.path("both.ply")).unwrap();
    let is_within = |v: &[f32; 3]| {
        let height = 0.1 * v[0] + 0.05 * v[1] + v[2] + 0.4;
        (1.1..=5.37).contains(&v[0]) && (1.2..=6.03).contains(&v[1]) && v[2] <= 4.0 && height > -1e-4
    };
    let beyond: Vec<_> = mesh.vertices.iter().filter(|v| !is_within(v)).collect();
    assert!(beyond.is_empty(), "{} beyond, such as {:?}", beyond.len(), beyond[0]);
    let on_wall = |v: &&[f32; 3]| (0.1 * v[0] + 0.05 * v[1] + v[2] + 0.4).abs() < 1e-4;
    assert!(mesh.vertices.iter().filter(on_wall).count() > 30);
}

/// Each isovalue and each label has a file of its own: all of them must be there.
#[test]
fn skipping_judges_every_file_of_a_volume() {
    let folder = Folder::new();
    write_ball(&folder, "ball.npy");
    let line = ["contour", "ball.npy", "--iso", "0,1", "-o", "b.ply", "--skip-existing", "--json"];
    let status = |line: &[&str]| {
        let report: serde_json::Value = serde_json::from_str(&folder.run(line).expect(0).stdout).unwrap();
        report["status"].as_str().unwrap().to_owned()
    };
    assert_eq!([status(&line), status(&line)], ["done", "skipped"]);
    std::fs::remove_file(folder.path("b_1.ply")).unwrap();
    assert_eq!([status(&line), status(&line)], ["done", "skipped"]);
    let run = folder.run(&["contour", "ball.npy", "--labels", "all", "--skip-existing"]).expect(2);
    assert!(run.stderr.contains("name the labels"), "{}", run.stderr);
    let run = folder.run(&["check", "b_1.ply", "--spacing", "1,1,1"]).expect(2);
    assert!(run.stderr.contains("--field"), "{}", run.stderr);
}

#[test]
fn quads_are_written_where_the_format_holds_them() {
    let folder = Folder::new();
    folder.write_xyz("cube.xyz", &cube(6));
    write_ball(&folder, "ball.npy");
    for line in [&["mesh", "cube.xyz", "-r", "0.5"][..], &["contour", "ball.npy", "--iso", "0"]] {
        folder.run(&[line, &["-o", "plain.ply", "--smooth"]].concat()).expect(0);
        let plain = check(&folder, "plain.ply");
        for name in ["a.ply", "a.obj", "a.vtk", "a.vtp", "a.vtu"] {
            let run = folder.run(&[line, &["-o", name, "--smooth", "--quads", "--json"]].concat()).expect(0);
            let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
            let made = if line[0] == "mesh" { &report } else { &report["surfaces"][0] };
            let (quads, triangles) = (made["quads"].as_u64().unwrap(), made["triangles"].as_u64().unwrap());
            assert_eq!(2 * quads + triangles, plain["triangles"].as_u64().unwrap(), "{name}");
            assert!(quads > 3 * triangles, "{quads} {triangles}");
            // As triangles again they are the same surface.
            let read = check(&folder, name);
            for key in ["closed_manifold", "triangles", "vertices", "euler_characteristic"] {
                assert_eq!(read[key], plain[key], "{name} {key}");
            }
            let ratio = read["signed_volume"].as_f64().unwrap() / plain["signed_volume"].as_f64().unwrap();
            // But for the diagonals of level parts, which alternate only where no quads are wanted.
            assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
        }
        for name in ["a.stl", "a.glb", "a.npz"] {
            let run = folder.run(&[line, &["-o", name, "--quads"]].concat()).expect(2);
            assert!(run.stderr.contains("quads are written to .ply"), "{}", run.stderr);
        }
    }
}

#[test]
fn the_speed_along_the_normal_is_made_of_the_velocity() {
    let folder = Folder::new();
    let lines: String = cube(5).iter().map(|[x, y, z]| format!("{x},{y},{z},0,0,-3,7\n")).collect();
    folder.write("cube.csv", format!("x,y,z,vx,vy,vz,id\n{lines}").as_bytes());
    let header = |attributes: &str| {
        folder.run(&["mesh", "cube.csv", "-r", "0.5", "-o", "a.ply", "--attributes", attributes]).expect(0);
        let bytes = std::fs::read(folder.path("a.ply")).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        text[..text.find("element face").unwrap()].to_owned()
    };
    let alone = header("normal_velocity");
    assert!(alone.contains("float normal_velocity\n") && !alone.contains("vx"), "{alone}");
    let both = header("velocity,normal_velocity,id");
    assert!(
        both.contains("float normal_velocity\n") && both.contains("float vx") && both.contains("float id"),
        "{both}"
    );
    folder.write_xyz("bare.xyz", &cube(3));
    let run = folder.run(&["mesh", "bare.xyz", "-r", "0.5", "--attributes", "normal_velocity"]).expect(1);
    assert!(run.stderr.contains("velocity"), "{}", run.stderr);
}
