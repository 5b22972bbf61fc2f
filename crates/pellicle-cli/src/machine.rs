//! The machine as this process may use it: threads, vector unit, memory.

use std::num::NonZeroUsize;

use pellicle::Lanes;

use crate::failure::Failure;

/// Forces the vector unit, for tests and comparisons; every choice gives the same bytes.
pub const LANES_VARIABLE: &str = "PELLICLE_LANES";

/// Threads when none are asked for: the processors that this process may use.
pub fn default_threads() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// A pool of `threads`, the calling one among them: with one thread nothing is started at all, so that small frames take
/// milliseconds.
pub fn thread_pool(threads: NonZeroUsize) -> Result<rayon::ThreadPool, Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.get())
        .use_current_thread()
        .build()
        .map_err(|error| Failure::Work(format!("cannot start {threads} threads: {error} (use fewer with --threads)")))
}

/// A pool of `threads` of its own, for work that several threads hand over.
pub fn separate_pool(threads: NonZeroUsize) -> Result<rayon::ThreadPool, Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.get())
        .build()
        .map_err(|error| Failure::Work(format!("cannot start {threads} threads: {error} (use fewer with --threads)")))
}

/// The vector unit that [`LANES_VARIABLE`] asks for; the widest of this machine without it. Whether the machine has it is
/// for the core to say.
pub fn lanes_from_environment() -> Result<Lanes, Failure> {
    match std::env::var(LANES_VARIABLE) {
        Err(std::env::VarError::NotPresent) => Ok(Lanes::Auto),
        Err(std::env::VarError::NotUnicode(word)) => Err(unknown_lanes(&word.to_string_lossy())),
        Ok(word) => lanes(&word),
    }
}

fn lanes(word: &str) -> Result<Lanes, Failure> {
    match word {
        "" | "auto" => Ok(Lanes::Auto),
        "avx512" => Ok(Lanes::Avx512),
        "avx2" => Ok(Lanes::Avx2),
        "portable" => Ok(Lanes::Portable),
        _ => Err(unknown_lanes(word)),
    }
}

fn unknown_lanes(word: &str) -> Failure {
    Failure::Usage(format!("{LANES_VARIABLE}={word}: must be auto, avx512, avx2 or portable"))
}

/// Bytes of memory that the system can still give out without swapping. Linux only.
pub fn available_memory() -> Option<u64> {
    meminfo(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

fn meminfo(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

/// The largest resident memory of this process so far, in bytes. Linux only; elsewhere nobody is misled by a guess.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_vector_unit_is_a_usage_error() {
        assert!(matches!(lanes("auto"), Ok(Lanes::Auto)));
        assert!(matches!(lanes("portable"), Ok(Lanes::Portable)));
        for word in ["sse9", "AVX512 ", "none"] {
            assert!(matches!(lanes(word), Err(Failure::Usage(_))), "{word}");
        }
    }

    #[test]
    fn available_memory_is_read_from_its_line() {
        let text = "MemTotal:       24684084 kB\nMemFree:        1 kB\nMemAvailable:   23000000 kB\n";
        assert_eq!(meminfo(text), Some(23_000_000 * 1024));
        assert_eq!(meminfo("MemTotal: 1 kB"), None);
    }

    #[test]
    fn one_thread_means_the_calling_thread() {
        let caller = std::thread::current().id();
        std::thread::spawn(|| {
            let own = std::thread::current().id();
            let pool = thread_pool(NonZeroUsize::MIN).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(pool.install(|| std::thread::current().id()), own);
        })
        .join()
        .unwrap();
        assert_eq!(caller, std::thread::current().id());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn peak_memory_is_at_least_what_was_touched() {
        let before = peak_memory().unwrap();
        let block = vec![1_u8; 32 << 20];
        assert!(peak_memory().unwrap() >= before.max(block.len() as u64));
    }
}
