//! The built-in domains in small rooms that are drawn: what goals may say there, and what is where in truth.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use descry_domains::load::{Domain, from_files};
use descry_robots::truth::Truth;

use super::drawn::Means::*;
use super::drawn::{Draws, Nouns, Pattern, Seen, Standing};

/// The domains, in the order in which goals are drawn over them.
pub const ALL: [Which; 6] =
    [Which::Home, Which::Tabletop, Which::Household, Which::Shapes, Which::Survey, Which::Learning];

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Which {
    Tabletop,
    Home,
    Survey,
    Shapes,
    Learning,
    Household,
}

/// Things with their kinds, as a scene has them.
const THINGS: [(&str, &str, &str); 3] = [
    ("cup-a", "cup", "name = \"cup A\"\nshape.cup = { diameter_m = 0.070, height_m = 0.104 }"),
    (
        "mug",
        "mug",
        "name = \"handled mug\"\nkind = \"mug\"\nshape.mug = { diameter_m = 0.080, height_m = 0.095 }",
    ),
    (
        "white-cylinder",
        "cylinder",
        "name = \"white cylinder\"\nkind = \"cylinder\"\nshape.cylinder = { diameter_m = 0.106, height_m = 0.277 }",
    ),
];
/// Further objects that may stand about.
const OTHERS: [&str; 2] = [
    "name = \"second cup\"\nkind = \"cup A\"\nshape.cup = { diameter_m = 0.070, height_m = 0.104 }",
    "name = \"carton\"\nkind = \"box\"\nshape.box = { size_m = [0.10, 0.06, 0.20] }",
];

const SURFACE_WORDS: &[Pattern] = &[
    (On, "(>= (presence {t} {p}) 0.8)"),
    (On, "(>= (+ (presence {t} {p}) 0.1) 0.9)"),
    (On, "(not (< (presence {t} {p}) 0.8))"),
    (On, "(>= (* 2 (presence {t} {p})) 1.6)"),
    (NotOn, "(>= (- 1 (presence {t} {p})) 0.9)"),
    (NotOn, "(= (presence {t} {p}) 0)"),
    (NotOn, "(< (/ (presence {t} {p}) 2) 0.1)"),
    (On, "(on {t} {p})"),
    (On, "(not (absent {t} {p}))"),
    (NotOn, "(absent {t} {p})"),
    (Somewhere, "(somewhere {t})"),
    (Somewhere, "(exists (?o - surface) (>= (presence {t} ?o) 0.8))"),
    (Nowhere, "(forall (?o - surface) (absent {t} ?o))"),
    (Nowhere, "(not (exists (?o - surface) (on {t} ?o)))"),
    (Nowhere, "(<= (+ (presence {t} {p}) (presence {t} {q})) 0.1)"),
    (AnythingOn, "(exists (?t - thing) (on ?t {p}))"),
    (NothingOn, "(forall (?t - thing) (not (on ?t {p})))"),
    (TwoOn, "(exists (?t ?u - thing) (and (not (= ?t ?u)) (on ?t {p}) (on ?u {p})))"),
    (BothOn, "(and (on {t} {p}) (on {u} {p}))"),
    (BothOn, "(>= (* (presence {t} {p}) (presence {u} {p})) 0.6)"),
    (NeitherOn, "(<= (+ (presence {t} {p}) (presence {u} {p})) 0.1)"),
    (RatherOn, "(and (> (presence {t} {p}) (presence {t} {q})) (not (on {t} {q})))"),
];
const TABLETOP_WORDS: &[Pattern] =
    &[(Somewhere, "(>= (confidence {t}) 0.8)"), (Somewhere, "(> (- (confidence {t}) 0.1) 0.7)")];
