//! Tests of `numbers`.

use descry_agent::numbers::*;

#[test]
fn shares_say_something_near_their_ends() {
    let cases = [
        (0.0, "0.00"),
        (-0.0, "0.00"),
        (-1e-9, "0.00"),
        (0.5, "0.50"),
        (0.004, "0.004"),
        (0.0174, "0.017"),
        (0.05, "0.05"),
        (0.00001, "0.00"),
        (0.9996, "0.9996"),
        (0.99999, "1.00"),
        (1.0, "1.00"),
        (9.1364, "9.14"),
    ];
    cases.iter().for_each(|(value, text)| assert_eq!(share(*value), *text));
    assert_eq!([share_of(0.89967, 0.9), share_of(0.912, 0.9)], ["0.8996", "0.91"]);
}
