//! Values that a word may turn out to have, for all that was looked at.

use descry_memory::belief::Track;

use crate::situation::Situation;

/// Range of the value of a word. A predicate has the value 1 where it holds and 0 elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Value as believed now: what is at least this much is believed to be.
    pub believed: f64,
    /// Least value that further looks may leave.
    pub least: f64,
    /// Greatest value that further looks may bring.
    pub greatest: f64,
}

/// Object that a word is said of.
#[derive(Debug, Clone, Copy)]
pub enum Referent<'a> {
    /// An object of the problem, by its symbol.
    Named(&'a str),
    /// An object that was seen and is none of the things that are asked about.
    Seen(&'a Track),
    /// A thing or a surface that nobody has seen.
    Unseen,
}

/// Range of a word on some objects, in a situation.
pub type Bounds = fn(&Situation, &[Referent<'_>]) -> Range;

impl Range {
    /// A probability of which nothing is known.
    pub const UNKNOWN: Range = Range { believed: 0.0, least: 0.0, greatest: 1.0 };
    /// A number of which nothing is known.
    pub const UNDEFINED: Range =
        Range { believed: f64::NEG_INFINITY, least: f64::NEG_INFINITY, greatest: f64::INFINITY };

    /// A value that is known.
    pub const fn exactly(value: f64) -> Range {
        Range { believed: value, least: value, greatest: value }
    }

    /// A certainty that looks may raise: one that is as great as was asked for stays.
    pub fn certainty(value: f64, wanted: f64) -> Range {
        // As the problem of a round states it.
        let value = (value * 1e6).round() / 1e6;
        Range { believed: value, least: if value >= wanted { value } else { 0.0 }, greatest: 1.0 }
    }

    /// Truth of a predicate that holds with a probability: settled where the probability, or its complement,
    /// reaches `wanted`.
    pub fn settled(probability: f64, wanted: f64) -> Range {
        match probability {
            p if p >= wanted => Range::exactly(1.0),
            p if p <= 1.0 - wanted => Range::exactly(0.0),
            _ => Range::UNKNOWN,
        }
    }

    /// True if only one value is possible.
    pub fn is_exact(&self) -> bool {
        self.least == self.greatest
    }

    /// A function of two values that is monotonic in each: the extremes of its corners.
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
        Range { believed: least, least, greatest }
    }
}
