//! Checks that every action is carried out by a skill or program, and that every call is answered.

use descry_planner::{Diagnostic, Span};
use descry_skills::Call;

use super::Check;
use crate::abilities;
use crate::ability::{Ability, SkillWord, Trace};
use crate::actions::{doer, substituted};
use crate::config::ActionConfig;
use crate::origin::{self, Origin};

/// Kinds of failure for which a domain may state lessons.
const FAILURES: [&str; 12] = [
    "unreachable",
    "blocked",
    "timed_out",
    "cancelled",
    "sensor_dropped",
    "lost",
    "slipped",
    "unable",
    "broken",
    "program",
    "meaningless",
    "unmet",
];

impl Check<'_> {
    /// Checks that every action has a skill, several, or a program, and that the actions' entries
    /// in `domain.toml` are valid.
    pub(super) fn actions(&self) -> Vec<Diagnostic> {
        let mut list = Vec::new();
        let actions = &self.domain.vocabulary.task.actions;
        for action in actions {
            let config = self.domain.config.action.get(&action.name).cloned().unwrap_or_default();
            let parameters: Vec<&str> = action.parameters.iter().map(|p| p.name.as_str()).collect();
            list.extend(self.performed(&action.name, &parameters, action.span, &config));
            list.extend(self.configured(&action.name, &config));
        }
        let is_unknown = |name: &&String| actions.iter().all(|a| a.name != **name);
        for name in self.domain.config.action.keys().filter(is_unknown) {
            let help = self.known(name, actions.iter().map(|a| a.name.as_str()));
            let message = format!("there is no action `{name}` in domain.pddl");
            list.push(self.error("no-action", message, self.toml.at(&["action", name]), help));
        }
        list
    }

    /// Warns of predicates that an ability reads by name and the domain does not remember.
    pub(super) fn traces(&self) -> Vec<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let is_type = |of: &&str| vocabulary.task.types.iter().any(|known| known.name == **of);
        let has = |trace: &Trace| {
            vocabulary.word(trace.name).is_some_and(|word| word.types.len() == trace.types.len())
        };
        let all = abilities::used(&self.domain.config.uses).flat_map(|ability| ability.traces);
        let missed = all.filter(|trace| trace.types.iter().all(&is_type) && !has(trace));
        let finding = |trace: &Trace| {
            let place = doer(self.domain, trace.of)?.span;
            let types: String = trace.types.iter().map(|of| format!(" ?{of} - {of}")).collect();
            let message = format!("nothing remembers `{}`: {}", trace.name, trace.without);
            let help = format!(
                "declare ({}{types}), the name by which it is read, and set it by an effect, `gives_up` or `teaches`",
                trace.name
            );
            Some(Diagnostic::warning("no-trace", message, place, "this does it").with_help(help))
        };
        missed.filter_map(finding).collect()
    }

    /// Checks the skills, or the program, that carry an action out.
    fn performed(
        &self,
        name: &str,
        parameters: &[&str],
        span: Span,
        config: &ActionConfig,
    ) -> Vec<Diagnostic> {
        let texts = config.does.texts();
        if config.kind.is_some() && config.program.is_none() {
            let message = format!("`{name}` is carried out by a skill, whose effect on the world is known");
            let place = self.toml.at(&["action", name, "kind"]);
            return vec![self.error(
                "kind-of-skill",
                message,
                place,
                "leave `kind` out: programs alone have one",
            )];
        }
        if let Some(program) = &config.program {
            let both = (!texts.is_empty()).then(|| {
                let message = format!("the action `{name}` has both a program and skills");
                let help = "leave `program` or `does` out";
                self.error("two-performers", message, self.toml.at(&["action", name]), help)
            });
            let unsaid = both.is_none().then(|| self.unsaid(name)).flatten();
            let started = self.program(&["action", name, "program"], program);
            return both.into_iter().chain(unsaid).chain(started).collect();
        }
        if texts.is_empty() {
            let text = format!("{name} {}", parameters.join(" "));
            return self.step(name, &text, span, "this action").into_iter().collect();
        }
        let step = |text: &&str| {
            self.step(name, text, self.toml.within(&["action", name, "does"], text), "this step")
        };
        texts.iter().filter_map(step).collect()
    }

    /// Warning about an action of a program whose effects set what a program states, if it is left unsaid
    /// whether the action finds that out or brings it about.
    fn unsaid(&self, name: &str) -> Option<Diagnostic> {
        let words = self.domain.vocabulary.words();
        let word = words.iter().find(|word| origin::unsaid(self.domain, word) == Some(name))?;
        let message = format!(
            "`{}` is stated by a program and set by `{name}`: until it is said which of the two it does, find out or bring about, nobody knows what is not stated",
            word.name
        );
        let help = "kind = \"sensing\" if the action finds it out, kind = \"changing\" if it brings it about";
        let place = self.toml.at(&["action", name]);
        Some(Diagnostic::warning("kind-unsaid", message, place, "this action").with_help(help))
    }

    /// Checks one step of an action: the skill exists and takes these arguments.
    fn step(&self, action: &str, text: &str, span: Span, label: &str) -> Option<Diagnostic> {
        let mut tokens = text.split_whitespace();
        let name = tokens.next().unwrap_or_default();
        let uses = &self.domain.config.uses;
        let Some(skill) = abilities::skill(uses, name) else {
            let message = if name == action {
                format!("no skill carries out the action `{action}`")
            } else {
                format!("no skill is called `{name}`, to carry out the action `{action}`")
            };
            let skills = abilities::used(uses).flat_map(|a| a.skills).map(|s| s.name);
            let has_it = |ability: &&Ability| ability.skills.iter().any(|skill| skill.name == name);
            let help = format!(
                "{}; or a program: [action.{action}] program = [\"python3\", \"{action}.py\"]",
                unused(has_it).unwrap_or_else(|| self.known(name, skills))
            );
            return Some(Diagnostic::error("no-skill", message, span, label).with_help(help));
        };
        self.fits(action, skill, &tokens.collect::<Vec<_>>(), span, label)
    }

    fn fits(
        &self,
        action: &str,
        skill: &SkillWord,
        given: &[&str],
        span: Span,
        label: &str,
    ) -> Option<Diagnostic> {
        let expected: Vec<String> = skill.types.iter().map(|t| format!("?{t}")).collect();
        let help = format!("it is `{} {}`: {}", skill.name, expected.join(" "), skill.about);
        let fault = |message: String| {
            Some(Diagnostic::error("skill-arguments", message, span, label).with_help(help.clone()))
        };
        if given.len() != skill.types.len() {
            let (wanted, found) = (skill.types.len(), given.len());
            return fault(format!("the skill `{}` takes {wanted} objects, not {found}", skill.name));
        }
        let vocabulary = &self.domain.vocabulary;
        let parameters = vocabulary.action(action).unwrap_or_default();
        for (argument, wanted) in given.iter().zip(skill.types) {
            let Some(variable) = argument.strip_prefix('?') else { continue };
            let found = parameters.iter().find(|(name, _)| name[1..] == *variable.to_lowercase());
            match found {
                None => return fault(format!("the action `{action}` has no parameter {argument}")),
                Some((_, of)) if !vocabulary.is_a(of, wanted) => {
                    let taken = format!("the skill `{}` takes a {wanted}", skill.name);
                    return fault(format!("{taken} where {argument} is a {of}"));
                }
                Some(_) => {}
            }
        }
        None
    }

    /// Checks that the lessons of a failure, the reason and the check of an action are texts over the
    /// action's variables.
    fn configured(&self, name: &str, config: &ActionConfig) -> Vec<Diagnostic> {
        let mut list = Vec::new();
        for (n, atom) in config.gives_up.iter().enumerate() {
            list.extend(self.teaches(name, &["action", name, "gives_up", &n.to_string()], atom));
        }
        for (n, taught) in config.teaches.iter().enumerate() {
            let n = n.to_string();
            list.extend(self.teaches(name, &["action", name, "teaches", &n, "says"], &taught.says));
            if !FAILURES.contains(&taught.when.as_str()) {
                let message = format!("there is no kind of failure \"{}\"", taught.when);
                let place = self.toml.at(&["action", name, "teaches", &n, "when"]);
                list.push(self.error("no-failure", message, place, self.known(&taught.when, FAILURES)));
            }
        }
        if let Some(because) = &config.because {
            let parameters = self.domain.vocabulary.action(name).unwrap_or_default();
            list.extend(self.marks(name, &["action", name, "because"], because, &parameters));
        }
        if let Some(check) = &config.check {
            list.extend(self.over_parameters(name, &["action", name, "check"], check));
        }
        list
    }

    /// Checks that a lesson from a failing action is one atom of a remembered predicate or function.
    fn teaches(&self, action: &str, path: &[&str], atom: &str) -> Option<Diagnostic> {
        if let Some(fault) = self.over_parameters(action, path, atom) {
            return Some(fault);
        }
        let (condition, _) = self.over(action, atom);
        let vocabulary = &self.domain.vocabulary;
        let read = crate::words::read(&condition);
        let Ok(instances) = read else {
            let help = "expected (word ?variables), (not (word ?variables)) or (= (word ?variables) 3)";
            return Some(self.error(
                "no-atom",
                format!("`{atom}` is more than one atom"),
                self.toml.at(path),
                help,
            ));
        };
        let is_remembered = |word: &str| {
            let ground = vocabulary.word(word).map(|w| origin::of(self.domain, &w));
            matches!(ground, Some(Origin::Remembered))
        };
        let (word, ..) = instances.iter().find(|(word, ..)| !is_remembered(word))?;
        let message =
            format!("what a failure of `{action}` teaches, `{word}`, is no word that is remembered");
        let help = "name a predicate of domain.pddl that no ability states, as (given-up ?to)";
        Some(self.error("not-remembered", message, self.toml.at(path), help))
    }

    /// Checks a condition over an action's variables.
    fn over_parameters(&self, action: &str, path: &[&str], text: &str) -> Option<Diagnostic> {
        let (condition, objects) = self.over(action, text);
        let fault = self.condition(path, &condition, &objects)?;
        if fault.code != "undeclared-variable" {
            return Some(fault);
        }
        let parameters = self.domain.vocabulary.action(action).unwrap_or_default();
        let span = fault.labels.first().map(|label| label.span.start as usize..label.span.end as usize);
        let unknown = span.and_then(|span| self.domain.toml.text.get(span)).unwrap_or_default();
        let help = self.known(unknown, parameters.iter().map(|(name, _)| name.as_str()));
        Some(fault.with_help(help))
    }

    /// Text over an action's variables with a distinct object for each, and these objects with
    /// their types.
    fn over(&self, action: &str, text: &str) -> (String, Vec<(String, String)>) {
        let parameters = self.domain.vocabulary.action(action).unwrap_or_default();
        let mut objects: Vec<(String, String)> =
            parameters.into_iter().map(|(name, of)| (format!("some-{}", &name[1..]), of)).collect();
        let call =
            Call { action: action.into(), arguments: objects.iter().map(|(name, _)| name.clone()).collect() };
        let mut condition = substituted(self.domain, &call, &[text.to_string()]).concat();
        if condition.contains("?by") {
            condition = condition.replace("?by", "what-was-in-the-way");
            let of = self.type_where(&condition, "what-was-in-the-way");
            objects.push(("what-was-in-the-way".into(), of));
        }
        (condition, objects)
    }

    /// Checks that every call has an answerer, and that every answerer has a call.
    pub(super) fn calls(&self) -> Vec<Diagnostic> {
        let known: Vec<&str> =
            abilities::used(&self.domain.config.uses).flat_map(|a| a.calls).map(|c| c.name).collect();
        let programs = &self.domain.config.attachments;
        let modules = &self.domain.vocabulary.task.modules;
        let mut list = Vec::new();
        for module in modules {
            let name = module.name.as_str();
            if known.contains(&name) || programs.contains_key(name) {
                continue;
            }
            let has_it = |ability: &&Ability| ability.calls.iter().any(|call| call.name == name);
            let help = format!(
                "{}; or a program: [attachments.{name}] program = [\"python3\", \"{name}.py\"]",
                unused(has_it).unwrap_or_else(|| self.known(name, known.iter().copied()))
            );
            let message = format!("nothing answers the call [{name}]");
            list.push(
                Diagnostic::error("no-attachment", message, module.span, "this module").with_help(help),
            );
        }
        for (name, program) in programs {
            if modules.iter().all(|m| m.name != *name) {
                let message = format!("no call of domain.pddl is named [{name}]");
                let help = self.known(name, modules.iter().map(|m| m.name.as_str()));
                list.push(self.error("no-module", message, self.toml.at(&["attachments", name]), help));
            }
            list.extend(self.program(&["attachments", name, "program"], &program.program));
            for (n, word) in program.reads.iter().enumerate() {
                if self.domain.vocabulary.word(&word.to_lowercase()).is_none() {
                    let words: Vec<String> =
                        self.domain.vocabulary.words().into_iter().map(|w| w.name).collect();
                    let place = self.toml.at(&["attachments", name, "reads", &n.to_string()]);
                    let help = self.known(word, words.iter().map(String::as_str));
                    list.push(self.error("no-word", format!("there is no word `{word}`"), place, help));
                }
            }
        }
        list
    }
}

/// Suggestion to use the ability that has what is missing; `None` if no ability has it.
fn unused(has_it: impl FnMut(&&Ability) -> bool) -> Option<String> {
    let ability = abilities::ALL.iter().copied().find(has_it)?;
    Some(format!("the ability `{}` has it: write it into `uses`", ability.name))
}
