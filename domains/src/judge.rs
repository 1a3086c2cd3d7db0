//! Three-valued truth of a goal under the belief: unobserved facts are unknown.
//!
//! The value of a predicate or function is known, or lies in a [`Range`]. Facts about seen objects are
//! bounded by what further views may show. What a program or the body states is known, unless a sensing
//! action that was not taken yet reveals it. A remembered predicate is known where only looking and
//! moving set it, where `init` mentions it, and where an action or a failure of this run has set it.
//! Quantifiers also range over an object that nobody has seen.

use descry_planner::semantics::Binding;
use descry_planner::state::State;
use descry_planner::task::{
    Comparison, Condition, Expression, Fluent, ObjectId, PredicateId, Quantified, Task, Term,
};
use descry_planner::{Attachments, Semantics};

use crate::config::ActionKind;
use crate::load::Domain;
use crate::origin::{self, Origin};
use crate::range::{Bounds, Range, Referent};
use crate::situation::Situation;
use crate::vocabulary::Word;
use crate::words::Words;
use crate::{abilities, actions};

/// Truth of a condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    /// The condition is false.
    False,
    /// The condition may be true or false.
    Unknown,
    /// The condition is true.
    True,
}

impl Truth {
    fn of(is_so: bool) -> Truth {
        if is_so { Truth::True } else { Truth::False }
    }

    fn not(self) -> Truth {
        match self {
            Truth::False => Truth::True,
            Truth::Unknown => Truth::Unknown,
            Truth::True => Truth::False,
        }
    }
}

/// Truth of a condition, with the facts that decide it or leave it open.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Truth value.
    pub value: Truth,
    /// Deciding fact, or all facts that leave the condition open, those that views can tell first; empty
    /// for a condition without facts.
    pub words: Vec<Decisive>,
    /// Probability that the truth value is right: the least of those of the facts that it rests on.
    pub sure: f64,
}

/// Predicate or function, with its objects, that decides a condition or leaves it open.
#[derive(Debug, Clone, PartialEq)]
pub struct Decisive {
    /// Name of the predicate or function.
    pub word: String,
    /// Objects as symbols of the problem; `None` for an unseen object, or one outside the problem.
    pub objects: Vec<Option<String>>,
    /// True for a numeric function.
    pub is_number: bool,
    /// True if views can tell the value.
    pub is_seen: bool,
    /// True if the predicate holds as believed now; for a function, true if it has a value.
    pub holds: bool,
}

impl Decisive {
    /// Fact in PDDL; `None` if an object is not in the problem.
    pub fn pddl(&self) -> Option<String> {
        let objects: Option<Vec<&str>> = self.objects.iter().map(Option::as_deref).collect();
        Some(format!("({})", [&[self.word.as_str()], objects?.as_slice()].concat().join(" ")))
    }
}

impl Judgement {
    /// Judgement of a condition that cannot be evaluated.
    pub const UNKNOWN: Judgement = Judgement { value: Truth::Unknown, words: Vec::new(), sure: 1.0 };

    fn of(value: Truth) -> Judgement {
        Judgement { value, words: Vec::new(), sure: 1.0 }
    }

    /// First of the facts that decide the condition or leave it open; `None` for a condition without facts.
    pub fn word(&self) -> Option<&Decisive> {
        self.words.first()
    }

    /// True if the condition is open and views may decide it.
    pub fn is_open_to_looks(&self) -> bool {
        self.value == Truth::Unknown && self.word().is_some_and(|word| word.is_seen)
    }
}

/// Object in a slot of a condition; `None` while the slot is unbound.
type Bound<'a> = Option<Held<'a>>;

#[derive(Clone, Copy)]
enum Held<'a> {
    Object(ObjectId),
    Other(Referent<'a>),
}

/// Judge of conditions in one situation.
pub struct Judge<'a> {
    domain: &'a Domain,
    words: &'a Words,
    s: &'a Situation,
    semantics: Semantics<'a>,
    state: State,
    vocabulary: Vec<Word>,
}

impl<'a> Judge<'a> {
    /// Judge of the conditions of a round's task; `None` if an attachment fails.
    pub fn new(
        domain: &'a Domain,
        words: &'a Words,
        s: &'a Situation,
        task: &'a Task,
        attachments: &'a Attachments,
    ) -> Option<Self> {
        let semantics = Semantics::new(task, attachments);
        let state = semantics.initial().ok()?;
        Some(Self { domain, words, s, semantics, state, vocabulary: domain.vocabulary.words() })
    }

