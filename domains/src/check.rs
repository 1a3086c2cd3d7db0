//! Whether a domain's folder makes sense as a whole: every action is carried out by something, every call is answered, every
//! phrase means something. Each finding is drawn under the text that it is about.

use descry_planner::{Diagnostic, Findings, Severity, Source, Span};

use crate::abilities::{self, SkillWord};
use crate::goal::{Filled, put_in, slots_of, type_of_slot};
use crate::lexicon::{Lexicon, Places, symbol};
use crate::load::Domain;
use crate::vocabulary::{Ground, Word};
use crate::words::{self, Words};

/// What keeps a domain from being run.
///
/// # Errors
/// The findings that are faults.
pub fn runnable(domain: &Domain) -> Result<(), Findings> {
    let mut findings = findings(domain);
    findings.list.retain(|f| f.severity == Severity::Error);
    if findings.list.is_empty() { Ok(()) } else { Err(findings) }
}

/// Everything that is to be said about a domain's folder, faults and warnings.
pub fn findings(domain: &Domain) -> Findings {
    let check = Check { domain };
    let mut list = check.actions();
    list.extend(check.calls());
    list.extend(check.words());
    list.extend(check.configured());
    list.extend(check.phrases());
    list.extend(check.surfaces());
    Findings { sources: vec![domain.pddl.clone(), domain.toml.clone()], list }
}

/// How each word, call and action of a domain is grounded, a line each.
pub fn grounding(domain: &Domain) -> Vec<String> {
    let vocabulary = &domain.vocabulary;
    let mut lines = vec!["words:".to_string()];
    for word in vocabulary.words() {
        let how = match vocabulary.ground(&word, &domain.config) {
            Ground::Sensed(fact) => format!("sensed: {}", fact.about),
            Ground::SensedByProgram => "sensed: by a program".into(),
            Ground::Remembered => "remembered: changes as carried-out actions say".into(),
            Ground::Fixed => "fixed: as domain.toml says in init".into(),
            Ground::Planned => "planned: changes within a plan alone".into(),
            Ground::Derived => "derived by the domain's rules".into(),
        };
        let types: String = word.types.iter().map(|t| format!(" {t}")).collect();
        lines.push(format!("  {:32} {how}", format!("({}{types})", word.name)));
    }
    lines.push("calls:".into());
    for module in &vocabulary.task.modules {
        let built_in =
            abilities::used(&domain.config.uses).flat_map(|a| a.calls).find(|c| c.name == module.name);
        let how = match (domain.config.attachments.get(&module.name), built_in) {
            (Some(program), _) => format!("program: {}", program.program.join(" ")),
            (None, Some(meaning)) => meaning.about.into(),
            (None, None) => "nothing answers it".into(),
        };
        lines.push(format!("  {:32} {how}", format!("[{}]", module.name)));
    }
    lines.push("actions:".into());
    for action in &vocabulary.task.actions {
        let config = domain.config.action.get(&action.name).cloned().unwrap_or_default();
        let how = match (&config.program, config.does.texts().as_slice()) {
            (Some(program), _) => format!("program: {}", program.join(" ")),
            (None, []) => abilities::skill(&domain.config.uses, &action.name)
                .map_or_else(|| "nothing carries it out".into(), |s| format!("skill: {}", s.about)),
            (None, steps) => format!("skills: {}", steps.join("; then ")),
        };
        let more = format!(
            "{how} (limit {:.0} s, {} tries{})",
            config.limit_s(),
            config.retries() + 1,
            config.check.as_ref().map(|c| format!(", checked by {c}")).unwrap_or_default()
        );
        lines.push(format!("  {:32} {more}", format!("({})", action.name)));
    }
    lines
}

struct Check<'a> {
    domain: &'a Domain,
}

