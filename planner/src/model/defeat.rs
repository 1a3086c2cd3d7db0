//! Durative actions that are never applicable because their own start deletes an invariant.

use crate::diagnostic::Span;
use crate::task::{Action, Atom, Change, Condition};

/// Over-all atom of a durative action that the action's own start deletes, with the span of that
/// effect; `None` if there is none.
pub fn self_defeating(action: &Action) -> Option<(&Atom, Span)> {
    let effects = &action.effects.start;
    let adds = |atom: &Atom| {
        let same = |change: &Change| matches!(change, Change::Add(own) if is_same(own, atom));
        effects.iter().any(|effect| same(&effect.change))
    };
    let takes = |atom: &Atom| {
        let sure = effects.iter().filter(|effect| effect.when.start.is_true() && effect.forall.is_empty());
        let mut deleted = sure.filter(|effect| match &effect.change {
            Change::Delete(own) => is_same(own, atom),
            _ => false,
        });
        deleted.next().map(|effect| effect.span)
    };
    let mut needed = Vec::new();
    action.is_durative().then(|| certain(&action.condition.over_all, &mut needed));
    needed.into_iter().filter(|atom| !adds(atom)).find_map(|atom| Some((atom, takes(atom)?)))
}

fn is_same(one: &Atom, other: &Atom) -> bool {
    one.predicate == other.predicate && one.arguments == other.arguments
}

/// Appends the atoms that must hold for the condition to hold.
fn certain<'c>(condition: &'c Condition, into: &mut Vec<&'c Atom>) {
    match condition {
        Condition::And(parts) => parts.iter().for_each(|part| certain(part, into)),
        Condition::Atom(atom) => into.push(atom),
        _ => {}
    }
}
