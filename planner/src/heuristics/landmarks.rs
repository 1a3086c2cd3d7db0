//! Landmarks (facts that every plan makes true at some time), their orderings, and the count of
//! landmarks still to achieve.
//!
//! They are found by backchaining from the goal (Hoffmann, Porteous and Sebastia 2004; Richter, Helmert
//! and Westphal 2008): a precondition shared by all operators that can achieve a landmark first is a
//! landmark too, ordered right before it.

use rustc_hash::FxHashMap;

use crate::classical::compiled::{Compiled, Lists};
use crate::ground::GroundFact;
use crate::memory::Rows;

/// Maximum number of facts of a disjunctive landmark.
const MOST_ALTERNATIVES: usize = 4;
/// Maximum number of landmarks.
const MOST_LANDMARKS: usize = 20_000;
/// Number of examined operators after which all achievers of a landmark count as possible first
/// achievers.
const EXPLORATION_WORK: usize = 40_000_000;

/// Landmark: a fact, or a disjunction of facts, that holds at some time in every plan.
#[derive(Clone, Debug)]
pub struct Landmark {
    pub facts: Vec<u32>,
    /// True if the landmark is a goal fact.
    pub goal: bool,
    /// Landmarks that must be achieved before this one (greedy-necessary and reasonable orders).
    before: Vec<u32>,
    /// Landmarks that need this one right before they are first achieved.
    enables: Vec<u32>,
    /// Facts that become true whenever this landmark is first achieved.
    beside: Vec<u32>,
}

/// All landmarks of a task that were found.
pub struct Landmarks {
    pub all: Vec<Landmark>,
    /// Landmarks that contain a fact, by fact.
    by_fact: Lists<u32>,
    /// Landmarks that are goal facts.
    goals: Vec<u32>,
    words: usize,
}

/// Working memory while landmarks are being found.
struct Find<'a> {
    task: &'a Compiled,
    /// Operators and axioms that achieve a fact, by fact; axioms are numbered after the operators.
    achievers: Lists<u32>,
    /// Operators and axioms that have a fact as precondition, by fact; axioms are numbered after the
    /// operators.
    needed_by: Lists<u32>,
    all: Vec<Landmark>,
    by_facts: FxHashMap<Vec<u32>, u32>,
    queue: Vec<u32>,
    /// First operator or axiom that reaches each fact in the delete relaxation; [`INITIAL`] or [`NEVER`].
    supporters: Vec<u32>,
    /// Number of unreachable or lost preconditions, by operator and axiom.
    lacking: Vec<u32>,
    /// Facts that are unreachable without the landmark under test, itself included.
    lost: Vec<u32>,
    is_lost: Vec<bool>,
    work: usize,
}

/// Supporter of a fact that holds initially.
const INITIAL: u32 = u32::MAX;
/// Supporter of a fact that is unreachable.
const NEVER: u32 = u32::MAX - 1;

impl Landmarks {
    /// Finds landmarks of a task; returns those found so far once `stop` returns true.
    pub fn new(
        task: &Compiled,
        mutex_groups: &[Vec<GroundFact>],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Landmarks {
        let mut find = Find::new(task);
        for &fact in &task.goal {
            let id = find.landmark(vec![task.id(fact)]);
            find.all[id as usize].goal = true;
        }
        let mut next = 0;
        while next < find.queue.len() && find.all.len() < MOST_LANDMARKS && !stop() {
            let id = find.queue[next];
            next += 1;
            find.backchain(id);
        }
        let mut all = find.all;
        order_reasonably(task, mutex_groups, &mut all);
        let pairs = (0..all.len()).flat_map(|l| all[l].facts.iter().map(move |&f| (f, l as u32)));
        let by_fact = Lists::group(task.facts, pairs);
        let goals = (0..all.len() as u32).filter(|&l| all[l as usize].goal).collect();
        Landmarks { words: all.len().div_ceil(64).max(1), by_fact, goals, all }
    }

    /// Number of landmarks.
    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }
}

