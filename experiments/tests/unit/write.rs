//! Tests of `write`.

use descry_experiments::write::*;
use descry_experiments::{Finished, Row};
use serde_json::{Value, json};

#[test]
fn csv_quotes_and_lines_up() {
    let row = |value: Value| value.as_object().cloned().unwrap_or_default();
    let job = |id: &str, rows: Vec<Row>, error: Option<&str>| Finished {
        job: id.into(),
        rows,
        clock: Row::new(),
        error: error.map(str::to_string),
    };
    let finished = [
        job("a", vec![row(json!({ "x": 1, "y": "p,q" })), row(json!({ "x": 2.5, "z": true }))], None),
        job("b", vec![row(json!({ "x": null }))], Some("say \"why\"")),
    ];
    let expected = "job,x,y,z,error\na,1,\"p,q\",,\na,2.5,,true,\nb,,,,\"say \"\"why\"\"\"\n";
    assert_eq!(csv(&finished, |job| job.rows.clone()), expected);
}
