//! Verbalisation of PDDL by the domain's `[said]` lines for actions, predicates, functions and calls; an
//! expression without a line is shown in PDDL.

use std::collections::BTreeMap;

use crate::english::one;
use crate::goal::spoken_types;
use crate::lexicon::{Lexicon, NAMED, Places};
use crate::load::Domain;

/// Line of `[said]`: parameters (name and type) in order, and the text.
type Form = (Vec<(String, String)>, String);

/// Wording of PDDL expressions in the domain's language.
#[derive(Debug, Default)]
pub struct Saying {
    forms: BTreeMap<String, Form>,
    /// Spoken names of symbols, by type.
    names: BTreeMap<String, BTreeMap<String, String>>,
    /// Types whose objects people speak of.
    spoken: Vec<String>,
}

/// Parsed PDDL expression.
#[derive(Debug, PartialEq)]
enum Written<'t> {
    One(&'t str),
    List(Vec<Written<'t>>),
}

/// Mood of a sentence: indicative or conditional.
#[derive(Debug, Clone, Copy)]
enum Mood {
    Is,
    Would,
}

impl Mood {
    fn of<'t>(self, is: &'t str, would: &'t str) -> &'t str {
        match self {
            Mood::Is => is,
            Mood::Would => would,
        }
    }
}

/// Variables in scope: name, and phrase that stands for the variable in the sentence.
type Bound<'t> = [(&'t str, String)];

impl Saying {
    /// Wording of a domain, with its place names.
    pub fn of(domain: &Domain, places: &Places) -> Self {
        Saying::of_lexicon(domain, &Lexicon::new(domain, places))
    }

    /// Wording of a domain, with the names of a lexicon.
    pub(crate) fn of_lexicon(domain: &Domain, lexicon: &Lexicon) -> Self {
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

    /// Verbalises a PDDL expression: step, condition or number; parts without a line stay in PDDL.
    pub fn say(&self, pddl: &str) -> String {
        let mut out = String::new();
        let mut rest = pddl;
        while let Some(at) = rest.find(['(', '[']) {
            out.push_str(&rest[..at]);
            rest = &rest[at..];
            let said = expression(rest).and_then(|(written, after)| Some((self.told(&written, &[])?, after)));
            match said {
                Some((said, after)) => {
                    out.push_str(&said);
                    rest = after;
                }
                None => {
                    out.push_str(&rest[..1]);
                    rest = &rest[1..];
                }
            }
        }
        out + rest
    }

    /// Verbalises that a condition does not hold.
    pub fn deny(&self, pddl: &str) -> String {
        let denied = self.whole(pddl).and_then(|written| self.denied(&written, &[], Mood::Is));
        denied.unwrap_or_else(|| format!("{} does not hold", self.say(pddl)))
    }

    /// Verbalises that a condition would not hold.
    pub fn would_deny(&self, pddl: &str) -> String {
        let denied = self.whole(pddl).and_then(|written| self.denied(&written, &[], Mood::Would));
        denied.unwrap_or_else(|| format!("{} would not hold", self.say(pddl)))
    }

    /// Text parsed as a single expression; `None` if it is none.
    fn whole<'t>(&self, pddl: &'t str) -> Option<Written<'t>> {
        expression(pddl.trim()).filter(|(_, after)| after.is_empty()).map(|(written, _)| written)
    }

    /// True if the domain has a line for an action, predicate, function or call.
    pub fn has(&self, name: &str) -> bool {
        self.forms.contains_key(name)
    }

    /// Wording of an action, predicate, function or call in general: `looking at the surface from a
    /// pose`.
    pub fn in_general(&self, name: &str) -> String {
        let Some((parameters, text)) = self.forms.get(name) else { return name.to_string() };
        let general = |text: String, (variable, of): &(String, String)| {
            text.replace(&format!("the {variable}"), &format!("the {of}")).replace(variable, &one(of))
        };
        parameters.iter().fold(text.clone(), general)
    }

    /// Spoken name of an object; the symbol with spaces for hyphens if it has none.
    pub fn name_of(&self, symbol: &str) -> String {
        self.name(symbol, NAMED[0], &[])
    }

    /// Sentence for an expression; `None` if a part has no wording.
    fn told(&self, written: &Written<'_>, bound: &Bound<'_>) -> Option<String> {
        let Written::List(parts) = written else { return None };
        let (Written::One(head), arguments) = parts.split_first()? else { return None };
        let all = || arguments.iter().map(|a| self.told(a, bound)).collect::<Option<Vec<_>>>();
        match (*head, arguments) {
            ("and", [_, ..]) => Some(all()?.join(", and ")),
            ("or", [_, ..]) => Some(all()?.join(", or ")),
            ("not", [of]) => self.denied(of, bound, Mood::Is),
            ("imply", [when, then]) => {
                Some(format!("if {}, {}", self.told(when, bound)?, self.told(then, bound)?))
            }
            ("exists", [over, body]) => {
                let (of, said) = self.quantified(over, body, bound)?;
                Some(format!("there is {} for which {said}", one(&of)))
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

    /// Sentence that denies an expression; `None` if a part has no wording.
    fn denied(&self, written: &Written<'_>, bound: &Bound<'_>, mood: Mood) -> Option<String> {
        let Written::List(parts) = written else { return None };
        let (Written::One(head), arguments) = parts.split_first()? else { return None };
        match (*head, arguments) {
            ("not", [of]) => self.told(of, bound),
            ("exists", [over, body]) => {
                let (of, said) = self.quantified(over, body, bound)?;
                let there_is = mood.of("there is", "there would be");
                Some(format!("{there_is} no {of} for which {said}"))
            }
            (">=", [a, b]) => self.compared(a, "less than ", b, bound),
            ("<=", [a, b]) => self.compared(a, "more than ", b, bound),
            _ => {
                let is_not = mood.of("it is not so that", "it would not be so that");
                Some(format!("{is_not} {}", self.told(written, bound)?))
            }
        }
    }

    fn compared(&self, a: &Written<'_>, is: &str, b: &Written<'_>, bound: &Bound<'_>) -> Option<String> {
        let side = |written: &Written<'_>| match written {
            Written::One(text) => Some(self.name(text, "", bound)),
            Written::List(_) => self.told(written, bound),
        };
        Some(format!("{} is {is}{}", side(a)?, side(b)?))
    }

    /// Type that a quantifier ranges over, and the sentence for its body.
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

    /// Type of a variable, from its position in the body of a quantifier.
    fn type_of(&self, variable: &str, body: &Written<'_>) -> Option<String> {
        let Written::List(parts) = body else { return None };
        let here = || {
            let (Written::One(head), arguments) = parts.split_first()? else { return None };
            let at = arguments.iter().position(|a| *a == Written::One(variable))?;
            Some(self.forms.get(*head)?.0.get(at)?.1.clone())
        };
        here().or_else(|| parts.iter().find_map(|part| self.type_of(variable, part)))
    }

    /// Domain's line for an action, predicate, function or call, with the names of its arguments filled
    /// in.
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

    /// Spoken name of a symbol, or the phrase that stands for a variable.
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

/// First expression of a text, and the remainder; `None` for unbalanced brackets.
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
