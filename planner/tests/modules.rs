//! The published domains of PDDL/M, with attachments that compute what their texts suggest.
//!
//! They read `../shared/pddl/modules`, and run when they are asked for; `attachments` tests the same with small tasks.

use std::path::{Path, PathBuf};

use descry_planner::{
    Answer, Attachment, Attachments, Call, CallError, CallKind, FactValue, Options, Plan, Read, Source, Task,
    plan,
};

fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/pddl/modules");
    assert!(folder.is_dir(), "{} is not there", folder.display());
    folder
}

fn solved(domain: &Path, problem: &Path, attachments: &Attachments) -> Plan {
    let read = |path: &Path| {
        let text =
            std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        Source::new(path.display().to_string(), text)
    };
    let task = match Task::read(&read(domain), &read(problem)) {
        Ok(task) => task,
        Err(findings) => panic!("{}", findings.render(false)),
    };
    let options = Options { evaluation_limit: Some(8_000), ..Options::default() };
    match plan(&task, attachments, &options, &|| false, &mut |_| {}) {
        Ok(outcome) => match outcome.plan() {
            Some(plan) => plan.clone(),
            None => panic!("{}: {outcome:?}", problem.display()),
        },
        Err(error) => panic!("{}: {error}", problem.display()),
    }
}

/// Adds one to each number that the module writes, which it reads.
struct Count {
    symbol: &'static str,
    of_argument: bool,
}

impl Attachment for Count {
    fn reads(&self) -> Vec<Read> {
        let positions = if self.of_argument { vec![Some(0)] } else { Vec::new() };
        vec![Read::At(self.symbol.to_string(), positions)]
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        let before = match &call.readings[0].value {
            FactValue::Number(number) => *number,
            _ => 0.0,
        };
        Ok(Answer::Writes(vec![FactValue::Number(before + 1.0)]))
    }
}

fn yes(_: &Call) -> Result<Answer, CallError> {
    Ok(Answer::Truth(true))
}

fn no(_: &Call) -> Result<Answer, CallError> {
    Ok(Answer::Truth(false))
}

