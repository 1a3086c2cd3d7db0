//! PDDL text of conditions and terms, with objects for variables.

use super::{Binding, Semantics, UNBOUND};
use crate::diagnostic::Span;
use crate::task::{
    Atom, CallTerm, Comparison, Condition, Expression, Fact, Fluent, GroundFluent, ObjectId, Quantified, Term,
};

impl Semantics<'_> {
    pub(crate) fn term_text(&self, term: &Term, binding: &Binding) -> String {
        match term {
            Term::Object(id) => self.task.object(*id).name.clone(),
            Term::Function(fluent) => self.fluent_text(fluent, binding),
            Term::Variable(slot) => match binding.get(*slot) {
                UNBOUND => format!("?{}", slot.index()),
                id => self.task.object(id).name.clone(),
            },
        }
    }

    fn listed(&self, head: &str, arguments: &[Term], binding: &Binding) -> String {
        let arguments: String =
            arguments.iter().map(|term| format!(" {}", self.term_text(term, binding))).collect();
        format!("{head}{arguments}")
    }

    pub(crate) fn atom_text(&self, atom: &Atom, binding: &Binding) -> String {
        format!("({})", self.listed(&self.task.predicate(atom.predicate).name, &atom.arguments, binding))
    }

    pub(crate) fn fluent_text(&self, fluent: &Fluent, binding: &Binding) -> String {
        format!("({})", self.listed(&self.task.function(fluent.function).name, &fluent.arguments, binding))
    }

    pub(crate) fn call_text(&self, call: &CallTerm, binding: &Binding) -> String {
        let mut text = self.listed(&self.task.module(call.module).name, &call.arguments, binding);
        for proposal in &binding.proposals {
            text.push(' ');
            text.push_str(proposal);
        }
        format!("[{text}]")
    }

    fn named(&self, head: &str, arguments: &[ObjectId]) -> String {
        let names: String = arguments.iter().map(|&id| format!(" {}", self.task.object(id).name)).collect();
        format!("({head}{names})")
    }

    pub(crate) fn fact_text(&self, fact: &Fact) -> String {
        self.named(&self.task.predicate(fact.predicate).name, &fact.arguments)
    }

    pub(crate) fn ground_text(&self, fluent: &GroundFluent) -> String {
        self.named(&self.task.function(fluent.function).name, &fluent.arguments)
    }

    pub(crate) fn expression_text(&self, expression: &Expression, binding: &Binding) -> String {
        let all = |head: &str, parts: &[Expression]| {
            let parts: String =
                parts.iter().map(|part| format!(" {}", self.expression_text(part, binding))).collect();
            format!("({head}{parts})")
        };
        match expression {
            Expression::Number(number) => format!("{number}"),
            Expression::Fluent(fluent) => self.fluent_text(fluent, binding),
            Expression::Add(parts) => all("+", parts),
            Expression::Multiply(parts) => all("*", parts),
            Expression::Subtract(sides) => all("-", &**sides),
            Expression::Divide(sides) => all("/", &**sides),
            Expression::Negative(inner) => format!("(- {})", self.expression_text(inner, binding)),
            Expression::Duration => "?duration".to_string(),
            Expression::TotalTime => "(total-time)".to_string(),
            Expression::Violated(id) => format!("(is-violated {})", self.task.preferences[id.index()].name),
            Expression::Call(call) => self.call_text(call, binding),
        }
    }

    /// PDDL text of a condition, with objects for bound variables and names for quantified ones.
    pub fn condition_text(&self, condition: &Condition, binding: &Binding) -> String {
        let all = |head: &str, parts: &[Condition]| {
            let parts: String =
                parts.iter().map(|part| format!(" {}", self.condition_text(part, binding))).collect();
            format!("({head}{parts})")
        };
        match condition {
            Condition::And(parts) => all("and", parts),
            Condition::Or(parts) => all("or", parts),
            Condition::Not(inner) => format!("(not {})", self.condition_text(inner, binding)),
            Condition::Forall(variables, inner) => self.quantified_text("forall", variables, inner, binding),
            Condition::Exists(variables, inner) => self.quantified_text("exists", variables, inner, binding),
            Condition::Atom(atom) => self.atom_text(atom, binding),
            Condition::Same(terms, _) => {
                format!("(= {} {})", self.term_text(&terms[0], binding), self.term_text(&terms[1], binding))
            }
            Condition::Compare(comparison, sides, _) => {
                let (left, right) =
                    (self.expression_text(&sides[0], binding), self.expression_text(&sides[1], binding));
                format!("({} {left} {right})", sign(*comparison))
            }
            Condition::Call(call) => self.call_text(call, binding),
        }
    }

    fn quantified_text(
        &self,
        head: &str,
        variables: &[Quantified],
        inner: &Condition,
        binding: &Binding,
    ) -> String {
        let mut open = binding.clone();
        for variable in variables {
            open.set(variable.slot, UNBOUND);
        }
        let names: Vec<&str> = variables.iter().map(|variable| variable.parameter.name.as_str()).collect();
        let mut text = format!("({head} ({}) {})", names.join(" "), self.condition_text(inner, &open));
        for variable in variables {
            text = text
                .replace(&format!("?{} ", variable.slot.index()), &format!("{} ", variable.parameter.name));
            text = text
                .replace(&format!("?{})", variable.slot.index()), &format!("{})", variable.parameter.name));
        }
        text
    }

    pub(crate) fn span_of(&self, condition: &Condition) -> Span {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().map(|part| self.span_of(part)).reduce(Span::to).unwrap_or_default()
            }
            Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
                self.span_of(inner)
            }
            Condition::Atom(atom) => atom.span,
            Condition::Same(_, span) | Condition::Compare(_, _, span) => *span,
            Condition::Call(call) => call.span,
        }
    }
}

fn sign(comparison: Comparison) -> &'static str {
    match comparison {
        Comparison::Less => "<",
        Comparison::LessOrEqual => "<=",
        Comparison::Equal => "=",
        Comparison::GreaterOrEqual => ">=",
        Comparison::Greater => ">",
    }
}
