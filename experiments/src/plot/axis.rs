//! Mapping of values to positions on the plot, with round ticks.

/// Approximate number of ticks of an axis.
const TICKS: f64 = 6.0;

/// Linear mapping of values along an axis to positions on the plot.
pub struct Scale {
    /// Value at the start of the axis.
    pub low: f64,
    /// Value at the end of the axis.
    pub high: f64,
    from: f64,
    to: f64,
    step: f64,
}

impl Scale {
    /// A scale from `from` to `to` on the plot with given ends, or with round ends around the data.
    pub fn new(range: Option<[f64; 2]>, values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (low, high) = match range {
            Some([low, high]) if high > low => (low, high),
            _ => around(values.filter(|v| v.is_finite())),
        };
        let step = round_step((high - low) / TICKS);
        let (low, high) = match range {
            Some([low, high]) if high > low => (low, high),
            _ => ((low / step).floor() * step, (high / step).ceil() * step),
        };
        Self { low, high, from, to, step }
    }

    /// Position of a value on the plot, clamped to the ends of the axis.
    pub fn at(&self, value: f64) -> f64 {
        let share = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        self.from + share * (self.to - self.from)
    }

    /// Round values along the axis at which ticks are drawn.
    pub fn ticks(&self) -> Vec<f64> {
        let (first, last) =
            ((self.low / self.step - 1e-9).ceil() as i64, (self.high / self.step + 1e-9).floor() as i64);
        (first..=last).map(|k| k as f64 * self.step).collect()
    }

    /// A tick as text, with as many decimals as its step has.
    pub fn text(&self, tick: f64) -> String {
        let decimals = (-self.step.log10().floor()).max(0.0) as usize;
        let text = format!("{tick:.decimals$}");
        if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
            text.trim_start_matches('-').into()
        } else {
            text
        }
    }
}

/// Ends around the values, including a nearby zero; at least one unit wide for a single value.
fn around(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    let low = if low > 0.0 && low < 0.5 * high { 0.0 } else { low };
    if high - low < 1e-9 * (1.0 + high.abs()) { (low - 0.5, high + 0.5) } else { (low, high) }
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let share = step / power;
    power
        * if share <= 1.0 {
            1.0
        } else if share <= 2.0 {
            2.0
        } else if share <= 5.0 {
            5.0
        } else {
            10.0
        }
}
