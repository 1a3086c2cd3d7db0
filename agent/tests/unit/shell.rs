//! Tests of `shell`.

use descry_agent::shell::*;

#[test]
fn a_word_of_the_shell_stays_one() {
    let check = |text: &str, expected: &str| assert_eq!(word(text), expected);
    check("runs/find-cup-a", "runs/find-cup-a");
    check("mongodb://host/base", "mongodb://host/base");
    check("my runs/one", "'my runs/one'");
    check("it's $HOME", r"'it'\''s $HOME'");
    check("mongodb://host/base#run", "'mongodb://host/base#run'");
    check("", "''");
}
