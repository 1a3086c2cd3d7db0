//! The tools: their parameters, and the command lines that carry them out.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::Served;

/// Default time limit of planning, seconds.
const PLANNING_S: f64 = 60.0;

/// Tool that assistants can call.
pub(super) struct Tool {
    pub(super) name: &'static str,
    about: &'static str,
    parameters: &'static [Parameter],
    kind: Kind,
}

/// Effect of a tool on the world.
#[derive(PartialEq)]
enum Kind {
    /// Reads and computes only.
    Reads,
    /// Writes a run, and moves the body if it is real.
    Runs,
}

/// A parameter of a tool.
struct Parameter {
    name: &'static str,
    about: &'static str,
    holds: Holds,
    is_required: bool,
}

/// Type of a parameter.
#[derive(PartialEq)]
enum Holds {
    /// PDDL or plan text, or the path of a file with it.
    Source,
    /// Free text.
    Words,
    /// A domain's folder, or the name of a built-in domain.
    Domain,
    /// A scene file, or the name of a scene of the domain.
    Scene,
    /// Path of an existing file or folder.
    Path,
    /// Paths of existing files or folders.
    Paths,
    Number,
    Whole,
    Flag,
}

const fn needed(name: &'static str, holds: Holds, about: &'static str) -> Parameter {
    Parameter { name, about, holds, is_required: true }
}

const fn optional(name: &'static str, holds: Holds, about: &'static str) -> Parameter {
    Parameter { name, about, holds, is_required: false }
}

const DOMAIN_TEXT: Parameter = needed("domain", Holds::Source, "PDDL domain: its text, or a file");
const PROBLEM_TEXT: Parameter = needed("problem", Holds::Source, "PDDL problem: its text, or a file");
const DOMAIN: Parameter =
    optional("domain", Holds::Domain, "built-in domain (tabletop, home, …) or a domain's folder");
const SCENE: Parameter =
    optional("scene", Holds::Scene, "scene of the simulated robot: its name in the domain, or a file");

/// All tools.
pub(super) static TOOLS: [Tool; 9] = [
    Tool {
        name: "check",
        about: "Finds what is wrong with a PDDL domain (and a problem), or with a robot's domain: each finding with its place, why, and a mend",
        parameters: &[
            needed(
                "domain",
                Holds::Source,
                "PDDL domain: its text, or a file; or a robot's domain: its folder, or a built-in one",
            ),
            optional("problem", Holds::Source, "PDDL problem: its text, or a file"),
        ],
        kind: Kind::Reads,
    },
    Tool {
        name: "format",
        about: "Lays out PDDL or a plan; comments stay, and what is read is the same",
        parameters: &[needed("text", Holds::Words, "a domain, a problem or a plan")],
        kind: Kind::Reads,
    },
    Tool {
        name: "plan",
        about: "Finds a plan, or proves that there is none, or says that time ran out",
        parameters: &[
            DOMAIN_TEXT,
            PROBLEM_TEXT,
            optional("time_limit_s", Holds::Number, "seconds to search [default: 60]"),
            optional("anytime", Holds::Flag, "go on improving the plan until the time limit"),
        ],
        kind: Kind::Reads,
    },
    Tool {
        name: "validate",
        about: "Checks a plan against its domain and problem, and says which step fails and why",
        parameters: &[
            DOMAIN_TEXT,
            PROBLEM_TEXT,
            needed("plan", Holds::Source, "plan in IPC form: its text, or a file"),
        ],
        kind: Kind::Reads,
    },
    Tool {
        name: "why_not",
        about: "Says why an action is not in the plan: what it lacks, whether a plan can have it, what that takes",
        parameters: &[
            DOMAIN_TEXT,
            PROBLEM_TEXT,
            needed("action", Holds::Words, "a ground action, such as (move a b)"),
        ],
        kind: Kind::Reads,
    },
    Tool {
        name: "goals",
        about: "Lists what may be said to a robot with a domain, and the names of things and places",
        parameters: &[DOMAIN, SCENE],
        kind: Kind::Reads,
    },
    Tool {
        name: "run",
        about: "Has a robot pursue a goal: plans, drives, looks, and answers achieved, not_found, cannot_tell, impossible or failed, with what it rests on",
        parameters: &[
            needed("goal", Holds::Words, "in the words of the domain, such as: find cup A in the kitchen"),
            DOMAIN,
            SCENE,
            optional(
                "seed",
                Holds::Whole,
                "fixes the arrangement of the simulated scene, its noise and every choice [default: 1]",
            ),
        ],
        kind: Kind::Runs,
    },
    Tool {
        name: "explain",
        about: "Says why a run went as it did: each plan and failure, and what the verdict rests on",
        parameters: &[needed("run", Holds::Path, "the run's folder, as `run` names it")],
        kind: Kind::Reads,
    },
    Tool {
        name: "recognise",
        about: "Finds tables and objects in point clouds (PCD, PLY)",
        parameters: &[
            needed("clouds", Holds::Paths, "files"),
            optional(
                "objects",
                Holds::Path,
                "folder of object files [default: those of the domain tabletop]",
            ),
        ],
        kind: Kind::Reads,
    },
];

