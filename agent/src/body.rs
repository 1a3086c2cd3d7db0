//! Choice of the body that pursues a goal: simulator, recording or program.

use std::path::Path;
use std::sync::Arc;

use descry_domains::load::Domain;
use descry_robots::Robot;
use descry_robots::input::read_text;
use descry_robots::sim::{FaultPlan, SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::truth::Truth;

use crate::exit::CommandError;
use crate::{keeping, shell};

pub mod program;
mod recorded;
pub mod tape;

/// Opened body.
pub struct Body {
    /// Robot that the agent controls.
    pub robot: Arc<dyn Robot>,
    /// Name and text of the simulated scene; `None` without one.
    pub scene: Option<(String, String)>,
    truth: Option<Told>,
}

/// Source of the ground truth about objects.
enum Told {
    Simulator(Arc<SimRobot>),
    Program(program::TruthFile),
}

/// True position of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct TruePlace {
    /// Centre of the object, in the map frame, metres.
    pub position_m: [f64; 3],
    /// Surface that the object stands on; `None` if it is in the hand.
    pub on: Option<String>,
    /// Room that the object is in; `None` if unknown.
    pub room: Option<String>,
}

impl Body {
    /// Wraps any robot as a body, without ground truth; the example `own_body` shows a complete
    /// one.
    pub fn new(robot: Arc<dyn Robot>) -> Self {
        Self { robot, scene: None, truth: None }
    }

    /// Wraps a simulated robot as a body with ground truth.
    pub fn simulated(robot: Arc<SimRobot>) -> Self {
        Self { truth: Some(Told::Simulator(Arc::clone(&robot))), ..Self::new(robot) }
    }

    /// Ground truth of the scene at present, for reports; `None` if the body has none.
    ///
    /// # Errors
    /// Message, if the file that a program wrote it to cannot be read.
    pub fn truth(&self) -> Result<Option<Truth>, String> {
        match &self.truth {
            None => Ok(None),
            Some(Told::Simulator(robot)) => Ok(Some(robot.truth())),
            Some(Told::Program(file)) => Truth::read(file.path()).map(Some),
        }
    }

    /// True place of an object of this name or kind, the nearest to the believed position (map
    /// frame, metres) if there are several; `None` without ground truth, or if the object is
    /// absent.
    pub fn true_place(&self, name: &str, believed_m: Option<[f64; 3]>) -> Option<TruePlace> {
        let truth = self.truth().ok().flatten()?;
        let distance = |at: &[f64; 3]| {
            let believed = believed_m.unwrap_or(*at);
            at.iter().zip(&believed).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        };
        truth
            .objects
            .iter()
            .filter(|o| o.present && (o.name == name || o.kind == name))
            .map(|o| TruePlace {
                position_m: o.centre_m.coords.into(),
                on: o.surface.clone(),
                room: o.room.clone(),
            })
            .min_by(|a, b| distance(&a.position_m).total_cmp(&distance(&b.position_m)))
    }
}

/// Opens the body that `robot` names: `sim`, `recorded:DIR` with a folder of frames or the record of a
/// run, `program:COMMAND`, `socket:HOST:PORT` or `socket:PATH`.
///
/// `scene` is for `sim` alone, and `seed` for `sim` and `program`.
///
/// # Errors
/// [`CommandError::BadInput`], which names the place and what was expected; [`CommandError::Broken`] if
/// a program does not complete the handshake.
pub fn open(robot: &str, scene: Option<&str>, seed: u64, domain: &Domain) -> Result<Body, CommandError> {
    match robot.split_once(':') {
        None if robot == "sim" => {
            let (name, text) = scene_text(scene, domain)?;
            let body = simulate(&parse(&name, &text, domain)?, seed, FaultPlan::default())?;
            Ok(Body { scene: Some((name, text)), ..body })
        }
        Some(("recorded", folder)) => {
            if let Some(scene) = scene {
                let text = format!(
                    "--scene {scene}: a recording shows what it shows\n  leave --scene out, or take --robot sim"
                );
                return Err(CommandError::BadInput(text));
            }
            let path = std::path::Path::new(folder);
            if keeping::is_address(path) && keeping::Address::read(folder)?.run.is_none() {
                let text = format!(
                    "--robot {robot}: one run is one body\n  name it behind a #; `descry memory show {}` lists the runs",
                    shell::word(folder)
                );
                return Err(CommandError::BadInput(text));
            }
            let robot = if keeping::is_address(path) || recorded::is_record(path) {
                recorded::open(keeping::open_whole(path)?, folder)?
            } else {
                let (robot, notes) =
                    descry_robots::recorded::RecordedRobot::open(path).map_err(CommandError::bad_input)?;
                notes.iter().for_each(|note| tracing::warn!("recorded:{folder}: {note}"));
                robot
            };
            Ok(Body::new(Arc::new(robot)))
        }
        Some((kind @ ("program" | "socket"), "")) => Err(CommandError::BadInput(format!(
            "--robot {kind}: names nothing behind the colon\n  expected: program:COMMAND, or socket:HOST:PORT or socket:PATH"
        ))),
        Some((kind @ ("program" | "socket"), at)) => {
            if let Some(scene) = scene {
                let text = format!(
                    "--scene {scene}: a program has its own world\n  leave --scene out, or say it in the program's command line"
                );
                return Err(CommandError::BadInput(text));
            }
            if kind == "program" { program::open(at, seed, &[]) } else { program::connect(at) }
        }
        _ => Err(CommandError::BadInput(format!(
            "--robot {robot}\n  expected: sim, recorded:DIR, program:COMMAND, or socket:HOST:PORT or socket:PATH"
        ))),
    }
}

/// Creates a simulated body in one random arrangement of a scene. Faults of the scene come before
/// `faults`.
///
/// # Errors
/// [`CommandError::BadInput`] if the scene cannot be arranged.
pub fn simulate(spec: &SceneSpec, seed: u64, faults: FaultPlan) -> Result<Body, CommandError> {
    let scene = arrange(spec, seed).map_err(CommandError::bad_input)?;
    let options = SimOptions { seed, faults: faults.after(spec), ..SimOptions::default() };
    Ok(Body::simulated(Arc::new(SimRobot::new(scene, options))))
}

/// Scene of the domain by name, or a scene from a file; `None` means the domain's default scene.
///
/// # Errors
/// [`CommandError::BadInput`] names the scenes that there are, or the mistake in the file.
pub fn scene_spec(scene: Option<&str>, domain: &Domain) -> Result<SceneSpec, CommandError> {
    let (name, text) = scene_text(scene, domain)?;
    parse(&name, &text, domain)
}

fn parse(name: &str, text: &str, domain: &Domain) -> Result<SceneSpec, CommandError> {
    let shown = if domain.scenes.contains_key(name) { format!("scenes/{name}.toml") } else { name.into() };
    SceneSpec::parse(&shown, text).map_err(CommandError::bad_input)
}

/// Name and text of a scene of the domain or of a file.
fn scene_text(scene: Option<&str>, domain: &Domain) -> Result<(String, String), CommandError> {
    let name = scene.unwrap_or(&domain.config.scene);
    if let Some(text) = domain.scenes.get(name) {
        return Ok((name.into(), text.clone()));
    }
    let text = read_text(Path::new(name)).map_err(|e| {
        let known: Vec<&str> = domain.scenes.keys().map(String::as_str).collect();
        CommandError::BadInput(format!(
            "--scene {name}: {e}\n  expected a TOML file, or one of: {}",
            known.join(", ")
        ))
    })?;
    Ok((name.into(), text))
}
