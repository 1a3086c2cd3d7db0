//! In-process functions that replace the programs named by a domain.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::Value;

/// Function that replaces a program: it gets the same questions without `id`, and its answers are
/// recorded like a program's.
pub trait Function: std::fmt::Debug + Send + Sync {
    /// Answers a question with the `value` that the program's answer would have.
    ///
    /// # Errors
    ///
    /// The `error` of the answer, in words.
    fn answer(&self, question: &Value) -> Result<Value, String>;
}

/// Functions by the name of the predicate, function, action or call that they serve.
pub type NamedFunctions = BTreeMap<String, Arc<dyn Function>>;

/// Functions that replace the programs of a domain.
#[derive(Debug, Clone, Default)]
pub struct Functions {
    /// Functions that answer calls: `attachments.NAME` of `domain.toml`.
    pub calls: NamedFunctions,
    /// Functions that state facts: `word.NAME`.
    pub facts: NamedFunctions,
    /// Functions that carry out actions: `action.NAME`.
    pub actions: NamedFunctions,
}

impl Functions {
    /// Function for a table of `domain.toml` and a name in this table.
    pub fn of(&self, table: &str, name: &str) -> Option<Arc<dyn Function>> {
        let named = match table {
            "attachments" => &self.calls,
            "word" => &self.facts,
            "action" => &self.actions,
            _ => return None,
        };
        named.get(name).cloned()
    }
}