/// Finds a tool by name.
pub(super) fn named(name: &str) -> Option<&'static Tool> {
    TOOLS.iter().find(|tool| tool.name == name)
}

/// Parameter that requests the real body; offered only by a server with one.
const REAL: Parameter =
    optional("real", Holds::Flag, "with the real robot, which moves, and not in simulation");

/// Descriptions of the tools in the protocol's form.
pub(super) fn listed(has_robot: bool) -> Vec<Value> {
    TOOLS.iter().map(|tool| tool.listed(has_robot)).collect()
}

/// Command line of a call.
#[derive(Default)]
pub(super) struct Task {
    /// The command and its options.
    pub(super) words: Vec<String>,
    /// Files to write beforehand into a temporary folder, by name.
    pub(super) files: Vec<(&'static str, String)>,
    /// Standard input of the command.
    pub(super) input: String,
    /// Command line that reports findings if the command cannot read its files.
    pub(super) check: Option<Vec<String>>,
}

impl Tool {
    fn listed(&self, has_robot: bool) -> Value {
        let real = (self.kind == Kind::Runs && has_robot).then_some(&REAL);
        let all = || self.parameters.iter().chain(real);
        let properties: Map<String, Value> = all().map(|p| (p.name.to_string(), p.schema())).collect();
        let required: Vec<&str> = all().filter(|p| p.is_required).map(|p| p.name).collect();
        json!({
            "name": self.name,
            "description": self.about,
            "inputSchema": {
                "type": "object", "properties": properties, "required": required, "additionalProperties": false,
            },
            "annotations": {
                "readOnlyHint": self.kind == Kind::Reads,
                "destructiveHint": self.kind == Kind::Runs && has_robot,
                "openWorldHint": false,
            },
        })
    }

    /// Builds the command line for a call.
    ///
    /// # Errors
    /// A missing, unknown or invalid argument, with the expectation.
    pub(super) fn task(&self, arguments: &Value, served: &Served) -> Result<Task, String> {
        let none = Map::new();
        let given = match arguments {
            Value::Object(given) => given,
            Value::Null => &none,
            _ => return Err("`arguments` must be an object".into()),
        };
        let is_known = |name: &&String| {
            self.parameters.iter().any(|p| p.name == **name) || self.kind == Kind::Runs && *name == REAL.name
        };
        if let Some(unknown) = given.keys().find(|name| !is_known(name)) {
            let known: Vec<&str> = self.parameters.iter().map(|p| p.name).collect();
            return Err(format!("{} has no argument `{unknown}`; it has {}", self.name, known.join(", ")));
        }
        let mut task = Task::default();
        let mut values = Values { given, folder: &served.folder, files: &mut task.files, all: Vec::new() };
        for parameter in self.parameters {
            values.take(parameter).map_err(|because| format!("{}: {because}", self.name))?;
        }
        let all = std::mem::take(&mut values.all);
        let of = |name: &str| -> Vec<String> {
            all.iter().filter(|(known, _)| *known == name).map(|(_, value)| value.clone()).collect()
        };
        let option = |flag: &str, name: &str| -> Vec<String> {
            of(name).into_iter().flat_map(|value| [flag.to_string(), value]).collect()
        };
        let pddl = || [of("domain"), of("problem")].concat();
        let json = || vec!["--json".to_string()];
        let command = |name: &str, parts: Vec<Vec<String>>| [vec![name.to_string()], parts.concat()].concat();
        let limit_s = of("time_limit_s").pop().unwrap_or_else(|| PLANNING_S.to_string());
        let limited = || vec!["--time-limit".to_string(), limit_s.clone()];
        let anytime =
            || of("anytime").iter().filter(|flag| *flag == "true").map(|_| "--anytime".into()).collect();
        task.words = match self.name {
            "check" => command("check", vec![json(), pddl()]),
            "plan" => command("plan", vec![json(), limited(), anytime(), pddl()]),
            "validate" => command("validate", vec![json(), pddl(), of("plan")]),
            "why_not" => command("plan", vec![json(), limited(), option("--why-not", "action"), pddl()]),
            "goals" => {
                command("goals", vec![json(), option("--domain", "domain"), option("--scene", "scene")])
            }
            "explain" => command("explain", vec![json(), of("run")]),
            "recognise" => command("recognise", vec![json(), option("--objects", "objects"), of("clouds")]),
            "format" => command("fmt", vec![]),
            _ => {
                let robot = robot(given, served)?.map(|robot| vec!["--robot".to_string(), robot]);
                let options =
                    [option("--domain", "domain"), option("--scene", "scene"), option("--seed", "seed")];
                command(
                    "do",
                    vec![json(), options.concat(), robot.unwrap_or_default(), vec!["--".into()], of("goal")],
                )
            }
        };
        task.input = of("text").pop().unwrap_or_default();
        task.check =
            (self.parameters.len() > 1 && self.parameters[1].name == "problem" && self.name != "check")
                .then(|| command("check", vec![json(), pddl()]));
        Ok(task)
    }
}

/// Address of the real body; `None` if the call asks for simulation, an error if the server has no real
/// body.
fn robot(given: &Map<String, Value>, served: &Served) -> Result<Option<String>, String> {
    match (given.get(REAL.name), &served.robot) {
        (None | Some(Value::Bool(false)), _) => Ok(None),
        (Some(Value::Bool(true)), Some(robot)) => Ok(Some(robot.clone())),
        (Some(Value::Bool(true)), None) => {
            Err("run: this server has no real robot; the person who starts it gives one, \
             as in `descry mcp --robot socket:/tmp/my-robot`. Without `real` it is simulated"
                .into())
        }
        (Some(_), _) => Err("run: `real` is true or false".into()),
    }
}

/// Conversion of a call's arguments to words of a command line.
struct Values<'a> {
    given: &'a Map<String, Value>,
    folder: &'a Path,
    files: &'a mut Vec<(&'static str, String)>,
    all: Vec<(&'static str, String)>,
}

