//! `descry plan DOMAIN PROBLEM`: a plan, or why there is none.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use descry_planner::{
    Attachments, Findings, Outcome, Plan, PlanError, Statistics, Task, endless, number_text,
};
use serde::Serialize;
use serde_json::json;

use crate::commands::input::{self, AttachmentArguments};
use descry_agent::exit::{CommandError, Exit};
use descry_agent::stop::Stop;
use descry_agent::why_not;

/// Arguments of `descry plan`.
#[derive(clap::Args)]
pub struct Arguments {
    /// PDDL domain
    #[arg(required_unless_present = "portfolio")]
    domain: Option<PathBuf>,
    /// PDDL problem
    #[arg(required_unless_present = "portfolio")]
    problem: Option<PathBuf>,
    /// Give up after so many seconds
    #[arg(long, value_name = "S")]
    time_limit: Option<f64>,
    /// Give up before the process takes more memory than this
    #[arg(long, value_name = "MB")]
    memory_limit: Option<u64>,
    /// Go on improving the plan until the time limit
    #[arg(long)]
    anytime: bool,
    /// End with the first plan, as the search has found it
    #[arg(long, conflicts_with = "anytime")]
    first: bool,
    /// Prove that no plan is better, or say none at all: A* with LM-cut, where actions take no time. Says the bound while it goes on
    #[arg(long, conflicts_with_all = ["anytime", "first", "threads"])]
    optimal: bool,
    /// Print the searches that are tried where actions take no time: engine, heuristics, shares of work, and what their ends prove
    #[arg(long)]
    portfolio: bool,
    /// How many searches may go on side by side, where actions take no time; the plan is the same [default: 1]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Decides every choice that is left open
    #[arg(long, default_value_t = 0, value_parser = input::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Leave a technique out, for ablation studies; may be given several times
    #[arg(long, value_name = "TECHNIQUE", value_parser = technique)]
    without: Vec<descry_planner::Technique>,
    /// Write the plan to a file (with --anytime, each better one replaces it)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw the plan as a Gantt chart, as SVG
    #[arg(long, value_name = "FILE")]
    gantt: Option<PathBuf>,
    /// Say besides why an action is not in the plan: what it lacks, whether a plan can have it, what that takes
    #[arg(long, value_name = "(ACTION …)")]
    why_not: Option<String>,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    attachments: AttachmentArguments,
}

/// Technique by its name.
fn technique(name: &str) -> Result<descry_planner::Technique, String> {
    descry_planner::Technique::named(name).ok_or_else(|| {
        let names: Vec<&str> = descry_planner::TECHNIQUES.iter().map(|(_, name, _)| *name).collect();
        format!("expected one of: {}", names.join(", "))
    })
}

/// Outcome of planning, as printed in JSON.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Status {
    Solved,
    Unsolvable,
    OutOfTime,
    OutOfMemory,
    Untried,
}

