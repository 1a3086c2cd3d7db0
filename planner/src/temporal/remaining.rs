//! Lower bounds from propositions to the goal. A proposition that comes too late to improve on the
//! goal's present label need not be followed further.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::grouped::Grouped;

use super::estimate::Key;
use super::relaxed::Relaxed;

impl Relaxed {
    /// Lower bound on the distance from each proposition to the last goal, in seconds (`timed`) or in summed
    /// costs; infinite for propositions that lead to no goal.
    ///
    /// Durations that depend on the state count as zero, and so do all other preconditions of an operator.
    pub(super) fn remaining(&self, timed: bool) -> Vec<f64> {
        let mut remaining = vec![f64::INFINITY; self.needed_by.keys()];
        let givers = self.operators.iter().zip(0u32..).flat_map(|(operator, index)| {
            operator.gives.iter().chain(&operator.moves).map(move |&given| (given, index))
        });
        let givers = Grouped::new(remaining.len(), givers);
        let mut queue = BinaryHeap::new();
        let closed = self.tokens.values().map(|&(_, closed)| closed);
        for goal in self.goal.iter().copied().chain(closed) {
            remaining[goal as usize] = 0.0;
            queue.push(Reverse((Key(0.0), goal)));
        }
        while let Some(Reverse((Key(left), proposition))) = queue.pop() {
            if left > remaining[proposition as usize] {
                continue;
            }
            for &giver in givers.of(proposition) {
                let left = left + self.hot[giver as usize].least(timed);
                for &need in &self.operators[giver as usize].needs {
                    if left < remaining[need as usize] {
                        remaining[need as usize] = left;
                        queue.push(Reverse((Key(left), need)));
                    }
                }
            }
        }
        remaining
    }
}
