//! Tests of `clauses::solver`.

use descry_planner::clauses::Literal;
use descry_planner::clauses::solver::*;

struct Nothing;
impl Decide for Nothing {
    fn next(&mut self, _: &Solver, _: &mut Vec<Literal>) -> u64 {
        0
    }
}

/// Clauses in numbers: variables from 1, negative for negated ones.
fn check(variables: usize, clauses: &[Vec<i32>], satisfiable: bool) {
    let mut solver = Solver::new(variables);
    let literal = |l: i32| Literal::new(l.unsigned_abs() - 1, l > 0);
    for clause in clauses {
        solver.add(&clause.iter().map(|&l| literal(l)).collect::<Vec<_>>());
    }
    let answer = loop {
        // In small pieces: going on must make no difference.
        let more = solver.work + 1_000;
        match solver.run(&mut Nothing, more, &|| false) {
            Satisfiability::Interrupted => {}
            answer => break answer,
        }
    };
    assert_eq!(answer == Satisfiability::Satisfied, satisfiable, "{clauses:?}");
    if satisfiable {
        let holds = |c: &Vec<i32>| c.iter().any(|&l| solver.value(literal(l)) == Some(true));
        assert!(clauses.iter().all(holds), "{clauses:?}");
    }
}

/// Every pigeon in a hole, no two in the same.
fn pigeons(pigeons: i32, holes: i32) -> Vec<Vec<i32>> {
    let at = |p: i32, h: i32| p * holes + h + 1;
    let mut clauses: Vec<Vec<i32>> = (0..pigeons).map(|p| (0..holes).map(|h| at(p, h)).collect()).collect();
    for h in 0..holes {
        for p in 0..pigeons {
            clauses.extend((0..p).map(|q| vec![-at(p, h), -at(q, h)]));
        }
    }
    clauses
}

#[test]
fn clauses_are_satisfied_or_proven_not_to_be() {
    check(1, &[], true);
    check(1, &[vec![1], vec![-1]], false);
    check(2, &[vec![1, 2], vec![-1, 2], vec![1, -2]], true);
    check(2, &[vec![1, 2], vec![-1, 2], vec![1, -2], vec![-1, -2]], false);
    check(20, &pigeons(5, 4), false);
    check(20, &pigeons(4, 5), true);
    check(56, &pigeons(8, 7), false);
}

#[test]
fn as_trying_all_values_says() {
    let mut seed = 7u64;
    let mut random = move |below: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) % below
    };
    for round in 0..300 {
        let clauses: Vec<Vec<i32>> = (0..30 + round % 20)
            .map(|_| {
                let mut clause: Vec<i32> = Vec::new();
                while clause.len() < 3 {
                    let variable = random(9) as i32 + 1;
                    if !clause.iter().any(|l| l.abs() == variable) {
                        clause.push(if random(2) == 0 { variable } else { -variable });
                    }
                }
                clause
            })
            .collect();
        let holds = |values: i32, l: i32| (values >> (l.abs() - 1) & 1 == 1) == (l > 0);
        let satisfiable =
            (0..1 << 9).any(|values| clauses.iter().all(|c| c.iter().any(|&l| holds(values, l))));
        check(9, &clauses, satisfiable);
    }
}

/// Counts how often it is asked.
struct Asked(u32);
impl Decide for Asked {
    fn next(&mut self, _: &Solver, _: &mut Vec<Literal>) -> u64 {
        self.0 += 1;
        0
    }
}

#[test]
fn what_is_left_open_is_set_in_one_go() {
    let (mut solver, mut asked) = (Solver::new(1_000), Asked(0));
    solver.add(&[Literal::new(3, true), Literal::new(7, true)]);
    assert_eq!(solver.run(&mut asked, u64::MAX, &|| false), Satisfiability::Satisfied);
    assert_eq!(asked.0, 2, "once more at the end");
}

#[test]
fn runs_between_restarts_grow_slowly() {
    let found: Vec<u64> = (1..=15).map(luby).collect();
    assert_eq!(found, [1, 1, 2, 1, 1, 2, 4, 1, 1, 2, 1, 1, 2, 4, 8]);
}
