//! Faults put into the template, each with what is found and under which text.

use std::path::Path;

use descry_domains::check::*;
use descry_domains::load::{Domain, Files, from_files};
use descry_domains::template;

/// The template with one text of a file replaced by another.
fn changed(file: &str, from: &str, to: &str) -> Result<Domain, descry_domains::load::error::LoadError> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("template");
    let mut files = Files::new();
    for (path, text) in template::files("mine") {
        let path = path.display().to_string();
        let text = if path == file {
            assert!(text.contains(from), "{file} has no {from}");
            text.replacen(from, to, 1)
        } else {
            text
        };
        files.insert(path.clone(), (path, text));
    }
    from_files(files, Some(folder))
}

/// Expects one finding of a code, at a place, with words in its message or mend.
fn check(file: &str, (from, to): (&str, &str), code: &str, place: &str, words: &[&str]) {
    let found = match changed(file, from, to) {
        Ok(domain) => findings(&domain),
        Err(descry_domains::load::error::LoadError::Findings { findings }) => findings,
        Err(other) => panic!("{to}: {other}"),
    };
    let codes: Vec<&str> = found.list.iter().map(|d| d.code).collect();
    assert_eq!(codes, [code], "{to}:\n{found}");
    let span = found.list[0].labels[0].span;
    let text = &found.sources[span.source as usize].text[span.start as usize..span.end as usize];
    assert_eq!(text, place, "{to}:\n{found}");
    for word in words {
        assert!(found.to_string().contains(word), "{to}: no {word} in\n{found}");
    }
}

#[test]
fn the_template_and_the_built_in_domains_are_faultless() {
    let domain = changed("domain.toml", "", "").expect("the template loads");
    assert!(findings(&domain).is_empty(), "{}", findings(&domain));
    assert_eq!(domain.config.name, "mine");
    for name in ["tabletop", "home", "shapes", "survey", "learning"] {
        let domain = Domain::load(name).expect("it loads");
        assert!(findings(&domain).is_empty(), "{name}: {}", findings(&domain));
    }
}

#[test]
fn what_is_said_to_people_is_about_what_is_declared() {
    let move_ = "move = \"driving to ?to\"";
    let toml = |to: &str, code, place, words: &[&str]| check("domain.toml", (move_, to), code, place, words);
    toml("mvoe = \"driving to ?to\"", "no-word", "\"driving to ?to\"", &["did you mean `move`?"]);
    toml("move = \"driving to ?too\"", "no-parameter", "?too", &["did you mean `?to`?", "?from"]);
}

