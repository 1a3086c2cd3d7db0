//! Small tasks as trees, and their text in PDDL.

use std::fmt::Write;

/// A variable or an object, by number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    Variable(usize),
    Object(usize),
}

/// A predicate or function with its arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    pub index: usize,
    pub terms: Vec<Term>,
}

/// A number.
#[derive(Debug, Clone)]
pub enum Number {
    Constant(f64),
    Fluent(Named),
    Duration,
    /// `+`, `-`, `*` or `/`.
    Binary(char, Box<[Number; 2]>),
    Negative(Box<Number>),
}

/// A condition.
#[derive(Debug, Clone)]
pub enum Formula {
    And(Vec<Formula>),
    Or(Vec<Formula>),
    Not(Box<Formula>),
    Imply(Box<[Formula; 2]>),
    /// For all (or some) objects of a type.
    Quantified {
        all: bool,
        variable: usize,
        of: usize,
        body: Box<Formula>,
    },
    Atom(Named),
    Same(Term, Term),
    Compare(&'static str, Number, Number),
}

/// A change made by an effect.
#[derive(Debug, Clone)]
pub enum Change {
    Add(Named),
    Delete(Named),
    Number(&'static str, Named, Number),
}

/// An effect, for all objects of a type if it is quantified.
#[derive(Debug, Clone)]
pub struct Effect {
    pub forall: Option<(usize, usize)>,
    /// At start, over all, at end; an effect at the start has the first alone.
    pub when: [Option<Formula>; 3],
    pub at_end: bool,
    pub change: Change,
}

/// A number that an action increases or decreases at a rate.
#[derive(Debug, Clone)]
pub struct Flow {
    pub increases: bool,
    pub fluent: Named,
    pub per_second: Number,
}

/// An action; its variables are numbered from 0.
#[derive(Debug, Clone)]
pub struct Action {
    pub parameters: Vec<usize>,
    /// Minimum and maximum duration; `None` inside for no maximum.
    pub duration: Option<[Option<Number>; 2]>,
    pub condition: [Option<Formula>; 3],
    pub effects: Vec<Effect>,
    /// Numbers that change while it goes on, with the change per second.
    pub flows: Vec<Flow>,
}

/// A rule of a derived predicate.
#[derive(Debug, Clone)]
pub struct Rule {
    pub predicate: usize,
    pub body: Formula,
}

/// A task. Type 0 is `object`, type 1 holds the objects below `special`.
#[derive(Debug, Clone)]
pub struct Task {
    pub objects: usize,
    pub special: usize,
    /// Types of the parameters; predicates from `derived` on are derived.
    pub predicates: Vec<Vec<usize>>,
    pub derived: usize,
    pub functions: Vec<Vec<usize>>,
    pub rules: Vec<Rule>,
    pub actions: Vec<Action>,
    pub facts: Vec<(usize, Vec<usize>)>,
    pub numbers: Vec<(usize, Vec<usize>, f64)>,
    /// Time, predicate, arguments, and whether it becomes true.
    pub timed: Vec<(f64, usize, Vec<usize>, bool)>,
    pub goal: Formula,
    pub metric: Option<Number>,
}

impl Task {
    /// Objects of a type.
    pub fn of(&self, kind: usize) -> std::ops::Range<usize> {
        0..if kind == 0 { self.objects } else { self.special }
    }

    pub fn is_temporal(&self) -> bool {
        !self.timed.is_empty() || self.actions.iter().any(|action| action.duration.is_some())
    }

    pub fn domain(&self) -> String {
        let mut text =
            "(define (domain d) (:requirements :adl :fluents :durative-actions :duration-inequalities
  :continuous-effects :derived-predicates :timed-initial-literals)
 (:types special - object)
 (:predicates"
                .to_string();
        for (index, parameters) in self.predicates.iter().enumerate() {
            let _ = write!(text, " (p{index}{})", typed(parameters, 0));
        }
        text.push_str(")\n (:functions");
        for (index, parameters) in self.functions.iter().enumerate() {
            let _ = write!(text, " (f{index}{})", typed(parameters, 0));
        }
        text.push_str(")\n");
        for rule in &self.rules {
            let head = typed(&self.predicates[rule.predicate], 0);
            let _ = writeln!(text, " (:derived (p{}{head}) {})", rule.predicate, formula(&rule.body));
        }
        for (index, action) in self.actions.iter().enumerate() {
            text.push_str(&action_text(index, action));
        }
        text + ")"
    }

