//! Sensing actions of a domain of one's own, and the time that programs take.

use super::*;

/// A word `wet` that a program states once the sensing action `probe` has been taken, and questions about it.
fn probes(stated: &str) -> Vec<Edit> {
    let done = "touch probed; ".to_string() + &answers("\"value\":\"done\"");
    let wet = format!(
        "if [ -e probed ]; then {}; else {}; fi",
        answers(&format!("\"value\":{stated}")),
        answers("\"value\":[]")
    );
    let phrase =
        |say: &str, means: &str| format!("[[goal]]\nsay = \"{say}\"\nmeans = \"{means}\"\nquestion = true\n");
    vec![
        replace("domain.pddl", "(:predicates", "(:predicates\n    (wet ?on - surface)"),
        action(
            "  (:durative-action probe :parameters (?from - pose ?on - surface) :duration (= ?duration 1)\n    :condition (and (over all (at ?from)) (at start ([can-see ?from ?on])))\n    :effect (at end (wet ?on)))\n",
        ),
        program("probe.sh", &done),
        program("wet.sh", &wet),
        append("domain.toml", &phrase("is <surface> wet", "(wet <surface>)")),
        append("domain.toml", &phrase("is <surface> dry", "(not (wet <surface>))")),
        append(
            "domain.toml",
            "[action.probe]\nprogram = [\"sh\", \"probe.sh\"]\nkind = \"sensing\"\n\n[word.wet]\nprogram = [\"sh\", \"wet.sh\"]",
        ),
    ]
}

#[test]
fn a_question_takes_the_sensing_action_that_answers_it() {
    let asked = |stated: &str, goal: &str, exit: i32, answer: &str| {
        let report = check(&probes(stated), goal, exit, &["(probe "], &[]);
        assert_eq!(report["answer"], answer, "{goal} {stated}: {report}");
    };
    asked("[\"(wet table)\"]", "is the table wet", 0, "yes");
    asked("[]", "is the table wet", 1, "no");
    asked("[\"(wet table)\"]", "is the table dry", 1, "no");
    asked("[]", "is the table dry", 0, "yes");
}

#[test]
fn an_action_that_may_find_something_out_is_asked_for_its_kind() {
    let mut edits = probes("[\"(wet table)\"]");
    edits.push(replace("domain.toml", "\"probe.sh\"]\nkind = \"sensing\"", "\"probe.sh\"]"));
    let folder = own(&edits);
    let (out, err) = shown(&descry(folder.path(), &["check", "own"]));
    assert!((out + &err).contains("kind = \"sensing\" if the action finds it out"), "{err}");
    for goal in ["is the table wet", "is the table dry"] {
        check(
            &edits,
            goal,
            1,
            &["cannot be told", "the domain does not say whether (probe) finds that out"],
            &["(probe "],
        );
    }
}

/// A number `warmth` that a program states once the sensing action `feel` has been taken, which promises
/// 50, and questions about it.
fn feels(stated: &str) -> Vec<Edit> {
    let done = "touch felt; ".to_string() + &answers("\"value\":\"done\"");
    let warmth = format!(
        "if [ -e felt ]; then {}; else {}; fi",
        answers(&format!("\"value\":{stated}")),
        answers("\"value\":[]")
    );
    let phrase =
        |say: &str, means: &str| format!("[[goal]]\nsay = \"{say}\"\nmeans = \"{means}\"\nquestion = true\n");
    vec![
        replace("domain.pddl", "(:functions", "(:functions\n    (warmth ?on - surface)"),
        action(
            "  (:durative-action feel :parameters (?from - pose ?on - surface) :duration (= ?duration 1)\n    :condition (and (over all (at ?from)) (at start ([can-see ?from ?on])))\n    :effect (at end (assign (warmth ?on) 50)))\n",
        ),
        program("feel.sh", &done),
        program("warmth.sh", &warmth),
        append("domain.toml", &phrase("is <surface> warm", "(>= (warmth <surface>) 30)")),
        append("domain.toml", &phrase("is <surface> cold", "(< (warmth <surface>) 30)")),
        append("domain.toml", &phrase("is <surface> not warm", "(not (>= (warmth <surface>) 30))")),
        append(
            "domain.toml",
            "[action.feel]\nprogram = [\"sh\", \"feel.sh\"]\nkind = \"sensing\"\n\n[word.warmth]\nprogram = [\"sh\", \"warmth.sh\"]",
        ),
    ]
}

