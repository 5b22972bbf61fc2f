//! The paper's numbers: Akinci et al. 2012, tables 1 to 8. Intel Xeon X5680, six cores at 3.33 GHz.

/// Time for the scalar field and for triangles in seconds, and memory in megabytes.
pub type Cost = [f64; 3];

/// What a row of ours stands beside.
pub struct Row {
    pub method: &'static str,
    /// One thread or six.
    pub threads: usize,
    pub cost: Cost,
}

const fn row(method: &'static str, threads: usize, field: f64, triangles: f64, megabytes: f64) -> Row {
    Row { method, threads, cost: [field, triangles, megabytes] }
}

/// Tables 3, 4: the corner breaking dam of 1.7 million particles, cells r and r/2.
pub static METHODS: [[Row; 5]; 2] = [
    [
        row("scatter", 1, 31.5, 7.5, 4830.0),
        row("gather", 1, 92.0, 7.5, 4700.0),
        row("gather", 6, 16.0, 7.5, 4700.0),
        row("ours", 1, 14.4, 0.18, 1390.0),
        row("ours", 6, 2.6, 0.18, 1390.0),
    ],
    [
        row("scatter", 1, 703.5, 63.5, 22_900.0),
        row("gather", 1, 2000.0, 63.5, 21_800.0),
        row("gather", 6, 350.0, 63.5, 21_800.0),
        row("ours", 1, 343.4, 1.1, 4100.0),
        row("ours", 6, 58.5, 1.1, 4100.0),
    ],
];

/// Tables 7, 8: the dam of 150,000 particles, cell r/2: Solenthaler's field and the anisotropic one.
pub static FIELDS: [[Row; 3]; 2] = [
    [row("scatter", 1, 110.0, 5.0, 2100.0), row("ours", 1, 58.0, 0.2, 380.0), row("ours", 6, 10.0, 0.2, 380.0)],
    [row("scatter", 1, 235.0, 5.0, 3400.0), row("ours", 1, 150.0, 0.2, 820.0), row("ours", 6, 26.0, 0.2, 820.0)],
];

/// A scene in tables 1, 2, 5 and 6.
pub struct Scene {
    pub name: &'static str,
    /// In thousands.
    pub particles: f64,
    /// Surface particles over all.
    pub surface_particles: f64,
    /// Surface vertices over all, at cells r and r/2.
    pub surface_nodes: [f64; 2],
    /// In thousands, at cells r and r/2.
    pub triangles: [f64; 2],
    /// Time to find surface particles, in milliseconds.
    pub finding: f64,
    /// Field on one thread, on six, triangles, megabytes, at cells r and r/2.
    pub cost: [[f64; 4]; 2],
}

pub static SCENES: [Scene; 3] = [
    Scene {
        name: "Drop",
        particles: 360.0,
        surface_particles: 0.12,
        surface_nodes: [0.075, 0.065],
        triangles: [87.0, 351.0],
        finding: 90.0,
        cost: [[3.3, 0.6, 0.05, 271.0], [61.1, 10.4, 0.28, 415.0]],
    },
    Scene {
        name: "CBD",
        particles: 1700.0,
        surface_particles: 0.13,
        surface_nodes: [0.1, 0.09],
        triangles: [420.0, 1700.0],
        finding: 444.0,
        cost: [[14.4, 2.6, 0.18, 1390.0], [343.4, 58.5, 1.13, 4076.0]],
    },
    Scene {
        name: "Hemispheres",
        particles: 2000.0,
        surface_particles: 0.17,
        surface_nodes: [0.18, 0.16],
        triangles: [782.0, 3100.0],
        finding: 520.0,
        cost: [[21.1, 3.8, 0.27, 1143.0], [617.3, 105.4, 2.92, 3356.0]],
    },
];
