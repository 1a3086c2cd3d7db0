//! Rules of relaxed reachability: one for each action or axiom, and further ones for conditional
//! effects and end effects.

use std::sync::Arc;

use petgraph::algo::tarjan_scc;
use petgraph::graph::DiGraph;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::task::{ObjectId, Task};

use super::normal::{
    Action_, Change_, Effect_, Formula, Named, Normal, Pattern, Rule_, Target, Term, module_writes,
};
use super::reach::{Head, Rule};

/// Maximum number of body atoms of a rule that a join matches; further ones are tested only if they
/// are static.
const LONGEST_BODY: usize = 60;
/// Maximum number of alternatives into which a condition's disjunctions are split.
const MOST_ALTERNATIVES: usize = 16;

/// Alternative body of a derived predicate: a conjunction over the rule's parameters and
/// existential variables.
pub(super) struct Alternative {
    /// Index of the rule in the normal form of the task.
    pub rule: usize,
    /// Slots of the parameters, then of the existential variables.
    pub slots: Vec<u32>,
    pub parts: Vec<Formula>,
}

/// Rules of actions and axioms. Instance lists of axiom alternatives follow those of actions.
pub(super) struct Rules {
    pub rules: Vec<Rule>,
    pub alternatives: Vec<Alternative>,
    /// True, by action, if the same instance may be found more than once.
    pub repeats: Vec<bool>,
    /// True, by predicate, if its atoms change. Includes the new predicates "this action was
    /// applied".
    pub fluent: Vec<bool>,
    /// True, by predicate, if the predicate is derived.
    derived: Vec<bool>,
}

/// True, by predicate, if its atoms change.
pub(super) fn fluent_predicates(task: &Task, normal: &Normal) -> Vec<bool> {
    let mut fluent = vec![false; normal.predicate_count];
    for action in &normal.actions {
        for effect in action.start_effects.iter().chain(&action.end_effects) {
            match &effect.change {
                Change_::Add(p) | Change_::Delete(p) | Change_::Unset(p) => {
                    fluent[p.predicate as usize] = true
                }
                Change_::Call(call) => {
                    for target in module_writes(task, call.index) {
                        if let Target::Truth(p) | Target::Object(p) = target {
                            fluent[p.predicate as usize] = true;
                        }
                    }
                }
                Change_::Number(..) => {}
            }
        }
    }
    for rule in &normal.rules {
        fluent[rule.head.predicate as usize] = true;
    }
    fluent
}

/// One alternative of a condition: existential variables and a conjunction.
#[derive(Clone, Default)]
struct Parts {
    slots: Vec<u32>,
    leaves: Vec<Formula>,
}

/// Splits a condition into alternatives: distributes disjunctions and lifts existential variables
/// out.
fn alternatives(formula: &Formula) -> Vec<Parts> {
    match formula {
        Formula::And(parts) => parts.iter().fold(vec![Parts::default()], |done, part| {
            let mut more = alternatives(part);
            if done.len() * more.len() > MOST_ALTERNATIVES {
                more = vec![Parts { slots: Vec::new(), leaves: vec![part.clone()] }];
            }
            done.iter()
                .flat_map(|left| {
                    more.iter().map(|right| Parts {
                        slots: [&left.slots[..], &right.slots[..]].concat(),
                        leaves: [&left.leaves[..], &right.leaves[..]].concat(),
                    })
                })
                .collect()
        }),
        Formula::Or(parts) => {
            let all: Vec<Parts> = parts.iter().flat_map(alternatives).collect();
            if all.len() > MOST_ALTERNATIVES {
                return vec![Parts { slots: Vec::new(), leaves: vec![formula.clone()] }];
            }
            all
        }
        Formula::Exists(slots, body) => {
            let mut all = alternatives(body);
            for parts in &mut all {
                parts.slots.extend(slots);
            }
            all
        }
        leaf => vec![Parts { slots: Vec::new(), leaves: vec![leaf.clone()] }],
    }
}

fn rule(domains: &[Arc<[ObjectId]>], slots: Vec<u32>, leaves: &[Formula], fluent: &[bool]) -> Rule {
    let mut rule = Rule {
        domains: domains.to_vec(),
        body: Vec::new(),
        filters: Vec::new(),
        unequal: Vec::new(),
        equal: Vec::new(),
        slots,
        heads: Vec::new(),
        instance: None,
    };
    for leaf in leaves {
        match leaf {
            Formula::Literal(pattern, true) if rule.body.len() < LONGEST_BODY => {
                rule.body.push(pattern.clone())
            }
            Formula::Literal(pattern, false) if fluent[pattern.predicate as usize] => {}
            Formula::Same(a, b, true) => rule.equal.push((*a, *b)),
            Formula::Same(a, b, false) => rule.unequal.push((*a, *b)),
            Formula::Call(..) => {}
            other => rule.filters.push(other.clone()),
        }
    }
    rule
}