impl<'a> Find<'a> {
    fn new(task: &'a Compiled) -> Self {
        let operators = task.operators() as u32;
        let effects = (0..operators)
            .flat_map(|op| task.effects.get(op as usize).iter().map(move |e| (task.id(e.fact), op)));
        let heads = task.axiom_heads.iter().enumerate().map(|(a, &h)| (task.id(h), operators + a as u32));
        let needs = (0..operators)
            .flat_map(|op| task.preconditions.get(op as usize).iter().map(move |&f| (task.id(f), op)));
        let bodies = (0..task.axiom_heads.len())
            .flat_map(|a| task.axiom_bodies.get(a).iter().map(move |&f| (task.id(f), operators + a as u32)));
        let missing = |facts: &[GroundFact]| facts.len() as u32;
        let mut find = Find {
            task,
            achievers: Lists::group(task.facts, effects.chain(heads)),
            needed_by: Lists::group(task.facts, needs.chain(bodies)),
            all: Vec::new(),
            by_facts: FxHashMap::default(),
            queue: Vec::new(),
            supporters: vec![NEVER; task.facts],
            lacking: Vec::with_capacity(task.operators() + task.axiom_heads.len()),
            lost: Vec::new(),
            is_lost: vec![false; task.facts],
            work: 0,
        };
        find.lacking.extend((0..task.operators()).map(|op| missing(task.preconditions.get(op))));
        find.lacking.extend((0..task.axiom_heads.len()).map(|a| missing(task.axiom_bodies.get(a))));
        find.explore();
        find
    }