    pub fn problem(&self) -> String {
        let names = |range: std::ops::Range<usize>| range.map(|o| format!(" o{o}")).collect::<String>();
        let mut text = format!(
            "(define (problem p) (:domain d) (:objects{} - special{} - object)\n (:init",
            names(0..self.special),
            names(self.special..self.objects)
        );
        for (predicate, arguments) in &self.facts {
            let _ = write!(text, " {}", ground("p", *predicate, arguments));
        }
        for (function, arguments, value) in &self.numbers {
            let _ = write!(text, " (= {} {value})", ground("f", *function, arguments));
        }
        for (time_s, predicate, arguments, holds) in &self.timed {
            let fact = ground("p", *predicate, arguments);
            let fact = if *holds { fact } else { format!("(not {fact})") };
            let _ = write!(text, " (at {time_s} {fact})");
        }
        let _ = write!(text, ")\n (:goal {})", formula(&self.goal));
        if let Some(metric) = &self.metric {
            let _ = write!(text, "\n (:metric minimize {})", number(metric));
        }
        text + ")"
    }
}

fn action_text(index: usize, action: &Action) -> String {
    let parameters = typed(&action.parameters, 0);
    let Some([least, most]) = &action.duration else {
        let condition = action.condition[0].as_ref().map_or("()".to_string(), formula);
        let effects: String =
            action.effects.iter().map(|effect| format!(" {}", effect_text(effect, false))).collect();
        return format!(
            " (:action a{index} :parameters ({parameters}) :precondition {condition}\n  :effect (and{effects}))\n"
        );
    };
    let duration = match [least, most].map(|bound| bound.as_ref().map(number)) {
        [Some(least), Some(most)] if least == most => format!("(= ?duration {least})"),
        bounds => {
            let parts = [">=", "<="].into_iter().zip(bounds);
            let parts =
                parts.filter_map(|(relation, bound)| Some(format!(" ({relation} ?duration {})", bound?)));
            format!("(and{})", parts.collect::<String>())
        }
    };
    let flows = action.flows.iter().map(|flow| {
        let how = if flow.increases { "increase" } else { "decrease" };
        format!(" ({how} {} (* #t {}))", named("f", &flow.fluent), number(&flow.per_second))
    });
    let effects: String =
        action.effects.iter().map(|effect| format!(" {}", effect_text(effect, true))).chain(flows).collect();
    format!(
        " (:durative-action a{index} :parameters ({parameters}) :duration {duration}
  :condition (and{})\n  :effect (and{effects}))\n",
        timed(&action.condition)
    )
}

fn timed(conditions: &[Option<Formula>; 3]) -> String {
    let times = ["at start", "over all", "at end"];
    let parts = times.iter().zip(conditions).filter_map(|(time, part)| Some((time, part.as_ref()?)));
    parts.map(|(time, part)| format!(" ({time} {})", formula(part))).collect()
}

fn effect_text(effect: &Effect, durative: bool) -> String {
    let change = match &effect.change {
        Change::Add(atom) => named("p", atom),
        Change::Delete(atom) => format!("(not {})", named("p", atom)),
        Change::Number(how, fluent, amount) => format!("({how} {} {})", named("f", fluent), number(amount)),
    };
    let time = if effect.at_end { "at end" } else { "at start" };
    let change = if durative { format!("({time} {change})") } else { change };
    let change = match effect.when.iter().flatten().next() {
        None => change,
        Some(_) if durative => format!("(when (and{}) {change})", timed(&effect.when)),
        Some(when) => format!("(when {} {change})", formula(when)),
    };
    match effect.forall {
        None => change,
        Some((variable, of)) => format!("(forall (?v{variable} - {}) {change})", kind(of)),
    }
}

fn kind(of: usize) -> &'static str {
    if of == 0 { "object" } else { "special" }
}

fn typed(kinds: &[usize], first: usize) -> String {
    kinds.iter().enumerate().map(|(index, of)| format!(" ?v{} - {}", first + index, kind(*of))).collect()
}

fn ground(letter: &str, index: usize, arguments: &[usize]) -> String {
    let terms = arguments.iter().map(|&o| Term::Object(o)).collect();
    named(letter, &Named { index, terms })
}

fn term(term: Term) -> String {
    match term {
        Term::Variable(variable) => format!("?v{variable}"),
        Term::Object(object) => format!("o{object}"),
    }
}

fn named(letter: &str, named: &Named) -> String {
    let terms: String = named.terms.iter().map(|&own| format!(" {}", term(own))).collect();
    format!("({letter}{}{terms})", named.index)
}

fn number(own: &Number) -> String {
    match own {
        Number::Constant(value) => value.to_string(),
        Number::Fluent(fluent) => named("f", fluent),
        Number::Duration => "?duration".to_string(),
        Number::Binary(operator, sides) => {
            format!("({operator} {} {})", number(&sides[0]), number(&sides[1]))
        }
        Number::Negative(inner) => format!("(- {})", number(inner)),
    }
}

fn formula(own: &Formula) -> String {
    let all = |parts: &[Formula]| parts.iter().map(|part| format!(" {}", formula(part))).collect::<String>();
    match own {
        Formula::And(parts) => format!("(and{})", all(parts)),
        Formula::Or(parts) => format!("(or{})", all(parts)),
        Formula::Not(inner) => format!("(not {})", formula(inner)),
        Formula::Imply(sides) => format!("(imply{})", all(&**sides)),
        Formula::Quantified { all, variable, of, body } => {
            let word = if *all { "forall" } else { "exists" };
            format!("({word} (?v{variable} - {}) {})", kind(*of), formula(body))
        }
        Formula::Atom(atom) => named("p", atom),
        Formula::Same(left, right) => format!("(= {} {})", term(*left), term(*right)),
        Formula::Compare(relation, left, right) => format!("({relation} {} {})", number(left), number(right)),
    }
}