    /// Truth of the task's goal.
    pub fn goal(&self) -> Judgement {
        let goal = &self.semantics.task.goal;
        self.condition(&goal.body, &mut vec![None; goal.slots], &mut Vec::new())
    }

    fn condition(
        &self,
        own: &Condition,
        scope: &mut Vec<Bound<'a>>,
        open: &mut Vec<(PredicateId, Vec<String>)>,
    ) -> Judgement {
        match own {
            Condition::And(parts) => {
                all(Truth::False, parts.iter().map(|part| self.condition(part, scope, open)))
            }
            Condition::Or(parts) => {
                all(Truth::True, parts.iter().map(|part| self.condition(part, scope, open)))
            }
            Condition::Not(inner) => {
                let inner = self.condition(inner, scope, open);
                Judgement { value: inner.value.not(), ..inner }
            }
            Condition::Forall(variables, inner) => self.each(Truth::False, variables, inner, scope, open),
            Condition::Exists(variables, inner) => self.each(Truth::True, variables, inner, scope, open),
            Condition::Atom(atom) => {
                let arguments = self.referents(&atom.arguments, scope);
                match arguments {
                    Some(arguments) => self.atom(atom.predicate, &arguments, open),
                    None => Judgement::of(Truth::False),
                }
            }
            Condition::Compare(comparison, sides, _) => self.compare(*comparison, sides, scope),
            Condition::Same(terms, _) => {
                let of = |term: &Term| self.referent(term, scope);
                Judgement::of(match (of(&terms[0]), of(&terms[1])) {
                    (Some(Held::Object(one)), Some(Held::Object(other))) => Truth::of(one == other),
                    (Some(Held::Other(Referent::Unseen)), Some(Held::Other(Referent::Unseen))) => {
                        Truth::Unknown
                    }
                    (Some(Held::Other(Referent::Seen(one))), Some(Held::Other(Referent::Seen(other)))) => {
                        Truth::of(one.id == other.id)
                    }
                    _ => Truth::False,
                })
            }
            Condition::Call(_) => match self.binding(scope) {
                Some(mut binding) => match self.semantics.holds(&self.state, own, &mut binding) {
                    Ok(holds) => Judgement::of(Truth::of(holds)),
                    Err(_) => Judgement::of(Truth::Unknown),
                },
                None => Judgement::of(Truth::Unknown),
            },
        }
    }

    /// Judges a condition for all values of some variables; one instance with the value `decides`
    /// suffices.
    fn each(
        &self,
        decides: Truth,
        variables: &[Quantified],
        inner: &Condition,
        scope: &mut Vec<Bound<'a>>,
        open: &mut Vec<(PredicateId, Vec<String>)>,
    ) -> Judgement {
        let Some((first, rest)) = variables.split_first() else {
            return self.condition(inner, scope, open);
        };
        let objects = first.parameter.objects.iter().map(|&object| Held::Object(object));
        let others: Vec<Held<'a>> = self.others(first).into_iter().map(Held::Other).collect();
        let values: Vec<Held<'a>> = objects.chain(others).collect();
        all(
            decides,
            values.into_iter().map(|value| {
                scope[first.slot.index()] = Some(value);
                let judged = self.each(decides, rest, inner, scope, open);
                // What nobody has seen may not be there at all.
                let may_lack = judged.value == decides && matches!(value, Held::Other(Referent::Unseen));
                if may_lack { Judgement { value: Truth::Unknown, ..judged } } else { judged }
            }),
        )
    }

