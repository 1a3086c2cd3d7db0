//! Checks that every predicate and function has a source of values, and that the entries on them and on
//! objects in `domain.toml` are valid.

use std::collections::BTreeMap;

use descry_planner::Diagnostic;

use super::Check;
use crate::config::Source;
use crate::origin::{self, Origin};
use crate::symbol::{SENSE, symbol};
use crate::vocabulary::Word;
use crate::{abilities, words};

/// Types of objects that come from the body's map, from `objects/` and from sightings.
const GIVEN: [&str; 8] = ["pose", "surface", "room", "door", "thing", "kind", "obstacle", SENSE];

impl Check<'_> {
    /// Checks that predicates and functions stated by an ability have the ability's types, and that
    /// those which nothing changes have an initial value.
    pub(super) fn words(&self) -> Vec<Diagnostic> {
        let (vocabulary, config) = (&self.domain.vocabulary, &self.domain.config);
        let mut list = Vec::new();
        for word in vocabulary.words() {
            match origin::of(self.domain, &word) {
                Origin::Sensed(fact) => {
                    let fits = word.types.len() == fact.types.len()
                        && word.types.iter().zip(fact.types).all(|(own, of)| vocabulary.is_a(own, of));
                    if !fits {
                        let types: Vec<String> = fact.types.iter().map(|t| format!(" ?x - {t}")).collect();
                        let message = format!("`{}` is stated by descry, for other arguments", word.name);
                        let help = format!(
                            "declare ({}{}): {}; or say where it comes from: [word.{}] is = \"remembered\"",
                            fact.name,
                            types.concat(),
                            fact.about,
                            word.name
                        );
                        list.push(
                            Diagnostic::error("word-types", message, word.span, "this word").with_help(help),
                        );
                    }
                }
                Origin::Fixed | Origin::Remembered | Origin::Planned if self.stays_undefined(&word) => {
                    list.push(never_defined(&word));
                }
                Origin::Remembered if self.is_compared_unset(&word) => list.push(not_begun(&word)),
                Origin::Fixed if !self.begins(&word) && !vocabulary.is_changed(&word.name) => {
                    let name = &word.name;
                    let message =
                        format!("nothing states `{name}`, and no action changes it: it never holds");
                    let help = format!(
                        "say what holds in the beginning, init = [\"({name} …)\"], or who states it: [word.{name}] program = […]"
                    );
                    list.push(
                        Diagnostic::warning("never-holds", message, word.span, "this word").with_help(help),
                    );
                }
                _ => {}
            }
        }
        for (name, configured) in &config.word {
            match vocabulary.word(name) {
                None => {
                    let words: Vec<String> = vocabulary.words().into_iter().map(|w| w.name).collect();
                    let help = self.known(name, words.iter().map(String::as_str));
                    let message = format!("there is no word `{name}` in domain.pddl");
                    list.push(self.error("no-word", message, self.toml.at(&["word", name]), help));
                }
                Some(word) if word.is_derived => {
                    let message =
                        format!("`{name}` is derived by the domain's rules; nothing else states it");
                    let help = "leave this out, or the rule in domain.pddl";
                    list.push(self.error("derived", message, self.toml.at(&["word", name]), help));
                }
                Some(_) if configured.is == Some(Source::Fixed) && vocabulary.is_changed(name) => {
                    let by = vocabulary.changers(name).join("`, `");
                    let message = format!("`{name}` is changed by `{by}`: it is not fixed");
                    let help = "leave `is` out; it is remembered then, and changes as the actions say";
                    list.push(self.error("not-fixed", message, self.toml.at(&["word", name, "is"]), help));
                }
                Some(_) => {}
            }
            if let Some(program) = &configured.program {
                list.extend(self.program(&["word", name, "program"], program));
                if configured.is.is_some() {
                    let message = format!("`{name}` is stated by a program: it is sensed");
                    let place = self.toml.at(&["word", name, "is"]);
                    list.push(self.error("two-sources", message, place, "leave `is` or `program` out"));
                }
            }
            list.extend(configured.untold.as_ref().and_then(|untold| self.untold(name, untold)));
        }
        list.extend(self.init());
        list.extend(self.said());
        list
    }

    /// Checks that the predicate `untold`, which marks values not known yet, has the arguments of the
    /// predicate that it marks.
    fn untold(&self, name: &str, untold: &str) -> Option<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let (own, other) = (vocabulary.word(name)?, vocabulary.word(untold));
        if other.is_some_and(|other| !other.is_number && !own.is_number && other.types == own.types) {
            return None;
        }
        let message = format!("`{untold}` is no predicate of the arguments of `{name}`");
        let types: String = own.types.iter().map(|of| format!(" {of}")).collect();
        let fitting = vocabulary.words().into_iter().filter(|w| !w.is_number && w.types == own.types);
        let fitting: Vec<String> = fitting.map(|w| w.name).filter(|w| w != name).collect();
        let help =
            format!("name a predicate of{types}; {}", self.known(untold, fitting.iter().map(String::as_str)));
        Some(self.error("untold", message, self.toml.at(&["word", name, "untold"]), help))
    }

    /// Checks that each line of `[said]` names an action, predicate, function or call, and uses its
    /// parameters.
    fn said(&self) -> Vec<Diagnostic> {
        let (vocabulary, config) = (&self.domain.vocabulary, &self.domain.config);
        let mut list = Vec::new();
        for (name, text) in &config.said {
            let path = ["said", name.as_str()];
            let Some(parameters) = vocabulary.parameters(name) else {
                let task = &vocabulary.task;
                let words = vocabulary.words().into_iter().map(|w| w.name);
                let actions = task.actions.iter().map(|a| a.name.clone());
                let names: Vec<String> =
                    actions.chain(words).chain(task.modules.iter().map(|m| m.name.clone())).collect();
                let message = format!("there is no action, word or call `{name}` in domain.pddl");
                let help = self.known(name, names.iter().map(String::as_str));
                list.push(self.error("no-word", message, self.toml.at(&path), help));
                continue;
            };
            list.extend(self.marks(name, &path, text, &parameters));
        }
        list
    }

    /// Checks that the variables of a text for people are parameters of its action, predicate, function
    /// or call.
    pub(super) fn marks(
        &self,
        name: &str,
        path: &[&str],
        text: &str,
        parameters: &[(String, String)],
    ) -> Vec<Diagnostic> {
        let marks = text.split('?').skip(1);
        let named = marks.map(|mark| {
            let end = mark.find(|c: char| !c.is_alphanumeric() && c != '-' && c != '_');
            format!("?{}", &mark[..end.unwrap_or(mark.len())])
        });
        // A question mark by itself is a sign.
        let unknown = named.filter(|mark| mark != "?" && parameters.iter().all(|(name, _)| name != mark));
        let told = |unknown: String| {
            let message = format!("`{name}` has no parameter {unknown}");
            let help = self.known(&unknown, parameters.iter().map(|(name, _)| name.as_str()));
            self.error("no-parameter", message, self.toml.within(path, &unknown), help)
        };
        unknown.map(told).collect()
    }

    /// True for a numeric function without an initial value or an action that assigns one.
    fn stays_undefined(&self, word: &Word) -> bool {
        // Costs begin at 0.
        let is_cost = word.name == "total-cost" && word.types.is_empty();
        word.is_number && !is_cost && !self.begins(word) && !self.domain.vocabulary.is_given(&word.name)
    }

    /// True if a numeric function without an initial value is compared in an action's condition.
    fn is_compared_unset(&self, word: &Word) -> bool {
        let vocabulary = &self.domain.vocabulary;
        word.is_number && !self.begins(word) && vocabulary.is_compared(&word.name)
    }

    pub(super) fn begins(&self, word: &Word) -> bool {
        let lines = self.domain.config.init.iter().filter_map(|line| words::read(line).ok());
        lines.flatten().any(|(name, ..)| name == word.name)
    }

    /// Checks that `init` names existing objects, sets nothing that is sensed, and gives nothing two
    /// values.
    fn init(&self) -> Vec<Diagnostic> {
        let (vocabulary, config) = (&self.domain.vocabulary, &self.domain.config);
        let mut list = Vec::new();
        let mut said: BTreeMap<(String, Vec<String>), Option<f64>> = BTreeMap::new();
        for (n, line) in config.init.iter().enumerate() {
            let n = n.to_string();
            let path = ["init", n.as_str()];
            let instances = match words::read(line) {
                Ok(instances) => instances,
                Err(because) => {
                    let message = format!("`{line}` cannot be read");
                    list.push(self.error("init", message, self.toml.at(&path), because));
                    continue;
                }
            };
            if let Some(fault) = self.condition(&path, line, &[]) {
                let hyphened = instances.iter().find_map(|(_, arguments, _)| self.hyphened(arguments));
                let help = hyphened.filter(|_| fault.code == "arity");
                list.push(match help {
                    Some(name) => {
                        fault.with_help(format!("a name of several words has hyphens here: {name}"))
                    }
                    None => fault,
                });
                continue;
            }
            let is_sensed = |(name, ..): &&(String, Vec<String>, Option<f64>)| {
                let ground = vocabulary.word(name).map(|w| origin::of(self.domain, &w));
                matches!(ground, Some(Origin::Sensed(_) | Origin::SensedByProgram | Origin::Derived))
            };
            if let Some((name, ..)) = instances.iter().find(is_sensed) {
                let message = format!("`{name}` is sensed: nothing can be said of how it begins");
                let help = "only what is remembered or fixed begins as init says";
                list.push(self.error("init", message, self.toml.at(&path), help));
            }
            for (name, arguments, value) in instances {
                let atom = std::iter::once(&name).chain(&arguments).cloned().collect::<Vec<_>>().join(" ");
                let other = said.insert((name, arguments), value).filter(|other| *other != value);
                if let Some(other) = other {
                    let message = format!("`({atom})` begins in two ways");
                    let help = match other {
                        Some(first) if value.is_some() => {
                            format!("it is {first} already; remove one of them")
                        }
                        _ => "it is said to hold and not to hold; remove one of them".into(),
                    };
                    list.push(self.error("two-values", message, self.toml.at(&path), help));
                }
            }
        }
        list
    }

    /// Known name that consecutive arguments make up, as `left-bench` for `left bench`.
    fn hyphened(&self, arguments: &[String]) -> Option<String> {
        let types = &self.domain.vocabulary.task.types;
        let is_name = |joined: &String| {
            types.iter().any(|of| self.lexicon.of_type(&of.name).iter().any(|name| name.symbol == *joined))
        };
        let joined = |count: usize| arguments.windows(count).map(|words| words.join("-"));
        (2..=arguments.len()).flat_map(joined).find(is_name)
    }

    /// Checks that the types whose objects may be named freely (`open`) exist.
    pub(super) fn open(&self) -> Vec<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let types = || vocabulary.task.types.iter().map(|t| t.name.as_str());
        let named = self.domain.config.open.iter().enumerate();
        let unknown = named.filter(|(_, of)| !vocabulary.has_type(of) && !GIVEN.contains(&of.as_str()));
        let told = |(n, of): (usize, &String)| {
            let message = format!("there is no type `{of}` in :types of domain.pddl");
            self.error("no-type", message, self.toml.at(&["open", &n.to_string()]), self.known(of, types()))
        };
        unknown.map(told).collect()
    }

    /// Checks that the used abilities exist.
    pub(super) fn abilities(&self) -> Vec<Diagnostic> {
        let abilities = || abilities::ALL.iter().map(|a| a.name);
        let used = self.domain.config.uses.iter().enumerate();
        let told = |(n, name): (usize, &String)| {
            let message = format!("there is no ability \"{name}\"");
            let place = self.toml.at(&["uses", &n.to_string()]);
            self.error("no-ability", message, place, self.known(name, abilities()))
        };
        used.filter(|(_, name)| abilities().all(|a| a != *name)).map(told).collect()
    }

    /// Checks that objects of the domain's own types have valid, unique names.
    pub(super) fn objects(&self) -> Vec<Diagnostic> {
        let (vocabulary, config) = (&self.domain.vocabulary, &self.domain.config);
        let mut list = Vec::new();
        let mut taken: Vec<(String, &str)> = Vec::new();
        for (of, names) in &config.objects {
            let key = self.toml.at(&["objects", of]);
            if GIVEN.contains(&of.as_str()) {
                let message =
                    format!("objects of type `{of}` come from the map, from objects/ or from looks");
                let help = "a thing is a file in objects/, a surface a [[surface]] of the scene";
                list.push(self.error("given-type", message, key, help));
                continue;
            }
            if !vocabulary.has_type(of) {
                let help = self.known(of, vocabulary.task.types.iter().map(|t| t.name.as_str()));
                let message = format!("there is no type `{of}` in :types of domain.pddl");
                list.push(self.error("no-type", message, key, help));
            }
            for (n, name) in names.iter().enumerate() {
                let other = taken.iter().find(|(known, _)| *known == symbol(name)).map(|(_, of)| *of);
                let is_called =
                    |of: &&&str| self.lexicon.of_type(of).iter().any(|k| k.symbol == symbol(name));
                let given = GIVEN.iter().find(is_called);
                if symbol(name).is_empty() {
                    let message = format!("\"{name}\" has neither a letter nor a digit");
                    let place = self.toml.at(&["objects", of, &n.to_string()]);
                    list.push(self.error("same-name", message, place, "names are told apart by these"));
                } else if let Some(other) = other.or(given.copied()) {
                    let message = format!("\"{name}\" is the name of a {other} already");
                    let place = self.toml.at(&["objects", of, &n.to_string()]);
                    list.push(self.error("same-name", message, place, "give it another name"));
                }
                taken.push((symbol(name), of));
            }
        }
        list
    }
}

/// Warning about a numeric function that an action compares before it has a value.
fn not_begun(word: &Word) -> Diagnostic {
    let name = &word.name;
    let arguments = if word.types.is_empty() { "" } else { " …" };
    let message =
        format!("`{name}` has no value in the beginning, and actions need one before they can be taken");
    let help = format!("say what it is at first: init = [\"(= ({name}{arguments}) 0)\"]");
    Diagnostic::warning("no-value", message, word.span, "this number").with_help(help)
}

/// Error about a numeric function that is read or changed and never has a value.
fn never_defined(word: &Word) -> Diagnostic {
    let name = &word.name;
    let arguments = if word.types.is_empty() { "" } else { " …" };
    let message = format!("`{name}` has no value in the beginning, and no action assigns it one");
    let help = format!(
        "what reads or changes it never happens: say what it is at first, init = [\"(= ({name}{arguments}) 0)\"], or who states it: \
         [word.{name}] program = […]"
    );
    Diagnostic::error("no-value", message, word.span, "this number").with_help(help)
}