    fn needs(&self, operator: u32) -> &'a [crate::ground::GroundFact] {
        let task = self.task;
        let operators = task.operators() as u32;
        if operator < operators {
            task.preconditions.get(operator as usize)
        } else {
            task.axiom_bodies.get((operator - operators) as usize)
        }
    }

    fn landmark(&mut self, facts: Vec<u32>) -> u32 {
        let next = self.all.len() as u32;
        let id = *self.by_facts.entry(facts.clone()).or_insert(next);
        if id == next {
            let (before, enables, beside) = (Vec::new(), Vec::new(), Vec::new());
            self.all.push(Landmark { facts, goal: false, before, enables, beside });
            self.queue.push(id);
        }
        id
    }

    /// Adds the preconditions shared by all first achievers of a landmark as landmarks ordered before
    /// it.
    fn backchain(&mut self, id: u32) {
        let task = self.task;
        let facts = self.all[id as usize].facts.clone();
        let compared = |f: u32| task.variables[f as usize] as usize >= task.numbers.first;
        if facts.iter().any(|&f| self.is_initial(f) || compared(f)) {
            return;
        }
        let is_explored = self.work < EXPLORATION_WORK;
        if is_explored {
            self.lose(&facts);
        }
        let possible = |op: u32| match is_explored {
            true => self.lacking[op as usize] == 0,
            false => self.needs(op).iter().all(|&f| !facts.contains(&task.id(f))),
        };
        let mut first: Vec<u32> = facts
            .iter()
            .flat_map(|&f| self.achievers.get(f as usize).iter().copied())
            .filter(|&op| possible(op))
            .collect();
        first.sort_unstable();
        first.dedup();
        if first.is_empty() {
            return;
        }
        self.work += first.len();
        if facts.len() == 1 {
            self.all[id as usize].beside = self.brought_about(&first);
        }
        for facts in self.shared(&first) {
            let before = self.landmark(facts);
            if before != id && !self.all[id as usize].before.contains(&before) {
                self.all[id as usize].before.push(before);
                self.all[before as usize].enables.push(id);
            }
        }
    }

    /// Facts that every one of the operators adds unconditionally.
    fn brought_about(&self, operators: &[u32]) -> Vec<u32> {
        let task = self.task;
        let effects = |op: u32| {
            let all = if (op as usize) < task.operators() { task.effects.get(op as usize) } else { &[] };
            all.iter().filter(|e| e.from == e.to).map(|e| task.id(e.fact))
        };
        let mut facts: Vec<u32> = operators.first().map_or_else(Vec::new, |&op| effects(op).collect());
        for &op in &operators[1..] {
            facts.retain(|&fact| effects(op).any(|other| other == fact));
            if facts.is_empty() {
                break;
            }
        }
        facts
    }

    /// Preconditions that all operators share, and small disjunctions of facts of one predicate such
    /// that each operator needs one of the facts.
    fn shared(&self, operators: &[u32]) -> Vec<Vec<u32>> {
        let task = self.task;
        let mut counts: FxHashMap<u32, u32> = FxHashMap::default();
        let mut symbols: FxHashMap<u32, (u32, u32, Vec<u32>)> = FxHashMap::default();
        for (index, &op) in operators.iter().enumerate() {
            for &fact in self.needs(op) {
                let fact = task.id(fact);
                *counts.entry(fact).or_default() += 1;
                let symbol = task.symbols[fact as usize];
                let entry = symbols.entry(symbol).or_insert((u32::MAX, 0, Vec::new()));
                if entry.0 != index as u32 {
                    entry.0 = index as u32;
                    entry.1 += 1;
                }
                if entry.2.len() <= MOST_ALTERNATIVES && !entry.2.contains(&fact) {
                    entry.2.push(fact);
                }
            }
        }
        let all = operators.len() as u32;
        let mut found: Vec<Vec<u32>> =
            counts.iter().filter(|&(_, &n)| n == all).map(|(&fact, _)| vec![fact]).collect();
        let single: Vec<u32> = found.iter().map(|f| f[0]).collect();
        for (&symbol, (_, count, facts)) in &symbols {
            let fits = *count == all && symbol != u32::MAX && (2..=MOST_ALTERNATIVES).contains(&facts.len());
            if fits && facts.iter().all(|f| !self.is_initial(*f) && !single.contains(f)) {
                let mut facts = facts.clone();
                facts.sort_unstable();
                found.push(facts);
            }
        }
        found.sort();
        found
    }

    /// True if a fact holds in the initial state.
    fn is_initial(&self, fact: u32) -> bool {
        let variable = self.task.variables[fact as usize] as usize;
        self.task.initial[variable] == fact - self.task.offsets[variable]
    }

    /// Facts that an operator adds, whatever the conditions of its effects, or the head of an axiom.
    fn adds(&self, operator: u32) -> impl Iterator<Item = u32> + use<'a> {
        let task = self.task;
        let axiom = (operator as usize).checked_sub(task.operators());
        let effects = if axiom.is_none() { task.effects.get(operator as usize) } else { &[] };
        let head = axiom.map(|axiom| task.id(task.axiom_heads[axiom]));
        effects.iter().map(|effect| task.id(effect.fact)).chain(head)
    }

    /// Explores the delete relaxation from the initial state.
    fn explore(&mut self) {
        let task = self.task;
        let initial = task.offsets.iter().zip(&task.initial).map(|(&offset, &value)| offset + value);
        let underived = (task.basic..task.domains.len()).map(|variable| task.offsets[variable] + 1);
        // What numbers can become is left open.
        let compared = (task.numbers.first..task.domains.len()).map(|variable| task.offsets[variable]);
        let mut queue: Vec<u32> = initial.chain(underived).chain(compared).collect();
        queue.sort_unstable();
        queue.dedup();
        queue.iter().for_each(|&fact| self.supporters[fact as usize] = INITIAL);
        for operator in 0..self.lacking.len() as u32 {
            if self.lacking[operator as usize] == 0 {
                self.support(operator, &mut queue);
            }
        }
        while let Some(fact) = queue.pop() {
            for index in 0..self.needed_by.get(fact as usize).len() {
                let operator = self.needed_by.get(fact as usize)[index];
                self.lacking[operator as usize] -= 1;
                if self.lacking[operator as usize] == 0 {
                    self.support(operator, &mut queue);
                }
            }
        }
    }

    /// Makes an applicable operator the supporter of the facts that it is the first to reach.
    fn support(&mut self, operator: u32, queue: &mut Vec<u32>) {
        for fact in self.adds(operator) {
            if self.supporters[fact as usize] == NEVER {
                self.supporters[fact as usize] = operator;
                queue.push(fact);
            }
        }
    }

    /// Finds the facts that the delete relaxation cannot reach if `without` never become true: all that
    /// depend on them by their supporters are lost, and those with another achiever come back
    /// (delete and rederive; Gupta, Mumick and Subrahmanian 1993).
    fn lose(&mut self, without: &[u32]) {
        for fact in std::mem::take(&mut self.lost) {
            self.regain(fact);
        }
        self.lost.extend(without.iter().filter(|&&fact| self.supporters[fact as usize] != NEVER));
        self.lost.iter().for_each(|&fact| self.is_lost[fact as usize] = true);
        let mut next = 0;
        while let Some(&fact) = self.lost.get(next) {
            next += 1;
            let needed_by = self.needed_by.get(fact as usize);
            self.work += needed_by.len() + 1;
            for &operator in needed_by {
                self.lacking[operator as usize] += 1;
                if self.lacking[operator as usize] > 1 {
                    continue;
                }
                for fact in self.adds(operator) {
                    let depends = self.supporters[fact as usize] == operator;
                    if depends && !std::mem::replace(&mut self.is_lost[fact as usize], true) {
                        self.lost.push(fact);
                    }
                }
            }
        }
        let mut found: Vec<u32> = Vec::new();
        for &fact in self.lost.iter().filter(|fact| !without.contains(fact)) {
            let achievers = self.achievers.get(fact as usize);
            self.work += achievers.len();
            if achievers.iter().any(|&operator| self.lacking[operator as usize] == 0) {
                found.push(fact);
            }
        }
        while let Some(fact) = found.pop() {
            if !self.is_lost[fact as usize] {
                continue;
            }
            for operator in self.regain(fact) {
                found.extend(self.adds(operator).filter(|fact| !without.contains(fact)));
            }
        }
        let is_lost = &self.is_lost;
        self.lost.retain(|&fact| is_lost[fact as usize]);
    }

    /// Makes a lost fact reachable again; returns the operators that this makes applicable.
    fn regain(&mut self, fact: u32) -> Vec<u32> {
        self.is_lost[fact as usize] = false;
        let needed_by = self.needed_by.get(fact as usize);
        self.work += needed_by.len();
        let lacking = &mut self.lacking;
        let applicable = needed_by.iter().copied().filter(|&operator| {
            lacking[operator as usize] -= 1;
            lacking[operator as usize] == 0
        });
        applicable.collect()
    }
}

