//! Answers of a domain's programs, kept in the record of the run.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use descry_domains::load::Domain;
use descry_domains::program::Tape;
use descry_memory::{Draft, Record};
use descry_robots::Robot;
use descry_robots::recorded::TapedRobot;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::exit::CommandError;

/// Record kind of an exchange with a program.
const PROGRAM: &str = "program";

/// Question to a program, with its answer.
#[derive(Debug, Serialize, Deserialize)]
struct Exchange {
    asked: Value,
    answered: Value,
}

/// Recording and replay of programs' answers.
struct Programs {
    into: Arc<Record>,
    robot: Arc<TapedRobot>,
    played: Mutex<VecDeque<Exchange>>,
    /// True if programs are run for questions that have no recorded answer.
    run: bool,
    /// Reason why a replay could not continue; `None` otherwise.
    ended: Mutex<Option<String>>,
}

/// Domain whose programs' answers are recorded and replayed.
pub struct OnRecord {
    /// Domain, with its programs routed through the record.
    pub domain: Domain,
    programs: Option<Arc<Programs>>,
}

impl OnRecord {
    /// Reason why a replay could not continue, because a program's question has no recorded answer;
    /// `None` otherwise.
    pub fn ended(&self) -> Option<String> {
        self.programs.as_ref()?.ended.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Programs {
    fn end(&self, because: String) -> String {
        *self.ended.lock().unwrap_or_else(PoisonError::into_inner) = Some(because.clone());
        because
    }
}

impl std::fmt::Debug for Programs {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Programs").field("run", &self.run).finish_non_exhaustive()
    }
}

impl Tape for Programs {
    fn answer(&self, asked: &Value, live: &dyn Fn() -> Value) -> Result<Value, String> {
        let next = self.played.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
        let exchange = match next {
            Some(exchange) if exchange.asked == *asked => exchange,
            Some(other) if !self.run => {
                let text =
                    format!("the record has an answer to {} where a program is asked {asked}", other.asked);
                return Err(self.end(text));
            }
            None if !self.run => {
                return Err(self.end(format!("the record ends before a program was asked {asked}")));
            }
            _ => {
                self.played.lock().unwrap_or_else(PoisonError::into_inner).clear();
                Exchange { asked: asked.clone(), answered: live() }
            }
        };
        let body = serde_json::to_value(&exchange).map_err(|e| e.to_string())?;
        let mut draft = Draft { kept: true, ..Draft::new(PROGRAM, self.robot.now_ns().max(0)) };
        draft.meta.body = body;
        self.into.put_soon(draft).map_err(|e| e.to_string())?;
        Ok(exchange.answered)
    }
}

/// Routes the programs of a domain through the record: answers are read `from` an earlier record as
/// long as the questions are the same, and all answers are written to `into`. Further questions run
/// the programs if `run`, and end the replay otherwise.
///
/// # Errors
/// [`CommandError::Broken`] if the earlier answers cannot be read.
pub fn on_record(
    domain: &Domain,
    into: &Arc<Record>,
    from: Option<&Record>,
    robot: &Arc<TapedRobot>,
    run: bool,
) -> Result<OnRecord, CommandError> {
    let mut domain = domain.clone();
    if domain.programs().is_empty() {
        return Ok(OnRecord { domain, programs: None });
    }
    let mut played = VecDeque::new();
    let earlier = from.map_or(Ok(Vec::new()), |from| from.find(&from.own(PROGRAM)));
    for document in earlier.map_err(CommandError::broken)? {
        played.push_back(serde_json::from_value(document.body).map_err(|e| {
            CommandError::broken(format!("record {}: no answer of a program: {e}", document.id))
        })?);
    }
    let programs = Arc::new(Programs {
        into: Arc::clone(into),
        robot: Arc::clone(robot),
        played: Mutex::new(played),
        run,
        ended: Mutex::default(),
    });
    domain.tape = Some(Arc::clone(&programs) as Arc<dyn Tape>);
    Ok(OnRecord { domain, programs: Some(programs) })
}

/// Checks that the programs which a record names may be run on this machine.
///
/// # Errors
/// [`CommandError::BadInput`] naming the programs, unless running them is `allowed` or there are
/// none.
pub fn check_allowed(domain: &Domain, robot: &str, place: &str, allowed: bool) -> Result<(), CommandError> {
    let one = |(name, command): &(&str, &[String])| format!("\n    {name}: {}", command.join(" "));
    let elsewhere = robot.split_once(':').filter(|(kind, _)| ["program", "socket"].contains(kind));
    let body = elsewhere.map(|(_, at)| format!("\n    the body: {at}"));
    let all: String = body.into_iter().chain(unbound(domain).iter().map(one)).collect();
    if allowed || all.is_empty() {
        return Ok(());
    }
    let text = format!(
        "{place}: its record names programs that would be run or spoken with:{all}\n  allow that with --allow-programs, if you trust them"
    );
    Err(CommandError::BadInput(text))
}

/// Programs of a domain, by name, that no function of the caller replaces.
fn unbound(domain: &Domain) -> Vec<(&str, &[String])> {
    let config = &domain.config;
    let calls = config.attachments.iter().map(|(name, p)| ("attachments", name, Some(&p.program)));
    let words = config.word.iter().map(|(name, word)| ("word", name, word.program.as_ref()));
    let actions = config.action.iter().map(|(name, action)| ("action", name, action.program.as_ref()));
    let runs = |(table, name, program): (&str, &'_ String, Option<&'_ Vec<String>>)| {
        domain.functions.of(table, name).is_none().then_some(program).flatten().is_some()
    };
    let all = calls.chain(words).chain(actions).filter(|of| runs(*of));
    all.filter_map(|(_, name, program)| Some((name.as_str(), program?.as_slice()))).collect()
}
