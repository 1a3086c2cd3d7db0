//! Checks of the initial state, timed literals included.

use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

use super::Checker;
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::ast::{Initial, InitialValue, Name};
use crate::pddl::nearest;
use crate::task::{
    Fact, FunctionId, GroundChange, GroundFluent, Init, ObjectId, Parameter, PredicateId, TimedInitial,
};

impl Checker<'_> {
    pub(super) fn initial(&mut self, all: &[Initial]) {
        let mut init = Init::default();
        let mut facts: FxHashMap<Fact, Span> = FxHashMap::default();
        let mut denied: Vec<(Fact, Span)> = Vec::new();
        let mut values: FxHashMap<GroundFluent, (usize, Span)> = FxHashMap::default();
        init.facts.reserve(all.len());
        facts.reserve(all.len());
        for one in all {
            let (time_s, one) = match one {
                Initial::At(time_s, inner) => (Some(*time_s), &**inner),
                other => (None, other),
            };
            if time_s.is_some() && self.is_derived(one) {
                continue;
            }
            let Some((change, span)) = self.ground_change(one) else { continue };
            if let Some(time_s) = time_s {
                init.timed.push(TimedInitial { time_s, change, span });
                continue;
            }
            match change {
                GroundChange::Add(fact) => {
                    if let Entry::Vacant(new) = facts.entry(fact) {
                        init.facts.push(new.key().clone());
                        new.insert(span);
                    }
                }
                // Everything that is not said to be true is false.
                GroundChange::Delete(fact) => denied.push((fact, span)),
                GroundChange::Number(fluent, value) => match values.get(&fluent) {
                    Some(&(at, first)) => {
                        let before = std::mem::replace(&mut init.numbers[at].1, value);
                        self.two_values(before == value, first, span);
                    }
                    None => {
                        values.insert(fluent.clone(), (init.numbers.len(), span));
                        init.numbers.push((fluent, value));
                    }
                },
                GroundChange::Object(fluent, value) => match values.get(&fluent) {
                    Some(&(at, first)) => {
                        let before = std::mem::replace(&mut init.objects[at].1, value);
                        self.two_values(before == value, first, span);
                    }
                    None => {
                        values.insert(fluent.clone(), (init.objects.len(), span));
                        init.objects.push((fluent, value));
                    }
                },
            }
        }
        // Costs start at 0 where nothing else is said.
        let costs = self.task.find_function("total-cost").map(|id| (id, self.task.function(id)));
        if let Some((function, _)) =
            costs.filter(|(_, own)| own.parameters.is_empty() && own.result.is_none())
        {
            let fluent = GroundFluent { function, arguments: Box::default() };
            if !values.contains_key(&fluent) {
                init.numbers.push((fluent, 0.0));
            }
        }
        for (fact, span) in denied {
            if let Some(&stated) = facts.get(&fact) {
                let message = format!("`{}` is true and false at the beginning", self.written(stated));
                self.push(
                    Diagnostic::error("contradiction", message, span, "false here")
                        .with_label(stated, "true here")
                        .with_help("remove one of them"),
                );
            }
        }
        init.timed.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
        self.task.init = init;
    }

    fn two_values(&mut self, same: bool, first: Span, second: Span) {
        if same {
            return;
        }
        self.push(
            Diagnostic::warning("duplicate", "two values for one function", second, "this value counts")
                .with_label(first, "it has this value already")
                .with_help("remove one of them"),
        );
    }

    /// Reports a timed literal over a derived predicate; true if there was one.
    fn is_derived(&mut self, one: &Initial) -> bool {
        let Initial::Literal { name, span, .. } = one else { return false };
        let known = self.predicates.get(&name.symbol).map(|&known| &self.task.predicates[known as usize]);
        if known.is_none_or(|predicate| predicate.stratum.is_none()) {
            return false;
        }
        let message = format!("derived predicate `{}` in a timed literal", self.name(name.symbol));
        let finding = Diagnostic::error("derived", message, *span, "this follows from its rules alone");
        self.push(finding.with_help("give or take what its rules depend on at that time instead"));
        true
    }

    fn ground_change(&mut self, one: &Initial) -> Option<(GroundChange, Span)> {
        match one {
            Initial::Literal { negated, name, arguments, span } => {
                let PredicateId(predicate) = self.find_predicate(*name)?;
                let declared = &self.task.predicates[predicate as usize];
                let derived = declared.stratum.is_some();
                let arguments =
                    self.ground_arguments("predicate", *name, Place::Predicate(predicate), arguments, *span)?;
                if derived && !negated {
                    let message =
                        format!("derived predicate `{}` in the initial state", self.name(name.symbol));
                    let finding =
                        Diagnostic::warning("derived", message, *span, "this follows from its rules alone");
                    self.push(finding.with_help("it is not taken as a fact; remove it"));
                    return None;
                }
                let fact = Fact { predicate: PredicateId(predicate), arguments };
                Some((if *negated { GroundChange::Delete(fact) } else { GroundChange::Add(fact) }, *span))
            }
            Initial::Value { name, arguments, value, span } => {
                let Some(&function) = self.functions.get(&name.symbol) else {
                    self.unknown_function(*name);
                    return None;
                };
                if self.value_of_unknown_object(arguments) {
                    return None;
                }
                let arguments =
                    self.ground_arguments("function", *name, Place::Function(function), arguments, *span)?;
                let fluent = GroundFluent { function: FunctionId(function), arguments };
                self.ground_value(fluent, *value, *span).map(|change| (change, *span))
            }
            Initial::At(_, inner) => self.ground_change(inner),
        }
    }

    fn ground_value(
        &mut self,
        fluent: GroundFluent,
        value: InitialValue,
        span: Span,
    ) -> Option<GroundChange> {
        let declared = self.task.function(fluent.function);
        let place = declared.span;
        match (&declared.result, value) {
            (None, InitialValue::Number(number, _)) => Some(GroundChange::Number(fluent, number)),
            (Some(types), InitialValue::Object(name) | InitialValue::Number(_, name)) => {
                let types = types.clone();
                if self.name(name.symbol) == "undefined" {
                    return None;
                }
                let object = self.find_object(name)?;
                if !self.task.fits(object, &types) {
                    let is = self.types_text(&self.task.object(object).types);
                    let wanted = self.types_text(&types);
                    let message = format!(
                        "the value of `{}` is a `{wanted}`, found a `{is}`",
                        self.task.function(fluent.function).name
                    );
                    self.push(
                        Diagnostic::error("wrong-type", message, name.span, format!("this is a `{is}`"))
                            .with_label(place, "declared here"),
                    );
                }
                Some(GroundChange::Object(fluent, object))
            }
            (None, InitialValue::Object(name)) => {
                let message = format!("the value of `{}` is a number", declared.name);
                let label = format!("`{}` is not a number", self.name(name.symbol));
                self.push(
                    Diagnostic::error("wrong-kind", message, span, label).with_label(place, "declared here"),
                );
                None
            }
        }
    }

    /// Reports an undeclared function that gets an initial value. This is only a warning, and the
    /// value is dropped, unless the name resembles a declared one, because problems are shared by
    /// variants of a domain.
    fn unknown_function(&mut self, name: Name) {
        let written = self.name(name.symbol);
        let near = nearest(written, self.task.functions.iter().map(|own| own.name.as_str()));
        if near.is_some() || self.predicates.contains_key(&name.symbol) {
            self.find_function(name);
        } else if self.left_out.insert(name.symbol) {
            let message = format!("function `{written}` is not declared in the domain");
            let label = "what is said with it is left out";
            let finding = Diagnostic::warning("undeclared-function", message, name.span, label);
            self.push(finding.with_help("declare it in `(:functions …)` of the domain, or remove it here"));
        }
    }

    /// Reports an initial value of a function for an undeclared object, with a warning; true if the
    /// value is to be dropped. Published problems contain such lines.
    fn value_of_unknown_object(&mut self, arguments: &[Name]) -> bool {
        let unknown = arguments.iter().find(|name| self.objects[name.symbol.0 as usize].is_none());
        let Some(&name) = unknown else { return false };
        let written = self.name(name.symbol);
        let near = nearest(written, self.task.objects.iter().map(|own| own.name.as_str()));
        let message = format!("object `{written}` is not declared");
        let label = "what is said with it is left out";
        let help = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => "declare it in `(:objects …)`, or remove it here".into(),
        };
        if self.left_out.insert(name.symbol) {
            self.push(Diagnostic::warning("undeclared-object", message, name.span, label).with_help(help));
        }
        true
    }

    fn ground_arguments(
        &mut self,
        kind: &str,
        name: Name,
        place: Place,
        arguments: &[Name],
        span: Span,
    ) -> Option<Box<[ObjectId]>> {
        let (wanted, declared) = {
            let (parameters, span) = self.declared(place);
            (parameters.len(), span)
        };
        if wanted != arguments.len() {
            self.wrong_arity(kind, name, declared, (wanted, arguments.len()), span);
            return None;
        }
        let mut ids = Vec::with_capacity(wanted);
        for (position, argument) in arguments.iter().enumerate() {
            let Some(id) = self.find_object(*argument) else {
                // The others may be unknown too.
                arguments[position + 1..].iter().for_each(|other| {
                    self.find_object(*other);
                });
                return None;
            };
            if !self.task.fits(id, &self.declared(place).0[position].types) {
                let parameter = self.declared(place).0[position].clone();
                let found = self.task.object(id).types.clone();
                self.wrong_type(kind, name, &parameter, &found, argument.span, None);
            }
            ids.push(id);
        }
        Some(ids.into())
    }

    fn declared(&self, place: Place) -> (&[Parameter], Span) {
        match place {
            Place::Predicate(id) => {
                let declared = &self.task.predicates[id as usize];
                (&declared.parameters, declared.span)
            }
            Place::Function(id) => {
                let declared = &self.task.functions[id as usize];
                (&declared.parameters, declared.span)
            }
        }
    }
}

/// Predicate or function whose arguments are checked, by index.
#[derive(Clone, Copy)]
enum Place {
    Predicate(u32),
    Function(u32),
}
