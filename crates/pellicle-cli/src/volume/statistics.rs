//! How the values of a volume are spread: range, percentiles, and an isovalue to try.
//!
//! Values are counted in bins: each integer of 8 or 16 bits has its own, other types share 65536 between their least and
//! greatest value. So percentiles are exact for the former, and to 1/65536 of the range for the latter. The suggestion is
//! Otsu's threshold, which parts the values in two groups of least variance: often tissue from air, or inside from outside.
//!
//! Source: Otsu, A Threshold Selection Method from Gray-Level Histograms, 1979.

use pellicle_io::{Samples, VolumeFile, VolumeHeader, each_sample_type};

use crate::failure::Failure;

const BINS: usize = 1 << 16;

/// The spread of the samples, in the values that they stand for.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// Least and greatest value; `None` if all are NaN.
    pub range: Option<[f64; 2]>,
    /// Samples that are NaN.
    pub invalid: u64,
    /// The values below which 1, 25, 50, 75 and 99 % of the samples lie.
    pub percentiles: [f64; 5],
    /// An isovalue to try; `None` if all values are equal.
    pub suggestion: Option<f64>,
}

/// The shares that [`Statistics::percentiles`] tells.
pub const SHARES: [f64; 5] = [0.01, 0.25, 0.5, 0.75, 0.99];

impl Statistics {
    /// Of a file that `open` opens, anew for each pass; layer by layer where that can be.
    pub fn of_file(open: &dyn Fn() -> Result<VolumeFile, Failure>) -> Result<Self, Failure> {
        let file = open()?;
        let header = file.header().clone();
        if file.why_no_layers().is_some() {
            return Ok(Self::of(&header, &file.read()?.samples));
        }
        let mut range = Range::default();
        for_layers(file, |samples| range.add(samples))?;
        let mut histogram = Histogram::over(&range);
        for_layers(open()?, |samples| histogram.add(samples))?;
        Ok(histogram.finish(&header, &range))
    }

    /// Of samples in memory.
    pub fn of(header: &VolumeHeader, samples: &Samples) -> Self {
        let mut range = Range::default();
        range.add(samples);
        let mut histogram = Histogram::over(&range);
        histogram.add(samples);
        histogram.finish(header, &range)
    }
}

/// Reads a file a few layers at a time.
fn for_layers(mut file: VolumeFile, mut each: impl FnMut(&Samples)) -> Result<(), Failure> {
    /// Enough samples for the work on them to outweigh the call.
    const TOGETHER: usize = 1 << 20;
    let [x, y, layers] = file.header().dims;
    let step = (TOGETHER / (x * y).max(1)).max(1);
    let mut samples = Samples::with_capacity(file.header().kind, 0);
    let mut done = 0;
    while done < layers {
        let count = step.min(layers - done);
        samples.clear();
        file.read_layers(count, &mut samples)?;
        each(&samples);
        done += count;
    }
    Ok(())
}

/// Least and greatest sample.
#[derive(Debug, Default)]
pub struct Range {
    bounds: Option<[f64; 2]>,
    invalid: u64,
    is_integer: bool,
}

impl Range {
    #[allow(clippy::unnecessary_cast, reason = "the same code serves every type")]
    fn add(&mut self, samples: &Samples) {
        self.is_integer = !matches!(samples, Samples::F32(_) | Samples::F64(_));
        each_sample_type!(samples, values => {
            let Some(&first) = values.iter().find(|value| is_number(**value)) else {
                self.invalid += values.len() as u64;
                return;
            };
            let (mut low, mut high, mut invalid) = (first, first, 0);
            for &value in values {
                if value < low { low = value }
                if value > high { high = value }
                invalid += u64::from(!is_number(value));
            }
            let [low, high] = [low as f64, high as f64];
            let [old_low, old_high] = self.bounds.unwrap_or([low, high]);
            self.bounds = Some([old_low.min(low), old_high.max(high)]);
            self.invalid += invalid;
        });
    }
}

/// Only NaN differs from itself.
#[allow(clippy::eq_op, reason = "the same code serves integers")]
fn is_number<T: PartialEq + Copy>(value: T) -> bool {
    value == value
}

struct Histogram {
    low: f64,
    /// Values per bin.
    width: f64,
    counts: Vec<u64>,
    /// Sum of the samples of a bin, so that means are exact.
    is_exact: bool,
}

impl Histogram {
    fn over(range: &Range) -> Self {
        let [low, high] = range.bounds.unwrap_or([0.0; 2]);
        // Infinite values are counted in the last bins.
        let (low, high) = (low.max(f64::MIN), high.min(f64::MAX));
        let is_exact = range.is_integer && high - low < BINS as f64;
        let width = if is_exact { 1.0 } else { (high / BINS as f64 - low / BINS as f64).max(f64::MIN_POSITIVE) };
        Self { low, width, counts: vec![0; BINS], is_exact }
    }