pub(super) fn run(arguments: &Arguments, stop: &Stop) -> Result<Exit, CommandError> {
    let started = Instant::now();
    let (Some(domain_path), Some(problem_path)) = (&arguments.domain, &arguments.problem) else {
        return portfolio(arguments.json);
    };
    if arguments.time_limit.is_some_and(|s| s.is_nan() || s <= 0.0) {
        return Err(CommandError::BadInput("--time-limit takes seconds, above 0".into()));
    }
    let (domain, problem) = (input::source(domain_path)?, input::source(problem_path)?);
    let task = Task::read(&domain, &problem).map_err(|f| CommandError::BadInput(input::drawn(&f)))?;
    let attachments = arguments.attachments.bind(domain_path, &task)?;
    let deadline = arguments.time_limit.map(|s| started + Duration::from_secs_f64(s.min(1e9)));
    let told = stop;
    let is_asked = || told.is_asked();
    let stop = || is_asked() || deadline.is_some_and(|d| Instant::now() >= d);
    let options = descry_planner::Options {
        anytime: arguments.anytime,
        first: arguments.first,
        seed: arguments.seed,
        threads: arguments.threads,
        without: arguments.without.iter().copied().collect(),
        memory_limit_bytes: arguments.memory_limit.map(|mb| mb << 20),
        memory_used: used_bytes().map(|_| (|| used_bytes().unwrap_or(0)) as fn() -> u64),
        ..descry_planner::Options::default()
    };
    let (found, endless) = searched(arguments, &task, &attachments, &options, started, &stop)?;
    let outcome = match found {
        Err(PlanError::Untried(findings)) => return untried(&findings, arguments.json, started),
        other => other.map_err(failed)?,
    };
    let signal = is_asked().then(|| told.signal());
    let (status, exit) = match &outcome {
        Outcome::Solved { .. } => (Status::Solved, Exit::Done),
        Outcome::Unsolvable { .. } => (Status::Unsolvable, Exit::Unsolvable),
        // An improvement that was cut short leaves a plan, which is what was asked for.
        Outcome::OutOfTime { best: Some(_), .. } | Outcome::OutOfMemory { best: Some(_), .. } => {
            (Status::Solved, Exit::Done)
        }
        Outcome::OutOfTime { .. } => (Status::OutOfTime, Exit::OutOfTime),
        Outcome::OutOfMemory { .. } => (Status::OutOfMemory, Exit::OutOfTime),
    };
    if let (Some(path), Some(plan)) = (&arguments.out, outcome.plan()) {
        write_plan(path, plan)?;
    }
    if let (Some(path), Some(plan)) = (&arguments.gantt, outcome.plan()) {
        let drawn = std::fs::write(path, descry_pages::gantt::svg(plan));
        drawn.map_err(|e| {
            CommandError::BadInput(format!(
                "--gantt {}: {e}\n  expected a file that can be written",
                path.display()
            ))
        })?;
    }
    let asked = arguments.why_not.as_deref();
    let answer = |asked| why_not::answer(&task, &attachments, outcome.plan(), asked, &options, &stop);
    let answer = asked.map(answer).transpose()?;
    if arguments.json {
        print_json((status, endless), &outcome, answer.as_ref(), started)?;
    } else {
        let cut = signal.map(|_| "stopped").or_else(|| stop().then_some("out of time"));
        show(&task, &status, &outcome, arguments.out.is_some(), started, cut)?;
        if let Some(answer) = answer {
            input::narrate_fitted(&answer.said(outcome.plan()));
        }
    }
    Ok(signal.map_or(exit, Exit::of_signal))
}