/// Maximum number of search steps for cycles among orderings.
const ORDERING_WORK: usize = 5_000_000;

/// Adds reasonable orders: landmark A comes before landmark B if achieving A would delete B, and B is a
/// goal or needed together with A (Hoffmann et al. 2004; Richter and Westphal 2010, section 4.3). Orders
/// that would close a cycle are left out.
fn order_reasonably(task: &Compiled, mutex_groups: &[Vec<GroundFact>], all: &mut [Landmark]) {
    let exclusions = Exclusions::new(task, mutex_groups, all);
    let initial = |l: &Landmark| l.facts.iter().any(|&f| task.holds(f, &task.initial));
    let mut work = 0;
    let needed: Vec<Vec<u32>> = all.iter().map(|l| l.before.clone()).collect();
    for id in 0..all.len() {
        if all[id].facts.len() > 1 || initial(&all[id]) {
            continue;
        }
        // What is true when the landmark becomes true, or right before.
        let mut threats = vec![all[id].facts[0]];
        threats.extend(needed[id].iter().filter_map(|&b| match all[b as usize].facts[..] {
            [fact] => Some(fact),
            _ => None,
        }));
        threats.extend(&all[id].beside);
        let mut later = Vec::new();
        threats.iter().for_each(|&fact| exclusions.goals(task, fact, &mut later));
        for &together in all[id].enables.iter().flat_map(|&e| &needed[e as usize]) {
            work += threats.len();
            if let [other] = all[together as usize].facts[..]
                && threats.iter().any(|&threat| exclusions.exclude(task, threat, other))
            {
                later.push(together);
            }
        }
        later.sort_unstable();
        later.dedup();
        for other in later {
            let known = other as usize == id || all[other as usize].before.contains(&(id as u32));
            if !known && work < ORDERING_WORK && !precedes(all, other, id as u32, &mut work) {
                all[other as usize].before.push(id as u32);
            }
        }
    }
}

