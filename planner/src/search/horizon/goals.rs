//! Reasonable order of goals: a goal comes earlier if it cannot be achieved any more once another one
//! holds (Koehler and Hoffmann 2000, transitively closed).

use crate::classical::compiled::{Compiled, Lists};
use crate::ground::GroundFact;

/// Goal facts in a reasonable order.
pub(super) fn in_order(task: &Compiled, mutex_groups: &[Vec<GroundFact>], adders: &Lists<u32>) -> Vec<u32> {
    let goals: Vec<u32> = task.goal.iter().map(|&goal| task.id(goal)).collect();
    let excluded = excluded(task, mutex_groups, &goals);
    let clashes = |operator: u32| -> Vec<u32> {
        let needs = task.preconditions.get(operator as usize).iter().map(|&fact| task.id(fact));
        let effects = task.effects.get(operator as usize).iter().map(|effect| task.id(effect.fact));
        let facts: Vec<u32> = needs.chain(effects).collect();
        let clash = |&goal: &u32| facts.iter().any(|&fact| excluded[goal as usize][fact as usize]);
        (0..goals.len() as u32).filter(clash).collect()
    };
    let ways = |goal: &u32| adders.get(*goal as usize).iter().map(|&operator| clashes(operator)).collect();
    let ways: Vec<Vec<Vec<u32>>> = goals.iter().map(ways).collect();
    arranged(&ways).into_iter().map(|goal| goals[goal as usize]).collect()
}

/// True, by goal and fact, if the fact is mutex with the goal.
fn excluded(task: &Compiled, mutex_groups: &[Vec<GroundFact>], goals: &[u32]) -> Vec<Vec<bool>> {
    let with = |&goal: &u32| {
        let mut excluded = vec![false; task.facts];
        let variable = task.variables[goal as usize];
        let offset = task.offsets[variable as usize];
        (offset..offset + task.domains[variable as usize]).for_each(|fact| excluded[fact as usize] = true);
        for group in mutex_groups.iter().filter(|group| group.iter().any(|&fact| task.id(fact) == goal)) {
            group.iter().for_each(|&fact| excluded[task.id(fact) as usize] = true);
        }
        excluded[goal as usize] = false;
        excluded
    };
    goals.iter().map(with).collect()
}

/// Goals in a reasonable order. `ways` lists, for each goal, its achievers, each as the list of goals
/// with which that achiever conflicts.
pub fn arranged(ways: &[Vec<Vec<u32>>]) -> Vec<u32> {
    let goals = ways.len();
    // By goal: those that come before it, directly or not.
    let mut before = vec![vec![false; goals]; goals];
    let mut changed = true;
    while std::mem::take(&mut changed) {
        for goal in 0..goals {
            let open = |way: &&Vec<u32>| !way.iter().any(|&other| before[goal][other as usize]);
            let mut ways = ways[goal].iter().filter(open);
            let Some(first) = ways.next() else { continue };
            let rest: Vec<&Vec<u32>> = ways.collect();
            let all = |other: &&u32| rest.iter().all(|way| way.contains(other));
            for &later in first.iter().filter(all) {
                let later = later as usize;
                if later == goal || before[later][goal] || before[goal][later] {
                    continue;
                }
                changed = true;
                let earlier: Vec<usize> = (0..goals).filter(|&g| g == goal || before[goal][g]).collect();
                for after in (0..goals).filter(|&g| g == later || before[g][later]).collect::<Vec<_>>() {
                    earlier.iter().for_each(|&g| before[after][g] = true);
                }
            }
        }
    }
    let mut order: Vec<u32> = (0..goals as u32).collect();
    order.sort_by_key(|&goal| before[goal as usize].iter().filter(|&&earlier| earlier).count());
    order
}
