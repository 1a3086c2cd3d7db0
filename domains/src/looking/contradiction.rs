//! Contradictions between looks and the map.

use descry_perception::consistency::Fault;

/// Reason why the looks at a surface prove nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Contradiction {
    /// A fault of camera or poses.
    Fault(Fault),
    /// The views inconsistent with their stated poses are as many as the consistent ones.
    Apart,
}

impl Contradiction {
    /// The contradiction in a sentence, with the surface by name.
    pub fn told(&self, surface: &str) -> String {
        match self {
            Contradiction::Fault(fault) => {
                format!("what the looks show of the {surface} contradicts the map: {fault}")
            }
            Contradiction::Apart => format!("too few views of the {surface} can be laid on each other"),
        }
    }
}