impl Check<'_> {
    /// Where a text stands in `domain.toml`; its beginning if it stands nowhere.
    fn in_toml(&self, needles: &[&str]) -> Span {
        let text = &self.domain.toml.text;
        let found = needles.iter().find_map(|n| text.find(n).map(|at| (at, n.len())));
        let (at, len) = found.unwrap_or((0, text.lines().next().map_or(0, str::len)));
        Span { source: 1, start: at as u32, end: (at + len) as u32 }
    }

    fn table(&self, table: &str, name: &str) -> Span {
        self.in_toml(&[&format!("[{table}.{name}]"), &format!("{table}.{name}"), name])
    }

    fn skills(&self) -> String {
        let names: Vec<&str> =
            abilities::used(&self.domain.config.uses).flat_map(|a| a.skills).map(|s| s.name).collect();
        names.join(", ")
    }

    /// Every action is carried out by a skill, several, or a program, with arguments of the right types.
    fn actions(&self) -> Vec<Diagnostic> {
        let mut list = Vec::new();
        for action in &self.domain.vocabulary.task.actions {
            let config = self.domain.config.action.get(&action.name).cloned().unwrap_or_default();
            let texts = config.does.texts();
            if config.program.is_some() {
                if !texts.is_empty() {
                    let message = format!("the action `{}` has both a program and skills", action.name);
                    list.push(
                        Diagnostic::error(
                            "two-performers",
                            message,
                            self.table("action", &action.name),
                            "here",
                        )
                        .with_help("leave `program` or `does` out"),
                    );
                }
                continue;
            }
            if texts.is_empty() {
                let variables: Vec<&str> = action.parameters.iter().map(|p| p.name.as_str()).collect();
                let text = format!("{} {}", action.name, variables.join(" "));
                list.extend(self.step(&action.name, &text, action.span, "this action"));
            }
            for text in texts {
                list.extend(self.step(&action.name, text, self.in_toml(&[text]), "this step"));
            }
        }
        list
    }

    /// One step of an action.
    fn step(&self, action: &str, text: &str, span: Span, label: &str) -> Option<Diagnostic> {
        let mut tokens = text.split_whitespace();
        let name = tokens.next()?;
        let uses = &self.domain.config.uses;
        let Some(skill) = abilities::skill(uses, name) else {
            let message = match text.trim_start().strip_prefix(action) {
                Some(_) => format!("no skill carries out the action `{action}`"),
                None => format!("no skill is called `{name}`, to carry out the action `{action}`"),
            };
            let help = format!(
                "skills: {}; or a program: [action.{action}] program = [\"python3\", \"{action}.py\"]",
                self.skills()
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
        if given.len() != skill.types.len() {
            let message = format!(
                "the skill `{}` takes {} objects, not {}",
                skill.name,
                skill.types.len(),
                given.len()
            );
            return Some(Diagnostic::error("skill-arity", message, span, label).with_help(help));
        }
        let vocabulary = &self.domain.vocabulary;
        let parameters = vocabulary.action(action).unwrap_or_default();
        for (argument, wanted) in given.iter().zip(skill.types) {
            let Some(variable) = argument.strip_prefix('?') else { continue };
            let found = parameters.iter().find(|(name, _)| name[1..] == *variable.to_lowercase());
            let message = match found {
                None => format!("the action `{action}` has no parameter {argument}"),
                Some((_, of)) if !vocabulary.is_a(of, wanted) => {
                    format!("the skill `{}` takes a {wanted} where {argument} is a {of}", skill.name)
                }
                Some(_) => continue,
            };
            return Some(Diagnostic::error("skill-type", message, span, label).with_help(help));
        }
        None
    }

    /// Every call is answered.
    fn calls(&self) -> Vec<Diagnostic> {
        let known: Vec<&str> =
            abilities::used(&self.domain.config.uses).flat_map(|a| a.calls).map(|c| c.name).collect();
        let programs = &self.domain.config.attachments;
        let unanswered = |m: &&descry_planner::task::Module| {
            !known.contains(&m.name.as_str()) && !programs.contains_key(&m.name)
        };
        let modules = &self.domain.vocabulary.task.modules;
        modules
            .iter()
            .filter(unanswered)
            .map(|m| {
                let near = known.iter().min_by_key(|k| strsim::levenshtein(k, &m.name));
                let near = near.filter(|k| strsim::levenshtein(k, &m.name) <= 3);
                let hint = near.map(|k| format!("did you mean `{k}`? ")).unwrap_or_default();
                let help = format!(
                    "{hint}known: {}; or a program: [attachments.{}] program = [\"python3\", \"{}.py\"]",
                    known.join(", "),
                    m.name,
                    m.name
                );
                Diagnostic::error(
                    "no-attachment",
                    format!("nothing answers the call [{}]", m.name),
                    m.span,
                    "this module",
                )
                .with_help(help)
            })
            .collect()
    }

    /// Words that an ability states have its types; words that nothing states or changes begin somewhere.
    fn words(&self) -> Vec<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let begun = |word: &Word| {
            let lines = self.domain.config.init.iter().filter_map(|line| words::read(line).ok());
            lines.flatten().any(|(name, ..)| name == word.name)
        };
        let mut list = Vec::new();
        for word in vocabulary.words() {
            match vocabulary.ground(&word, &self.domain.config) {
                Ground::Sensed(fact) => {
                    let fits = word.types.len() == fact.types.len()
                        && word.types.iter().zip(fact.types).all(|(own, of)| vocabulary.is_a(own, of));
                    if !fits {
                        let types: Vec<String> = fact.types.iter().map(|t| format!("?x - {t}")).collect();
                        let message = format!("`{}` is stated by descry, for other arguments", word.name);
                        let help = format!(
                            "declare ({} {}): {}; or say where it comes from: [word.{}] is = \"remembered\"",
                            fact.name,
                            types.join(" "),
                            fact.about,
                            word.name
                        );
                        list.push(
                            Diagnostic::error("word-types", message, word.span, "this word").with_help(help),
                        );
                    }
                }
                Ground::Fixed if !begun(&word) => {
                    let message =
                        format!("nothing states `{}`, and no action changes it: it never holds", word.name);
                    let help = format!(
                        "say what holds in the beginning, init = [\"({} …)\"], or who states it: [word.{}] program = […]",
                        word.name, word.name
                    );
                    list.push(
                        Diagnostic::warning("never-holds", message, word.span, "this word").with_help(help),
                    );
                }
                _ => {}
            }
        }
        list
    }

    /// What `domain.toml` names is there.
    fn configured(&self) -> Vec<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let config = &self.domain.config;
        let mut list = Vec::new();
        let mut error = |code, message: String, span, help: String| {
            list.push(Diagnostic::error(code, message, span, "here").with_help(help));
        };
        for name in config.uses.iter().filter(|n| abilities::ALL.iter().all(|a| a.name != n.as_str())) {
            let known: Vec<&str> = abilities::ALL.iter().map(|a| a.name).collect();
            let span = self.in_toml(&[&format!("\"{name}\""), "uses"]);
            error(
                "no-ability",
                format!("there is no ability \"{name}\""),
                span,
                format!("known: {}", known.join(", ")),
            );
        }
        let actions: Vec<&str> = vocabulary.task.actions.iter().map(|a| a.name.as_str()).collect();
        for (name, action) in &config.action {
            if !actions.contains(&name.as_str()) {
                let help = format!("actions: {}", actions.join(", "));
                error("no-action", format!("there is no action `{name}`"), self.table("action", name), help);
                continue;
            }
            for word in action.taught() {
                let ground = vocabulary.word(&word).map(|w| vocabulary.ground(&w, config));
                if !matches!(ground, Some(Ground::Remembered)) {
                    let message = format!(
                        "what a failure of `{name}` teaches, `{word}`, is no word that is remembered"
                    );
                    let help =
                        "name a predicate of domain.pddl that no ability states, as (given-up ?to)".into();
                    error("not-remembered", message, self.in_toml(&[&format!("({word}")]), help);
                }
            }
        }
        for name in config.word.keys().filter(|n| vocabulary.word(n).is_none()) {
            let help = "declare it in :predicates or :functions of domain.pddl".into();
            error("no-word", format!("there is no word `{name}`"), self.table("word", name), help);
        }
        for name in config.objects.keys().filter(|n| !vocabulary.has_type(n)) {
            let help = "declare it in :types of domain.pddl".into();
            error("no-type", format!("there is no type `{name}`"), self.in_toml(&[name]), help);
        }
        if let Err(because) = Words::begin(self.domain) {
            error("init", because, self.in_toml(&["init"]), "as in init = [\"(open front-door)\"]".into());
        }
        list
    }

    /// Every phrase means a goal of this domain.
    fn phrases(&self) -> Vec<Diagnostic> {
        let places = Places::of_scene(self.domain);
        let lexicon = Lexicon::new(self.domain, &places);
        let mut list = Vec::new();
        for phrase in &self.domain.config.goal {
            let span = self.in_toml(&[&phrase.say]);
            let mut filled: Vec<Filled> = Vec::new();
            let mut unknown = None;
            for slot in slots_of(&phrase.say) {
                let of = type_of_slot(slot);
                let known_type = self.domain.vocabulary.has_type(of) || !lexicon.of_type(of).is_empty();
                if !known_type {
                    unknown = Some((slot, of));
                }
                let named = lexicon.of_type(of).first();
                filled.push(Filled {
                    slot: slot.into(),
                    number: filled.iter().filter(|f| f.slot == slot).count(),
                    symbol: named.map_or_else(|| "something".into(), |n| n.symbol.clone()),
                    name: String::new(),
                });
            }
            if let Some((slot, of)) = unknown {
                let types: Vec<&str> =
                    self.domain.vocabulary.task.types.iter().map(|t| t.name.as_str()).collect();
                list.push(
                    Diagnostic::error(
                        "unknown-slot",
                        format!("the slot <{slot}> wants a type `{of}`, which there is not"),
                        span,
                        "this phrase",
                    )
                    .with_help(format!("types: {}", types.join(", "))),
                );
                continue;
            }
            let answers = [&phrase.answer.achieved, &phrase.answer.not_found, &phrase.answer.cannot_tell];
            let means = phrase.means.replace("<threshold>", "0.5");
            for text in std::iter::once(&means).chain(answers.into_iter().flatten()) {
                if let Err(because) = put_in(text, &filled, |f| f.symbol.clone()) {
                    list.push(Diagnostic::error("phrase", because, span, "this phrase"));
                }
            }
            if let Ok(goal) = put_in(&means, &filled, |f| f.symbol.clone()) {
                list.extend(self.means(&goal, &filled, &lexicon, span));
            }
        }
        list
    }

    /// A goal condition, held against the domain.
    fn means(&self, goal: &str, filled: &[Filled], lexicon: &Lexicon, span: Span) -> Option<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let mut objects = String::new();
        let mut known: Vec<String> = vocabulary.task.objects.iter().map(|o| o.name.clone()).collect();
        let mut declare = |symbol: &str, of: &str| {
            if vocabulary.has_type(of) && !known.iter().any(|k| k == symbol) {
                objects.push_str(&format!(" {symbol} - {of}"));
                known.push(symbol.to_string());
            }
        };
        filled.iter().for_each(|f| declare(&f.symbol, type_of_slot(&f.slot)));
        for of in lexicon.types() {
            lexicon.of_type(of).iter().for_each(|n| declare(&n.symbol, of));
        }
        // Poses have their names from the body: one that a goal names may be there.
        for token in goal.split(|c: char| c.is_whitespace() || "()".contains(c)).filter(|t| !t.is_empty()) {
            let is_name = token.starts_with(char::is_alphabetic) && vocabulary.word(token).is_none();
            let is_operator = ["and", "or", "not", "forall", "exists", "imply", "either"].contains(&token);
            let is_type = vocabulary.has_type(token);
            if is_name && !is_operator && !is_type {
                declare(token, "pose");
            }
        }
        let problem = format!(
            "(define (problem p) (:domain {}) (:objects{objects}) (:init) (:goal {goal}))",
            vocabulary.task.domain
        );
        let findings = descry_planner::check(&self.domain.pddl, Some(&Source::new("phrase", problem)));
        let fault = findings
            .list
            .iter()
            .find(|f| f.severity == Severity::Error && f.labels.iter().any(|l| l.span.source == 1))?;
        let mut told = Diagnostic::error("phrase", fault.message.clone(), span, format!("it means {goal}"));
        if let Some(help) = &fault.help {
            told = told.with_help(help.clone());
        }
        Some(told)
    }

    /// The surfaces that are named are in the usual scene.
    fn surfaces(&self) -> Vec<Diagnostic> {
        let places = Places::of_scene(self.domain);
        if places.surfaces.is_empty() {
            return Vec::new();
        }
        let named = self.domain.config.surfaces.iter();
        let missing = named.filter(|name| !places.surfaces.iter().any(|s| symbol(s) == symbol(name)));
        missing
            .map(|name| {
                let message = format!("the scene {} has no surface \"{name}\"", self.domain.config.scene);
                let help =
                    format!("it has {}; surfaces of the map need not be named", places.surfaces.join(", "));
                Diagnostic::error("no-surface", message, self.in_toml(&[&format!("\"{name}\"")]), "here")
                    .with_help(help)
            })
            .collect()
    }
}
