//! Plans: what to do, when, for how long.

/// One step of a plan.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Step {
    /// When it starts, from the beginning of the plan; `None` in a classical plan.
    pub start_s: Option<f64>,
    /// Name of the action, lower case.
    pub action: String,
    /// Names of the objects, lower case.
    pub arguments: Vec<String>,
    /// How long it takes; 0 for an instantaneous action.
    pub duration_s: f64,
}

/// A plan, in order of time.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Plan {
    /// Its steps.
    pub steps: Vec<Step>,
    /// Its cost, as far as known.
    pub cost: Option<f64>,
}
