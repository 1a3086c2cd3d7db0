//! Why there is no plan.

use std::fmt;

use serde::Serialize;

use crate::diagnostic::Findings;

/// Why a task has no plan: findings that point at the goal, at what nobody achieves, and at who said no.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// The reasons, the goal's first.
    pub findings: Findings,
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, finding) in self.findings.list.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            f.write_str(&finding.message)?;
        }
        Ok(())
    }
}
