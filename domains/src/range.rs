//! Range of values that a predicate or function may take after further views.

use descry_memory::belief::Track;

use crate::situation::Situation;

/// Range of the value of a predicate or function; a predicate is 1 if true and 0 if false.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Value as believed now.
    pub believed: f64,
    /// Minimum value that further views may leave.
    pub least: f64,
    /// Maximum value that further views may bring.
    pub greatest: f64,
    /// Probability that the value lies in the range.
    pub sure: f64,
}

/// Argument of a predicate or function.
#[derive(Debug, Clone, Copy)]
pub enum Referent<'a> {
    /// Object of the problem, by symbol.
    Named(&'a str),
    /// Seen object outside the requested things.
    Seen(&'a Track),
    /// Unseen thing or surface.
    Unseen,
}

/// Function that bounds the value of a predicate or function on some objects, in a situation.
pub type Bounds = fn(&Situation, &[Referent<'_>]) -> Range;

impl Range {
    /// Range of an unknown probability.
    pub const UNKNOWN: Range = Range { believed: 0.0, least: 0.0, greatest: 1.0, sure: 1.0 };
    /// Range of an unknown number.
    pub const UNDEFINED: Range =
        Range { believed: f64::NEG_INFINITY, least: f64::NEG_INFINITY, greatest: f64::INFINITY, sure: 1.0 };

    /// Range of a known value.
    pub const fn exactly(value: f64) -> Range {
        Range { believed: value, least: value, greatest: value, sure: 1.0 }
    }

    /// The same range with a probability that the value lies in it.
    pub const fn with(self, sure: f64) -> Range {
        Range { sure, ..self }
    }

    /// Range of a certainty that views may raise; its lower bound is fixed once the certainty reaches
    /// `wanted`.
    pub fn certainty(value: f64, wanted: f64) -> Range {
        // As the problem of a round states it.
        let value = (value * 1e6).round() / 1e6;
        Range {
            believed: value,
            least: if value >= wanted { value } else { 0.0 },
            greatest: 1.0,
            sure: value,
        }
    }

    /// Range of a predicate with a probability; settled if the probability, or its complement, reaches
    /// `wanted`.
    pub fn settled(probability: f64, wanted: f64) -> Range {
        match probability {
            p if p >= wanted => Range::exactly(1.0).with(p),
            p if p <= 1.0 - wanted => Range::exactly(0.0).with(1.0 - p),
            _ => Range::UNKNOWN,
        }
    }

    /// True if only one value is possible.
    pub fn is_exact(&self) -> bool {
        self.least == self.greatest
    }

    /// Range of a function that is monotonic in both values: the extremes of its corners.
    pub fn combined(self, other: Range, function: impl Fn(f64, f64) -> f64) -> Range {
        let corners = [
            (self.least, other.least),
            (self.least, other.greatest),
            (self.greatest, other.least),
            (self.greatest, other.greatest),
        ];
        let values = corners.map(|(a, b)| function(a, b));
        if values.iter().any(|value| value.is_nan()) {
            return Range::UNDEFINED;
        }
        let (least, greatest) =
            values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, g), &v| (l.min(v), g.max(v)));
        Range { believed: least, least, greatest, sure: self.sure.min(other.sure) }
    }
}
