//! CDCL solver (Marques-Silva and Sakallah 1999; watched literals after Moskewicz et al. 2001;
//! clause deletion after Audemard and Simon 2009). Decisions are left to the caller, who knows the
//! meaning of the variables.

use super::Literal;

/// Position of a clause in the arena; [`NONE`] for no reason.
pub(super) type Place = u32;
pub(super) const NONE: Place = u32::MAX;
/// Flag of a reason that is a binary clause with the given other literal.
pub(super) const PAIR: u32 = 1 << 31;
/// Words before a clause's literals: length and LBD (0 for an input clause).
pub(super) const HEAD: usize = 2;

/// Conflicts of the shortest run between restarts.
const RESTART: u64 = 64;
/// Initial limit of learned clauses; the next constant is its increase after each reduction.
const KEPT: usize = 2_000;
const KEPT_MORE: usize = 500;
/// Maximum LBD of learned clauses that are never deleted.
const GLUE: u32 = 2;

/// Answer of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Satisfiability {
    /// All clauses hold under the values.
    Satisfied,
    /// Unsatisfiable.
    Unsatisfiable,
    /// Work limit reached or stopped by the caller; the solver can continue.
    Interrupted,
}

/// Decision heuristic.
pub trait Decide {
    /// Appends decision literals, in order of preference; assigned ones are skipped. If none is
    /// appended, all open variables become false. Returns the work done (see [`Solver::work`]).
    fn next(&mut self, solver: &Solver, out: &mut Vec<Literal>) -> u64;
}

#[derive(Clone, Copy)]
pub(super) struct Watch {
    clause: Place,
    /// Blocking literal of the clause: while this literal is true, the clause is satisfied and need
    /// not be inspected.
    blocker: Literal,
}

/// Clause database and assignment.
pub struct Solver {
    /// Clauses of three or more literals, consecutively.
    pub(super) arena: Vec<u32>,
    learned: Vec<Place>,
    kept: usize,
    /// Binary clauses, by literal: the other literals of the clauses with its negation.
    pairs: Vec<Vec<Literal>>,
    /// Clauses that watch a literal, by literal.
    watches: Vec<Vec<Watch>>,
    /// Value by literal: 1 true, -1 false, 0 open.
    values: Vec<i8>,
    /// Decision level by variable.
    pub(super) levels: Vec<u32>,
    pub(super) reasons: Vec<u32>,
    /// Activity by variable: decayed count of its recent conflicts.
    activity: Vec<f64>,
    bump: f64,
    pub(super) trail: Vec<Literal>,
    starts: Vec<usize>,
    /// Position in the trail up to which propagation is done.
    followed: usize,
    contradiction: bool,
    /// Stack of planned decisions.
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
    /// A solver without clauses over this many variables.
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

    /// Approximate memory, bytes.
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

    /// Activity of a variable: decayed count of its recent conflicts.
    pub(crate) fn activity(&self, variable: u32) -> f64 {
        self.activity[variable as usize]
    }

    /// Number of conflicts so far; while unchanged, no assignment has been undone.
    pub(crate) fn conflicts(&self) -> u64 {
        self.conflicts
    }

    /// Adds a clause, before the search begins.
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

    /// Stores a clause of two or more literals; returns its reason reference.
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

    /// Unit propagation; returns the literals of a conflicting clause, if any.
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

    /// Inspects the clauses that watch a literal that became false; returns a conflicting clause,
    /// if any.
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

    /// Searches until the total work reaches `work`, or `stop` returns true.
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

    /// Learns from a conflicting clause and backtracks.
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

    /// Makes the next decision; `false` if all literals are assigned.
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

    /// Deletes the worse half of the learned clauses.
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

/// 1 1 2 1 1 2 4 … (Luby, Sinclair and Zuckerman 1993), from 1.
pub fn luby(mut index: u64) -> u64 {
    loop {
        let bits = u64::BITS - index.leading_zeros();
        if index + 1 == 1 << bits {
            return 1 << (bits - 1);
        }
        index -= (1 << (bits - 1)) - 1;
    }
}
