//! Answers about recordings whose camera or poses are not as stated.

use crate::lies::measured;

#[test]
#[ignore = "slow: 42 recordings and their true ones: minutes"]
fn recordings_with_a_false_camera_or_false_poses_get_no_false_answer() {
    for (name, tally) in measured(42, 7001).expect("they are recorded and searched") {
        let [right, off, yes, denied, open] = tally.answers;
        assert_eq!([off, yes, denied], [0; 3], "{name}: off, false yes, false not there");
        assert!(name != "none" || open == 0 && right > 0, "{name}: {right} right, {open} open");
    }
}
