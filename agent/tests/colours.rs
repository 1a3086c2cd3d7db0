//! Things asked for by colour, in rooms whose light the seed draws: no thing of another colour is taken for them.

use descry_agent::body;
use descry_agent::keeping::Keeping;
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::conclusion::Verdict;
use descry_domains::load::Domain;
use descry_perception::recognise::Colour;

const ROOM: &str = "title = \"Cups and mugs\"\n[[surface]]\nname = \"table\"\nsize_m = [1.2, 0.7]\nheight_m = 0.72\n\
    [start]\nposition_m = [-1.8, 0.0]\n[light]\ngain = [0.6, 1.2]\ncast = 0.1\ngloss = 0.5\nnoise = 4.0\n";

/// Verdict and answer on a table with a cup and a mug of some colours; the domain knows a red mug and a blue one.
fn asked(goal: &str, cup: [u8; 3], mug: [u8; 3], seed: u64) -> (Verdict, String) {
    let mut domain = Domain::load("tabletop").expect("it is built in");
    let mug_model = domain.objects.iter().find(|o| o.name == "mug").cloned().expect("a mug");
    domain.objects.retain(|o| o.name != "mug");
    for name in ["red", "blue"] {
        let mut model = mug_model.clone();
        (model.name, model.phrases, model.colours) =
            (format!("{name} mug"), Vec::new(), vec![Colour::Name(name)]);
        domain.objects.push(model);
    }
    let object = |name: &str, shape: &str, [x, y]: [f64; 2], colour: [u8; 3]| {
        format!(
            "[[object]]\nname = \"{name}\"\nshape.{shape}\nposition_m = [{x}, {y}]\ncolour = {colour:?}\n"
        )
    };
    let scene = ROOM.to_string()
        + &object("a cup", "cup = { diameter_m = 0.088, height_m = 0.155 }", [0.1, 0.2], cup)
        + &object("a mug", "mug = { diameter_m = 0.08, height_m = 0.095 }", [-0.1, -0.2], mug);
    domain.scenes.insert("colours".into(), scene);
    let body = body::open("sim", Some("colours"), seed, &domain).expect("a scene");
    let understood = run::understood(goal, &domain, &*body.robot, None).expect(goal);
    let settings = Settings {
        robot: "sim".into(),
        scene: Some("colours".into()),
        seed,
        domain: "tabletop".into(),
        policy: policies::PLAN.into(),
        keeping: Keeping::default(),
        remember: None,
    };
    let scratch = tempfile::TempDir::new().expect("a folder can be made");
    let folder = Folder::of_new_run(Some(&scratch.path().join("run")), &understood).expect("a run's folder");
    let watcher = Watcher { stop: &Stop::default(), tell: &mut |_| {} };
    let chooser = policies::named(policies::PLAN, seed, None).expect("the planner");
    let task = Task { domain: &domain, goal: &understood, past: None };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let report = runtime.block_on(run::pursue(task, &body, &folder, &settings, chooser, watcher));
    let report = report.unwrap_or_else(|e| panic!("{goal}: {e}"));
    (report.verdict, report.why)
}

const RED: [u8; 3] = [190, 30, 35];
const GREEN: [u8; 3] = [20, 150, 40];
const BLUE: [u8; 3] = [30, 60, 180];

fn check(goal: &str, cup: [u8; 3], mug: [u8; 3], seed: u64, expected: Verdict) {
    let (verdict, why) = asked(goal, cup, mug, seed);
    assert_eq!(verdict, expected, "{goal}, cup {cup:?}, mug {mug:?}, seed {seed}: {why}");
}

#[test]
fn a_thing_of_another_colour_is_not_taken_for_what_is_asked_for() {
    check("find the red cup", GREEN, RED, 3, Verdict::NotFound);
    check("find the red mug", GREEN, RED, 3, Verdict::Achieved);
}

#[test]
#[ignore = "slow: 15 runs"]
fn things_of_many_colours_are_told_apart_in_words() {
    for seed in 11..14 {
        check("find the red cup", RED, BLUE, seed, Verdict::Achieved);
        check("is there a green cup on the table", BLUE, GREEN, seed, Verdict::NotFound);
        check("find all blue cups", BLUE, BLUE, seed, Verdict::Achieved);
        check("find the blue mug", BLUE, RED, seed, Verdict::NotFound);
        check("find the blue mug", RED, BLUE, seed, Verdict::Achieved);
    }
}