/// Atoms that an effect adds.
fn heads(task: &Task, effect: &Effect_, domains: &mut Vec<Arc<[ObjectId]>>) -> Vec<Head> {
    match &effect.change {
        Change_::Add(atom) => vec![Head { forall: effect.forall.clone(), atom: atom.clone() }],
        Change_::Call(call) => module_writes(task, call.index)
            .iter()
            .filter_map(|t| written(task, effect, call, t, domains))
            .collect(),
        _ => Vec::new(),
    }
}

/// Atom that an effect module may make true by writing `target`: a predicate's atom, or one for
/// every value of an object function. `None` for a number.
fn written(
    task: &Task,
    effect: &Effect_,
    call: &Named,
    target: &Target,
    domains: &mut Vec<Arc<[ObjectId]>>,
) -> Option<Head> {
    let place = |term: &Term| match *term {
        Term::Slot(slot) => call.terms[slot as usize],
        object => object,
    };
    let (Target::Truth(pattern) | Target::Object(pattern)) = target else { return None };
    let mut terms: Vec<Term> = pattern.terms.iter().map(place).collect();
    let mut forall = effect.forall.clone();
    if let Target::Object(_) = target {
        let function = &task.functions[pattern.predicate as usize - task.predicates.len()];
        let types = function.result.as_deref().unwrap_or_default();
        let value = domains.len() as u32;
        domains.push((0..task.objects.len() as u32).map(ObjectId).filter(|&o| task.fits(o, types)).collect());
        terms.push(Term::Slot(value));
        forall.push(value);
    }
    Some(Head { forall, atom: Pattern { predicate: pattern.predicate, terms } })
}

fn is_true(formula: &Formula) -> bool {
    matches!(formula, Formula::And(parts) if parts.iter().all(is_true))
}

/// Makes the rules of a task; `fresh` creates a new predicate, "this action was applied".
pub(super) fn make(task: &Task, normal: &Normal, fresh: &mut dyn FnMut() -> u32) -> Rules {
    let mut all = Rules {
        rules: Vec::new(),
        alternatives: Vec::new(),
        repeats: Vec::new(),
        fluent: fluent_predicates(task, normal),
        derived: vec![false; normal.predicate_count],
    };
    for axiom in &normal.rules {
        all.derived[axiom.head.predicate as usize] = true;
    }
    let (circle_of, given) = circles(&normal.actions);
    for (index, action) in normal.actions.iter().enumerate() {
        all.action(task, (index, action), &given[circle_of[index]], fresh);
    }
    for (index, axiom) in normal.rules.iter().enumerate() {
        all.axiom(index, axiom, normal.actions.len());
    }
    all
}

impl Rules {
    fn axiom(&mut self, index: usize, axiom: &Rule_, first: usize) {
        for parts in alternatives(&axiom.body) {
            let mut slots: Vec<u32> = (0..axiom.head.terms.len() as u32).collect();
            slots.extend(&parts.slots);
            let mut made = rule(&axiom.domains, slots.clone(), &parts.leaves, &self.fluent);
            made.heads.push(Head { forall: Vec::new(), atom: axiom.head.clone() });
            made.instance = Some(((first + self.alternatives.len()) as u32, slots.len()));
            self.alternatives.push(Alternative { rule: index, slots, parts: parts.leaves });
            self.rules.push(made);
        }
    }