#[test]
fn faults_of_actions_and_calls_are_found_at_their_place() {
    let pddl =
        |change: (&str, &str), code, place, words: &[&str]| check("domain.pddl", change, code, place, words);
    let toml =
        |change: (&str, &str), code, place, words: &[&str]| check("domain.toml", change, code, place, words);
    let more = "[action.observe]";
    toml(
        ("\"move ?from ?to\"", "\"moev ?from ?to\""),
        "no-skill",
        "moev ?from ?to",
        &["did you mean `move`", "python3"],
    );
    toml(("\"move ?from ?to\"", "\"move ?to\""), "skill-arguments", "move ?to", &["2 objects, not 1"]);
    toml(
        ("\"move ?from ?to\"", "\"move ?from ?there\""),
        "skill-arguments",
        "move ?from ?there",
        &["?there"],
    );
    toml(
        ("\"observe ?from ?on\"", "\"observe ?on ?from\""),
        "skill-arguments",
        "observe ?on ?from",
        &["pose"],
    );
    toml((more, "[action.obsrve]\n\n[action.observe]"), "no-action", "obsrve", &["did you mean `observe`"]);
    toml(
        (more, "[attachments.path-csot]\nprogram = [\"sh\"]\n\n[action.observe]"),
        "no-module",
        "path-csot",
        &["did you mean `path-cost`"],
    );
    pddl(
        ("(can-see ?from", "(may-see ?from - pose ?on - surface conditionchecker x@y) (can-see ?from"),
        "no-attachment",
        "may-see",
        &["[may-see]", "did you mean `can-see`"],
    );
    toml(("retries = 2\ngives_up", "program = [\"sh\"]\ngives_up"), "two-performers", "move", &["leave"]);
    toml(
        ("[\"(out-of-reach ?to)\"]", "[\"(out-of-reach ?to)\", \"(out-of-raech ?to)\"]"),
        "undeclared-predicate",
        "out-of-raech",
        &["out-of-reach"],
    );
    toml(
        ("[\"(out-of-reach ?to)\"]", "[\"(out-of-reach ?too)\"]"),
        "undeclared-variable",
        "?too",
        &["did you mean `?to`", "?from"],
    );
    toml(
        ("\"move ?from ?to\"", "\"pick-up ?from ?to\""),
        "no-skill",
        "pick-up ?from ?to",
        &["the ability `carrying` has it: write it into `uses`"],
    );
    toml(
        ("[\"(out-of-reach ?to)\"]", "[\"(out-of-reach ?to)\", \"(at ?to)\"]"),
        "not-remembered",
        "\"(at ?to)\"",
        &["remembered"],
    );
    toml(
        ("retries = 2\n", "teaches = [{ when = \"bloked\", says = \"(out-of-reach ?to)\" }]\n"),
        "no-failure",
        "\"bloked\"",
        &["did you mean `blocked`"],
    );
    toml(("retries = 2\n", "check = \"(att ?to)\"\n"), "undeclared-predicate", "att", &["`at`"]);
    toml(("retries = 2\n", "because = \"on to ?too\"\n"), "no-parameter", "?too", &["did you mean `?to`?"]);
    toml(("limit_s = 120.0", "limit_s = -1.0"), "value", "-1.0", &["seconds, above 0"]);
    toml(("retries = 2\n", "kind = \"sensing\"\n"), "kind-of-skill", "\"sensing\"", &["programs alone"]);
}

#[test]
fn faults_of_programs_are_found_at_their_place() {
    let toml = |program: &str, code, place, words: &[&str]| {
        let to = format!("program = {program}");
        check("domain.toml", ("does = \"move ?from ?to\"", &to), code, place, words);
    };
    toml("[]", "no-program", "[]", &["empty"]);
    toml("[\"sh\", \"go.sh\"]", "no-program", "go.sh", &["template/go.sh"]);
    toml("[\"no-such-command-here\"]", "no-program", "no-such-command-here", &["not on this machine"]);
}

#[test]
fn faults_of_what_plans_make_small_are_found_at_their_place() {
    let top = "scene = \"default\"\n";
    let toml = |expression: &str, code, place, words: &[&str]| {
        check("domain.toml", (top, &format!("{top}minimise = \"{expression}\"\n")), code, place, words);
    };
    toml("(+ (total-time) (wasted))", "undeclared-function", "wasted", &["total-time"]);
    toml("(total-time", "unbalanced", "(", &["the last `)` is missing"]);
}

