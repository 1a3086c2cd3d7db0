//! CDCL solver (Marques-Silva and Sakallah 1999; watched literals after Moskewicz et al. 2001;
//! clause deletion after Audemard and Simon 2009). Decisions are left to the caller, who knows the
//! meaning of the variables.

use super::Literal;

/// Position of a clause in the arena. As the reason of an assignment, [`NONE`] stands for a decision or
/// a unit clause.
pub(super) type Place = u32;
pub(super) const NONE: Place = u32::MAX;
/// Flag in a reason: the reason is a binary clause, and the other bits give its other literal.
pub(super) const PAIR: u32 = 1 << 31;
/// Number of words before a clause's literals: its length and its LBD (0 for an input clause).
pub(super) const HEAD: usize = 2;

/// Number of conflicts before the first restart, and unit of the Luby sequence after it.
const RESTART: u64 = 64;
/// Initial limit on learned clauses, to which the length of the trail is added.
const KEPT: usize = 2_000;
/// Increase of the limit on learned clauses each time that clauses are deleted.
const KEPT_MORE: usize = 500;
/// LBD up to which learned clauses are never deleted.
const GLUE: u32 = 2;

/// Result of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Satisfiability {
    /// The values satisfy all clauses.
    Satisfied,
    /// No values satisfy all clauses.
    Unsatisfiable,
    /// The work limit was reached or the caller stopped the search; the search can be continued.
    Interrupted,
}

/// Decision heuristic of the caller.
pub trait Decide {
    /// Appends the literals to decide next, in order of preference; assigned ones are skipped. If all
    /// are assigned or none is appended, every open variable becomes false. Returns the work done, in
    /// the unit of [`Solver::work`].
    fn next(&mut self, solver: &Solver, out: &mut Vec<Literal>) -> u64;
}

#[derive(Clone, Copy)]
pub(super) struct Watch {
    clause: Place,
    /// Some other literal of the clause: while it is true, the clause is satisfied and need not be
    /// inspected.
    blocker: Literal,
}

/// CDCL solver: clauses and the current assignment.
pub struct Solver {
    /// Clauses of three or more literals, one after the other.
    pub(super) arena: Vec<u32>,
    learned: Vec<Place>,
    kept: usize,
    /// For each literal, the other literals of the binary clauses that contain its negation.
    pairs: Vec<Vec<Literal>>,
    /// Clauses to inspect when a literal becomes false, by literal.
    watches: Vec<Vec<Watch>>,
    /// Value of each literal: 1 true, -1 false, 0 open.
    values: Vec<i8>,
    /// Decision level at which each variable was assigned.
    pub(super) levels: Vec<u32>,
    pub(super) reasons: Vec<u32>,
    /// Activity of each variable: decayed count of recent conflicts that involve it.
    activity: Vec<f64>,
    bump: f64,
    pub(super) trail: Vec<Literal>,
    starts: Vec<usize>,
    /// Number of literals of the trail that have been propagated.
    followed: usize,
    contradiction: bool,
    /// Decisions to make next, the last one first.
    plan: Vec<Literal>,
    conflicts: u64,
    restart_at: u64,
    restarts: u64,
    /// Number of inspected watches: a deterministic measure of work.
    pub work: u64,
    pub(super) seen: Vec<bool>,
    bytes: usize,
}

impl Solver {
    /// Solver over a number of variables, without clauses.
    pub fn new(variables: usize) -> Solver {
        Solver {
            arena: Vec::new(),
            learned: Vec::new(),
            kept: KEPT,
            pairs: vec![Vec::new(); 2 * variables],
            watches: vec![Vec::new(); 2 * variables],
            values: vec![0; 2 * variables],
            levels: vec![0; variables],
            reasons: vec![NONE; variables],
            activity: vec![0.0; variables],
            bump: 1.0,
            trail: Vec::new(),
            starts: Vec::new(),
            followed: 0,
            contradiction: false,
            plan: Vec::new(),
            conflicts: 0,
            restart_at: RESTART,
            restarts: 0,
            work: 0,
            seen: vec![false; variables],
            bytes: variables * 100,
        }
    }

