//! A search of a simulated table that looks from given poses in turn, without planning.

use std::sync::Arc;

use descry_domains::abilities::searching::policies;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_domains::situation::Situation;
use descry_domains::world::{Setting, World};
use descry_memory::{Options, Record};
use descry_perception::recognise::Descry;
use descry_robots::sim::{Scene, SimOptions, SimRobot};
use descry_robots::{CancellationToken, Progress, Robot};
use descry_skills::{Call, Context, SkillFailure};

/// Search task: a goal in a simulated scene.
pub struct Search<'a> {
    pub domain: &'a Domain,
    pub scene: Scene,
    pub options: SimOptions,
    /// Goal in words.
    pub goal: &'a str,
    /// Maximum number of views.
    pub looks: usize,
}

impl Search<'_> {
    /// Takes the views: the first from the start, each later one from the pose whose index `choose`
    /// returns for the poses left. Ends after the first view for which `hear` returns true; returns what
    /// `hear` has made of each view.
    pub async fn run<T>(
        self,
        mut choose: impl FnMut(&[String]) -> usize,
        mut hear: impl FnMut(&Situation) -> (T, bool),
    ) -> Result<Vec<T>, String> {
        let text = |e: &dyn std::fmt::Display| e.to_string();
        let (domain, seed) = (self.domain, self.options.seed);
        let robot: Arc<dyn Robot> = Arc::new(SimRobot::new(self.scene, self.options));
        let folder = tempfile::TempDir::new().map_err(|e| text(&e))?;
        let record =
            Record::create(&folder.path().join("record"), Options::default()).map_err(|e| text(&e))?;
        let lexicon = Lexicon::new(domain, &Places::of_body(&*robot));
        let goal = goal::read(self.goal, domain, &lexicon).map_err(|e| text(&e))?;
        let recogniser = Descry::default();
        let here = robot.pose().await.map_err(|e| text(&e))?;
        let setting = Setting {
            domain,
            goal: &goal,
            robot: Arc::clone(&robot),
            record: &record,
            recogniser: &recogniser,
            past: None,
        };
        let chooser = policies::named(policies::PLAN, seed, None).map_err(|e| text(&e))?;
        let mut world = World::begin(setting, chooser, &here).map_err(|e| text(&e))?;
        let round = world.round().map_err(|e| text(&e))?;
        let mut poses: Vec<String> = round.situation.candidates.iter().map(|c| c.symbol.clone()).collect();
        let mut at = round.situation.candidates[round.situation.at].symbol.clone();
        let mut heard = Vec::new();
        for look in 0..self.looks {
            if look > 0 {
                let to = poses[choose(&poses)].clone();
                act(&mut world, &*robot, "move", [&at, &to]).await?;
                at = to;
            }
            act(&mut world, &*robot, "observe", [&at, "table"]).await?;
            poses.retain(|pose| *pose != at);
            let round = world.round().map_err(|e| text(&e))?;
            let (said, is_last) = hear(&round.situation);
            heard.push(said);
            if is_last || poses.is_empty() {
                break;
            }
        }
        Ok(heard)
    }
}

/// Carries a call out and updates the world model from its outcome.
async fn act(
    world: &mut World<'_>,
    robot: &dyn Robot,
    action: &str,
    arguments: [&str; 2],
) -> Result<(), String> {
    let call = Call { action: action.into(), arguments: arguments.map(String::from).to_vec() };
    let job = world.ground(&call, 0).map_err(|e| e.to_string())?.ok_or("no part")?;
    let (cancel, progress) = (CancellationToken::new(), &|_: &Progress| {});
    let context = Context { robot, cancel, time_limit_s: job.limit_s, progress };
    let skill = job.skill.map_err(|e: SkillFailure| e.to_string())?;
    let outcome = skill.perform(&context).await.map_err(|e| e.to_string())?;
    world.learn(&call, 0, &outcome, &mut Vec::new()).map_err(|e| e.to_string())?;
    Ok(())
}
