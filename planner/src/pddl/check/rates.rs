//! Checks that rates of change are constant between happenings.

use super::Checker;
use crate::diagnostic::Diagnostic;
use crate::model::walk::{self, Part};

impl Checker<'_> {
    /// Reports rates that depend on continuously changing numbers.
    pub(super) fn steady_rates(&mut self) {
        let rates = || self.task.actions.iter().flat_map(|action| &action.continuous);
        let mut found = Vec::new();
        for rate in rates() {
            walk::expression(&rate.per_second, &mut |part| {
                let Part::Fluent(fluent) = part else { return };
                let Some(other) = rates().find(|other| other.fluent.function == fluent.function) else {
                    return;
                };
                let name = &self.task.function(fluent.function).name;
                let message = format!("a rate that itself changes at a rate: it depends on `{name}`");
                let finding = Diagnostic::error("not-supported", message, rate.span, "not a steady rate")
                    .with_label(other.span, format!("`{name}` changes at a rate here"))
                    .with_help("let rates depend on numbers that change `at start`, `at end` or never");
                found.push(finding);
            });
        }
        found.into_iter().for_each(|finding| self.push(finding));
    }
}
