//! Tests of `commands::name`.

#[test]
fn days_are_those_of_the_calendar() {
    for (unix_s, day) in [(0.0, "Thursday"), (951_782_399.0, "Monday"), (1_795_478_400.0, "Tuesday")] {
        assert_eq!(descry_cli::commands::name::weekday(unix_s), day);
    }
}
