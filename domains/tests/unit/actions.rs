//! Tests of `actions`.

use descry_domains::actions::kind;
use descry_domains::config::{ActionKind, Config};

#[test]
fn an_action_is_of_the_strongest_kind_of_what_it_does() {
    let check = |action: &str, expected: ActionKind| {
        let text = format!(
            "name = \"d\"\nabout = \"d\"\nuses = [\"searching\", \"carrying\"]\n[action.act]\n{action}"
        );
        let config: Config = toml::from_str(&text).unwrap_or_else(|e| panic!("{action}: {e}"));
        assert_eq!(kind(&config, "act"), expected, "{action}");
    };
    check("does = \"move ?a ?b\"", ActionKind::Moving);
    check("does = \"observe ?a ?b\"", ActionKind::Sensing);
    check("does = [\"move ?a ?b\", \"observe ?b ?c\"]", ActionKind::Moving);
    check("does = [\"observe ?a ?b\", \"put-down ?a ?b ?c\", \"observe ?a ?b\"]", ActionKind::Changing);
    check("does = \"open-door ?a ?b\"", ActionKind::Changing);
    check("does = \"push-aside ?a ?b\"", ActionKind::Changing);
    check("program = [\"sh\"]", ActionKind::Changing);
    check("program = [\"sh\"]\nkind = \"sensing\"", ActionKind::Sensing);
    check("program = [\"sh\"]\nkind = \"moving\"", ActionKind::Moving);
    // Nobody knows what a skill does that there is not.
    check("does = \"dance ?a\"", ActionKind::Changing);
    check("limit_s = 3.0", ActionKind::Changing);
    let config: Config = toml::from_str("name = \"d\"\nabout = \"d\"").expect("a configuration");
    assert_eq!(kind(&config, "observe"), ActionKind::Sensing, "the skill of its name");
}
