//! The five settings of figure 7, and the paper's numbers.

use pellicle_scenes::{FRAMES, ISO, Play, SUPPORT, Show};

use crate::rivals::Task;

/// A show on a lattice.
pub struct Setting {
    pub show: Show,
    pub spacing: f64,
    /// Edge of approach 2's blocks in cubes: the fastest that `--search` found.
    pub block: usize,
    /// Edge of the cells of approaches 2 and 3 in supports, found likewise.
    pub cells: [f64; 2],
    /// What the paper measured of approaches 1, 2 and 3 on one core of a 3.2 GHz Core 2 Duo.
    pub paper: [Paper; 3],
}

/// A row of the paper's table: memory in megabytes.
pub struct Paper {
    pub cubes_per_s: f64,
    pub triangles_per_s: f64,
    pub render_mb: f64,
    pub cache_mb: f64,
    pub fps: f64,
}

const fn paper(cubes_per_s: f64, triangles_per_s: f64, render_mb: f64, cache_mb: f64, fps: f64) -> Paper {
    Paper { cubes_per_s, triangles_per_s, render_mb, cache_mb, fps }
}

/// In the order of the paper.
pub static ALL: [Setting; 5] = [
    Setting {
        show: Show::Fountain,
        spacing: 1.0,
        block: 32,
        cells: [1.0, 1.0],
        paper: [
            paper(1_636_312.0, 3_171_223.0, 0.517, 0.894, 46.6),
            paper(947_294.0, 1_836_490.0, 7.474, 8.020, 27.2),
            paper(462_378.0, 898_280.0, 4.756, 0.368, 13.1),
        ],
    },
    Setting {
        show: Show::Fountain,
        spacing: 0.75,
        block: 32,
        cells: [1.0, 1.0],
        paper: [
            paper(1_859_083.0, 3_657_317.0, 0.741, 1.548, 29.1),
            paper(1_033_835.0, 2_033_716.0, 10.513, 8.022, 16.2),
            paper(477_330.0, 939_837.0, 8.611, 0.364, 7.4),
        ],
    },
    Setting {
        show: Show::Fountain,
        spacing: 0.5,
        block: 32,
        cells: [1.0, 1.0],
        paper: [
            paper(1_706_667.0, 3_388_940.0, 0.749, 0.408, 11.7),
            paper(968_568.0, 1_924_154.0, 8.827, 8.002, 6.5),
            paper(451_350.0, 899_031.0, 2.051, 0.346, 3.0),
        ],
    },
    Setting {
        show: Show::Blob,
        spacing: 0.3,
        block: 32,
        cells: [1.0, 1.0],
        paper: [
            paper(2_145_530.0, 4_288_108.0, 0.246, 0.137, 77.7),
            paper(1_228_188.0, 2_458_939.0, 8.655, 8.000, 49.3),
            paper(559_283.0, 1_118_880.0, 3.179, 0.022, 22.5),
        ],
    },
    Setting {
        show: Show::Explosion,
        spacing: 0.6,
        block: 32,
        cells: [1.0, 1.0],
        paper: [
            paper(1_967_465.0, 3_811_094.0, 0.437, 0.099, 33.2),
            paper(790_634.0, 1_533_241.0, 8.495, 8.001, 13.3),
            paper(298_943.0, 586_777.0, 8.211, 0.052, 4.8),
        ],
    },
];

impl Setting {
    pub fn task(&self) -> Task {
        Task { spacing: self.spacing, support: SUPPORT.into(), iso: ISO }
    }

    /// Particles of about fifty frames spread over the show, or of one in `every` of them; of the fountain's only once it
    /// has all its particles.
    pub fn frames(&self, every: usize) -> Vec<Vec<[f32; 3]>> {
        let first = if self.show == Show::Fountain { FRAMES / 2 } else { 0 };
        let step = (FRAMES - first) / 50 * every;
        let mut play = Play::new(self.show, 1);
        let mut frames = Vec::new();
        while play.frame() < FRAMES {
            if play.frame() >= first && (play.frame() - first).is_multiple_of(step) {
                frames.push(play.balls().positions.clone());
            }
            play.step();
        }
        frames
    }
}