impl Values<'_> {
    fn take(&mut self, parameter: &Parameter) -> Result<(), String> {
        let name = parameter.name;
        let value = match self.given.get(name) {
            Some(value) if !value.is_null() => value,
            _ if parameter.is_required => return Err(format!("`{name}` is missing: {}", parameter.about)),
            _ => return Ok(()),
        };
        let wrong = || format!("`{name}` is {value}; expected {}", parameter.holds.expected());
        let word = match (&parameter.holds, value) {
            (Holds::Words, Value::String(text)) => text.clone(),
            (_, Value::String(text)) if text.trim().is_empty() => return Err(wrong()),
            (Holds::Source, Value::String(text)) => self.source(name, text)?,
            (Holds::Domain, Value::String(text)) => self.named(text, Path::exists)?,
            (Holds::Scene, Value::String(text)) => self.named(text, Path::is_file)?,
            (Holds::Path, Value::String(text)) => self.path(text)?,
            (Holds::Number, Value::Number(number)) if number.as_f64().is_some_and(|n| n > 0.0) => {
                number.to_string()
            }
            (Holds::Whole, Value::Number(number)) if number.is_u64() => number.to_string(),
            (Holds::Flag, Value::Bool(flag)) => flag.to_string(),
            (Holds::Paths, Value::Array(paths)) if !paths.is_empty() => {
                for path in paths {
                    let path = path.as_str().filter(|path| !path.trim().is_empty()).ok_or_else(wrong)?;
                    let path = self.path(path)?;
                    self.all.push((name, path));
                }
                return Ok(());
            }
            _ => return Err(wrong()),
        };
        if word.starts_with('-') {
            return Err(format!("`{name}` begins with a hyphen, as options do"));
        }
        self.all.push((name, word));
        Ok(())
    }

    /// File of a PDDL or plan argument: one to be written with the given text, or the named file.
    fn source(&mut self, name: &'static str, text: &str) -> Result<String, String> {
        if text.contains('(') {
            let file = match name {
                "domain" => "domain.pddl",
                "problem" => "problem.pddl",
                _ => "plan.txt",
            };
            self.files.push((file, text.to_string()));
            return Ok(file.into());
        }
        self.named(text, Path::exists)
    }

    /// Name of something built-in, unless the server's folder has such a path; else a path below the
    /// folder.
    fn named(&self, text: &str, is_path: fn(&Path) -> bool) -> Result<String, String> {
        let is_name = text.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
        if is_name && !is_path(&self.folder.join(text)) { Ok(text.to_string()) } else { self.path(text) }
    }

    /// Resolves an existing path below the server's folder.
    fn path(&self, text: &str) -> Result<String, String> {
        let folder = self.folder.display();
        let found = self.folder.join(text).canonicalize();
        let found = found.map_err(|e| format!("{text}: {e}; expected a path below {folder}"))?;
        match found.starts_with(self.folder) {
            true => Ok(found.display().to_string()),
            false => Err(format!(
                "{text} is not below {folder}: the person who starts the server chooses its --folder"
            )),
        }
    }
}

impl Holds {
    fn expected(&self) -> &'static str {
        match self {
            Holds::Source => "a text or the name of a file",
            Holds::Words => "a text",
            Holds::Domain => "the name of a domain or of a folder",
            Holds::Scene => "the name of a scene or of a file",
            Holds::Path => "a path",
            Holds::Paths => "a list of one path or more",
            Holds::Number => "a number above 0",
            Holds::Whole => "a whole number from 0",
            Holds::Flag => "true or false",
        }
    }
}

impl Parameter {
    fn schema(&self) -> Value {
        let about = self.about;
        match self.holds {
            Holds::Paths => {
                json!({ "type": "array", "items": { "type": "string" }, "minItems": 1, "description": about })
            }
            Holds::Number => json!({ "type": "number", "exclusiveMinimum": 0, "description": about }),
            Holds::Whole => json!({ "type": "integer", "minimum": 0, "description": about }),
            Holds::Flag => json!({ "type": "boolean", "description": about }),
            _ => json!({ "type": "string", "description": about }),
        }
    }
}
