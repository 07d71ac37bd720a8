//! A range of values mapped to a range of pixels, with ticks.

use super::Scale;

/// A range of values mapped to a range of pixels.
pub(super) struct Span {
    scale: Scale,
    /// Values, or their logarithms.
    low: f64,
    high: f64,
    pixels: [f64; 2],
}

impl Span {
    pub(super) fn new(scale: Scale, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let shown = values.filter_map(|value| inner(scale, value));
        let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let margin = if high > low { 0.04 * (high - low) } else { 0.5 * low.abs().max(f64::MIN_POSITIVE) };
        // The axis of a quantity that is never negative starts at zero if the values come near it.
        let from_zero = scale == Scale::Linear && low >= 0.0 && low <= 0.5 * high;
        let low = if from_zero { 0.0 } else { low - margin };
        let high = high + margin;
        let (low, high) = if high > low && (high - low).is_finite() { (low, high) } else { (0.0, 1.0) };
        Self { scale, low, high, pixels }
    }

    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let part = (inner(self.scale, value)? - self.low) / (self.high - self.low);
        Some(self.pixels[0] + part * (self.pixels[1] - self.pixels[0]))
    }

    /// Values at both ends of a linear axis.
    pub(super) fn linear_ends(&self) -> Option<[f64; 2]> {
        (self.scale == Scale::Linear).then_some([self.low, self.high])
    }

    /// Labels and positions of ticks: about six round numbers, or decades.
    pub(super) fn ticks(&self) -> Vec<(String, f64)> {
        let rough = (self.high - self.low) / 6.0;
        let decade = 10.0_f64.powf(rough.log10().floor());
        let round = [1.0, 2.0, 5.0, 10.0].map(|part| part * decade).into_iter().find(|step| *step >= rough);
        let mut step = round.unwrap_or(rough);
        if self.scale == Scale::Log {
            step = step.ceil();
        }
        let first = (self.low / step).ceil();
        let count = ((self.high / step).floor() - first).clamp(-1.0, 20.0) as i32;
        (0..=count)
            .map(|n| {
                let at = (first + f64::from(n)) * step;
                let place = self.pixels[0]
                    + (at - self.low) / (self.high - self.low) * (self.pixels[1] - self.pixels[0]);
                let label =
                    if self.scale == Scale::Log { number(10.0_f64.powf(at), 1) } else { linear(at, step) };
                (label, place)
            })
            .collect()
    }
}

/// Label of a tick on a linear axis, with as many decimals as its step needs.
fn linear(at: f64, step: f64) -> String {
    if !(1e-4..1e6).contains(&step) {
        return number(if at.abs() < step / 2.0 { 0.0 } else { at }, 3);
    }
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let text = format!("{at:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

fn number(value: f64, digits: usize) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        format!("{}", (value * 1e9).round() / 1e9)
    } else {
        format!("{value:.0$e}", digits - 1)
    }
}

fn inner(scale: Scale, value: f64) -> Option<f64> {
    let mapped = match scale {
        Scale::Linear => value,
        Scale::Log if value > 0.0 => value.log10(),
        Scale::Log => return None,
    };
    mapped.is_finite().then_some(mapped)
}
