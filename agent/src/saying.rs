//! What is written in PDDL, as the domain says it to people: its `[said]` has a line for an action, a word or a call. What has none is
//! shown as it is written.

use std::collections::BTreeMap;

use descry_domains::goal::spoken_types;
use descry_domains::lexicon::{Lexicon, NAMED, Places};
use descry_domains::load::Domain;
use descry_robots::sim::SceneSpec;

use crate::run::Beginning;

/// What a line of `[said]` is about: the parameters, in their order, with their types.
type Form = (Vec<(String, String)>, String);

/// What stands behind an expression that does not hold.
const DOES_NOT_HOLD: &str = " does not hold";
/// What stands behind one that would not, at the end of what is told.
pub const WOULD_NOT_HOLD: &str = " would not hold";

/// How a domain says what is written in PDDL.
#[derive(Debug, Default)]
pub struct Saying {
    forms: BTreeMap<String, Form>,
    /// The names of symbols, by type.
    names: BTreeMap<String, BTreeMap<String, String>>,
    /// Types whose objects people speak of.
    spoken: Vec<String>,
}

/// An expression in PDDL.
#[derive(Debug, PartialEq)]
enum Written<'t> {
    One(&'t str),
    List(Vec<Written<'t>>),
}

/// What a variable stands for where something is said of it: the type that it is of, and how it is called there.
type Bound<'t> = [(&'t str, String)];

impl Saying {
    /// As a domain has it, with the names of its places.
    pub fn of(domain: &Domain, places: &Places) -> Self {
        let lexicon = Lexicon::new(domain, places);
        let named =
            |of: &str| lexicon.of_type(of).iter().map(|n| (n.symbol.clone(), n.names[0].clone())).collect();
        let names = lexicon.types().map(|of| (of.to_string(), named(of))).collect();
        let said = domain.config.said.iter();
        let forms = said.filter_map(|(name, text)| {
            let parameters = domain.vocabulary.parameters(name)?;
            Some((name.clone(), (parameters, text.clone())))
        });
        let spoken = spoken_types(domain).into_iter().chain(NAMED).map(str::to_string);
        Saying { forms: forms.collect(), names, spoken: spoken.collect() }
    }

    /// As the domain of a run has it; of a domain that this version does not understand, nothing.
    pub fn of_run(beginning: &Beginning) -> Self {
        let Ok(domain) = beginning.domain() else { return Saying::default() };
        let scene = beginning.scene.as_ref().and_then(|(name, text)| SceneSpec::parse(name, text).ok());
        Saying::of(&domain, &scene.as_ref().map(Places::of_spec).unwrap_or_default())
    }

    /// A text with everything in it that is written in PDDL said as the domain says it.
    pub fn say(&self, text: &str) -> String {
        let mut out = String::new();
        let mut rest = text;
        while let Some(at) = rest.find(['(', '[']) {
            out.push_str(&rest[..at]);
            rest = &rest[at..];
            let Some((expression, after)) = expression(rest) else {
                out.push_str(&rest[..1]);
                rest = &rest[1..];
                continue;
            };
            let is_not = after.strip_prefix(DOES_NOT_HOLD);
            let would_not = after.strip_prefix(WOULD_NOT_HOLD);
            let said = match (is_not, would_not) {
                (None, None) => self.told(&expression, &[]),
                (_, None) => self.denied(&expression, &[]),
                (_, Some(_)) => self.denied(&expression, &[]).map(|said| would_be(&said)),
            };
            match said {
                Some(said) => {
                    out.push_str(&said);
                    rest = is_not.or(would_not).unwrap_or(after);
                }
                None => {
                    out.push_str(&rest[..1]);
                    rest = &rest[1..];
                }
            }
        }
        out + rest
    }

    /// Whether the domain has a line for an action, a word or a call.
    pub fn has(&self, name: &str) -> bool {
        self.forms.contains_key(name)
    }

    /// What an action, a word or a call is about in general: `looking at the surface from a pose`.
    pub fn in_general(&self, name: &str) -> String {
        let Some((parameters, text)) = self.forms.get(name) else { return name.to_string() };
        let general = |text: String, (variable, of): &(String, String)| {
            text.replace(&format!("the {variable}"), &format!("the {of}"))
                .replace(variable, &format!("a {of}"))
        };
        parameters.iter().fold(text.clone(), general)
    }

    /// What an object is called that people have a name for.
    pub fn name_of(&self, symbol: &str) -> String {
        self.name(symbol, NAMED[0], &[])
    }

    /// An expression, said; none if a part of it cannot be.
    fn told(&self, written: &Written<'_>, bound: &Bound<'_>) -> Option<String> {
        let Written::List(parts) = written else { return None };
        let (Written::One(head), arguments) = parts.split_first()? else { return None };
        let all = || arguments.iter().map(|a| self.told(a, bound)).collect::<Option<Vec<_>>>();
        match (*head, arguments) {
            ("and", [_, ..]) => Some(all()?.join(", and ")),
            ("or", [_, ..]) => Some(all()?.join(", or ")),
            ("not", [of]) => self.denied(of, bound),
            ("imply", [when, then]) => {
                Some(format!("if {}, {}", self.told(when, bound)?, self.told(then, bound)?))
            }
            ("exists", [over, body]) => {
                let (of, said) = self.quantified(over, body, bound)?;
                Some(format!("there is a {of} for which {said}"))
            }
            ("forall", [over, body]) => {
                let (of, said) = self.quantified(over, body, bound)?;
                Some(format!("for every {of}: {said}"))
            }
            (">=", [a, b]) => self.compared(a, "at least ", b, bound),
            ("<=", [a, b]) => self.compared(a, "at most ", b, bound),
            (">", [a, b]) => self.compared(a, "more than ", b, bound),
            ("<", [a, b]) => self.compared(a, "less than ", b, bound),
            ("=", [a, b]) => self.compared(a, "", b, bound),
            _ => self.form(head, arguments, bound),
        }
    }