    /// Approximate memory of the solver, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes + self.arena.capacity() * 4
    }

    /// Value of a literal; `None` while unassigned.
    pub fn value(&self, literal: Literal) -> Option<bool> {
        match self.values[literal.at()] {
            0 => None,
            value => Some(value > 0),
        }
    }

    /// Activity of a variable: decayed count of recent conflicts that involve it.
    pub(crate) fn activity(&self, variable: u32) -> f64 {
        self.activity[variable as usize]
    }

    /// Number of conflicts so far; while unchanged, no assignment has been undone.
    pub(crate) fn conflicts(&self) -> u64 {
        self.conflicts
    }

    /// Adds a clause; only before the search begins.
    pub fn add(&mut self, clause: &[Literal]) {
        let mut open = Vec::with_capacity(clause.len());
        for &literal in clause {
            match self.value(literal) {
                Some(true) => return,
                Some(false) => {}
                None => open.push(literal),
            }
        }
        match open[..] {
            [] => self.contradiction = true,
            [one] => self.set(one, NONE),
            _ => {
                self.store(&open, 0);
            }
        }
    }

    /// Stores a clause of two or more literals; returns the reason value that refers to it.
    fn store(&mut self, clause: &[Literal], rank: u32) -> u32 {
        self.bytes += 24;
        if let [one, other] = *clause {
            self.pairs[one.negated().at()].push(other);
            self.pairs[other.negated().at()].push(one);
            return PAIR | other.0;
        }
        let place = self.arena.len() as Place;
        self.arena.extend([clause.len() as u32, rank]);
        self.arena.extend(clause.iter().map(|literal| literal.0));
        self.watches[clause[0].at()].push(Watch { clause: place, blocker: clause[1] });
        self.watches[clause[1].at()].push(Watch { clause: place, blocker: clause[0] });
        if rank > 0 {
            self.learned.push(place);
        }
        place
    }

    pub(super) fn level(&self) -> u32 {
        self.starts.len() as u32
    }

    fn set(&mut self, literal: Literal, reason: u32) {
        self.values[literal.at()] = 1;
        self.values[literal.negated().at()] = -1;
        self.levels[literal.variable() as usize] = self.level();
        self.reasons[literal.variable() as usize] = reason;
        self.trail.push(literal);
    }

    fn back_to(&mut self, level: u32) {
        let Some(&start) = self.starts.get(level as usize) else { return };
        for literal in self.trail.drain(start..) {
            self.values[literal.at()] = 0;
            self.values[literal.negated().at()] = 0;
        }
        self.starts.truncate(level as usize);
        self.followed = start;
        self.plan.clear();
    }

    /// Propagates units; returns the literals of a conflicting clause, or `None` without conflict.
    fn propagate(&mut self) -> Option<Vec<Literal>> {
        while self.followed < self.trail.len() {
            let literal = self.trail[self.followed];
            self.followed += 1;
            let pairs = std::mem::take(&mut self.pairs[literal.at()]);
            self.work += pairs.len() as u64 / 2 + 1;
            let mut broken = None;
            for &other in &pairs {
                match self.values[other.at()] {
                    0 => self.set(other, PAIR | literal.negated().0),
                    1 => {}
                    _ => {
                        broken = Some(vec![other, literal.negated()]);
                        break;
                    }
                }
            }
            self.pairs[literal.at()] = pairs;
            if broken.is_some() {
                return broken;
            }
            if let Some(place) = self.follow(literal.negated()) {
                return Some(self.literals(place).collect());
            }
        }
        None
    }

    /// Inspects the clauses that watch a literal that has become false; returns a conflicting clause,
    /// or `None`.
    fn follow(&mut self, gone: Literal) -> Option<Place> {
        let mut watches = std::mem::take(&mut self.watches[gone.at()]);
        self.work += 2 * watches.len() as u64;
        let (mut from, mut to, mut broken) = (0, 0, None);
        'watches: while from < watches.len() {
            let watch = watches[from];
            from += 1;
            if self.values[watch.blocker.at()] > 0 {
                watches[to] = watch;
                to += 1;
                continue;
            }
            let start = watch.clause as usize + HEAD;
            let length = self.arena[watch.clause as usize] as usize;
            if self.arena[start] == gone.0 {
                self.arena.swap(start, start + 1);
            }
            let first = Literal(self.arena[start]);
            if self.values[first.at()] <= 0 {
                for other in start + 2..start + length {
                    if self.values[self.arena[other] as usize] >= 0 {
                        self.arena.swap(start + 1, other);
                        let watched = self.arena[start + 1] as usize;
                        self.watches[watched].push(Watch { clause: watch.clause, blocker: first });
                        continue 'watches;
                    }
                }
            }
            watches[to] = Watch { clause: watch.clause, blocker: first };
            to += 1;
            match self.values[first.at()] {
                0 => self.set(first, watch.clause),
                1 => {}
                _ => {
                    broken = Some(watch.clause);
                    break;
                }
            }
        }
        watches.copy_within(from.., to);
        watches.truncate(watches.len() - (from - to));
        self.watches[gone.at()] = watches;
        broken
    }

    pub(super) fn literals(&self, place: Place) -> impl Iterator<Item = Literal> + '_ {
        let start = place as usize + HEAD;
        self.arena[start..start + self.arena[place as usize] as usize].iter().map(|&l| Literal(l))
    }

    pub(super) fn bump(&mut self, variable: u32) {
        self.activity[variable as usize] += self.bump;
        if self.activity[variable as usize] > 1e100 {
            self.activity.iter_mut().for_each(|a| *a *= 1e-100);
            self.bump *= 1e-100;
        }
    }

    /// Searches for satisfying values until [`Solver::work`] exceeds `work` or `stop` returns true.
    pub fn run(&mut self, decide: &mut dyn Decide, work: u64, stop: &dyn Fn() -> bool) -> Satisfiability {
        if self.contradiction {
            return Satisfiability::Unsatisfiable;
        }
        loop {
            if let Some(broken) = self.propagate() {
                if self.level() == 0 {
                    self.contradiction = true;
                    return Satisfiability::Unsatisfiable;
                }
                self.resolve(broken);
                if self.conflicts >= self.restart_at {
                    self.restarts += 1;
                    self.restart_at = self.conflicts + RESTART * luby(self.restarts);
                    self.back_to(0);
                }
                continue;
            }
            if self.work > work || stop() {
                return Satisfiability::Interrupted;
            }
            if self.learned.len() > self.kept + self.trail.len() {
                self.forget();
            }
            if !self.try_next(decide) {
                return Satisfiability::Satisfied;
            }
        }
    }

    /// Learns a clause from a conflicting one, backtracks and assigns the clause's first literal.
    fn resolve(&mut self, broken: Vec<Literal>) {
        self.conflicts += 1;
        let learned = self.learn(broken);
        self.back_to(learned.level);
        let reason = match learned.clause.len() {
            1 => NONE,
            _ => self.store(&learned.clause, learned.rank),
        };
        self.set(learned.clause[0], reason);
        self.bump /= 0.95;
    }

    /// Makes the next decision; `false` if all variables are assigned.
    fn try_next(&mut self, decide: &mut dyn Decide) -> bool {
        let next = loop {
            match self.plan.pop() {
                Some(literal) if self.value(literal).is_none() => break literal,
                Some(_) => continue,
                None => {}
            }
            let mut plan = std::mem::take(&mut self.plan);
            self.work += decide.next(self, &mut plan);
            plan.retain(|&literal| self.value(literal).is_none());
            if plan.is_empty() {
                let all = (0..self.levels.len() as u32).map(|variable| Literal::new(variable, false));
                plan.extend(all.filter(|&literal| self.value(literal).is_none()));
            }
            if plan.is_empty() {
                return false;
            }
            plan.reverse();
            self.plan = plan;
        };
        self.starts.push(self.trail.len());
        self.set(next, NONE);
        true
    }

    /// Deletes the worse half of the learned clauses by LBD, except reasons and those with small LBD.
    fn forget(&mut self) {
        let mut learned = std::mem::take(&mut self.learned);
        let rank = |place: Place| self.arena[place as usize + 1];
        learned.sort_by_key(|&place| (rank(place), std::cmp::Reverse(place)));
        let mut dropped: Vec<Place> = learned.split_off(learned.len() / 2);
        dropped.retain(|&place| {
            let first = self.arena[place as usize + HEAD];
            let is_reason = self.reasons[first as usize >> 1] == place && self.values[first as usize] > 0;
            let keep = rank(place) <= GLUE || is_reason;
            if keep {
                learned.push(place);
            }
            !keep
        });
        dropped.sort_unstable();
        for watches in &mut self.watches {
            watches.retain(|watch| dropped.binary_search(&watch.clause).is_err());
        }
        self.learned = learned;
        self.kept += KEPT_MORE;
    }
}

/// Luby sequence 1 1 2 1 1 2 4 … (Luby, Sinclair and Zuckerman 1993), indexed from 1.
pub fn luby(mut index: u64) -> u64 {
    loop {
        let bits = u64::BITS - index.leading_zeros();
        if index + 1 == 1 << bits {
            return 1 << (bits - 1);
        }
        index -= (1 << (bits - 1)) - 1;
    }
}