/// Mutexes between facts, for ordering landmarks.
struct Exclusions<'a> {
    mutex_groups: &'a [Vec<GroundFact>],
    /// Mutex groups that contain a fact, by fact.
    groups_of: Lists<u32>,
    /// Goal landmark of each fact; `u32::MAX` for facts that are no goals.
    goal_of_fact: Vec<u32>,
    /// Goal landmark on each variable; `u32::MAX` if no goal is on the variable.
    goal_of_variable: Vec<u32>,
}

impl<'a> Exclusions<'a> {
    fn new(task: &Compiled, mutex_groups: &'a [Vec<GroundFact>], all: &[Landmark]) -> Self {
        let members = mutex_groups
            .iter()
            .enumerate()
            .flat_map(|(g, facts)| facts.iter().map(move |&f| (task.id(f), g as u32)));
        let mut goal_of_fact = vec![u32::MAX; task.facts];
        let mut goal_of_variable = vec![u32::MAX; task.domains.len()];
        for (id, landmark) in all.iter().enumerate().filter(|(_, l)| l.goal) {
            let fact = landmark.facts[0] as usize;
            goal_of_fact[fact] = id as u32;
            goal_of_variable[task.variables[fact] as usize] = id as u32;
        }
        Exclusions {
            mutex_groups,
            groups_of: Lists::group(task.facts, members),
            goal_of_fact,
            goal_of_variable,
        }
    }

    /// Appends the goal landmarks that cannot hold together with a fact.
    fn goals(&self, task: &Compiled, fact: u32, out: &mut Vec<u32>) {
        let same = self.goal_of_variable[task.variables[fact as usize] as usize];
        out.extend((same != u32::MAX && self.goal_of_fact[fact as usize] != same).then_some(same));
        for &group in self.groups_of.get(fact as usize) {
            let others = self.mutex_groups[group as usize].iter().map(|&f| task.id(f)).filter(|&f| f != fact);
            out.extend(others.map(|f| self.goal_of_fact[f as usize]).filter(|&g| g != u32::MAX));
        }
    }

    /// True if two facts are known to be mutually exclusive.
    fn exclude(&self, task: &Compiled, one: u32, other: u32) -> bool {
        let groups = self.groups_of.get(other as usize);
        one != other
            && (task.variables[one as usize] == task.variables[other as usize]
                || self.groups_of.get(one as usize).iter().any(|g| groups.contains(g)))
    }
}

/// True if landmark `first` is ordered before landmark `second`, directly or transitively; adds the
/// work done to `work`.
fn precedes(all: &[Landmark], first: u32, second: u32, work: &mut usize) -> bool {
    let mut seen = vec![false; all.len()];
    let mut stack = vec![second];
    *work += all.len() / 8;
    while let Some(id) = stack.pop() {
        if id == first {
            return true;
        }
        *work += 1;
        if !std::mem::replace(&mut seen[id as usize], true) {
            stack.extend(&all[id as usize].before);
        }
    }
    false
}

/// Landmark status of each state: the landmarks accepted on all known paths to the state.
pub(crate) struct Status {
    accepted: Rows<u64>,
    scratch: Vec<u64>,
}

impl Status {
    /// Landmark status without any state.
    pub(crate) fn new(landmarks: &Landmarks) -> Status {
        Status { accepted: Rows::new(landmarks.words), scratch: vec![0; landmarks.words] }
    }

