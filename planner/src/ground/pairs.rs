//! Mutex groups from h² (Haslum and Geffner 2000), which finds the pairs of facts that are
//! reachable together. It finds more than invariant synthesis where ground actions no longer
//! correspond to lifted ones.

use super::task::{GroundAction, GroundFact, GroundOutcome, GroundTask};

/// Maximum number of facts; h² is skipped for larger tasks.
const MOST_FACTS: usize = 4_000;
/// Maximum number of machine words examined in search of pairs; beyond, no group is found.
const MOST_WORK: usize = 50_000_000;
/// Maximum total number of members of all groups.
const MOST_MEMBERS: usize = 50_000;

/// Mutex groups that together cover the pairs of facts found mutually exclusive; none for tasks
/// with axioms, conditional effects or too many facts.
pub fn exclusive(task: &GroundTask) -> Vec<Vec<GroundFact>> {
    let conditional = task.actions.iter().flat_map(|action| &action.effects).any(|e| e.when.is_some());
    let facts: Vec<GroundFact> = (0..task.variables.len() as u32)
        .flat_map(|variable| {
            (0..task.variables[variable as usize].domain_size())
                .map(move |value| GroundFact { variable, value })
        })
        .collect();
    if conditional || !task.axioms.is_empty() || facts.len() > MOST_FACTS {
        return Vec::new();
    }
    Pairs::reached(task, &facts).map_or_else(Vec::new, |pairs| pairs.groups(&facts))
}

/// Bit matrix over facts: two facts that may hold together (h²). The bit of a fact with itself says
/// that it is reachable.
struct Pairs {
    words: usize,
    rows: Vec<u64>,
}

impl Pairs {
    fn reached(task: &GroundTask, facts: &[GroundFact]) -> Option<Pairs> {
        let words = facts.len().div_ceil(64);
        let mut pairs = Pairs { words, rows: vec![0; words * facts.len()] };
        let mut offsets = Vec::with_capacity(task.variables.len() + 1);
        let mut next = 0;
        for variable in &task.variables {
            offsets.push(next);
            next += variable.domain_size() as usize;
        }
        offsets.push(next);
        let initial: Vec<usize> =
            offsets.iter().zip(&task.initial.values).map(|(o, &v)| o + v as usize).collect();
        for &one in &initial {
            initial.iter().for_each(|&other| pairs.set(one, other));
        }
        let mut work = 0;
        loop {
            let mut changed = false;
            for action in &task.actions {
                work += words * (action.condition.facts.len() + action.effects.len());
                changed |= pairs.apply(action, &offsets);
            }
            if !changed {
                return Some(pairs);
            }
            if work > MOST_WORK {
                return None;
            }
        }
    }

    fn row(&self, fact: usize) -> &[u64] {
        &self.rows[fact * self.words..(fact + 1) * self.words]
    }

    fn set(&mut self, one: usize, other: usize) {
        self.rows[one * self.words + other / 64] |= 1 << (other % 64);
    }

    fn may(&self, one: usize, other: usize) -> bool {
        self.row(one)[other / 64] >> (other % 64) & 1 == 1
    }

    /// Adds the pairs that an action makes reachable; true if there are new ones.
    fn apply(&mut self, action: &GroundAction, offsets: &[usize]) -> bool {
        let id = |fact: GroundFact| offsets[fact.variable as usize] + fact.value as usize;
        let needs: Vec<usize> = action.condition.facts.iter().map(|&fact| id(fact)).collect();
        if needs.iter().any(|&one| needs.iter().any(|&other| !self.may(one, other))) {
            return false;
        }
        // What may hold beside: all that goes with what is needed, but for the variables that change.
        let mut beside = vec![0u64; self.words];
        match needs.split_first() {
            Some((&first, rest)) => {
                beside.copy_from_slice(self.row(first));
                for &fact in rest {
                    beside.iter_mut().zip(self.row(fact)).for_each(|(word, other)| *word &= other);
                }
            }
            None => {
                let reached = (0..self.rows.len() / self.words.max(1)).filter(|&fact| self.may(fact, fact));
                reached.for_each(|fact| beside[fact / 64] |= 1 << (fact % 64));
            }
        }
        let set = action.effects.iter().filter_map(|effect| match effect.outcome {
            GroundOutcome::Set(fact) => Some(fact),
            _ => None,
        });
        let set: Vec<GroundFact> = set.collect();
        for fact in &set {
            let variable = fact.variable as usize;
            (offsets[variable]..offsets[variable + 1])
                .for_each(|other| beside[other / 64] &= !(1 << (other % 64)));
        }
        set.iter().for_each(|&fact| beside[id(fact) / 64] |= 1 << (id(fact) % 64));
        let mut changed = false;
        for fact in set.into_iter().map(id) {
            for (word, &beside) in beside.iter().enumerate() {
                let mut new = beside & !self.row(fact)[word];
                changed |= new != 0;
                self.rows[fact * self.words + word] |= new;
                while new != 0 {
                    self.set(64 * word + new.trailing_zeros() as usize, fact);
                    new &= new - 1;
                }
            }
        }
        changed
    }

    /// Mutex groups, grown greedily, that cover the mutually exclusive pairs of reachable facts of
    /// different variables.
    fn groups(&self, facts: &[GroundFact]) -> Vec<Vec<GroundFact>> {
        let reached: Vec<usize> = (0..facts.len()).filter(|&fact| self.may(fact, fact)).collect();
        let mut all = vec![0; self.words];
        reached.iter().for_each(|&fact| all[fact / 64] |= 1 << (fact % 64));
        let mut covered = Pairs { words: self.words, rows: vec![0; self.rows.len()] };
        let (mut groups, mut members) = (Vec::new(), 0);
        for (place, &one) in reached.iter().enumerate() {
            for &other in &reached[place + 1..] {
                let same = facts[one].variable == facts[other].variable;
                if same || self.may(one, other) || covered.may(one, other) {
                    continue;
                }
                let group = self.enlarged(&[one, other], &all);
                group.iter().for_each(|&a| group.iter().for_each(|&b| covered.set(a, b)));
                members += group.len();
                if members > MOST_MEMBERS {
                    return groups;
                }
                groups.push(group.into_iter().map(|fact| facts[fact]).collect());
            }
        }
        groups
    }

    /// Extends a set of facts by facts of `all` that are mutex with all its members, in index
    /// order.
    fn enlarged(&self, facts: &[usize], all: &[u64]) -> Vec<usize> {
        let mut open = all.to_vec();
        let without = |open: &mut Vec<u64>, fact: usize| {
            open.iter_mut().zip(self.row(fact)).for_each(|(word, beside)| *word &= !beside);
        };
        facts.iter().for_each(|&fact| without(&mut open, fact));
        let mut group = facts.to_vec();
        while let Some(word) = open.iter().position(|&word| word != 0) {
            let fact = 64 * word + open[word].trailing_zeros() as usize;
            without(&mut open, fact);
            group.push(fact);
        }
        group
    }
}
