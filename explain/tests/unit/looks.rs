//! Tests of `looks`.

use descry_agent::standing::{InDoubt, Seen};
use descry_domains::note::{LeftOut, Note};
use descry_domains::saying::Saying;
use descry_explain::looks::*;
use descry_explain::standings::Standing;
use descry_memory::belief::Belief;
use descry_memory::belief::Track;

/// An object on the table that may be the ring or the stone.
fn track(ring: f64, stone: f64) -> Track {
    serde_json::from_value(serde_json::json!({
        "id": 0, "on": "table", "position_m": [1.0, 2.0, 0.7], "position_sigma_m": 0.01, "size_m": [0.1, 0.1, 0.1],
        "probabilities": [["the ring", ring], ["stone", stone]], "kinds": [], "unknown": 1.0 - ring - stone,
        "seen_fraction": 0.6, "viewpoints_m": [], "evidence": descry_perception::recognise::Evidence::default(),
        "cites": [], "first_ns": 0, "last_ns": 0,
    }))
    .expect("a track")
}

fn standing(tracks: Vec<Track>, sure: f64, hidden: f64, share: f64) -> Standing {
    let seen = Seen {
        on: "table".into(),
        share: Some(share),
        places: usize::from(share > 0.0),
        hidden,
        ..Seen::default()
    };
    let seen = vec![seen];
    let about = "the ring".to_string();
    let doubt = InDoubt { about, sure: Some(sure), wanted: 0.8, hidden, seen, ..InDoubt::default() };
    let mut belief = Belief::default();
    belief.adopt(tracks);
    Standing { doubts: vec![doubt], belief, ..Standing::default() }
}

fn perceived(left_out: &[(usize, &str)]) -> Note {
    Note::Perceived {
        on: "table".into(),
        merged: 1,
        left_out: left_out
            .iter()
            .map(|(view, why)| LeftOut::View { view: *view, why: why.to_string() })
            .collect(),
        points: 0,
        residual_m: 0.0,
        objects: Vec::new(),
        changed: Vec::new(),
    }
}

#[test]
fn why_it_is_no_surer_is_said() {
    let begin = standing(Vec::new(), 0.0, 0.75, 0.0);
    let check = |before: &Standing, after: &Standing, note: Note, words: &[&str], not: &str| {
        let asked = Hopes { goal: "(found the-ring)", hoped: &[], saying: &Saying::default() };
        let said = told(Some(before), after, &[&note], &asked).join(" ");
        words.iter().for_each(|word| assert!(said.contains(word), "{word:?} is not in {said}"));
        assert!(not.is_empty() || !said.contains(not), "{not:?} is in {said}");
    };
    // Nothing stood there, and something may be hidden.
    let empty = standing(vec![track(0.0, 0.9)], 0.0, 0.3, 0.7);
    let words = [
        "is still 0.00 (0.80 is wanted)",
        "the one object that was seen is not it",
        "with 0.30 it stands where it could not be seen yet",
        "70 % of the table (0 % before, 30 % are left)",
    ];
    check(&begin, &empty, perceived(&[]), &words, "could not be used");
    // On several surfaces it is said on which, and where something is that no object explains.
    let mut several = empty.clone();
    let desk = Seen { on: "desk".into(), share: Some(0.0), hidden: 0.1, ..Seen::default() };
    several.doubts[0].seen.push(desk);
    several.doubts[0].seen[0].measured = 0.25;
    let words = [
        "with 0.30 it stands where it could not be seen yet (0.30 on the table, mostly where something was measured that no object \
         explains; 0.10 on the desk)",
    ];
    check(&begin, &several, perceived(&[]), &words, "less on");
    // What was taken for it is something else.
    let taken = standing(vec![track(0.4, 0.35)], 0.3, 0.3, 0.7);
    let words = ["may be it with 0.40 (or stone with 0.35)", "this is the place is certain with 0.75"];
    check(&begin, &taken, perceived(&[]), &words, "");
    check(
        &taken,
        &empty,
        perceived(&[]),
        &["what might have been the ring, with 0.40, is stone with 0.90"],
        "before, 30",
    );
    // It went, or only what had been seen of it does not hold any more.
    let gone = standing(Vec::new(), 0.0, 0.3, 0.7);
    let words =
        ["with 0.40, is not seen there any more; no object was seen", "with 0.70 it is not there at all"];
    check(&taken, &gone, perceived(&[]), &words, "no longer holds");
    let words = ["with 0.40, is not counted on any more: what was seen there before no longer holds"];
    check(&taken, &begin, perceived(&[]), &words, "not seen there any more");
    // The view failed.
    let failed = perceived(&[(2, "left out: it contradicts")]);
    check(&begin, &empty, failed, &["this view of the table could not be used"], "");
    let because = "no plane".into();
    let nothing = Note::Nothing { because, advice: String::new(), is_left_out: false, contradiction: None };
    check(
        &begin,
        &begin,
        nothing,
        &["the look showed no surface", "Nothing was seen yet of the table"],
        "Seen by now",
    );
    // It is sure enough.
    let sure = standing(vec![track(0.9, 0.0)], 0.9, 0.1, 0.95);
    check(
        &taken,
        &sure,
        perceived(&[]),
        &["is now 0.90 (0.30 before, 0.80 is wanted). Seen by now"],
        "no more",
    );
}