    /// Approximate memory of the landmark status, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.accepted.bytes()
    }

    fn of(&self, id: u32) -> &[u64] {
        self.accepted.row(id as usize)
    }

    fn has(bits: &[u64], landmark: u32) -> bool {
        bits[landmark as usize / 64] >> (landmark % 64) & 1 == 1
    }

    /// Records the landmarks that hold in the initial state, as the status of state 0.
    pub(crate) fn initial(&mut self, landmarks: &Landmarks, task: &Compiled, state: &[u32]) {
        self.scratch.fill(0);
        for (&offset, &value) in task.offsets.iter().zip(state) {
            for &l in landmarks.by_fact.get((offset + value) as usize) {
                self.scratch[l as usize / 64] |= 1 << (l % 64);
            }
        }
        self.accepted.push_row(&self.scratch);
    }

    /// Computes the status of a successor from that of its parent (`step` is parent and successor). A
    /// state reached on several paths keeps only the landmarks accepted on all of them.
    pub(crate) fn follow(
        &mut self,
        landmarks: &Landmarks,
        task: &Compiled,
        step: (u32, u32),
        state: &[u32],
        new: bool,
    ) {
        let (parent, id) = step;
        let parent = self.accepted.row(parent as usize);
        self.scratch.copy_from_slice(parent);
        for (word, &held) in parent.iter().enumerate() {
            let mut open = !held;
            while open != 0 {
                let l = word * 64 + open.trailing_zeros() as usize;
                open &= open - 1;
                let Some(landmark) = landmarks.all.get(l) else { break };
                if landmark.facts.iter().any(|&f| task.holds(f, state))
                    && landmark.before.iter().all(|&b| Self::has(parent, b))
                {
                    self.scratch[word] |= 1 << (l % 64);
                }
            }
        }
        if new {
            self.accepted.push_row(&self.scratch);
        } else {
            for (held, now) in self.accepted.row_mut(id as usize).iter_mut().zip(&self.scratch) {
                *held &= now;
            }
        }
    }

    /// Landmark count of a state: landmarks not yet accepted, or accepted, false and needed again.
    pub(crate) fn left(&self, landmarks: &Landmarks, task: &Compiled, id: u32, state: &[u32]) -> u32 {
        let bits = self.of(id);
        let seen: u32 = bits.iter().map(|w| w.count_ones()).sum();
        let mut left = landmarks.all.len() as u32 - seen;
        for (word, &bits_here) in bits.iter().enumerate() {
            let mut rest = bits_here;
            while rest != 0 {
                let l = (word * 64) as u32 + rest.trailing_zeros();
                rest &= rest - 1;
                let landmark = &landmarks.all[l as usize];
                let wanted = landmark.goal || landmark.enables.iter().any(|&e| !Self::has(bits, e));
                if wanted && !landmark.facts.iter().any(|&f| task.holds(f, state)) {
                    left += 1;
                }
            }
        }
        left
    }

    /// Number of goals that are false in a state, or true but not accepted, because other landmarks
    /// must come before.
    pub(crate) fn goals_left(&self, landmarks: &Landmarks, task: &Compiled, id: u32, state: &[u32]) -> u32 {
        let bits = self.of(id);
        let open = |&&goal: &&u32| {
            !Self::has(bits, goal) || !task.holds(landmarks.all[goal as usize].facts[0], state)
        };
        landmarks.goals.iter().filter(open).count() as u32
    }

    /// True if an operator has an effect that achieves a landmark not yet accepted, all of whose
    /// predecessors are.
    pub(crate) fn advances(&self, landmarks: &Landmarks, task: &Compiled, id: u32, operator: u32) -> bool {
        let bits = self.of(id);
        task.effects.get(operator as usize).iter().any(|effect| {
            landmarks.by_fact.get(task.id(effect.fact) as usize).iter().any(|&l| {
                !Self::has(bits, l) && landmarks.all[l as usize].before.iter().all(|&b| Self::has(bits, b))
            })
        })
    }
}
