//! Order of operators within a step, in which few operators delete preconditions of later ones.

use crate::classical::compiled::Compiled;

/// Use of a fact by an operator in a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Use {
    pub fact: u32,
    pub needs: bool,
    /// True if the operator deletes the fact and can share a step with other operators that need it.
    pub takes: bool,
}

/// Facts that each operator needs, or deletes while other operators may need them.
pub(super) fn uses(task: &Compiled) -> Vec<Vec<Use>> {
    let used = |operator: usize| {
        let needs = task.preconditions.get(operator);
        let mut uses: Vec<Use> =
            needs.iter().map(|&f| Use { fact: task.id(f), needs: true, takes: false }).collect();
        for effect in task.effects.get(operator) {
            let (variable, value) = (effect.fact.variable, effect.fact.value);
            match needs.iter().position(|f| f.variable == variable) {
                Some(place) => uses[place].takes |= needs[place].value != value,
                None => {
                    let offset = task.offsets[variable as usize];
                    let others = (0..task.domains[variable as usize]).filter(|&other| other != value);
                    uses.extend(others.map(|v| Use { fact: offset + v, needs: false, takes: true }));
                }
            }
        }
        uses
    };
    (0..task.operators()).map(used).collect()
}

/// Operators in order, each with the index of its strong component in the disabling graph (Rintanen,
/// Heljanko and Niemelä 2006). An operator disables no later operator of another component.
pub(super) fn order(task: &Compiled, uses: &[Vec<Use>]) -> Vec<(u32, u32)> {
    // Nodes: operators, then facts. From an operator to what it takes, from a fact to who needs it.
    let operators = uses.len();
    let mut edges: Vec<Vec<u32>> = vec![Vec::new(); operators + task.facts];
    for (operator, list) in uses.iter().enumerate() {
        for used in list {
            let fact = operators + used.fact as usize;
            if used.takes {
                edges[operator].push(fact as u32);
            }
            if used.needs {
                edges[fact].push(operator as u32);
            }
        }
    }
    let circles = components(&edges);
    let mut order: Vec<(u32, u32)> = (0..operators as u32).map(|op| (op, circles[op as usize])).collect();
    order.sort_by_key(|&(operator, circle)| (circle, operator));
    order
}

/// Index of each node's strongly connected component (Tarjan 1972); a component that can be reached
/// from another one has the lower index.
pub fn components(edges: &[Vec<u32>]) -> Vec<u32> {
    const OPEN: u32 = u32::MAX;
    let mut found = vec![OPEN; edges.len()];
    let (mut index, mut low) = (vec![OPEN; edges.len()], vec![0u32; edges.len()]);
    let (mut next, mut count) = (0, 0);
    let mut stack = Vec::new();
    for root in 0..edges.len() {
        if index[root] != OPEN {
            continue;
        }
        let mut calls = vec![(root, 0usize)];
        while let Some((node, edge)) = calls.pop() {
            if edge == 0 {
                (index[node], low[node]) = (next, next);
                next += 1;
                stack.push(node);
            }
            if let Some(&to) = edges[node].get(edge) {
                let to = to as usize;
                calls.push((node, edge + 1));
                if index[to] == OPEN {
                    calls.push((to, 0));
                } else if found[to] == OPEN {
                    low[node] = low[node].min(index[to]);
                }
                continue;
            }
            if low[node] == index[node] {
                while let Some(member) = stack.pop() {
                    found[member] = count;
                    if member == node {
                        break;
                    }
                }
                count += 1;
            }
            if let Some(&(parent, _)) = calls.last() {
                low[parent] = low[parent].min(low[node]);
            }
        }
    }
    found
}