    fn action(
        &mut self,
        task: &Task,
        (index, action): (usize, &Action_),
        given: &Given,
        fresh: &mut dyn FnMut() -> u32,
    ) {
        let mut own: Vec<u32> = (0..action.arity as u32).collect();
        own.extend(&action.extra);
        let (start, later) = self.split(action, given);
        let mut domains = action.domains.clone();
        let (mut at_once, mut conditional) = (Vec::new(), Vec::new());
        let ends = action.end_effects.iter().map(|e| (e, true));
        for (effect, at_end) in action.start_effects.iter().map(|e| (e, false)).chain(ends) {
            let when = &effect.when;
            let free = is_true(&when.start) && is_true(&when.over_all) && is_true(&when.end);
            let made = heads(task, effect, &mut domains);
            if free && (!at_end || later.is_empty()) {
                at_once.extend(made);
            } else if !made.is_empty() {
                conditional.push((effect, at_end, made));
            }
        }
        let applied = Pattern {
            predicate: if conditional.is_empty() { 0 } else { fresh() },
            terms: own.iter().map(|&slot| Term::Slot(slot)).collect(),
        };
        let ways = alternatives(&Formula::And(start));
        self.repeats.push(ways.len() > 1 || ways.iter().any(|w| !w.slots.is_empty()));
        for way in ways {
            let slots = [&own[..], &way.slots[..]].concat();
            let mut made = rule(&domains, slots, &way.leaves, &self.fluent);
            made.instance = Some((index as u32, own.len()));
            made.heads
                .extend(at_once.iter().map(|h| Head { forall: h.forall.clone(), atom: h.atom.clone() }));
            if !conditional.is_empty() {
                made.heads.push(Head { forall: Vec::new(), atom: applied.clone() });
            }
            self.rules.push(made);
        }
        if !conditional.is_empty() {
            self.fluent.push(true);
        }
        for (effect, at_end, made) in conditional {
            self.conditional(&own, &applied, &later, &domains, effect, at_end, made);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn conditional(
        &mut self,
        own: &[u32],
        applied: &Pattern,
        later: &[Formula],
        domains: &[Arc<[ObjectId]>],
        effect: &Effect_,
        at_end: bool,
        heads: Vec<Head>,
    ) {
        let when = &effect.when;
        let mut condition = vec![when.start.clone(), when.over_all.clone(), when.end.clone()];
        if at_end {
            condition.extend_from_slice(later);
        }
        for way in alternatives(&Formula::And(condition)) {
            let slots = [own, &effect.forall[..], &way.slots[..]].concat();
            let mut leaves = vec![Formula::Literal(applied.clone(), true)];
            leaves.extend(way.leaves);
            let mut made = rule(domains, slots, &leaves, &self.fluent);
            for head in &heads {
                let forall = head.forall.iter().copied().filter(|s| !effect.forall.contains(s)).collect();
                made.heads.push(Head { forall, atom: head.atom.clone() });
            }
            self.rules.push(made);
        }
    }

    /// Splits a durative action's conditions into those needed at its start and those that may
    /// become true while it runs. A condition over all is needed at the start unless the action's
    /// own start or a simultaneous start may add it.
    fn split(&self, action: &Action_, given: &Given) -> (Vec<Formula>, Vec<Formula>) {
        let mut start = vec![action.condition.start.clone()];
        let mut later = Vec::new();
        for leaf in leaves(&action.condition.over_all) {
            let changing = predicates(leaf).iter().any(|&p| self.derived[p as usize] || given.has(p));
            if changing { later.push(leaf.clone()) } else { start.push(leaf.clone()) }
        }
        for leaf in leaves(&action.condition.end) {
            let changing = predicates(leaf).iter().any(|&p| self.fluent[p as usize]);
            if changing { later.push(leaf.clone()) } else { start.push(leaf.clone()) }
        }
        (start, later)
    }
}

/// Predicates to which some action starts add atoms.
#[derive(Default)]
struct Given {
    predicates: FxHashSet<u32>,
    /// True if one of the starts calls an effect module, which counts as adding anything.
    anything: bool,
}

impl Given {
    fn by(actions: &[&Action_]) -> Given {
        let mut given = Given::default();
        for effect in actions.iter().flat_map(|action| &action.start_effects) {
            match &effect.change {
                Change_::Add(atom) => given.predicates.extend([atom.predicate]),
                Change_::Call(_) => given.anything = true,
                _ => {}
            }
        }
        given
    }

    fn has(&self, predicate: u32) -> bool {
        self.anything || self.predicates.contains(&predicate)
    }
}

/// Groups of actions that may have to start at the same time, because each needs over all what
/// another adds at its start, in a cycle. Returns the group of each action and the start effects of
/// each group.
fn circles(actions: &[Action_]) -> (Vec<usize>, Vec<Given>) {
    let mut givers: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    let mut of_anything: Vec<u32> = Vec::new();
    for (action, index) in actions.iter().zip(0..) {
        let given = Given::by(&[action]);
        given.predicates.iter().for_each(|&predicate| givers.entry(predicate).or_default().push(index));
        of_anything.extend(given.anything.then_some(index));
    }
    let mut edges: Vec<(u32, u32)> = Vec::new();
    for (action, index) in actions.iter().zip(0..) {
        for predicate in predicates(&action.condition.over_all) {
            let own = givers.get(&predicate).into_iter().flatten().chain(&of_anything);
            edges.extend(own.map(|&giver| (giver, index)));
        }
    }
    let mut graph: DiGraph<(), ()> = DiGraph::new();
    actions.iter().for_each(|_| {
        graph.add_node(());
    });
    graph.extend_with_edges(edges);
    let (mut circle_of, mut given) = (vec![0; actions.len()], Vec::new());
    for (number, circle) in tarjan_scc(&graph).iter().enumerate() {
        circle.iter().for_each(|node| circle_of[node.index()] = number);
        given.push(Given::by(&circle.iter().map(|node| &actions[node.index()]).collect::<Vec<_>>()));
    }
    (circle_of, given)
}

fn leaves(formula: &Formula) -> Vec<&Formula> {
    match formula {
        Formula::And(parts) => parts.iter().flat_map(leaves).collect(),
        leaf => vec![leaf],
    }
}

/// Predicates that a formula mentions.
fn predicates(formula: &Formula) -> Vec<u32> {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().flat_map(predicates).collect(),
        Formula::Literal(pattern, _) => vec![pattern.predicate],
        Formula::Forall(_, body) | Formula::Exists(_, body) => predicates(body),
        Formula::Same(..) | Formula::Compare(..) | Formula::Call(..) => Vec::new(),
    }
}
