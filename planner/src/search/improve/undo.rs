//! Removes plan steps that cancel each other, among steps that only change numbers by constants.
//!
//! Other steps are first moved to the earliest position where they are applicable, so that a number
//! need not return to a value for their sake. Then groups of steps that change the same numbers in
//! opposite directions are removed where the rest of the plan still reaches the goal.

use rustc_hash::FxHashMap;

use super::Improve;
use crate::classical::compiled::Compiled;
use crate::technique::Technique;

/// Maximum number of steps of one operator that are removed together.
const MOST_TOGETHER: u32 = 6;
/// Maximum number of words of all states along a plan; longer plans are left alone.
const MOST_WORDS: usize = 1 << 24;

/// Operator that cancels another one, with the number of applications of each.
#[derive(Clone, Copy)]
struct Opposite {
    operator: u32,
    own: usize,
    other: usize,
}

/// Operators of a plan that only change numbers by constants, each with the operators that cancel it.
struct Shifts {
    opposites: FxHashMap<u32, Vec<Opposite>>,
}

impl Shifts {
    fn new(task: &Compiled, plan: &[u32]) -> Shifts {
        let mut operators = plan.to_vec();
        operators.sort_unstable();
        operators.dedup();
        let shifts = operators.into_iter().filter_map(|operator| Some((operator, shift(task, operator)?)));
        let mut alike: FxHashMap<Vec<u32>, Vec<(u32, Vec<f64>)>> = FxHashMap::default();
        for (operator, (numbers, gains)) in shifts {
            alike.entry(numbers).or_default().push((operator, gains));
        }
        let mut opposites = FxHashMap::default();
        for group in alike.values() {
            for (operator, gains) in group {
                let against = group.iter().filter_map(|(other, others)| {
                    let (own, count) = balance(gains, others)?;
                    Some(Opposite { operator: *other, own, other: count })
                });
                opposites.insert(*operator, against.collect());
            }
        }
        Shifts { opposites }
    }
}

/// Numbers that an operator changes by constants, ascending, with the amounts; `None` if the operator
/// does anything else.
fn shift(task: &Compiled, operator: u32) -> Option<(Vec<u32>, Vec<f64>)> {
    let changes = &task.numbers.changes[operator as usize];
    if changes.is_empty() || !task.effects.get(operator as usize).is_empty() {
        return None;
    }
    let gain = |change: &crate::classical::numbers::NumberChange| {
        let gain = change.constant_gain().filter(|_| change.conditions.is_empty());
        Some((change.number, gain?))
    };
    let mut gains: Vec<(u32, f64)> = changes.iter().map(gain).collect::<Option<_>>()?;
    gains.sort_by_key(|&(number, _)| number);
    Some(gains.into_iter().unzip())
}

/// Least numbers of applications of two operators whose changes then cancel; `None` if there are none
/// up to the limit.
fn balance(one: &[f64], other: &[f64]) -> Option<(usize, usize)> {
    let counts = (1..=MOST_TOGETHER).flat_map(|own| (1..=MOST_TOGETHER).map(move |count| (own, count)));
    let cancels = |&(own, count): &(u32, u32)| {
        one.iter().zip(other).all(|(a, b)| (f64::from(own) * a + f64::from(count) * b).abs() < 1e-9)
    };
    let found = counts.filter(cancels).min()?;
    Some((found.0 as usize, found.1 as usize))
}

impl Improve<'_> {
    /// Removes steps of a plan that cancel each other.
    pub(super) fn undo(&mut self, plan: &mut Vec<u32>) {
        if !self.without.uses(Technique::Cancelling) {
            return;
        }
        let task = self.task;
        if task.numbers.is_empty() || plan.len().saturating_mul(task.initial.len()) > MOST_WORDS {
            return;
        }
        let shifts = Shifts::new(task, plan);
        if shifts.opposites.values().all(Vec::is_empty) {
            return;
        }
        let mut states = vec![task.initial.clone()];
        self.follow(plan, &mut states);
        self.pull(plan, &shifts, &mut states);
        self.cancel(plan, &shifts, &mut states);
    }

    /// Extends the states along a plan, from the last one given to the end of the plan.
    fn follow(&mut self, plan: &[u32], states: &mut Vec<Vec<u32>>) {
        for &operator in &plan[states.len() - 1..] {
            let mut next = Vec::new();
            if let Some(last) = states.last() {
                self.task.apply(operator, last, &mut next);
            }
            states.push(next);
        }
        self.work += plan.len() as u64 * 2;
    }

    /// True if the steps can be applied from a state and end in a goal state.
    fn reaches(&mut self, from: &[u32], steps: impl Iterator<Item = u32>) -> bool {
        let task = self.task;
        self.state.clear();
        self.state.extend_from_slice(from);
        for operator in steps {
            self.work += 2 + self.state.len() as u64 / 16;
            if !task.applicable(operator, &self.state) {
                return false;
            }
            task.apply(operator, &self.state, &mut self.next);
            std::mem::swap(&mut self.state, &mut self.next);
        }
        task.is_goal(&self.state)
    }

    /// Moves every step that does more than change numbers to the earliest position where it is
    /// applicable, if the plan remains valid.
    fn pull(&mut self, plan: &mut [u32], shifts: &Shifts, states: &mut Vec<Vec<u32>>) {
        for from in 0..plan.len() {
            let operator = plan[from];
            if shifts.opposites.contains_key(&operator) || self.over() {
                continue;
            }
            let first = (0..from).find(|&to| self.task.applicable(operator, &states[to]));
            let Some(to) = first else { continue };
            plan[to..=from].rotate_right(1);
            let before = std::mem::take(&mut states[to]);
            let works = self.reaches(&before, plan[to..].iter().copied());
            states[to] = before;
            if works {
                states.truncate(to + 1);
                self.follow(plan, states);
            } else {
                plan[to..=from].rotate_left(1);
            }
        }
    }

    /// Removes steps together with the nearest earlier steps that they cancel, if the plan remains
    /// valid.
    fn cancel(&mut self, plan: &mut Vec<u32>, shifts: &Shifts, states: &mut Vec<Vec<u32>>) {
        let mut at = 0;
        'next: while at < plan.len() && !self.over() {
            for &opposite in shifts.opposites.get(&plan[at]).into_iter().flatten() {
                let Some(gone) = together(plan, at, opposite) else { continue };
                let first = gone[0];
                let rest: Vec<u32> = (first..plan.len())
                    .filter(|index| gone.binary_search(index).is_err())
                    .map(|index| plan[index])
                    .collect();
                let before = std::mem::take(&mut states[first]);
                let works = self.reaches(&before, rest.iter().copied());
                states[first] = before;
                if works {
                    plan.truncate(first);
                    plan.extend(rest);
                    states.truncate(first + 1);
                    self.follow(plan, states);
                    at = first;
                    continue 'next;
                }
            }
            at += 1;
        }
    }
}

/// Positions, in ascending order, of the step at `at`, of later ones of its operator, and of the
/// nearest earlier ones that they cancel; `None` if there are too few.
fn together(plan: &[u32], at: usize, opposite: Opposite) -> Option<Vec<usize>> {
    let behind = (at..plan.len()).filter(|&index| plan[index] == plan[at]).take(opposite.own);
    let ahead = (0..at).rev().filter(|&index| plan[index] == opposite.operator).take(opposite.other);
    let mut places: Vec<usize> = behind.chain(ahead).collect();
    places.sort_unstable();
    (places.len() == opposite.own + opposite.other).then_some(places)
}
