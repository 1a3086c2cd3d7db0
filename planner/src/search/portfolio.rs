//! Portfolio of searches for a first plan, and the order of their turns.

use serde::Serialize;

/// The algorithm of a search of the portfolio.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "engine")]
pub enum Engine {
    /// Lazy greedy best-first search with h_FF and landmark count in alternating open lists (Richter and Westphal 2010).
    LazyGreedy {
        /// True if operator costs count in the heuristic; false: unit costs.
        costs: bool,
        /// Uses lookahead states along relaxed plans (Vidal 2004).
        lookahead: bool,
        /// LIFO tie-breaking, or FIFO.
        newest_first: bool,
        /// Operators that achieve landmarks are preferred besides those of the relaxed plan.
        prefers_landmarks: bool,
    },
    /// Best-first width search: novelty beside goal count and relaxed plan (Lipovetzky and Geffner 2017).
    Width {
        /// True if states that are not novel are pruned.
        prunes: bool,
    },
    /// Planning as satisfiability with parallel steps (Rintanen, Heljanko and Niemelä 2006).
    Satisfiability,
}

/// Conclusion from an exhausted search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Proof {
    /// Exhaustion proves that no plan exists.
    Unsolvable,
    /// Exhaustion proves that no plan exists, unless the cost is bounded.
    UnsolvableWithoutBound,
    /// Exhaustion proves nothing.
    Nothing,
}

/// A search of the portfolio.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Configuration {
    /// Name.
    pub name: &'static str,
    /// Search algorithm.
    #[serde(flatten)]
    pub engine: Engine,
    /// Conclusion from an exhausted search.
    pub proof: Proof,
    /// True if a turn is limited to the work of the first full round, for searches that succeed
    /// soon or not at all.
    pub is_capped: bool,
}

const fn lazy(
    name: &'static str,
    costs: bool,
    lookahead: bool,
    newest_first: bool,
    prefers_landmarks: bool,
) -> Configuration {
    let engine = Engine::LazyGreedy { costs, lookahead, newest_first, prefers_landmarks };
    let proof = if lookahead { Proof::UnsolvableWithoutBound } else { Proof::Unsolvable };
    Configuration { name, engine, proof, is_capped: false }
}

/// Configurations of the portfolio. Only the first search counts costs, as cheap operators may lead
/// nowhere.
pub const PORTFOLIO: [Configuration; 7] = [
    lazy("lookahead, costs", true, true, false, true),
    lazy("lookahead, LIFO", false, true, true, true),
    Configuration {
        name: "width",
        engine: Engine::Width { prunes: false },
        proof: Proof::UnsolvableWithoutBound,
        is_capped: false,
    },
    lazy("plain", false, false, false, false),
    lazy("plain, LIFO", false, false, true, true),
    Configuration {
        name: "narrow width",
        engine: Engine::Width { prunes: true },
        proof: Proof::Nothing,
        is_capped: true,
    },
    Configuration {
        name: "satisfiability",
        engine: Engine::Satisfiability,
        proof: Proof::Nothing,
        is_capped: true,
    },
];

/// Portfolio indices of each round's turns; the first round is short. Within a round, every search
/// has the same work limit.
pub const ROUNDS: [&[usize]; 3] = [&[0, 6], &[0, 5, 2, 3, 6], &[1, 5, 2, 4, 6]];
/// Divisor of the work of a search in the short round.
pub const SHORT_SHARE: u64 = 6;
/// Factor on the work of each later round.
pub const ROUND_FACTOR: u64 = 3;
/// Index of the first search.
pub const FIRST: usize = 0;

/// Turns of a round.
pub fn turns(round: usize) -> &'static [usize] {
    match round {
        0 => ROUNDS[0],
        _ => ROUNDS[1 + (round - 1) % (ROUNDS.len() - 1)],
    }
}
