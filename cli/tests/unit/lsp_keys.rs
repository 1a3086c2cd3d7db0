//! Tests of `lsp::keys`.

use descry_cli::lsp::keys::*;

const TOML: &str =
    "name = \"toy\"\n\n[[goal]]\nsay = \"go\"\n\n[action.fly]\ndoes = \"move ?from ?to\"\nretries = 2\n";

#[test]
fn headings_and_keys_mean_what_the_reference_says() {
    let check = |sought: &str, further: usize, name: Option<&str>, words: &str| {
        let at = TOML.find(sought).expect("it is there") + further;
        let found = here("domain.toml", TOML, at);
        assert_eq!(found.as_ref().map(|here| here.name.1), name, "{sought}");
        let meaning = found.map(|here| here.meaning).unwrap_or_default();
        assert!(meaning.contains(words), "{sought}: {meaning}");
    };
    check("name =", 2, Some("name"), "The domain's name.");
    check("[[goal]]", 3, Some("goal"), "Phrases that may be said, each with a goal");
    check("say =", 0, Some("say"), "Words and `<slots>`");
    check("[action.fly]", 2, Some("action"), "Execution of each action");
    check("[action.fly]", 9, Some("fly"), "");
    check("retries", 7, Some("retries"), "tries again after a failure");
    check("\"move ?from", 2, None, "");
    check("\"toy\"", 2, None, "");
}