const HOME_WORDS: &[Pattern] = &[
    (KindOn, "(exists (?t - thing) (and (is ?t {k}) (on ?t {p})))"),
    (EachOfKindOn, "(forall (?t - thing) (imply (is ?t {k}) (on ?t {p})))"),
    (
        TwoOfKindOn,
        "(exists (?t ?u - thing) (and (not (= ?t ?u)) (is ?t {k}) (is ?u {k}) (on ?t {p}) (on ?u {p})))",
    ),
    (Held, "(holding {t})"),
    (HandFree, "(hand-free)"),
    (Shut, "(shut {d})"),
];
const SURVEY_WORDS: &[Pattern] = &[
    (Somewhere, "(>= (confidence {t}) 0.8)"),
    (Somewhere, "(known {t})"),
    (Nowhere, "(not (known {t}))"),
    (Nowhere, "(<= (confidence {t}) 0.1)"),
    (BothSomewhere, "(>= (+ (confidence {t}) (confidence {u})) 1.6)"),
    (NeitherSomewhere, "(< (+ (confidence {t}) (confidence {u})) 0.1)"),
];
const SHAPES_WORDS: &[Pattern] = &[
    (Somewhere, "(>= (found {t}) 0.9)"),
    (Somewhere, "(lies {t})"),
    (Somewhere, "(>= (+ (found {t}) 0.05) 0.95)"),
    (Nowhere, "(not (lies {t}))"),
    (Nowhere, "(>= (- 1 (found {t})) 0.9)"),
    (Nowhere, "(<= (found {t}) 0.1)"),
    (Nowhere, "(forall (?x - spot) (not (may-be ?x {t})))"),
    (BothSomewhere, "(>= (+ (found {t}) (found {u})) 1.8)"),
    (NeitherSomewhere, "(< (+ (found {t}) (found {u})) 0.1)"),
];
const LEARNING_WORDS: &[Pattern] = &[
    (Somewhere, "(exists (?n - novelty) (not (settled ?n)))"),
    (Nowhere, "(forall (?n - novelty) (settled ?n))"),
    (Nowhere, "(not (exists (?n - novelty) (>= (unfaced ?n) 0)))"),
];
const HOUSEHOLD_WORDS: &[Pattern] = &[
    (On, "(located {t} {p})"),
    (On, "(not (elsewhere {t} {p}))"),
    (NotOn, "(elsewhere {t} {p})"),
    (NotOn, "(not (located {t} {p}))"),
    (Somewhere, "(exists (?p - location) (located {t} ?p))"),
    (Nowhere, "(forall (?p - location) (elsewhere {t} ?p))"),
    (AnythingOn, "(exists (?t - item) (located ?t {p}))"),
    (NothingOn, "(forall (?t - item) (not (located ?t {p})))"),
    (TwoOn, "(exists (?t ?u - item) (and (not (= ?t ?u)) (located ?t {p}) (located ?u {p})))"),
    (BothOn, "(and (located {t} {p}) (located {u} {p}))"),
    (NeitherOn, "(not (or (located {t} {p}) (located {u} {p})))"),
    (Held, "(holding {t})"),
    (HandFree, "(hand-free)"),
];

