//! Tests of `states`.

use std::cell::Cell;

use descry_domains::states::*;

#[derive(Clone, Default, Debug, PartialEq)]
struct Pours(usize);

#[derive(Clone, Default, Debug, PartialEq)]
struct Names(Vec<String>);

impl State for Pours {
    fn nothing() -> &'static Self {
        static NOTHING: Pours = Pours(0);
        &NOTHING
    }
}

impl State for Names {
    fn nothing() -> &'static Self {
        static NOTHING: Names = Names(Vec::new());
        &NOTHING
    }
}

#[test]
fn a_snapshot_keeps_the_states_that_it_was_taken_with() {
    let mut now = States::default();
    assert_eq!(now.get::<Pours>(), &Pours(0));
    now.get_mut::<Names>().0.push("cup A".into());
    now.get_mut::<Pours>().0 += 1;
    let before = now.clone();
    now.get_mut::<Pours>().0 += 1;
    now.get_mut::<Names>().0.clear();
    assert_eq!((before.get::<Pours>().0, before.get::<Names>().0.len()), (1, 1));
    assert_eq!((now.get::<Pours>().0, now.get::<Names>().0.len()), (2, 0));
}

#[test]
fn a_value_is_worked_out_once_and_for_each_type() {
    let (derived, made) = (Derived::default(), Cell::new(0));
    let pours = || {
        made.set(made.get() + 1);
        Pours(made.get())
    };
    assert_eq!(derived.get(&|| Names(vec!["cup A".into()])).0.len(), 1);
    assert_eq!((derived.get(&pours), derived.get(&pours)), (&Pours(1), &Pours(1)));
    assert_eq!((made.get(), derived.get(&Names::default).0.len()), (1, 1));
}