fn pose(_: &Call) -> Result<Answer, CallError> {
    Ok(Answer::Writes([1.0, 2.0, 0.8, 0.0, 0.0, 0.0, 1.0].map(FactValue::Number).to_vec()))
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn a_dear_edge_is_driven_around() {
    let folder = folder();
    let mut attachments = Attachments::new();
    attachments.insert("costDrive", |call: &Call| {
        let dear = [&*call.arguments[0], &*call.arguments[1]] == ["l1", "l3"];
        Ok(Answer::Number(if dear { 100.0 } else { 10.0 }))
    });
    let folder = folder.join("costtest");
    let plan = solved(&folder.join("domain_cost.pddl"), &folder.join("p01.pddl"), &attachments);
    let goals: Vec<&str> = plan.steps.iter().map(|step| step.arguments[1].as_str()).collect();
    assert_eq!(goals, ["l2", "l3"]);
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn the_crew_is_planned_and_effects_are_counted() {
    let folder = folder();
    let folder = folder.join("crewplanning-modules");
    for problem in ["p01", "p02", "p03"] {
        let mut attachments = Attachments::new();
        attachments.insert("available", yes);
        attachments.insert("effectCall", Count { symbol: "effectsCalled", of_argument: false });
        let problem = folder.join(format!("{problem}.pddl"));
        solved(&folder.join("domain-modules.pddl"), &problem, &attachments);
        assert!(attachments.statistics()["effectCall"].calls > 0);
    }
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn goals_that_only_an_effect_module_reaches_are_found() {
    let folder = folder();
    let folder = folder.join("grounding-modules");
    for problem in ["p01", "p02"] {
        let mut attachments = Attachments::new();
        attachments.insert("writeResult", Count { symbol: "x", of_argument: true });
        let plan = solved(
            &folder.join("domain-modules.pddl"),
            &folder.join(format!("{problem}.pddl")),
            &attachments,
        );
        assert_eq!(plan.steps.len(), 5);
    }
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn peg_solitaire_with_a_check_and_a_count() {
    let folder = folder();
    let folder = folder.join("modules-test");
    for problem in ["p00", "p01", "p02"] {
        let mut attachments = Attachments::new();
        attachments.insert("checkTrue", yes);
        attachments.insert("countIt", Count { symbol: "stepped-on", of_argument: true });
        solved(&folder.join("domain-modules.pddl"), &folder.join(format!("{problem}.pddl")), &attachments);
    }
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn calls_may_be_negated() {
    let folder = folder();
    let folder = folder.join("negated-modules");
    for domain in ["domain-modules", "domain-negated"] {
        for problem in ["p01", "p02"] {
            let mut attachments = Attachments::new();
            attachments.insert("checkTrue", yes);
            attachments.insert("checkFalse", no);
            let (domain, problem) =
                (folder.join(format!("{domain}.pddl")), folder.join(format!("{problem}.pddl")));
            assert_eq!(solved(&domain, &problem, &attachments).steps.len(), 5);
        }
    }
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn packages_are_loaded_where_the_attachment_allows() {
    let folder = folder();
    let folder = folder.join("transport-modules");
    for problem in ["p01", "p02", "p03"] {
        let mut attachments = Attachments::new();
        attachments.insert("can_load", |call: &Call| Ok(Answer::Truth(&*call.arguments[0] != "truck-1")));
        let plan = solved(&folder.join("domain.pddl"), &folder.join(format!("{problem}.pddl")), &attachments);
        let picked = plan.steps.iter().filter(|step| step.action == "pick-up");
        assert!(picked.clone().count() > 0 && picked.into_iter().all(|step| step.arguments[0] != "truck-1"));
    }
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn a_room_is_tidied() {
    let folder = folder();
    let mut attachments = Attachments::new();
    attachments.insert("planning_scene_pathCost", |_: &Call| Ok(Answer::Number(10.0)));
    attachments.insert("canPutdown", yes);
    attachments.insert("wipePointFree", yes);
    attachments.insert("updatePutdownPose", pose);
    let folder = folder.join("tidyup");
    let plan = solved(&folder.join("domain_modules.pddl"), &folder.join("problem.pddl"), &attachments);
    assert!(plan.steps.iter().any(|step| step.action == "putdown-object"));
    assert!(attachments.statistics()["updatePutdownPose"].calls > 0);
}

/// Position of a table of the task, metres; a robot that drove to it stands there, too.
fn table_m(name: &str) -> (f64, f64) {
    if name.ends_with('1') { (4.81, 5.28) } else { (0.5, 6.44) }
}

struct NearTable;

impl Attachment for NearTable {
    fn reads(&self) -> Vec<Read> {
        vec![Read::All("robot-x".to_string()), Read::All("robot-y".to_string())]
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        let (x, y) = table_m(&call.arguments[0]);
        let (dx, dy) = (call.number("robot-x", &[])? - x, call.number("robot-y", &[])? - y);
        Ok(Answer::Truth(dx.hypot(dy) < 0.9))
    }
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl/modules"]
fn drive_poses_are_proposed_by_a_grounding_module() {
    let folder = folder();
    let mut attachments = Attachments::new();
    attachments.insert("determine_drive_pose", |_: &Call| {
        Ok(Answer::Proposals(vec!["beside_table1".into(), "beside_table2".into()]))
    });
    attachments.insert("robot_near_table", NearTable);
    // One function for a cost and a condition, as in the domain; the proposed pose comes behind the table.
    attachments.insert("navigation_cost_grounding", |call: &Call| {
        Ok(match call.kind {
            CallKind::Condition => Answer::Truth(call.arguments[1].ends_with(&*call.arguments[0])),
            _ => Answer::Number(20.0),
        })
    });
    attachments.insert("navigation_effect_grounding", |call: &Call| {
        let (x, y) = table_m(&call.arguments[0]);
        Ok(Answer::Writes([x + 0.6, y, 3.1, 0.1].map(FactValue::Number).to_vec()))
    });
    attachments.insert("can_pickup", yes);
    attachments.insert("can_putdown", yes);
    attachments.insert("pickup_effect", pose);
    attachments.insert("putdown_effect", pose);
    let folder = folder.join("tidyup-grounding");
    let (domain, problem) = ("domain_grounding_tidyup.pddl", "problem_grounding_modules.pddl");
    let plan = solved(&folder.join(domain), &folder.join(problem), &attachments);
    let drives = plan.steps.iter().filter(|step| step.action == "move-robot-to-table");
    assert!(drives.clone().count() >= 2);
    assert!(drives.into_iter().all(|step| step.arguments[1] == format!("beside_{}", step.arguments[0])));
}