#[test]
fn faults_of_words_and_objects_are_found_at_their_place() {
    let pddl =
        |change: (&str, &str), code, place, words: &[&str]| check("domain.pddl", change, code, place, words);
    let toml =
        |change: (&str, &str), code, place, words: &[&str]| check("domain.toml", change, code, place, words);
    let (top, more) = ("scene = \"default\"\n", "[action.observe]");
    let with = |text: &str| format!("{top}{text}\n");
    pddl(
        ("(on ?what - thing ?on - surface)", "(on ?what ?on - surface)"),
        "word-types",
        "on",
        &["(on ?x - thing ?x - surface)"],
    );
    pddl(("(at ?where - pose) ", "(at ?where - pose) (rain)"), "never-holds", "rain", &["[word.rain]"]);
    toml((top, &with("[word.obsrved]\nis = \"fixed\"")), "no-word", "obsrved", &["did you mean `observed`"]);
    toml(
        (top, &with("[word.on]\nis = \"fixed\"\nprogram = [\"sh\"]")),
        "two-sources",
        "\"fixed\"",
        &["leave"],
    );
    let below = format!("{more}\ninit = []");
    toml((more, &below), "unreadable", "init", &["above the first [table]"]);
    toml((top, &with("init = [\"(observed table\"]")), "init", "\"(observed table\"", &["expected"]);
    toml((top, &with("init = [\"(at start)\"]")), "init", "\"(at start)\"", &["sensed"]);
    toml((top, &with("init = [\"(observed table-1 shelf)\"]")), "undeclared-object", "shelf", &["table"]);
    let twice = "\"(not (observed table-1 table))\"";
    let init = with(&format!("init = [\"(observed table-1 table)\", \"(observed table-1 table)\", {twice}]"));
    toml((top, &init), "two-values", twice, &["hold and not to hold"]);
    pddl(
        ("(confidence ?what - thing))", "(confidence ?what - thing) (tried ?on - surface))"),
        "no-value",
        "tried",
        &["init = [\"(= (tried …) 0)\"]"],
    );
    toml((top, &with("open = [\"surfac\"]")), "no-type", "\"surfac\"", &["did you mean `surface`?"]);
    toml((top, &with("[objects]\nperson = [\"Anna\"]")), "no-type", "[\"Anna\"]", &[":types"]);
    toml((top, &with("[objects]\nthing = [\"spoon\"]")), "given-type", "[\"spoon\"]", &["objects/"]);
    toml(("[\"searching\"]", "[\"serching\", \"searching\"]"), "no-ability", "\"serching\"", &["searching"]);
}

#[test]
fn faults_of_phrases_are_found_at_their_place() {
    let toml =
        |change: (&str, &str), code, place, words: &[&str]| check("domain.toml", change, code, place, words);
    let say = "say = \"find <thing>\"";
    toml((say, "say = \"find <thng>\""), "unknown-slot", "<thng>", &["did you mean `thing`"]);
    toml((say, "say = \"find <thing>s\""), "glued-slot", "<thing>", &["space"]);
    toml((say, "say = \"find it\""), "slots", "<thing>", &["no slot <thing>; it has none"]);
    toml((say, "say = \"find <thing>\"\nconfidence = 0.4"), "value", "0.4", &["above 0.5"]);
    toml(("confidence = 0.8", "confidence = 0.5"), "value", "0.5", &["above 0.5"]);
    for key in ["remaining", "out_of_sight", "not_there"] {
        let left = format!("{key} = 0.5");
        toml(("confidence = 0.8", &left), "value", "0.5", &["above 0 and below 0.5"]);
    }
    toml(("confidence = 0.8", "prior = 0.05"), "value", "0.05", &["above `remaining` and `not_there`"]);
    let means = "(>= (confidence <thing>) <threshold>)";
    toml(
        (means, "(>= (confidnce <thing>) <threshold>)"),
        "undeclared-function",
        "confidnce",
        &["confidence"],
    );
    toml((means, "(on <thing> tabel)"), "undeclared-object", "tabel", &["table"]);
    let about = "about = \"look";
    let answer = |text: &str| format!("answer.achieved = \"{text}\"\nabout = \"look");
    toml((about, &answer("{(on <thing> ?}")), "answer", "(on <thing> ?", &["one question mark"]);
    toml((about, &answer("{(onn <thing> ?)}")), "answer", "(onn <thing> ?)", &["did you mean `on`"]);
    toml((about, &answer("{(on ? <thing>)}")), "wrong-type", "(on ? <thing>)", &["thing"]);
    toml((about, &answer("on {(on <thing> ?)")), "answer", "\"on {(on <thing> ?)\"", &["not closed"]);
    toml((about, &answer("<cup>")), "slots", "<cup>", &["it has <thing>"]);
    toml((about, &answer("{(on ? ?)}")), "answer", "(on ? ?)", &["two objects at once"]);
    toml((say, "say = \"find <thing\""), "slots", "find <thing", &["opened and not closed"]);
    toml((means, "(on <thing> table"), "unbalanced", "(", &["at the end of this text"]);
}