/// Searches for a plan and reports results and bounds meanwhile; also returns a note if the metric seems
/// to have no best value.
fn searched(
    arguments: &Arguments,
    task: &Task,
    attachments: &Attachments,
    options: &descry_planner::Options,
    started: Instant,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(Result<Outcome, PlanError>, Option<String>), CommandError> {
    let told = |said: &str| match arguments.json {
        true => (),
        false => input::narrate(&format!("{:8.2} s: {said}", started.elapsed().as_secs_f64())),
    };
    if arguments.optimal {
        let mut told_at: Option<Instant> = None;
        let mut on_bound = |bound: f64| {
            if told_at.is_none_or(|told_at| told_at.elapsed() >= BETWEEN_BOUNDS) {
                told_at = Some(Instant::now());
                told(&bounded(task, bound));
            }
        };
        let found = descry_planner::plan_optimally(task, attachments, options, stop, &mut on_bound);
        return Ok((found, None));
    }
    let (mut unwritten, mut endless) = (Ok(()), None);
    let mut on_plan = |plan: &Plan| {
        if let Some(path) = &arguments.out {
            unwritten = write_plan(path, plan);
        }
        if arguments.anytime {
            told(&summary(plan));
        }
        if arguments.anytime && endless.is_none() {
            endless = ever_better(task, attachments, plan);
            endless.iter().filter(|_| !arguments.json).for_each(|said| input::narrate(said));
        }
    };
    let found = descry_planner::plan(task, attachments, options, stop, &mut on_plan);
    unwritten?;
    Ok((found, endless))
}

/// Minimum interval between reported bounds.
const BETWEEN_BOUNDS: Duration = Duration::from_secs(1);

/// Sentence on a proven bound of the metric or, without a metric, of the number of steps.
fn bounded(task: &Task, bound: f64) -> String {
    let bound = number_text(bound);
    match &task.metric {
        None => format!("no plan has fewer than {bound} steps"),
        Some(metric) if metric.minimise => format!("no plan costs less than {bound}"),
        Some(_) => format!("no plan has a metric above {bound}"),
    }
}

/// Prints the configurations of the portfolio, and the rounds in which they run.
fn portfolio(as_json: bool) -> Result<Exit, CommandError> {
    use descry_planner::portfolio::{PORTFOLIO, ROUND_FACTOR, ROUNDS, SHORT_SHARE};
    let names = |round: &[usize]| -> Vec<&str> {
        round.iter().map(|&place| PORTFOLIO[place].technique.name()).collect()
    };
    let rounds: Vec<Vec<&str>> = ROUNDS.iter().map(|round| names(round)).collect();
    if as_json {
        let said = json!({
            "configurations": PORTFOLIO,
            "techniques": descry_planner::TECHNIQUES.map(|(_, name, what)| json!({"name": name, "description": what})),
            "rounds": rounds,
            "short_round_divisor": SHORT_SHARE,
            "round_factor": ROUND_FACTOR,
        });
        input::print_json(&said)?;
        return Ok(Exit::Done);
    }
    for configuration in &PORTFOLIO {
        input::print_text(&told(configuration))?;
    }
    for (index, round) in rounds.iter().enumerate() {
        let share = 100.0 / round.len() as f64;
        let when = match index {
            0 => format!("round 1, 1/{SHORT_SHARE} of the work"),
            _ => format!(
                "rounds {}, {}, …, each {ROUND_FACTOR} times the work of the one before",
                index + 1,
                index + 3
            ),
        };
        input::print_text(&format!("{when}; {share:.0} % each: {}", round.join(" · ")))?;
    }
    input::print_text("techniques, each of which `--without` leaves out:")?;
    for (_, name, what) in descry_planner::TECHNIQUES {
        input::print_text(&format!("{name:17} {what}"))?;
    }
    Ok(Exit::Done)
}

/// Line that describes a configuration of the portfolio.
fn told(configuration: &descry_planner::portfolio::Configuration) -> String {
    use descry_planner::portfolio::{Engine, Proof};
    let yes = |holds: bool, said: &'static str| if holds { said } else { "" };
    let engine = match configuration.engine {
        Engine::LazyGreedy { costs, lookahead, newest_first, prefers_landmarks } => format!(
            "lazy greedy best-first; h_FF ({}) and landmark count alternate; preferred operators of h_FF{}; {} tie-breaking{}",
            if costs { "costs plus one" } else { "unit costs" },
            yes(prefers_landmarks, " and landmarks"),
            if newest_first { "LIFO" } else { "FIFO" },
            yes(lookahead, "; follows relaxed plans (YAHSP lookahead)"),
        ),
        Engine::Width { prunes } => {
            format!(
                "best-first width search; novelty, goal count{}",
                yes(prunes, "; prunes what is not novel")
            )
        }
        Engine::Satisfiability => "planning as satisfiability, parallel steps".to_string(),
    };
    let proof = match configuration.proof {
        Proof::Unsolvable => "its end proves unsolvability",
        Proof::UnsolvableWithoutBound => "its end proves unsolvability where no cost bound is given",
        Proof::Nothing => "its end proves nothing",
    };
    format!(
        "{:17} {engine}; {proof}{}",
        configuration.technique.name(),
        yes(configuration.is_capped, "; work capped a turn")
    )
}

/// Resident memory of the process, bytes; `u64::MAX` once the address space is nearly used up, `None` if
/// unknown.
fn used_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kilobytes = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    };
    let (resident, addresses) = (kilobytes("VmRSS:")? << 10, kilobytes("VmSize:")? << 10);
    let most = *ADDRESS_SPACE_BYTES.get_or_init(address_space_bytes);
    let used_up = most.is_some_and(|most| addresses > most - most / ADDRESS_RESERVE);
    Some(if used_up { u64::MAX } else { resident })
}

/// Part of the address space kept in reserve for allocations between two checks, as a divisor.
const ADDRESS_RESERVE: u64 = 16;
static ADDRESS_SPACE_BYTES: OnceLock<Option<u64>> = OnceLock::new();

/// Limit of the address space, bytes, if any.
fn address_space_bytes() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

fn print_json(
    (status, endless): (Status, Option<String>),
    outcome: &Outcome,
    answer: Option<&why_not::Answer>,
    started: Instant,
) -> Result<(), CommandError> {
    let plan = outcome.plan();
    let why = match outcome {
        Outcome::Unsolvable { why, .. } => Some(why),
        _ => None,
    };
    let Statistics { evaluated, expanded, plans, actions, optimal, lower_bound, scored_only, attachments } =
        outcome.statistics();
    let mut said = json!({
        "status": status,
        "cost": plan.and_then(|p| p.cost),
        "makespan": plan.and_then(Plan::makespan_s),
        "steps": plan.map(|p| p.steps.len()),
        "time_s": started.elapsed().as_secs_f64(),
        "evaluated": evaluated,
        "expanded": expanded,
        "plans": plans,
        "actions": actions,
        "optimal": optimal,
        "lower_bound": lower_bound,
        "scored_only": scored_only,
        "endless": endless,
        "attachments": attachments,
        // A proof takes their answers as they are.
        "rests_on": why.map(|_| attachments.keys().collect::<Vec<_>>()),
        "why": why.map(|why| why.to_string()),
        // A proof holds for plans in which none of these overlaps itself.
        "overlapping": why.map(|why| &why.overlapping),
        "findings": why.map(|why| &why.findings),
        "plan": plan.map(|p| &p.steps),
    });
    if let Some(answer) = answer {
        said["why_not"] = json!(answer);
    }
    input::print_json(&said)
}

