//! Tests of `commands::runs`.

#[test]
fn dates_are_those_of_the_calendar() {
    let cases = [
        (0, "1970-01-01 00:00"),
        (951_782_399, "2000-02-28 23:59"),
        (951_825_600, "2000-02-29 12:00"),
        (1_709_251_140, "2024-02-29 23:59"),
        (1_709_251_200, "2024-03-01 00:00"),
        (1_735_689_599, "2024-12-31 23:59"),
        (4_107_542_400, "2100-03-01 00:00"),
    ];
    for (unix_s, text) in cases {
        assert_eq!(descry_cli::commands::runs::date(unix_s), text);
    }
}