#[test]
fn all_of_a_phrase_is_heard() {
    let toml =
        |change: (&str, &str), code, place, words: &[&str]| check("domain.toml", change, code, place, words);
    let say = "say = \"find <thing>\"";
    let and = |more: &str| format!("{more}\n\n[[goal]]\n{say}");
    let looks = "means = \"(observed table-1 table)\"";
    let unused = and(&format!("say = \"is <thing> here\"\n{looks}"));
    toml((say, &unused), "unused-slot", "<thing>", &["is the same", "in `means`"]);
    let within = and(&format!("say = \"look within a room\"\n{looks}"));
    toml((say, &within), "unsayable", "within", &["how soon", "other words"]);
    let sure = and(&format!("say = \"look with confidence\"\n{looks}"));
    toml((say, &sure), "unsayable", "with confidence", &["how sure"]);
    let again = and("say = \"Find <a:thing>!\"\nmeans = \"(>= (confidence <a:thing>) 0.6)\"");
    toml((say, &again), "same-phrase", "\"find <thing>\"", &["\"Find <a:thing>!\" is said above"]);
    for (none, place) in [("", "\"\""), ("(and)", "\"(and)\"")] {
        let nothing = and(&format!("say = \"rest\"\nmeans = \"{none}\""));
        toml((say, &nothing), "no-goal", place, &["asks for nothing"]);
    }
    // What a slot holds may be for the answer alone.
    let told = and(&format!("say = \"greet <thing>\"\n{looks}\nanswer.achieved = \"hello, <thing>\""));
    let domain = changed("domain.toml", say, &told).expect("it loads");
    assert!(findings(&domain).is_empty(), "{}", findings(&domain));
}

#[test]
fn faults_of_scenes_and_places_are_found_at_their_place() {
    let toml =
        |change: (&str, &str), code, place, words: &[&str]| check("domain.toml", change, code, place, words);
    let scene = "scene = \"default\"\n";
    toml((scene, "scene = \"defualt\"\n"), "no-scene", "\"defualt\"", &["did you mean `default`"]);
    // Which places there are is unknown then.
    let named = "scene = \"defualt\"\ninit = [\"(observed table-1 table)\"]\n";
    toml((scene, named), "no-scene", "\"defualt\"", &["did you mean `default`"]);
    toml((scene, "scene = \"default\"\nsurfaces = [\"shelf\"]\n"), "no-surface", "\"shelf\"", &["table"]);
    let expect =
        |what: &str, at: &str| format!("{scene}[[expect]]\nwhat = \"{what}\"\nat = \"{at}\"\nweight = 2.0\n");
    toml((scene, &expect("mug", "attic")), "no-place", "\"attic\"", &["known: table"]);
    toml((scene, &expect("spoon", "table")), "no-thing", "\"spoon\"", &["known: mug"]);
    let other =
        "[[surface]]\nname = \"Table!\"\nposition_m = [2.4, 1.9]\nsize_m = [1.0, 1.0]\nheight_m = 0.7\n";
    let first = "[[surface]]";
    check(
        "scenes/default.toml",
        (first, &(other.to_string() + first)),
        "same-name",
        "\"default\"",
        &["tells"],
    );
    check("scenes/default.toml", ("[[surface]]", "[[surfaces]]"), "scene", "surfaces]]", &["surfaces"]);
}

/// Expects findings of these codes, whatever else is found, of the template with texts replaced in its files.
fn check_codes(edits: &[(&str, &str, &str)], expected: &[&str]) {
    let mut files = Files::new();
    for (path, text) in template::files("mine") {
        let path = path.display().to_string();
        let own = edits.iter().filter(|(file, ..)| *file == path);
        let text = own.fold(text, |text, (_, from, to)| {
            assert!(text.contains(from), "{path} has no {from}");
            text.replacen(from, to, 1)
        });
        files.insert(path.clone(), (path, text));
    }
    let domain = from_files(files, None).unwrap_or_else(|e| panic!("{e}"));
    let found = findings(&domain);
    let codes: std::collections::BTreeSet<&str> = found.list.iter().map(|d| d.code).collect();
    assert_eq!(codes.into_iter().collect::<Vec<_>>(), expected, "{edits:?}\n{found}");
}