    #[allow(clippy::unnecessary_cast, reason = "the same code serves every type")]
    fn add(&mut self, samples: &Samples) {
        let (low, scale) = (self.low, 1.0 / self.width);
        each_sample_type!(samples, values => {
            for &value in values.iter().filter(|value| is_number(**value)) {
                // Casts saturate: what is beyond goes to the ends.
                let bin = ((value as f64 - low) * scale) as usize;
                self.counts[bin.min(BINS - 1)] += 1;
            }
        });
    }

    /// The middle of a bin, or its value.
    fn value(&self, bin: usize) -> f64 {
        self.low + self.width * (bin as f64 + if self.is_exact { 0.0 } else { 0.5 })
    }

    fn finish(self, header: &VolumeHeader, range: &Range) -> Statistics {
        let scaling = header.scaling;
        let total: u64 = self.counts.iter().sum();
        let percentiles = SHARES.map(|share| {
            let wanted = (share * total as f64).ceil().max(1.0) as u64;
            let mut sum = 0;
            let bin = self.counts.iter().position(|&count| {
                sum += count;
                sum >= wanted
            });
            scaling.value(bin.map_or(f64::NAN, |bin| self.value(bin)))
        });
        Statistics {
            range: range.bounds.map(|bounds| bounds.map(|sample| scaling.value(sample))),
            invalid: range.invalid,
            percentiles,
            suggestion: self.otsu().map(|sample| scaling.value(sample)),
        }
    }

    /// Between the two groups of values whose means differ most, weighed by their sizes.
    fn otsu(&self) -> Option<f64> {
        let total: f64 = self.counts.iter().map(|&count| count as f64).sum();
        let sum: f64 = self.counts.iter().enumerate().map(|(bin, &count)| bin as f64 * count as f64).sum();
        let (mut below, mut sum_below, mut best, mut found) = (0.0, 0.0, 0.0, None);
        for (bin, &count) in self.counts.iter().enumerate() {
            below += count as f64;
            sum_below += bin as f64 * count as f64;
            let above = total - below;
            if below == 0.0 || above <= 0.0 {
                continue;
            }
            let difference = sum_below / below - (sum - sum_below) / above;
            let variance = below * above * difference * difference;
            // Over a gap the variance stays: the middle of the gap is the best guess.
            if variance > best * (1.0 + 1e-12) {
                (best, found) = (variance, Some([bin, bin]));
            } else if count == 0
                && let Some([_, last]) = &mut found
                && *last + 1 == bin
            {
                *last = bin;
            }
        }
        let [first, last] = found?;
        Some(self.low + self.width * (0.5 * (first + last) as f64 + if self.is_exact { 0.5 } else { 1.0 }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pellicle_io::{SampleType, VolumeOptions, read_volume};

    /// A header of samples of this type.
    fn header(kind: SampleType) -> VolumeHeader {
        let path = std::env::temp_dir().join(format!("pellicle-statistics-{}-{kind:?}.bin", std::process::id()));
        std::fs::write(&path, vec![0; 8 * kind.bytes()]).unwrap();
        let raw = pellicle_io::RawVolume { dims: [2; 3], kind, components: 1, big_endian: false, skip: 0 };
        let volume = read_volume(&path, &VolumeOptions { raw: Some(raw), ..VolumeOptions::default() }).unwrap();
        std::fs::remove_file(path).unwrap();
        volume.header
    }

    #[test]
    fn bytes_are_counted_exactly_and_parted_in_two() {
        let samples = Samples::U8((0..100).map(|i| if i < 70 { 10 } else { 200 }).collect());
        let found = Statistics::of(&header(SampleType::U8), &samples);
        assert_eq!(found.range, Some([10.0, 200.0]));
        assert_eq!(found.percentiles, [10.0, 10.0, 10.0, 200.0, 200.0]);
        assert_eq!(found.suggestion, Some(105.0), "the middle of the gap");
    }

    #[test]
    fn floats_may_be_nan_and_infinite() {
        let mut values: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        values.push(f32::NAN);
        let found = Statistics::of(&header(SampleType::F32), &Samples::F32(values.clone()));
        assert_eq!((found.range, found.invalid), (Some([0.0, 999.0]), 1));
        assert!((found.percentiles[2] - 499.5).abs() < 1.0, "{:?}", found.percentiles);
        assert!((found.suggestion.unwrap() - 499.5).abs() < 2.0, "{:?}", found.suggestion);
        values.push(f32::INFINITY);
        assert_eq!(Statistics::of(&header(SampleType::F32), &Samples::F32(values)).range, Some([0.0, f64::INFINITY]));
        let none = Statistics::of(&header(SampleType::F64), &Samples::F64(vec![f64::NAN; 8]));
        assert_eq!((none.range, none.suggestion, none.invalid), (None, None, 8));
        let same = Statistics::of(&header(SampleType::I32), &Samples::I32(vec![7; 8]));
        assert_eq!((same.range, same.suggestion), (Some([7.0, 7.0]), None));
    }
}
