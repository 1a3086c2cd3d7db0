//! Functions of the process that runs the agent, in the places of the programs that a domain names.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::Value;

/// A function in the place of a program. It gets the questions that the program would get, without their
/// `id`, and its answers are recorded as those of a program are.
pub trait Function: std::fmt::Debug + Send + Sync {
    /// The `value` of the answer.
    ///
    /// # Errors
    /// The `error` of the answer, in words.
    fn answer(&self, question: &Value) -> Result<Value, String>;
}

/// Functions by the names of what they answer for.
pub type NamedFunctions = BTreeMap<String, Arc<dyn Function>>;

/// The functions that stand in for programs of a domain.
#[derive(Debug, Clone, Default)]
pub struct Functions {
    /// Behind calls: `attachments.NAME` of `domain.toml`.
    pub calls: NamedFunctions,
    /// Behind facts: `word.NAME`.
    pub facts: NamedFunctions,
    /// Behind actions: `action.NAME`.
    pub actions: NamedFunctions,
}

impl Functions {
    /// The function for a table of `domain.toml` and a name in it.
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
