//! The programs that a domain names: behind calls, behind facts, behind actions.

use std::collections::BTreeMap;
use std::sync::Arc;

use descry_planner::{Attachment, Attachments, CallError};
use descry_skills::{Asked, Call, Skill};
use serde_json::{Value, json};

use crate::config::Program;
use crate::load::Domain;
use crate::program::ProgramAttachment;
use crate::vocabulary::Word;
use crate::words;

/// All programs of a domain, each started by its first question.
pub struct Programs {
    calls: Vec<(String, Arc<ProgramAttachment>)>,
    facts: BTreeMap<String, ProgramAttachment>,
    actions: BTreeMap<String, ProgramAction>,
}

/// Action that a program carries out.
pub struct ProgramAction {
    program: Arc<ProgramAttachment>,
}

impl Programs {
    /// Programs named by a domain.
    pub fn of(domain: &Domain) -> Self {
        let bind = |p: Program, table: &str, name: &str| {
            let function = domain.functions.of(table, name);
            ProgramAttachment::new(p, domain.folder.clone()).answered_by(function).on(domain.tape.clone())
        };
        let config = &domain.config;
        let calls = config.attachments.iter();
        let calls = calls.map(|(name, p)| (name.clone(), Arc::new(bind(p.clone(), "attachments", name))));
        let facts = config.word.iter().filter_map(|(name, word)| {
            let program = word.program.clone()?;
            let program = Program { program, time_limit_s: word.time_limit_s, reads: Vec::new() };
            Some((name.clone(), bind(program, "word", name)))
        });
        let actions = config.action.iter().filter_map(|(name, action)| {
            let program = action.program.clone()?;
            let program = Program { program, time_limit_s: action.limit_s(), reads: Vec::new() };
            Some((name.clone(), ProgramAction { program: Arc::new(bind(program, "action", name)) }))
        });
        Self { calls: calls.collect(), facts: facts.collect(), actions: actions.collect() }
    }

    /// Binds the programs that answer calls.
    pub fn bind(&self, attachments: &mut Attachments) {
        for (name, program) in &self.calls {
            attachments.insert_shared(name.clone(), Arc::clone(program) as Arc<dyn Attachment>);
        }
    }

    /// Program of an action, if it has one.
    pub fn action(&self, name: &str) -> Option<&ProgramAction> {
        self.actions.get(name)
    }

    /// Facts that the program of a predicate or function states now, one PDDL line each. The question is
    /// `{"id": 0, "fact": "raining", "objects": ["table", …]}`, the answer `{"id": 0, "value":
    /// ["(raining)"]}`. If senses were read, the question contains their last readings: `"readings":
    /// {"rain-gauge": 1.5}`.
    ///
    /// # Errors
    ///
    /// The reason why there is no usable answer.
    pub fn state(
        &self,
        word: &Word,
        objects: &[String],
        readings: &BTreeMap<String, Value>,
    ) -> Result<Vec<String>, String> {
        let Some(program) = self.facts.get(&word.name) else { return Ok(Vec::new()) };
        let failed =
            |because: String| format!("the program that says what holds of {}: {because}", word.name);
        let mut question = json!({ "fact": word.name, "objects": objects });
        if !readings.is_empty() {
            question["readings"] = json!(readings);
        }
        let answer = program.ask_one(question).map_err(|e| failed(e.to_string()))?;
        let lines: Vec<String> = serde_json::from_value(answer["value"].clone()).map_err(|_| {
            failed(format!("answered {answer}, expected {{\"value\": [\"({} …)\"]}}", word.name))
        })?;
        for line in &lines {
            for (name, arguments, _) in words::read(line).map_err(|e| failed(format!("\"{line}\": {e}")))? {
                let unknown = arguments.iter().find(|a| !objects.contains(a));
                let is_value = line.trim_start_matches(['(', ' ']).starts_with('=');
                if name != word.name || arguments.len() != word.types.len() || (is_value != word.is_number) {
                    return Err(failed(format!("\"{line}\" is not about ({})", word.name)));
                }
                if let Some(unknown) = unknown {
                    return Err(failed(format!("\"{line}\": there is no object {unknown}")));
                }
            }
        }
        Ok(lines)
    }
}

impl ProgramAction {
    /// Skill that carries a call out by its program. The question is `{"id": 0, "action": "greet",
    /// "arguments": ["anna"]}`, the answer `{"id": 0, "value": "said hello"}`; `{"id": 0, "error": "why
    /// not"}` and `false` are retried as the domain says.
    pub fn perform(&self, call: &Call) -> Box<dyn Skill> {
        let program = Arc::clone(&self.program);
        let question = json!({ "action": call.action, "arguments": call.arguments });
        let ask = move || match program.ask_one(question.clone()) {
            Ok(answer) => match &answer["value"] {
                Value::String(word) => Asked::Done(word.clone()),
                Value::Null | Value::Bool(true) => Asked::Done("done".into()),
                Value::Bool(false) => Asked::Failed { because: "it answered false".into(), passing: true },
                other => Asked::Done(other.to_string()),
            },
            Err(CallError::Failed(because)) => Asked::Failed { because, passing: true },
            Err(other) => Asked::Failed { because: other.to_string(), passing: false },
        };
        Box::new(descry_skills::Program { ask: Arc::new(ask) })
    }
}
