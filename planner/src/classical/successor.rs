//! Successor generator: a decision tree that finds the applicable operators of a state (Helmert 2006,
//! section 5.3.1), stored in one flat array.

use super::compiled::Compiled;

/// Index that stands for a missing node.
const EMPTY: u32 = u32::MAX;

/// Decision tree over variables. A node either lists operators and names the node to continue with, or
/// branches on the value of a variable.
pub struct Successors {
    /// Nodes one after the other. Branch: `[variable, node for any value, child of each value…]`; list
    /// of operators: `[LEAF, node to continue with, count, operators…]`.
    nodes: Vec<u32>,
    root: u32,
}

/// First word of a node that lists operators.
const LEAF: u32 = u32::MAX - 1;

impl Successors {
    /// Builds the tree from the operators' preconditions.
    pub fn new(task: &Compiled) -> Successors {
        let mut operators: Vec<u32> = (0..task.operators() as u32).collect();
        let key = |op: u32| task.preconditions.get(op as usize).iter().map(|f| (f.variable, f.value));
        operators.sort_by(|&a, &b| key(a).cmp(key(b)).then(a.cmp(&b)));
        let mut successors = Successors { nodes: Vec::new(), root: EMPTY };
        successors.root = successors.build(task, &operators, 0);
        successors
    }

    fn build(&mut self, task: &Compiled, operators: &[u32], depth: usize) -> u32 {
        if operators.is_empty() {
            return EMPTY;
        }
        let precondition = |op: u32| task.preconditions.get(op as usize).get(depth);
        let ended = operators.iter().take_while(|&&op| precondition(op).is_none()).count();
        if ended > 0 {
            let leaf = self.nodes.len() as u32;
            self.nodes.extend([LEAF, EMPTY, ended as u32]);
            self.nodes.extend_from_slice(&operators[..ended]);
            let rest = self.build(task, &operators[ended..], depth);
            self.nodes[leaf as usize + 1] = rest;
            return leaf;
        }
        let Some(first) = precondition(operators[0]) else { return EMPTY };
        let variable = first.variable;
        let here = operators
            .iter()
            .take_while(|&&op| precondition(op).is_some_and(|f| f.variable == variable))
            .count();
        let size = task.domains[variable as usize] as usize;
        let node = self.nodes.len();
        self.nodes.extend([variable, EMPTY]);
        self.nodes.resize(node + 2 + size, EMPTY);
        let mut from = 0;
        while from < here {
            let Some(value) = precondition(operators[from]).map(|f| f.value) else { break };
            let same = operators[from..here]
                .iter()
                .take_while(|&&op| precondition(op).is_some_and(|f| f.value == value))
                .count();
            let child = self.build(task, &operators[from..from + same], depth + 1);
            self.nodes[node + 2 + value as usize] = child;
            from += same;
        }
        let rest = self.build(task, &operators[here..], depth);
        self.nodes[node + 1] = rest;
        node as u32
    }

    /// Appends the operators that are applicable in a state.
    pub(crate) fn applicable(&self, task: &Compiled, state: &[u32], out: &mut Vec<u32>) {
        self.collect(self.root, state, out);
        if task.some_impossible() {
            out.retain(|&operator| task.possible(operator, state));
        }
    }

    fn collect(&self, mut node: u32, state: &[u32], out: &mut Vec<u32>) {
        while node != EMPTY {
            let at = node as usize;
            if self.nodes[at] == LEAF {
                let count = self.nodes[at + 2] as usize;
                out.extend_from_slice(&self.nodes[at + 3..at + 3 + count]);
            } else {
                let value = state[self.nodes[at] as usize] as usize;
                let child = self.nodes[at + 2 + value];
                if child != EMPTY {
                    self.collect(child, state, out);
                }
            }
            node = self.nodes[at + 1];
        }
    }
}
