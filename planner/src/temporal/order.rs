//! Partial order behind a sequence of happenings (simple temporal network), and its earliest schedule.
//!
//! A happening reads and writes resources: variables and numbers. Two happenings that interfere keep
//! the order of the sequence, [`EPSILON_S`] apart; all others are unordered. A happening that begins or
//! ends the truth of an action's over-all condition also keeps its order towards the action's start and
//! end, but may be simultaneous with them. Durations and timed literals give upper bounds on distances.
//! The earliest solution of the network is updated by propagation.

use crate::plan::EPSILON_S;

use super::world::DurationRange;

/// Shift of a time, in seconds, below which it counts as rounding.
const ROUNDING_S: f64 = 1e-9;

/// Resources that one happening accesses, by index: variables, then numbers.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// Resources whose value is read; they must not be written at the same time.
    pub reads: Vec<u32>,
    /// Resources of over-all conditions: they must keep their value right after the happening (a start)
    /// or right before it (an end), but may be written at the same time.
    pub holds: Vec<u32>,
    /// Resources that get a new value.
    pub writes: Vec<u32>,
    /// Numbers that are increased or decreased; such changes commute with one another.
    pub adds: Vec<u32>,
}

#[derive(Debug, Clone, Default)]
struct Resource {
    writer: Option<u32>,
    readers: Vec<u32>,
    adders: Vec<u32>,
    holders: Vec<u32>,
}

/// Start and end of an action, with the allowed distance between them.
#[derive(Debug, Clone, Copy)]
struct Tie {
    start: u32,
    end: u32,
    span: DurationRange,
}

/// Network of the happenings in a sequence, with their earliest times.
#[derive(Debug, Clone)]
pub struct Order {
    earliest_s: Vec<f64>,
    /// Happenings that each happening follows, with the minimum distance in seconds.
    after: Vec<Vec<(u32, f64)>>,
    fixed: Vec<(u32, f64)>,
    ties: Vec<Tie>,
    resources: Vec<Resource>,
}

/// Error: the times cannot meet all durations and timed literals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inconsistent;

impl Order {
    /// Network without happenings, over a number of resources.
    pub fn new(resources: usize) -> Order {
        Order {
            earliest_s: Vec::new(),
            after: Vec::new(),
            fixed: Vec::new(),
            ties: Vec::new(),
            resources: vec![Resource::default(); resources],
        }
    }

    /// Earliest time of a happening, in seconds.
    pub fn earliest_s(&self, happening: u32) -> f64 {
        self.earliest_s[happening as usize]
    }

    /// Number of happenings.
    pub fn len(&self) -> usize {
        self.earliest_s.len()
    }

    /// For each resource, the greatest `value` among the happenings of its last write, and of the
    /// reads, additions and holds since then, in this order; -1 for none.
    pub fn touched(&self, value: impl Fn(u32) -> f64) -> impl Iterator<Item = [f64; 4]> {
        let latest =
            move |nodes: &[u32]| nodes.iter().fold(NEVER, |latest: f64, &node| latest.max(value(node)));
        self.resources.iter().map(move |resource| {
            let Resource { writer, readers, adders, holders } = resource;
            [latest(writer.as_slice()), latest(readers), latest(adders), latest(holders)]
        })
    }

    /// Minimum delay of each happening from `first` on after the happening `start`, in seconds; minus
    /// infinity if the happening may come before `start`.
    pub fn after_s(&self, start: u32, first: usize) -> Vec<f64> {
        let mut after_s = vec![f64::NEG_INFINITY; self.len() - first];
        after_s[start as usize - first] = 0.0;
        let inner = |node: u32| (node as usize).checked_sub(first);
        for _ in 0..self.ties.len() + 2 {
            let mut raised = false;
            let mut raise = |after_s: &mut Vec<f64>, node: u32, from: u32, gap_s: f64| {
                if let (Some(node), Some(from)) = (inner(node), inner(from))
                    && after_s[from] + gap_s > after_s[node] + ROUNDING_S
                {
                    after_s[node] = after_s[from] + gap_s;
                    raised = true;
                }
            };
            for node in first..self.len() {
                for &(other, gap_s) in &self.after[node] {
                    raise(&mut after_s, node as u32, other, gap_s);
                }
            }
            for tie in &self.ties {
                raise(&mut after_s, tie.end, tie.start, tie.span.least_s);
                raise(&mut after_s, tie.start, tie.end, -tie.span.most_s);
            }
            if !raised {
                break;
            }
        }
        after_s
    }

    /// Latest time, in seconds, of a happening after which others must follow with the delays `after_s`
    /// (from happening `first` on), given the times of timed literals; infinite if there are none.
    pub fn latest_s(&self, after_s: &[f64], first: usize) -> f64 {
        let bound =
            |&(node, time_s): &(u32, f64)| Some(time_s - after_s[(node as usize).checked_sub(first)?]);
        self.fixed.iter().filter_map(bound).fold(f64::INFINITY, f64::min)
    }