impl Which {
    /// The name by which the table calls it.
    pub fn name(self) -> &'static str {
        match self {
            Which::Tabletop => "tabletop",
            Which::Home => "home",
            Which::Survey => "survey",
            Which::Shapes => "shapes",
            Which::Learning => "learning",
            Which::Household => "multi-object-search",
        }
    }

    pub fn patterns(self) -> Vec<Pattern> {
        match self {
            Which::Tabletop => [SURFACE_WORDS, TABLETOP_WORDS].concat(),
            Which::Home => [SURFACE_WORDS, HOME_WORDS].concat(),
            Which::Survey => SURVEY_WORDS.to_vec(),
            Which::Shapes => SHAPES_WORDS.to_vec(),
            Which::Learning => LEARNING_WORDS.to_vec(),
            Which::Household => HOUSEHOLD_WORDS.to_vec(),
        }
    }

    pub fn nouns(self) -> Nouns {
        let things = THINGS.iter().map(|(thing, kind, _)| (*thing, *kind)).collect();
        let (places, of_place, door) = (vec!["floor"], "", "");
        match self {
            Which::Tabletop => {
                Nouns { things, places: vec!["table", "sideboard"], of_place: "surface", door }
            }
            Which::Home => {
                Nouns { things, places: vec!["desk", "counter"], of_place: "surface", door: "study-door" }
            }
            Which::Survey => Nouns { things, places, of_place, door },
            Which::Shapes => {
                let shapes = ["recycle-bin", "big-chair", "dell-box"];
                Nouns { things: shapes.map(|shape| (shape, "")).into(), places, of_place, door }
            }
            Which::Learning => Nouns { things: vec![("anything", "")], places, of_place, door },
            Which::Household => {
                let things = ["knife", "notebook", "clock", "mug", "pillow"].map(|item| (item, "")).into();
                let places = vec!["living-room", "kitchen", "bedroom", "office", "start"];
                Nouns { things, places, of_place: "location", door }
            }
        }
    }

    /// Actions that change the world, by their names in this domain.
    pub fn changing(self) -> &'static [&'static str] {
        match self {
            Which::Tabletop => &["push-aside"],
            Which::Home => &["open-door", "pick-up", "put-down"],
            Which::Survey | Which::Shapes | Which::Learning => &[],
            Which::Household => &["pick", "place"],
        }
    }

    /// The place that an action looks at; `anything` where it is none by name.
    pub fn looked_at(self, action: &str, arguments: &[String]) -> Option<String> {
        let is_of_floor = ["chart", "scan", "survey", "patrol", "face"].contains(&action);
        match action {
            "observe" if self != Which::Survey => arguments.get(1).cloned(),
            "search" => arguments.get(1).cloned(),
            "observe" => Some("floor".into()),
            _ if is_of_floor => Some("floor".into()),
            // A drive meets the door, or leads past it.
            "move" if self == Which::Home => Some("study-door".into()),
            _ => None,
        }
    }

    /// The domain with derived words, one phrase "check it", and a room.
    pub fn domain(self, means: &str, is_question: bool, draws: &mut Draws, scratch: &Path) -> Domain {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../domains").join(self.name());
        let loaded = Domain::load(&folder.to_string_lossy()).unwrap_or_else(|e| panic!("{e}"));
        let (mut files, mut folder) = (loaded.files, None::<PathBuf>);
        let (derived, words) = match self {
            Which::Tabletop | Which::Home => (
                "(:derived (absent ?w - thing ?o - surface) (not (on ?w ?o)))\n\
                 (:derived (somewhere ?w - thing) (exists (?o - surface) (on ?w ?o)))\n",
                "(absent ?w - thing ?o - surface) (somewhere ?w - thing)",
            ),
            Which::Survey => {
                ("(:derived (known ?w - thing) (>= (confidence ?w) 0.8))\n", "(known ?w - thing)")
            }
            Which::Shapes => ("(:derived (lies ?n - shape) (>= (found ?n) 0.9))\n", "(lies ?n - shape)"),
            Which::Learning => ("", ""),
            Which::Household => (
                "(:derived (elsewhere ?i - item ?p - location) (not (located ?i ?p)))\n",
                "(elsewhere ?i - item ?p - location)",
            ),
        };
        if let Some((_, pddl)) = files.get_mut("domain.pddl") {
            *pddl = pddl
                .replacen("(:durative-action", &format!("{derived}(:durative-action"), 1)
                .replacen("(:predicates", &format!("(:predicates {words}"), 1)
                .replacen(":modules)", ":modules :derived-predicates)", 1);
        }
        if let Some((_, toml)) = files.get_mut("domain.toml") {
            let phrase =
                format!("[[goal]]\nsay = \"check it\"\nmeans = \"{means}\"\nquestion = {is_question}\n");
            *toml = toml.replacen("\n[said]", &format!("\n{phrase}\n[said]"), 1).replacen(
                "scene = \"",
                &format!("scene = \"{}\" # ", self.scene()),
                1,
            );
        }
        let scene = self.room(draws);
        if self == Which::Household {
            let own = scratch.join("household");
            fs::create_dir_all(&own).expect("a folder can be made");
            let copied = "world.py";
            let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../domains/multi-object-search");
            fs::copy(from.join(copied), own.join(copied)).expect("a file can be copied");
            let seed = draws.below(1000).to_string();
            let reset = Command::new("python3").args([copied, "reset", &seed]).current_dir(&own).status();
            assert!(reset.expect("python3").success(), "the household is laid out");
            folder = Some(own);
        } else {
            files.insert("scenes/small.toml".into(), ("small.toml".into(), scene));
        }
        from_files(files, folder).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Name of the scene of the simulated body.
    pub fn scene(self) -> &'static str {
        if self == Which::Household { "default" } else { "small" }
    }

    fn room(self, draws: &mut Draws) -> String {
        let objects = |draws: &mut Draws, places: &str| -> String {
            let own =
                THINGS.iter().filter(|_| draws.below(4) > 0).map(|(.., thing)| *thing).collect::<Vec<_>>();
            let others = OTHERS.iter().filter(|_| draws.below(3) == 0).copied().collect::<Vec<_>>();
            let all = own.into_iter().chain(others);
            all.map(|thing| format!("[[object]]\n{thing}\non = {places}\n")).collect()
        };
        let surface = |name: &str, at: &str, size: &str, height: &str| {
            format!(
                "[[surface]]\nname = \"{name}\"\nposition_m = {at}\nsize_m = {size}\nheight_m = {height}\n"
            )
        };
        let start = "[start]\nposition_m = [0.0, -1.9]\nyaw_deg = 90.0\n";
        match self {
            Which::Tabletop => {
                let tables = surface("table", "[-1.2, 0.0]", "[1.1, 0.7]", "0.72")
                    + &surface("sideboard", "[1.4, 0.0]", "[1.1, 0.7]", "0.80");
                let head = "title = \"Two tables\"\ngap_m = 0.08\n[room]\nsize_m = [6.0, 5.0]\n";
                let things = objects(draws, "[\"table\", \"sideboard\"]");
                format!("{head}{tables}{start}{things}")
            }
            Which::Home => {
                let tables = surface("desk", "[-1.2, 0.0]", "[1.1, 0.7]", "0.72")
                    + &surface("counter", "[1.4, 0.0]", "[1.1, 0.7]", "0.80");
                let rooms = match draws.below(3) {
                    0 => {
                        "[[room]]\nname = \"study\"\nposition_m = [-1.6, 0.0]\nsize_m = [3.0, 5.0]\n\
                         [[room]]\nname = \"kitchen\"\nposition_m = [1.6, 0.0]\nsize_m = [3.0, 5.0]\n\
                         [[door]]\nname = \"study door\"\nposition_m = [0.0, -1.4]\nshut_chance = 0.3\n"
                    }
                    _ => {
                        "[[room]]\nname = \"study\"\nsize_m = [6.0, 5.0]\n\
                         [[room]]\nname = \"hall\"\nposition_m = [0.0, -4.1]\nsize_m = [6.0, 3.0]\n\
                         [[door]]\nname = \"study door\"\nposition_m = [1.5, -2.55]\nshut_chance = 0.3\n"
                    }
                };
                let start = "[start]\nposition_m = [-1.0, -1.9]\nyaw_deg = 90.0\n";
                let things = objects(draws, "[\"desk\", \"counter\"]");
                format!("title = \"Two tables\"\ngap_m = 0.08\n{rooms}{tables}{start}{things}")
            }
            Which::Survey => {
                let head = "title = \"A room\"\nmapped = false\n[stereo]\nbaseline_m = 0.12\n\
                            disparity_sigma_px = 0.1\ntextured = 0.6\n[room]\nsize_m = [4.4, 4.0]\n";
                let table = surface("table", "[1.1, -0.5]", "[1.2, 0.8]", "0.72");
                let start = "[start]\nposition_m = [-1.2, 0.6]\nyaw_deg = 20.0\n";
                let things = objects(draws, "\"table\"");
                format!("{head}{table}{start}{things}")
            }
            Which::Shapes => {
                let head = "title = \"Some things on the floor\"\n[room]\nsize_m = [7.0, 6.0]\n\
                            [start]\nposition_m = [-2.8, 0.0]\n";
                let things = [
                    ("recycle bin", "[0.4046, 0.2484, 0.5]\ncorner_m = 0.1083", "[0.9, 1.5]"),
                    ("big chair", "[0.5811, 0.5811, 0.9]\ncorner_m = 0.1458", "[0.9, -1.5]"),
                    ("dell box", "[0.6442, 0.6442, 0.55]\ncorner_m = 0.0542", "[-0.8, 0.0]"),
                ];
                let there: Vec<_> = things.iter().filter(|_| draws.below(2) > 0).collect();
                let of = |(name, size, at): &(&str, &str, &str)| {
                    format!(
                        "[[obstacle]]\nname = \"{name}\"\non_map = false\nposition_m = {at}\nsize_m = {size}\n"
                    )
                };
                head.to_string() + &there.into_iter().map(of).collect::<String>()
            }
            Which::Learning => {
                let tables = surface("table", "[-1.7, 0.3]", "[1.2, 0.8]", "0.72");
                let things = objects(draws, "\"table\"");
                format!("title = \"One table\"\n[room]\nsize_m = [6.0, 5.0]\n{tables}{start}{things}")
            }
            Which::Household => String::new(),
        }
    }

    /// True places of the objects.
    pub fn seen(self, truth: &Truth, scratch: &Path) -> Seen {
        let standing = match self {
            Which::Household => household(&scratch.join("household/world.json")),
            // Before anything is remembered of a place, nothing there is new.
            Which::Learning => Vec::new(),
            _ => truth.objects.iter().filter(|o| o.present).map(standing).collect(),
        };
        let in_place = |s: Standing| match self {
            Which::Survey | Which::Shapes => Standing { place: Some("floor".into()), ..s },
            _ => s,
        };
        let shut = truth.doors.iter().filter(|d| d.shut).map(|d| d.name.replace(' ', "-")).collect();
        Seen { standing: standing.into_iter().map(in_place).collect(), shut, looked: Default::default() }
    }
}

fn standing(object: &descry_robots::truth::TrueObject) -> Standing {
    let thing = match object.kind.as_str() {
        "cup A" => "cup-a".into(),
        "cylinder" => "white-cylinder".into(),
        kind => kind.replace(' ', "-"),
    };
    let kind = if object.kind == "cup A" { "cup".into() } else { object.kind.clone() };
    let place = object.surface.clone().map(|on| on.replace(' ', "-"));
    Standing { thing, kind, place, is_held: object.in_hand }
}

fn household(file: &Path) -> Vec<Standing> {
    let text = fs::read_to_string(file).expect("the household is written");
    let world: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let of = |(item, place): (&String, &serde_json::Value)| {
        let place = place.as_str().expect("a place").to_string();
        let is_held = place == "hand";
        Standing { thing: item.clone(), kind: String::new(), place: (!is_held).then_some(place), is_held }
    };
    world["truth"].as_object().expect("things").iter().map(of).collect()
}
