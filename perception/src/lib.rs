//! From views to percepts, models and maps.