    /// Values of a variable besides the objects of the problem. An object of a wider type counts as
    /// unseen, as it may not have the variable's type.
    fn others(&self, variable: &Quantified) -> Vec<Referent<'a>> {
        let (task, vocabulary) = (self.semantics.task, &self.domain.vocabulary);
        let takes = |of: &str, other: Referent<'a>| {
            let name = |id: &descry_planner::task::TypeId| task.type_of(*id).name.as_str();
            let mut taken = variable.parameter.types.iter().map(name);
            if taken.clone().any(|taken| taken == of || vocabulary.is_a(of, taken)) {
                return Some(other);
            }
            taken.any(|taken| vocabulary.is_a(taken, of)).then_some(Referent::Unseen)
        };
        let finders = abilities::used(&self.domain.config.uses).filter_map(|ability| ability.others);
        finders.flat_map(|others| others(self.s)).filter_map(|(of, other)| takes(of, other)).collect()
    }

    fn atom(
        &self,
        predicate: PredicateId,
        arguments: &[Held<'a>],
        open: &mut Vec<(PredicateId, Vec<String>)>,
    ) -> Judgement {
        let declared = self.semantics.task.predicate(predicate);
        if declared.stratum.is_some() {
            return self.derived(predicate, arguments, open);
        }
        let objects: Option<Vec<ObjectId>> = arguments.iter().map(Held::object).collect();
        let holds = objects.is_some_and(|objects| self.state.holds(predicate, &objects));
        let (value, is_seen, sure) = match self.bounds(&declared.name) {
            Some(bounds) => {
                let range = self.range(bounds, arguments);
                let value = match range {
                    Range { least, .. } if least >= 1.0 => Truth::True,
                    Range { greatest, .. } if greatest <= 0.0 => Truth::False,
                    _ => Truth::Unknown,
                };
                (value, true, range.sure)
            }
            None if holds => (Truth::True, false, 1.0),
            None if self.is_told_of_seen_alone(&declared.name, arguments) => (Truth::Unknown, true, 1.0),
            None if self.is_known(&declared.name, arguments) => (Truth::False, false, 1.0),
            None => (Truth::Unknown, false, 1.0),
        };
        let word = self.decisive(&declared.name, arguments, (false, is_seen, holds));
        Judgement { value, words: vec![word], sure }
    }

    /// Judges a derived predicate: true if one of its rules holds.
    fn derived(
        &self,
        predicate: PredicateId,
        arguments: &[Held<'a>],
        open: &mut Vec<(PredicateId, Vec<String>)>,
    ) -> Judgement {
        let key =
            (predicate, arguments.iter().map(|held| format!("{:?}", self.shown(held))).collect::<Vec<_>>());
        // What rests on itself alone does not hold.
        if open.contains(&key) {
            return Judgement::of(Truth::False);
        }
        open.push(key);
        let task = self.semantics.task;
        let fits = |rule: &&descry_planner::task::Rule| {
            let fits = |(held, parameter): (&Held<'a>, &descry_planner::task::Parameter)| match held {
                Held::Object(id) => parameter.objects.contains(id),
                Held::Other(_) => true,
            };
            rule.predicate == predicate && arguments.iter().zip(&rule.parameters).all(fits)
        };
        let rules: Vec<_> = task.rules.iter().filter(fits).collect();
        let judged = all(
            Truth::True,
            rules.into_iter().map(|rule| {
                let mut scope: Vec<Bound<'a>> = vec![None; rule.slots];
                scope.iter_mut().zip(arguments).for_each(|(slot, held)| *slot = Some(*held));
                self.condition(&rule.body, &mut scope, open)
            }),
        );
        open.pop();
        judged
    }

    fn compare(&self, comparison: Comparison, sides: &[Expression; 2], scope: &[Bound<'a>]) -> Judgement {
        let mut words = Vec::new();
        let [left, right] = sides.each_ref().map(|side| self.expression(side, scope, &mut words));
        // A certainty by itself is as great as it is believed to be; in a sum it counts as what further looks leave.
        let plain = |side: &Expression, range: Range| match side {
            Expression::Fluent(_) => range.believed,
            _ => range.least,
        };
        let (believed_left, believed_right) = (plain(&sides[0], left), plain(&sides[1], right));
        let value = match comparison {
            Comparison::GreaterOrEqual if believed_left >= right.greatest => Truth::True,
            Comparison::GreaterOrEqual if left.greatest < right.least => Truth::False,
            Comparison::Greater if believed_left > right.greatest => Truth::True,
            Comparison::Greater if left.greatest <= right.least => Truth::False,
            Comparison::LessOrEqual if left.greatest <= believed_right => Truth::True,
            Comparison::LessOrEqual if left.least > right.greatest => Truth::False,
            Comparison::Less if left.greatest < believed_right => Truth::True,
            Comparison::Less if left.least >= right.greatest => Truth::False,
            Comparison::Equal if left.is_exact() && right.is_exact() && left.least == right.least => {
                Truth::True
            }
            Comparison::Equal if left.greatest < right.least || left.least > right.greatest => Truth::False,
            _ => Truth::Unknown,
        };
        // Numbers without a value are the reason before what looks tell.
        let lacks = |word: &Decisive| !word.is_seen && !word.holds;
        if words.iter().any(lacks) {
            words.retain(lacks);
        } else {
            words.sort_by_key(|word| !word.is_seen);
            words.truncate(1);
        }
        Judgement { value, words, sure: left.sure.min(right.sure) }
    }

    fn expression(&self, own: &Expression, scope: &[Bound<'a>], words: &mut Vec<Decisive>) -> Range {
        let mut side = |part: &Expression| self.expression(part, scope, words);
        match own {
            Expression::Number(number) => Range::exactly(*number),
            Expression::Fluent(fluent) => self.fluent(fluent, scope, words),
            Expression::Add(parts) => {
                parts.iter().map(side).fold(Range::exactly(0.0), |sum, part| sum.combined(part, |a, b| a + b))
            }
            Expression::Multiply(parts) => {
                parts.iter().map(side).fold(Range::exactly(1.0), |sum, part| sum.combined(part, |a, b| a * b))
            }
            Expression::Subtract(sides) => side(&sides[0]).combined(side(&sides[1]), |a, b| a - b),
            Expression::Negative(inner) => Range::exactly(0.0).combined(side(inner), |a, b| a - b),
            Expression::Divide(sides) => {
                let (above, below) = (side(&sides[0]), side(&sides[1]));
                match below.least > 0.0 || below.greatest < 0.0 {
                    true => above.combined(below, |a, b| a / b),
                    false => Range::UNDEFINED,
                }
            }
            Expression::Call(_) => {
                let value = self
                    .binding(scope)
                    .and_then(|binding| self.semantics.number(&self.state, own, &binding).ok().flatten());
                value.map_or(Range::UNDEFINED, Range::exactly)
            }
            Expression::Duration | Expression::TotalTime | Expression::Violated(_) => Range::UNDEFINED,
        }
    }

    fn fluent(&self, fluent: &Fluent, scope: &[Bound<'a>], words: &mut Vec<Decisive>) -> Range {
        let name = &self.semantics.task.function(fluent.function).name;
        let Some(arguments) = self.referents(&fluent.arguments, scope) else { return Range::UNDEFINED };
        let objects: Option<Vec<ObjectId>> = arguments.iter().map(Held::object).collect();
        let value = objects.and_then(|objects| self.state.number(fluent.function, &objects));
        let bounds = self.bounds(name);
        words.push(self.decisive(name, &arguments, (true, bounds.is_some(), value.is_some())));
        match (bounds, value) {
            (Some(bounds), _) => self.range(bounds, &arguments),
            (None, Some(value)) => Range::exactly(value),
            (None, None) => Range::UNDEFINED,
        }
    }

    /// Function that bounds the value of a predicate or function after further views; `None` if views do
    /// not tell the value.
    fn bounds(&self, name: &str) -> Option<Bounds> {
        let word = self.vocabulary.iter().find(|word| word.name == name)?;
        match origin::of(self.domain, word) {
            Origin::Sensed(fact) => fact.bounds,
            _ => None,
        }
    }

    /// True if an argument is an object that nobody has seen, and the predicate is one that is stated of
    /// seen objects alone.
    fn is_told_of_seen_alone(&self, name: &str, arguments: &[Held<'a>]) -> bool {
        let is_sensed = |word: &Word| origin::is_sensed(self.domain, word);
        arguments.iter().any(|held| matches!(held, Held::Other(Referent::Unseen)))
            && self.vocabulary.iter().find(|word| word.name == name).is_some_and(is_sensed)
    }

    /// True if the predicate `mark`, which marks a value as not found out yet, holds, or may hold of an
    /// object outside the problem.
    fn is_untold(&self, mark: &str, arguments: &[Held<'a>]) -> bool {
        let id = self.semantics.task.find_predicate(mark);
        let objects: Option<Vec<ObjectId>> = arguments.iter().map(Held::object).collect();
        id.zip(objects).is_none_or(|(id, objects)| self.state.holds(id, &objects))
    }

    /// True if a predicate that is not stated to hold is known to be false.
    fn is_known(&self, name: &str, arguments: &[Held<'a>]) -> bool {
        let Some(word) = self.vocabulary.iter().find(|word| word.name == name) else { return true };
        let objects: Option<Vec<String>> = arguments.iter().map(|held| self.shown(held)).collect();
        let is_told = objects.is_some_and(|objects| self.words.is_told(name, &objects));
        match origin::of(self.domain, word) {
            Origin::Remembered => is_told || is_own(self.domain, name) || self.words.is_spoken_of(name),
            _ => {
                let mark = self.domain.config.word.get(name).and_then(|word| word.untold.as_ref());
                let is_open = || origin::is_revealed(self.domain, word);
                is_told || !mark.map_or_else(is_open, |mark| self.is_untold(mark, arguments))
            }
        }
    }

    fn range(&self, bounds: Bounds, arguments: &[Held<'a>]) -> Range {
        let referents: Vec<Referent<'_>> = arguments
            .iter()
            .map(|held| match held {
                Held::Object(id) => Referent::Named(&self.semantics.task.object(*id).name),
                Held::Other(other) => *other,
            })
            .collect();
        bounds(self.s, &referents)
    }

    fn decisive(
        &self,
        word: &str,
        arguments: &[Held<'a>],
        (is_number, is_seen, holds): (bool, bool, bool),
    ) -> Decisive {
        let objects = arguments.iter().map(|held| self.shown(held)).collect();
        Decisive { word: word.into(), objects, is_number, is_seen, holds }
    }

    fn shown(&self, held: &Held<'a>) -> Option<String> {
        held.object().map(|id| self.semantics.task.object(id).name.clone())
    }

    /// Objects denoted by terms; `None` if one is undefined.
    fn referents(&self, terms: &[Term], scope: &[Bound<'a>]) -> Option<Vec<Held<'a>>> {
        terms.iter().map(|term| self.referent(term, scope)).collect()
    }

    fn referent(&self, term: &Term, scope: &[Bound<'a>]) -> Bound<'a> {
        match term {
            Term::Variable(slot) => scope.get(slot.index()).copied().flatten(),
            Term::Object(id) => Some(Held::Object(*id)),
            Term::Function(_) => {
                let binding = self.binding(scope)?;
                self.semantics.object(&self.state, term, &binding).map(Held::Object)
            }
        }
    }

    /// Binding of the slots; `None` if an object is not in the problem.
    fn binding(&self, scope: &[Bound<'a>]) -> Option<Binding> {
        let mut binding = Binding::new(scope.len());
        for (slot, held) in binding.objects.iter_mut().zip(scope) {
            match held {
                Some(Held::Object(id)) => *slot = *id,
                Some(Held::Other(_)) => return None,
                None => {}
            }
        }
        Some(binding)
    }
}

impl Held<'_> {
    fn object(&self) -> Option<ObjectId> {
        match self {
            Held::Object(id) => Some(*id),
            Held::Other(_) => None,
        }
    }
}

/// True if a remembered predicate or function depends on looking and moving alone: no changing action
/// sets it.
pub(crate) fn is_own(domain: &Domain, word: &str) -> bool {
    let changers = domain.vocabulary.changers(word);
    changers.into_iter().all(|action| actions::kind(&domain.config, action) < ActionKind::Changing)
}

/// Judges several parts; one with the value `decides` suffices. Facts that views can tell come first
/// among those of the open parts.
fn all(decides: Truth, parts: impl Iterator<Item = Judgement>) -> Judgement {
    let mut left: Option<Judgement> = None;
    let mut sure = 1.0_f64;
    for part in parts {
        if part.value == decides {
            return part;
        }
        sure = sure.min(part.sure);
        let is_open = part.value == Truth::Unknown;
        match &mut left {
            Some(left) if is_open && left.value == Truth::Unknown => left.words.extend(part.words),
            Some(_) if !is_open => {}
            _ => left = Some(part),
        }
    }
    let mut judged = left.unwrap_or(Judgement::of(decides.not()));
    judged.words.sort_by_key(|word| !word.is_seen);
    Judgement { sure, ..judged }
}