#[test]
fn a_question_takes_the_sensing_action_that_tells_a_number_whatever_that_promises() {
    let asked = |stated: &str, goal: &str, exit: i32| {
        let report = check(&feels(stated), goal, exit, &["(feel "], &[]);
        assert_eq!(report["answer"], ["yes", "no"][exit as usize], "{goal} {stated}: {report}");
    };
    for (stated, warm, cold) in
        [("[\"(= (warmth table) 12.5)\"]", 1, 0), ("[\"(= (warmth table) 40)\"]", 0, 1)]
    {
        asked(stated, "is the table warm", warm);
        asked(stated, "is the table cold", cold);
        asked(stated, "is the table not warm", cold);
    }
    // A sense that says nothing is asked once.
    check(
        &feels("[]"),
        "is the table cold",
        1,
        &["(feel ", "cannot be told", "nothing gives it a value"],
        &[],
    );
}

#[test]
fn one_part_of_a_question_that_can_be_told_may_decide_it() {
    let attic = "[[surface]]\nname = \"attic\"\nposition_m = [0.0, 1.6]\nsize_m = [0.6, 0.4]\nheight_m = 0.7\n\n[start]";
    let edits = |stated: &str| {
        let all =
            "[[goal]]\nsay = \"is all wet\"\nmeans = \"(forall (?on - surface) (wet ?on))\"\nquestion = true";
        let mut edits = probes(stated);
        edits.push(append("domain.toml", all));
        edits.push(replace("scenes/default.toml", "[start]", attic));
        edits.push(replace("domain.pddl", "(:predicates", "(:predicates\n    (near ?on - surface)"));
        edits.push(replace(
            "domain.pddl",
            "(over all (at ?from)) (at",
            "(over all (at ?from)) (at start (near ?on)) (at",
        ));
        edits.push(replace(
            "domain.toml",
            "scene = \"default\"",
            "scene = \"default\"\ninit = [\"(near table)\"]",
        ));
        edits
    };
    let report = check(&edits("[]"), "is all wet", 1, &["(probe "], &[]);
    assert_eq!(report["answer"], "no", "{report}");
    check(&edits("[\"(wet table)\"]"), "is all wet", 1, &["(probe ", "it cannot be told"], &[]);
}

#[test]
fn an_action_of_a_program_takes_its_time_on_a_clock_that_stands_still() {
    let twice = |within: &str, exit: i32| {
        let mut edits = rings(&answers("\"value\":\"ding\""), "");
        edits.push(replace("domain.pddl", "() :duration (= ?duration 1)", "() :duration (= ?duration 5)"));
        edits.push(append(
            "domain.toml",
            "[[goal]]\nsay = \"ring twice\"\nmeans = \"(and (rung) (tired))\"\n\n[action.rest]\nprogram = [\"sh\", \"ring.sh\"]",
        ));
        edits.push(action(
            "  (:durative-action rest :parameters () :duration (= ?duration 5)\n    :condition (at start (rung)) :effect (at end (tired)))\n",
        ));
        check(&edits, &format!("ring twice{within}"), exit, &[], &[])
    };
    twice(" within 7 s", 1);
    let report = twice(" within 12 s", 0);
    let seconds = report["sim_time_s"].as_f64().unwrap_or_default();
    assert!((10.0..11.0).contains(&seconds), "{report}");
}
