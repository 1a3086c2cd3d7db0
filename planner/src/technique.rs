//! Techniques of planning, each of which an ablation study can leave out.

use serde::Serialize;

/// Technique of searching for a plan or of improving one; [`TECHNIQUES`] describes each.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Technique {
    LookaheadCosts,
    LookaheadLifo,
    Width,
    Plain,
    PlainLifo,
    NarrowWidth,
    Satisfiability,
    LandmarkCount,
    NumericLookahead,
    SecondSearch,
    Elimination,
    Cancelling,
    BlockReordering,
    Windows,
    SparseLookahead,
    EagerLookahead,
    Compression,
    Envelopes,
    LinearPrograms,
    Shortcuts,
    Tours,
    Tightening,
    Restarts,
    Neighbourhoods,
}

use Technique::*;

/// Techniques with their names and what they do, in the order of their declaration: first plans without
/// durations, their improvement, plans with durations, their improvement.
pub const TECHNIQUES: [(Technique, &str, &str); 24] = [
    (LookaheadCosts, "lookahead-costs", "search of the portfolio"),
    (LookaheadLifo, "lookahead-lifo", "search of the portfolio"),
    (Width, "width", "search of the portfolio"),
    (Plain, "plain", "search of the portfolio"),
    (PlainLifo, "plain-lifo", "search of the portfolio"),
    (NarrowWidth, "narrow-width", "search of the portfolio"),
    (Satisfiability, "satisfiability", "search of the portfolio"),
    (LandmarkCount, "landmark-count", "open lists and preferred operators by landmarks"),
    (NumericLookahead, "numeric-lookahead", "lookahead that changes numbers towards conditions"),
    (SecondSearch, "second-search", "search without lookahead for a shorter first plan"),
    (Elimination, "elimination", "removes actions that the goal does not need"),
    (Cancelling, "cancelling", "removes changes of numbers that undo each other"),
    (BlockReordering, "block-reordering", "moves dependent actions next to each other"),
    (Windows, "windows", "replans windows of a plan"),
    (SparseLookahead, "sparse-lookahead", "short search in time that follows some relaxed plans"),
    (EagerLookahead, "eager-lookahead", "short search in time that follows every relaxed plan"),
    (Compression, "compression", "portfolio over compressed and split actions"),
    (Envelopes, "envelopes", "first pass that splits only actions that others must run inside"),
    (LinearPrograms, "linear-programs", "search whose times are chosen by linear programs"),
    (Shortcuts, "shortcuts", "replaces two actions by one"),
    (Tours, "tours", "reorders the stops of a tour"),
    (Tightening, "tightening", "exchanges actions on the critical path"),
    (Restarts, "restarts", "restarting weighted A*"),
    (Neighbourhoods, "neighbourhoods", "large neighbourhood search"),
];

impl Technique {
    /// Technique of a name.
    pub fn named(name: &str) -> Option<Technique> {
        TECHNIQUES.iter().find(|(_, own, _)| *own == name).map(|(technique, ..)| *technique)
    }

    /// Name.
    pub fn name(self) -> &'static str {
        TECHNIQUES[self as usize].1
    }
}

/// Techniques that are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Without(u32);

impl Without {
    /// True if a technique is used.
    pub fn uses(self, technique: Technique) -> bool {
        self.0 >> (technique as u32) & 1 == 0
    }
}

impl FromIterator<Technique> for Without {
    fn from_iter<T: IntoIterator<Item = Technique>>(techniques: T) -> Without {
        Without(techniques.into_iter().fold(0, |bits, technique| bits | 1 << technique as u32))
    }
}