    /// Calls `tell` for every distance of the network: from a happening, to a happening (`None` for the
    /// beginning of the plan), and the minimum distance in seconds.
    pub fn distances(&self, mut tell: impl FnMut(Option<u32>, Option<u32>, f64)) {
        for (node, after) in self.after.iter().enumerate() {
            after.iter().for_each(|&(other, gap_s)| tell(Some(other), Some(node as u32), gap_s));
        }
        for tie in &self.ties {
            tell(Some(tie.start), Some(tie.end), tie.span.least_s);
            if tie.span.most_s.is_finite() {
                tell(Some(tie.end), Some(tie.start), -tie.span.most_s);
            }
        }
        for &(node, time_s) in &self.fixed {
            tell(None, Some(node), time_s);
            tell(Some(node), None, -time_s);
        }
    }

    /// True if a happening is a timed literal.
    pub fn is_given(&self, happening: usize) -> bool {
        self.fixed.iter().any(|&(node, _)| node as usize == happening)
    }

    /// Time of the last happening that is no timed literal, in seconds.
    pub fn makespan_s(&self) -> f64 {
        let own = self.earliest_s.iter().enumerate().filter(|&(index, _)| !self.is_given(index));
        own.fold(0.0, |latest, (_, &time_s)| latest.max(time_s))
    }

    /// Time of the last write or addition of each resource, in seconds; 0 for none.
    pub fn ready_s(&self) -> Vec<f64> {
        let last = |resource: &Resource| {
            let done = resource.writer.iter().chain(&resource.adders);
            done.fold(0.0, |last_s: f64, &node| last_s.max(self.earliest_s(node)))
        };
        self.resources.iter().map(last).collect()
    }

    /// Appends an instantaneous step, or the start of an action; returns its happening.
    pub fn push(&mut self, access: &Access) -> u32 {
        let node = self.earliest_s.len() as u32;
        let mut after: Vec<(u32, f64)> = Vec::new();
        let mut follow =
            |others: &[u32], gap_s: f64| after.extend(others.iter().map(|&other| (other, gap_s)));
        let resource = |&resource: &u32| &self.resources[resource as usize];
        let strict = access.reads.iter().chain(&access.adds).chain(&access.writes).map(resource);
        for resource in strict.filter(|resource| resource.readers.is_empty() && resource.adders.is_empty()) {
            follow(resource.writer.as_slice(), EPSILON_S);
        }
        for resource in access.reads.iter().map(resource) {
            follow(resource.writer.as_slice(), EPSILON_S);
            follow(&resource.adders, EPSILON_S);
        }
        for resource in access.holds.iter().map(resource) {
            follow(resource.writer.as_slice(), 0.0);
            follow(&resource.adders, 0.0);
        }
        for resource in access.adds.iter().map(resource) {
            follow(resource.writer.as_slice(), EPSILON_S);
            follow(&resource.readers, EPSILON_S);
            follow(&resource.holders, 0.0);
        }
        for resource in access.writes.iter().map(resource) {
            follow(&resource.readers, EPSILON_S);
            follow(&resource.adders, EPSILON_S);
            follow(&resource.holders, 0.0);
        }
        after.sort_unstable_by(|one, other| one.0.cmp(&other.0).then(other.1.total_cmp(&one.1)));
        after.dedup_by_key(|&mut (other, _)| other);
        let time_s =
            after.iter().fold(0.0, |time_s: f64, &(other, gap_s)| time_s.max(self.earliest_s(other) + gap_s));
        self.earliest_s.push(time_s);
        self.after.push(after);
        self.record(node, access);
        node
    }

    /// Appends the end of the action that begins with the happening `start`; returns its happening.
    pub fn push_end(
        &mut self,
        start: u32,
        access: &Access,
        span: DurationRange,
    ) -> Result<u32, Inconsistent> {
        let end = self.push(access);
        // An action without duration ends when it starts.
        let own = self.after[end as usize].iter_mut().filter(|(other, _)| *other == start);
        own.for_each(|(_, gap_s)| *gap_s = gap_s.min(span.most_s));
        let tie = Tie { start, end, span };
        self.ties.push(tie);
        let end_s = self.earliest_s(end).max(self.earliest_s(start) + span.least_s);
        self.earliest_s[end as usize] = end_s;
        let start_s = end_s - span.most_s;
        if start_s > self.earliest_s(start) + ROUNDING_S {
            self.earliest_s[start as usize] = start_s;
            if end != start + 1 {
                self.propagate()?;
            }
        }
        Ok(end)
    }

    /// Appends a timed literal at a time in seconds; returns its happening.
    pub fn push_fixed(&mut self, access: &Access, time_s: f64) -> Result<u32, Inconsistent> {
        let node = self.push(access);
        self.fixed.push((node, time_s));
        if self.earliest_s(node) > time_s + ROUNDING_S {
            return Err(Inconsistent);
        }
        self.earliest_s[node as usize] = time_s;
        Ok(node)
    }

    /// Makes the second happening of each pair follow the first, [`EPSILON_S`] apart; the second is the
    /// later one in the sequence.
    pub fn separate(&mut self, pairs: &[(u32, u32)]) -> Result<(), Inconsistent> {
        pairs.iter().for_each(|&(first, second)| self.after[second as usize].push((first, EPSILON_S)));
        self.propagate()
    }

