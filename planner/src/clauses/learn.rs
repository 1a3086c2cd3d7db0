//! Conflict analysis: derives a minimised clause from a conflict (first unique implication point).

use super::Literal;
use super::solver::{NONE, PAIR, Solver};

/// Learned clause. After backtracking to `level`, its first literal must become true.
pub(super) struct Learned {
    pub clause: Vec<Literal>,
    pub level: u32,
    /// Number of distinct decision levels among the clause's literals (LBD).
    pub rank: u32,
}

impl Solver {
    /// Learns a clause from a conflicting one, whose literals are all false.
    pub(super) fn learn(&mut self, mut reason: Vec<Literal>) -> Learned {
        let mut clause = vec![Literal::default()];
        let (mut open, mut index) = (0, self.trail.len());
        let mut marked = Vec::new();
        loop {
            for &literal in &reason {
                let variable = literal.variable();
                let level = self.levels[variable as usize];
                if level == 0 || std::mem::replace(&mut self.seen[variable as usize], true) {
                    continue;
                }
                marked.push(variable);
                self.bump(variable);
                if level == self.level() {
                    open += 1;
                } else {
                    clause.push(literal);
                }
            }
            index -= 1;
            while !self.seen[self.trail[index].variable() as usize] {
                index -= 1;
            }
            let literal = self.trail[index];
            open -= 1;
            self.seen[literal.variable() as usize] = false;
            if open == 0 {
                clause[0] = literal.negated();
                break;
            }
            reason = self.because(literal);
        }
        let mut place = 1;
        while place < clause.len() {
            if self.follows(clause[place]) {
                clause.swap_remove(place);
            } else {
                place += 1;
            }
        }
        marked.iter().for_each(|&variable| self.seen[variable as usize] = false);
        self.measured(clause)
    }

    /// Other literals of the clause that propagated a literal; all of them are false.
    fn because(&self, literal: Literal) -> Vec<Literal> {
        let reason = self.reasons[literal.variable() as usize];
        if reason & PAIR != 0 && reason != NONE {
            return vec![Literal(reason & !PAIR)];
        }
        self.literals(reason).filter(|&other| other != literal).collect()
    }

    /// True if a literal of the learned clause is redundant: implied by the other marked literals.
    fn follows(&self, literal: Literal) -> bool {
        let reason = self.reasons[literal.variable() as usize];
        let marked = |other: Literal| {
            self.seen[other.variable() as usize] || self.levels[other.variable() as usize] == 0
        };
        reason != NONE && self.because(literal.negated()).into_iter().all(marked)
    }

    fn measured(&self, mut clause: Vec<Literal>) -> Learned {
        let level = |literal: Literal| self.levels[literal.variable() as usize];
        let Some(second) = (1..clause.len()).max_by_key(|&place| level(clause[place])) else {
            return Learned { clause, level: 0, rank: 1 };
        };
        clause.swap(1, second);
        let mut levels: Vec<u32> = clause.iter().map(|&literal| level(literal)).collect();
        levels.sort_unstable();
        levels.dedup();
        Learned { level: level(clause[1]), rank: levels.len() as u32, clause }
    }
}