fn show(
    task: &Task,
    status: &Status,
    outcome: &Outcome,
    written: bool,
    started: Instant,
    cut: Option<&str>,
) -> Result<(), CommandError> {
    let time = format!(
        "{:.3} s, {} states evaluated",
        started.elapsed().as_secs_f64(),
        outcome.statistics().evaluated
    );
    let bound = outcome.statistics().lower_bound.map_or(String::new(), |b| format!("; {}", bounded(task, b)));
    match (outcome, outcome.plan()) {
        (Outcome::Unsolvable { why, .. }, _) => {
            let but_for = match why.overlapping.is_empty() {
                true => "",
                false => " as long as no action overlaps itself",
            };
            let asked: Vec<&str> = outcome.statistics().attachments.keys().map(String::as_str).collect();
            let said = match asked.is_empty() {
                true => "proven unsolvable".to_string(),
                false => format!("unsolvable if the answers of attachments are right ({})", asked.join(", ")),
            };
            input::print_text(&format!("{said}{but_for}"))?;
            input::print_findings(&why.findings)?;
            input::narrate(&time);
        }
        (_, Some(plan)) => {
            if !written {
                input::print_text(plan.to_string().trim_end())?;
            }
            let proof = if outcome.statistics().optimal { ", proven optimal" } else { "" };
            input::narrate(&format!("{}{proof} ({time})", summary(plan)));
            if outcome.statistics().scored_only {
                input::narrate(
                    "  not every preference was planned for: those that the metric does not count, and \
                     some on times or attachments, were only looked at afterwards",
                );
            }
        }
        _ if matches!(status, Status::OutOfMemory) => {
            input::narrate(&format!("out of memory, no plan yet{bound} ({time})"))
        }
        _ => input::narrate(&match cut {
            Some(cut) => format!("{cut}, no plan yet{bound} ({time})"),
            None => {
                format!(
                    "no plan was found, and none is ruled out: the search has left possibilities out ({time})"
                )
            }
        }),
    }
    for (name, calls) in &outcome.statistics().attachments {
        input::narrate(&format!(
            "  [{name}] {} calls, {} from the cache, {:.3} s",
            calls.calls + calls.relaxed,
            calls.hits,
            calls.time_s
        ));
    }
    Ok(())
}

/// Note that the metric seems to have no best value; `None` unless the plan shows this.
fn ever_better(task: &Task, attachments: &Attachments, plan: &Plan) -> Option<String> {
    let (step, gain) = endless(task, attachments, plan)?;
    let arguments: String = step.arguments.iter().map(|name| format!(" {name}")).collect();
    Some(format!(
        "  the metric seems to have no best value: ({}{arguments}) can be done ever again and makes it better by {} each time; \
         this goes on until a limit ends it",
        step.action,
        number_text(gain)
    ))
}

fn summary(plan: &Plan) -> String {
    let cost = plan.cost.map_or(String::new(), |cost| format!(", cost {}", number_text(cost)));
    let makespan = plan.makespan_s().map_or(String::new(), |s| format!(", makespan {s:.3}"));
    format!("{} steps{cost}{makespan}", plan.steps.len())
}

fn write_plan(path: &Path, plan: &Plan) -> Result<(), CommandError> {
    std::fs::write(path, plan.to_string())
        .map_err(|e| CommandError::BadInput(format!("--out {}: {e}", path.display())))
}

/// Reports constraints that no search supports, so that there is neither a plan nor a proof of
/// unsolvability.
fn untried(findings: &Findings, as_json: bool, started: Instant) -> Result<Exit, CommandError> {
    input::narrate(&input::drawn(findings));
    if as_json {
        let time_s = started.elapsed().as_secs_f64();
        input::print_json(&json!({ "status": Status::Untried, "time_s": time_s, "findings": findings }))?;
    }
    Ok(Exit::OutOfTime)
}

fn failed(error: PlanError) -> CommandError {
    match (error.findings(), &error) {
        (Some(findings), _) => CommandError::BadInput(input::drawn(findings)),
        (None, PlanError::Internal { .. }) => CommandError::Bug(error.to_string()),
        (None, _) => CommandError::bad_input(error),
    }
}