#[test]
fn what_actions_change_is_neither_fixed_nor_planned_alone() {
    let goal = "[[goal]]\nsay = \"look\"\nmeans = \"(observed table-1 table)\"\n[said]";
    let check = |is: &str, expected: &[&str]| {
        let more = format!("[word.observed]\nis = \"{is}\"\n{goal}");
        let unteach = ("domain.toml", "gives_up = [\"(observed ?from ?on)\"]", "");
        check_codes(&[("domain.toml", "[said]", more.as_str()), unteach], expected);
    };
    check("fixed", &["not-fixed"]);
    check("planned", &["only-planned"]);
    check("remembered", &[]);
}

#[test]
fn what_no_look_tells_is_found() {
    let shine = "(:durative-action shine :parameters (?from - pose) :duration (= ?duration 1)\n  \
                 :condition (at start (at ?from)) :effect (at end (shiny ?from)))\n  (:durative-action move";
    let shiny = ("domain.pddl", "(:predicates", "(:predicates (shiny ?p - pose)");
    let action = ("domain.pddl", "(:durative-action move", shine);
    let by = |kind: &str| format!("[action.shine]\nprogram = [\"sh\"]\n{kind}\n[action.move]");
    let asked = |more: &str| {
        format!(
            "[[goal]]\nsay = \"is it shiny\"\nmeans = \"(exists (?p - pose) (shiny ?p))\"\nquestion = {more}\n[said]"
        )
    };
    let check = |question: &str, kind: &str, init: &str, expected: &[&str]| {
        let (by, asked) = (by(kind), asked(question));
        let init = format!("{init}scene = \"default\"");
        let edits = [
            shiny,
            action,
            ("domain.toml", "[action.move]", by.as_str()),
            ("domain.toml", "[said]", asked.as_str()),
            ("domain.toml", "scene = \"default\"", init.as_str()),
        ];
        check_codes(&edits, expected);
    };
    check("true", "", "", &["never-told"]);
    // A task sets it, a program that only looks tells it, and what the domain says in the beginning is known.
    check("false", "", "", &[]);
    check("true", "kind = \"sensing\"", "", &[]);
    check("true", "", "init = [\"(shiny start)\"]\n", &[]);
    // Where a program states it, whether the action finds it out must be said.
    let stated = "[word.shiny]\nprogram = [\"sh\"]\n";
    check("true", stated, "", &["kind-unsaid"]);
    for kind in ["sensing", "changing"] {
        check("true", &format!("kind = \"{kind}\"\n{stated}"), "", &[]);
    }
}

#[test]
fn goals_that_need_a_look_find_an_action_that_looks() {
    let by_program = ("domain.toml", "does = \"observe ?from ?on\"", "program = [\"sh\"]");
    check_codes(&[by_program], &["no-look"]);
}

#[test]
fn words_that_are_read_by_name_have_that_name() {
    for (word, name) in [("observed", "seen"), ("out-of-reach", "given-up")] {
        let texts = template::files("mine");
        let renamed = |file: &str| {
            let (_, text) =
                texts.iter().find(|(path, _)| path.display().to_string() == file).expect("it is there");
            text.replace(&format!("({word} "), &format!("({name} "))
                .replace(&format!("\n{word} ="), &format!("\n{name} ="))
        };
        let mut files: Files = Files::new();
        for (path, text) in &texts {
            files.insert(path.display().to_string(), (path.display().to_string(), text.clone()));
        }
        for file in ["domain.pddl", "domain.toml"] {
            files.insert(file.into(), (file.into(), renamed(file)));
        }
        let found = findings(&from_files(files, None).unwrap_or_else(|e| panic!("{e}")));
        let codes: Vec<&str> = found.list.iter().map(|d| d.code).collect();
        assert_eq!(codes, ["no-trace"], "{found}");
        assert!(found.to_string().contains(&format!("declare ({word} ?")), "{found}");
    }
}

