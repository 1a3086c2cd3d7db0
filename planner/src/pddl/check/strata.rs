//! Stratification of axioms: no predicate may depend on its own negation.

use super::expressions::Place;
use super::{Checker, Scope};
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::ast;
use crate::task::{Condition, PredicateId, Rule};

/// Use of a derived predicate (`body`) in a rule of another (`head`), both by index.
struct Use {
    head: usize,
    body: usize,
    negated: bool,
    span: Span,
}

impl Checker<'_> {
    pub(super) fn derived_rules(&mut self, derived: &[ast::Derived]) {
        for rule in derived {
            let Some(&predicate) = self.predicates.get(&rule.head.name.symbol) else { continue };
            let predicate = PredicateId(predicate);
            if self.task.predicate(predicate).parameters.len() != rule.head.parameters.len() {
                continue;
            }
            let mut scope = Scope::default();
            let mut parameters = self.scoped_parameters(&rule.head.parameters, &mut scope);
            // A head without types is of the declared ones.
            for (index, typed) in rule.head.parameters.iter().enumerate() {
                if typed.types.is_empty() {
                    let declared = self.task.predicate(predicate).parameters[index].clone();
                    parameters[index].types.clone_from(&declared.types);
                    parameters[index].objects = declared.objects;
                    scope.variables[index].types = declared.types;
                }
            }
            let Some(body) = self.condition(&rule.body, false, Place::Condition, &mut scope) else {
                continue;
            };
            let span = rule.head.name.span;
            self.task.rules.push(Rule { predicate, parameters, slots: scope.slots, body, span });
        }
    }

    /// Assigns a stratum to every derived predicate, and sorts the rules by stratum.
    pub(super) fn order_strata(&mut self) {
        let mut uses = Vec::new();
        for rule in &self.task.rules {
            self.collect_uses(&rule.body, rule.predicate.index(), &mut uses);
        }
        let mut strata = vec![0u32; self.task.predicates.len()];
        let limit =
            self.task.predicates.iter().filter(|predicate| predicate.stratum.is_some()).count() as u32;
        // Raise heads above what they use until nothing changes; beyond `limit` there is a cycle through a negation.
        loop {
            let raised = uses.iter().find(|one| strata[one.head] < strata[one.body] + u32::from(one.negated));
            let Some(one) = raised else { break };
            strata[one.head] = strata[one.body] + u32::from(one.negated);
            if strata[one.head] > limit {
                self.not_stratified(&uses, one.head);
                return;
            }
        }
        for (predicate, stratum) in self.task.predicates.iter_mut().zip(&strata) {
            predicate.stratum = predicate.stratum.map(|_| *stratum);
        }
        let predicates = &self.task.predicates;
        self.task.rules.sort_by_key(|rule| predicates[rule.predicate.index()].stratum);
    }

    fn collect_uses(&self, condition: &Condition, head: usize, uses: &mut Vec<Use>) {
        let mut note = |atom: &crate::task::Atom, negated: bool| {
            if self.task.predicate(atom.predicate).stratum.is_some() {
                uses.push(Use { head, body: atom.predicate.index(), negated, span: atom.span });
            }
        };
        match condition {
            Condition::Atom(atom) => note(atom, false),
            Condition::Not(inner) => {
                if let Condition::Atom(atom) = &**inner {
                    note(atom, true);
                }
            }
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().for_each(|part| self.collect_uses(part, head, uses));
            }
            Condition::Forall(_, inner) | Condition::Exists(_, inner) => self.collect_uses(inner, head, uses),
            Condition::Same(..) | Condition::Compare(..) | Condition::Call(_) => {}
        }
    }

    fn not_stratified(&mut self, uses: &[Use], head: usize) {
        // A negated use from whose predicate its own head follows.
        let culprit = uses.iter().find(|one| one.negated && reaches(uses, one.body, one.head));
        let name = self.task.predicates[culprit.map_or(head, |one| one.head)].name.clone();
        let span = culprit.map_or(self.task.predicates[head].span, |one| one.span);
        let message = format!("derived predicate `{name}` follows from its own negation");
        let finding = Diagnostic::error("not-stratified", message, span, "this negation closes the circle");
        self.push(
            finding.with_help("such rules have no meaning: let one of them depend on basic facts alone"),
        );
    }
}

/// True if the rules of `from` use `to`, directly or through other derived predicates.
fn reaches(uses: &[Use], from: usize, to: usize) -> bool {
    let mut found = vec![from];
    let mut next = 0;
    while let Some(&at) = found.get(next) {
        next += 1;
        if at == to {
            return true;
        }
        for one in uses.iter().filter(|one| one.head == at) {
            if !found.contains(&one.body) {
                found.push(one.body);
            }
        }
    }
    false
}
