//! Tests of `run`.

use descry_agent::exit::{CommandError, Exit};
use descry_agent::run::*;
use std::path::Path;

#[test]
fn a_run_that_did_not_end_says_how_it_goes_on() {
    let check = |folder: &str, expected: &str| {
        let stopped = CommandError::Stopped { said: "stopped".into(), signal: 2 };
        let full = CommandError::Broken("no room left".into());
        for (error, exit) in [(stopped, Exit::Interrupted), (full, Exit::Broken)] {
            let error = how_to_go_on(error, Path::new(folder), false);
            let said = error.to_string();
            assert_eq!(error.exit(), exit, "{said}");
            assert!(said.ends_with(&format!("go on with: descry do --resume {expected}")), "{said}");
        }
        let others = [
            (CommandError::BadInput("no such word".into()), false),
            (CommandError::Broken("it does not fit".into()), true),
        ];
        for (other, is_at_bound) in others {
            let said = other.to_string();
            assert_eq!(how_to_go_on(other, Path::new(folder), is_at_bound).to_string(), said);
        }
    };
    check("runs/mug", "runs/mug");
    check("my runs/mug", "'my runs/mug'");
}
