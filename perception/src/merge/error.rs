//! Errors of a merge.

/// Views that cannot be merged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MergeError {
    /// The list of views is empty.
    #[error("no view to merge: give at least one")]
    NoViews,
    /// Invalid options.
    #[error("merge option `{field}` is {value}: expected {expected}")]
    Option {
        /// Name of the option.
        field: &'static str,
        /// Value that was given.
        value: f64,
        /// The expected values, in words.
        expected: &'static str,
    },
    /// A pose that is not finite.
    #[error("the pose of view {view} is not finite: leave the view out or mend its transform")]
    Pose {
        /// Index of the view.
        view: usize,
    },
    /// No view has a point that can be used.
    #[error(
        "none of the {views} views has a point within {range_m} m{band}: check range, height band and units"
    )]
    Empty {
        /// Number of views.
        views: usize,
        /// The range limit, metres.
        range_m: f64,
        /// Description of the height band, or empty.
        band: String,
    },
}