    fn record(&mut self, node: u32, access: &Access) {
        for &resource in &access.reads {
            self.resources[resource as usize].readers.push(node);
        }
        for &resource in &access.adds {
            self.resources[resource as usize].adders.push(node);
        }
        for &resource in &access.holds {
            self.resources[resource as usize].holders.push(node);
        }
        for &resource in &access.writes {
            self.resources[resource as usize] = Resource { writer: Some(node), ..Resource::default() };
        }
    }

    /// Raises earliest times until every distance holds (Bellman-Ford). Most edges follow the sequence,
    /// so one pass settles everything except the effects of upper bounds.
    fn propagate(&mut self) -> Result<(), Inconsistent> {
        for _ in 0..self.ties.len() + 2 {
            let mut pushed = false;
            let mut tie_of: Vec<Option<usize>> = vec![None; self.earliest_s.len()];
            for (index, tie) in self.ties.iter().enumerate() {
                tie_of[tie.end as usize] = Some(index);
            }
            for (node, tie) in tie_of.iter().enumerate() {
                let mut time_s = self.earliest_s[node];
                for &(other, gap_s) in &self.after[node] {
                    time_s = time_s.max(self.earliest_s(other) + gap_s);
                }
                if let Some(tie) = tie.map(|index| self.ties[index]) {
                    time_s = time_s.max(self.earliest_s(tie.start) + tie.span.least_s);
                }
                self.earliest_s[node] = time_s;
            }
            if self.fixed.iter().any(|&(node, time_s)| self.earliest_s(node) > time_s + ROUNDING_S) {
                return Err(Inconsistent);
            }
            for tie in &self.ties {
                let start_s = self.earliest_s[tie.end as usize] - tie.span.most_s;
                if start_s > self.earliest_s[tie.start as usize] + ROUNDING_S {
                    self.earliest_s[tie.start as usize] = start_s;
                    pushed = true;
                }
            }
            if !pushed {
                return Ok(());
            }
        }
        Err(Inconsistent)
    }
}

/// Earliest schedule of consecutive compressed actions, stored as four times per resource; equal to
/// that of [`Order`] as long as no upper bound shifts earlier happenings.
#[derive(Debug, Clone)]
pub struct Clock {
    /// Times, in seconds, of each resource's last write, and of the last read, addition and hold since;
    /// negative for none.
    last_s: Vec<[f64; 4]>,
    latest_s: f64,
}

const NEVER: f64 = -1.0;

impl Clock {
    /// Schedule without actions.
    pub fn new(resources: usize) -> Clock {
        Clock { last_s: vec![[NEVER; 4]; resources], latest_s: 0.0 }
    }

    /// End of the last action, in seconds.
    pub fn makespan_s(&self) -> f64 {
        self.latest_s
    }

    /// Time of the last write or addition of each resource, in seconds; 0 for none.
    pub fn ready_s(&self) -> Vec<f64> {
        self.last_s.iter().map(|&[write_s, _, add_s, _]| write_s.max(add_s).max(0.0)).collect()
    }

    /// Appends an action at its earliest time: its start, and its end if durative.
    pub fn push(&mut self, start: &Access, end: Option<(&Access, DurationRange)>) {
        let mut start_s = self.after(start);
        let Some((end, span)) = end else {
            self.record(start, start_s);
            return;
        };
        let end_s = self.after(end).max(start_s + span.least_s);
        start_s = start_s.max(end_s - span.most_s);
        self.record(start, start_s);
        self.record(end, end_s);
    }

    fn after(&self, access: &Access) -> f64 {
        let mut after_s: f64 = 0.0;
        let mut follow = |times_s: &[f64], gap_s: f64| {
            let last_s = times_s.iter().fold(NEVER, |last_s, &time_s| last_s.max(time_s));
            if last_s >= 0.0 {
                after_s = after_s.max(last_s + gap_s);
            }
        };
        let last = |resource: &u32| self.last_s[*resource as usize];
        for [write_s, _, add_s, _] in access.reads.iter().map(last) {
            follow(&[write_s, add_s], EPSILON_S);
        }
        for [write_s, _, add_s, _] in access.holds.iter().map(last) {
            follow(&[write_s, add_s], 0.0);
        }
        for [write_s, read_s, _, hold_s] in access.adds.iter().map(last) {
            follow(&[write_s, read_s], EPSILON_S);
            follow(&[hold_s], 0.0);
        }
        for [write_s, read_s, add_s, hold_s] in access.writes.iter().map(last) {
            follow(&[write_s, read_s, add_s], EPSILON_S);
            follow(&[hold_s], 0.0);
        }
        after_s
    }

    fn record(&mut self, access: &Access, time_s: f64) {
        self.latest_s = self.latest_s.max(time_s);
        for (list, kind) in [(&access.reads, 1), (&access.adds, 2), (&access.holds, 3)] {
            for &resource in list {
                let last_s = &mut self.last_s[resource as usize][kind];
                *last_s = last_s.max(time_s);
            }
        }
        for &resource in &access.writes {
            self.last_s[resource as usize] = [time_s, NEVER, NEVER, NEVER];
        }
    }
}
