//! `rear-side`: the view that shows most unobserved space right beside occupied space, where
//! objects continue or hide (rear side voxels of Delmerico et al., *A comparison of volumetric
//! information gain metrics*, section III).

use descry_memory::space::Cell;
use descry_perception::nalgebra::{Point3, Vector3};

use super::policy::{Look, Policy, best};
use super::unseen;
use crate::situation::Situation;

/// Horizontal distance from occupied space within which unobserved space counts as rear side, metres.
const BEHIND_M: f64 = 0.04;

pub(super) struct RearSide;

impl Policy for RearSide {
    fn choose(&mut self, situation: &Situation, looks: &[Look]) -> Option<Look> {
        best(looks, |look| unseen::visible(situation, look, |p| is_behind(situation, look.on, p)))
    }
}

fn is_behind(situation: &Situation, on: usize, p: &Point3<f64>) -> bool {
    let aside = [Vector3::x(), Vector3::y()].into_iter().flat_map(|d| [d, -d]);
    aside.into_iter().any(|d| situation.spaces[on].cell(&(p + d * BEHIND_M)) == Cell::Occupied)
}
