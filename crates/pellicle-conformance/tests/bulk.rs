//! Every scene on road A: each vector unit, several numbers of threads, whole and in chunks, with the least memory.

use pellicle::{Band, Lanes};
use pellicle_conformance::{Delivery, Memory, Subject, conformance};

conformance! {
    defaults => Subject::default(),
    avx512 => Subject { lanes: Lanes::Avx512, ..Subject::default() },
    avx2 => Subject { lanes: Lanes::Avx2, ..Subject::default() },
    portable => Subject { lanes: Lanes::Portable, ..Subject::default() },
    one_thread => Subject { threads: 1, ..Subject::default() },
    seven_threads => Subject { threads: 7, ..Subject::default() },
    full_band => Subject { band: Band::Full, ..Subject::default() },
    in_chunks => Subject { delivery: Delivery::Chunks, ..Subject::default() },
    least_memory => Subject { memory: Memory::Least, ..Subject::default() },
    least_memory_in_chunks => Subject { memory: Memory::Least, delivery: Delivery::Chunks, ..Subject::default() },
}