    /// That an expression does not hold.
    fn denied(&self, written: &Written<'_>, bound: &Bound<'_>) -> Option<String> {
        let Written::List(parts) = written else { return None };
        let (Written::One(head), arguments) = parts.split_first()? else { return None };
        match (*head, arguments) {
            ("not", [of]) => self.told(of, bound),
            ("exists", [over, body]) => {
                let (of, said) = self.quantified(over, body, bound)?;
                Some(format!("there is no {of} for which {said}"))
            }
            (">=", [a, b]) => self.compared(a, "less than ", b, bound),
            ("<=", [a, b]) => self.compared(a, "more than ", b, bound),
            _ => Some(format!("it is not so that {}", self.told(written, bound)?)),
        }
    }

    fn compared(&self, a: &Written<'_>, is: &str, b: &Written<'_>, bound: &Bound<'_>) -> Option<String> {
        let side = |written: &Written<'_>| match written {
            Written::One(text) => Some(self.name(text, "", bound)),
            Written::List(_) => self.told(written, bound),
        };
        Some(format!("{} is {is}{}", side(a)?, side(b)?))
    }

    /// What is said of all, or of one, of a type: what it is called, and what is said.
    fn quantified(
        &self,
        over: &Written<'_>,
        body: &Written<'_>,
        bound: &Bound<'_>,
    ) -> Option<(String, String)> {
        let Written::List(over) = over else { return None };
        let words: Vec<&str> =
            over.iter().map(|w| if let Written::One(text) = w { text } else { "" }).collect();
        let (variable, of) = match words.as_slice() {
            [variable] => (*variable, self.type_of(variable, body)?),
            [variable, "-", of] => (*variable, of.to_string()),
            _ => return None,
        };
        let it = if bound.is_empty() { "it".into() } else { format!("that {of}") };
        let inner: Vec<(&str, String)> = bound.iter().cloned().chain([(variable, it)]).collect();
        Some((of, self.told(body, &inner)?))
    }

    /// The type of a variable, by where it stands in what is said of it.
    fn type_of(&self, variable: &str, body: &Written<'_>) -> Option<String> {
        let Written::List(parts) = body else { return None };
        let here = || {
            let (Written::One(head), arguments) = parts.split_first()? else { return None };
            let at = arguments.iter().position(|a| *a == Written::One(variable))?;
            Some(self.forms.get(*head)?.0.get(at)?.1.clone())
        };
        here().or_else(|| parts.iter().find_map(|part| self.type_of(variable, part)))
    }

    /// The domain's line for an action, a word or a call, with the names of what it is about.
    fn form(&self, head: &str, arguments: &[Written<'_>], bound: &Bound<'_>) -> Option<String> {
        let (parameters, text) = self.forms.get(head)?;
        if parameters.len() != arguments.len() {
            return None;
        }
        let mut said = String::new();
        let mut rest = text.as_str();
        while let Some(at) = rest.find('?') {
            let end = rest[at + 1..].find(|c: char| !c.is_alphanumeric() && c != '-' && c != '_');
            let end = end.map_or(rest.len(), |end| at + 1 + end);
            let n = parameters.iter().position(|(name, _)| *name == rest[at..end])?;
            let Written::One(symbol) = arguments[n] else { return None };
            let is_bound = bound.iter().any(|(variable, _)| *variable == symbol);
            let before = &rest[..at];
            let before = before.strip_suffix("the ").filter(|_| is_bound).unwrap_or(before);
            said += before;
            said += &self.name(symbol, &parameters[n].1, bound);
            rest = &rest[end..];
        }
        Some(said + rest)
    }

    /// What a symbol, or what a variable stands for, is called.
    fn name(&self, symbol: &str, of: &str, bound: &Bound<'_>) -> String {
        if let Some((_, it)) = bound.iter().find(|(variable, _)| *variable == symbol) {
            return it.clone();
        }
        let of_type = self.names.get(of).and_then(|names| names.get(symbol));
        match of_type.or_else(|| self.names.values().find_map(|names| names.get(symbol))) {
            Some(name) => name.clone(),
            None if self.spoken.iter().any(|spoken| spoken == of) => symbol.replace('-', " "),
            None => symbol.to_string(),
        }
    }
}

/// The expression that a text begins with, and what follows it; none if its brackets do not fit.
fn expression(text: &str) -> Option<(Written<'_>, &str)> {
    let close = match text.chars().next()? {
        '(' => ')',
        '[' => ']',
        _ => return None,
    };
    let mut rest = text[1..].trim_start();
    let mut parts = Vec::new();
    loop {
        let next = rest.chars().next()?;
        if next == close {
            return Some((Written::List(parts), &rest[1..]));
        }
        let (part, after) = match next {
            '(' | '[' => expression(rest)?,
            ')' | ']' => return None,
            _ => {
                let end = rest.find(|c: char| c.is_whitespace() || "()[]".contains(c))?;
                (Written::One(&rest[..end]), &rest[end..])
            }
        };
        parts.push(part);
        rest = after.trim_start();
    }
}

/// What is not so, as what would not be so.
fn would_be(denied: &str) -> String {
    const TOLD: [(&str, &str); 2] =
        [("there is no ", "there would be no "), ("it is not so ", "it would not be so ")];
    TOLD.iter().fold(denied.to_string(), |said, (is, would)| said.replacen(is, would, 1))
}