#[test]
fn numbers_that_are_compared_begin_somewhere() {
    let charge = ("domain.pddl", "(:functions", "(:functions (charge)");
    let needs = (
        "domain.pddl",
        "(at start (not (= ?from ?to)))",
        "(at start (not (= ?from ?to))) (at start (>= (charge) 5))",
    );
    let gives = ("domain.pddl", "(at end (at ?to))", "(at end (at ?to)) (at end (assign (charge) 100))");
    check_codes(&[charge, needs, gives], &["no-value"]);
    check_codes(
        &[
            charge,
            needs,
            gives,
            ("domain.toml", "scene = \"default\"", "init = [\"(= (charge) 9)\"]\nscene = \"default\""),
        ],
        &[],
    );
}

#[test]
fn objects_that_nothing_tells_apart_are_found() {
    let mut files: Files = template::files("mine")
        .into_iter()
        .map(|(path, text)| (path.display().to_string(), (path.display().to_string(), text)))
        .collect();
    let (_, mug) = files.get("objects/mug.toml").expect("the template's mug").clone();
    let named = |name: &str| {
        mug.replace("name = \"mug\"", &format!("name = \"{name}\"")).replace("\"coffee mug\"", "")
    };
    let other = named("red mug");
    files.insert("objects/mug.toml".into(), ("objects/mug.toml".into(), named("blue mug")));
    files.insert("objects/red-mug.toml".into(), ("objects/red-mug.toml".into(), other.clone()));
    let found = |files: &Files| findings(&from_files(files.clone(), None).unwrap_or_else(|e| panic!("{e}")));
    let all = found(&files);
    assert_eq!(all.list.iter().map(|d| d.code).collect::<Vec<_>>(), ["alike"], "{all}");
    assert!(all.to_string().contains("colour = \"red\""), "{all}");
    let mut painted = |colours: [&str; 2], expected: &[&str]| {
        for ((key, text), colour) in
            [("mug", named("blue mug")), ("red-mug", other.clone())].into_iter().zip(colours)
        {
            let key = format!("objects/{key}.toml");
            files.insert(key.clone(), (key, format!("{text}\n{colour}\n")));
        }
        let found = found(&files);
        assert_eq!(found.list.iter().map(|d| d.code).collect::<Vec<_>>(), expected, "{colours:?}: {found}");
    };
    painted(["colour = \"blue\"", "colours = [\"red\", \"white\"]"], &[]);
    painted(["colour = \"red\"", "colours = [\"red\", \"white\"]"], &["alike"]);
    painted(["", "colour = \"red\""], &["alike"]);
    painted(["colour = \"blue\"", "colour = { hue_deg = [10, 35], saturation = [0.2, 0.5] }"], &[]);
}

#[test]
fn colours_that_mean_nothing_are_refused_at_their_place() {
    let check = |colour: &str, words: &[&str]| {
        let mut files: Files = template::files("mine")
            .into_iter()
            .map(|(path, text)| (path.display().to_string(), (path.display().to_string(), text)))
            .collect();
        let (_, mug) = files.get("objects/mug.toml").expect("the template's mug").clone();
        let text = format!("{mug}\n{colour}\n");
        files.insert("objects/mug.toml".into(), ("objects/mug.toml".into(), text));
        let found = from_files(files, None).map(|_| ()).expect_err(colour).to_string();
        words.iter().for_each(|word| assert!(found.contains(word), "{colour}: {found}"));
    };
    check("colour = \"rde\"", &["`rde` is no colour name: did you mean `red`?", "colour = \"rde\"", "──┬──"]);
    check("colours = [\"white\", \"turquoise\"]", &["`turquoise` is no colour name: known are black", "╰──"]);
    check("colour = { hue_deg = [40, 20] }", &["`hue_deg` = [40, 20] holds no colour"]);
    check("colour = { hue = [20, 40] }", &["unknown field `hue`", "hue_deg"]);
}
