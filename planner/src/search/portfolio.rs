//! Portfolio of searches for a first plan, and the rounds in which the searches take turns.

use serde::Serialize;

use crate::technique::Technique;

/// Algorithm of a search in the portfolio.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "engine")]
pub enum Engine {
    /// Lazy greedy best-first search with two alternating heuristics, h_FF and landmark count (Richter
    /// and Westphal 2010).
    LazyGreedy {
        /// True if the heuristic h_FF counts operator costs, false if every operator costs one.
        costs: bool,
        /// True if states along relaxed plans are tried as well (lookahead; Vidal 2004).
        lookahead: bool,
        /// True if ties in the open list go to the newest entry (LIFO), false if to the oldest (FIFO).
        newest_first: bool,
        /// True if operators that achieve landmarks are preferred, in addition to those of the relaxed
        /// plan.
        prefers_landmarks: bool,
    },
    /// Best-first width search: ranks states by novelty, in terms of open landmarks or goals and
    /// relaxed-plan facts (Lipovetzky and Geffner 2017).
    Width {
        /// True if states without a new fact are pruned, false if they only come later.
        prunes: bool,
    },
    /// Planning as satisfiability with parallel steps (Rintanen, Heljanko and Niemelä 2006).
    Satisfiability,
}

/// Conclusion to draw when a search has exhausted its search space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Proof {
    /// No plan exists.
    Unsolvable,
    /// No plan exists, if the search had no cost bound; otherwise nothing is proven.
    UnsolvableWithoutBound,
    /// Nothing is proven.
    Nothing,
}

/// One search of the portfolio.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Configuration {
    /// Name of the search, by which it can be left out.
    #[serde(rename = "name")]
    pub technique: Technique,
    /// Search algorithm.
    #[serde(flatten)]
    pub engine: Engine,
    /// Conclusion to draw when the search is exhausted.
    pub proof: Proof,
    /// True if each turn is limited to the work of the first full round, for searches that succeed soon
    /// or not at all.
    pub is_capped: bool,
}

const fn lazy(
    technique: Technique,
    costs: bool,
    lookahead: bool,
    newest_first: bool,
    prefers_landmarks: bool,
) -> Configuration {
    let engine = Engine::LazyGreedy { costs, lookahead, newest_first, prefers_landmarks };
    let proof = if lookahead { Proof::UnsolvableWithoutBound } else { Proof::Unsolvable };
    Configuration { technique, engine, proof, is_capped: false }
}

/// Searches of the portfolio. Only the first one counts operator costs, because preferring cheap
/// operators can mislead.
pub const PORTFOLIO: [Configuration; 7] = [
    lazy(Technique::LookaheadCosts, true, true, false, true),
    lazy(Technique::LookaheadLifo, false, true, true, true),
    Configuration {
        technique: Technique::Width,
        engine: Engine::Width { prunes: false },
        proof: Proof::UnsolvableWithoutBound,
        is_capped: false,
    },
    lazy(Technique::Plain, false, false, false, false),
    lazy(Technique::PlainLifo, false, false, true, true),
    Configuration {
        technique: Technique::NarrowWidth,
        engine: Engine::Width { prunes: true },
        proof: Proof::Nothing,
        is_capped: true,
    },
    Configuration {
        technique: Technique::Satisfiability,
        engine: Engine::Satisfiability,
        proof: Proof::Nothing,
        is_capped: true,
    },
];

/// Indices in [`PORTFOLIO`] of the searches in each kind of round: the short first round, then two that
/// alternate. All searches of a round have the same work limit.
pub const ROUNDS: [&[usize]; 3] = [&[0, 6], &[0, 5, 2, 3, 6], &[1, 5, 2, 4, 6]];
/// Divisor of a search's work limit in the short first round.
pub const SHORT_SHARE: u64 = 6;
/// Factor by which the work limit grows from one round to the next, after the first full round.
pub const ROUND_FACTOR: u64 = 3;
/// Index in [`PORTFOLIO`] of the first search.
pub const FIRST: usize = 0;

/// Indices in [`PORTFOLIO`] of the searches that take turns in a round, in order.
pub fn turns(round: usize) -> &'static [usize] {
    match round {
        0 => ROUNDS[0],
        _ => ROUNDS[1 + (round - 1) % (ROUNDS.len() - 1)],
    }
}
