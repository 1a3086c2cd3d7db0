//! The tree of frames of a bag, by time.

use super::cdr::Transform;
use crate::recorded::pose::interpolated;
use nalgebra::Isometry3;
use std::collections::BTreeMap;

/// Longest gap of a transform across which it is interpolated, seconds. From: chosen.
const GAP_S: f64 = 1.0;

/// Transforms by child frame, with the parent frame: fixed ones, and moving ones in order of time, seconds.
#[derive(Default)]
pub(super) struct Transforms {
    fixed: BTreeMap<String, (String, Isometry3<f64>)>,
    moving: BTreeMap<String, (String, Vec<(f64, Isometry3<f64>)>)>,
}

impl Transforms {
    pub(super) fn add(&mut self, fixed: bool, transform: Transform) {
        let Transform { header, child, parent_from_child } = transform;
        if fixed {
            self.fixed.insert(child, (header.frame, parent_from_child));
        } else {
            let (parent, poses) = self.moving.entry(child).or_insert((header.frame.clone(), Vec::new()));
            *parent = header.frame;
            poses.push((header.stamp_s, parent_from_child));
        }
    }

    pub(super) fn sort(&mut self) {
        self.moving.values_mut().for_each(|(_, poses)| poses.sort_by(|(a, _), (b, _)| a.total_cmp(b)));
    }

    fn parent(&self, frame: &str) -> Option<&str> {
        let moving = self.moving.get(frame).map(|(parent, _)| parent.as_str());
        moving.or_else(|| self.fixed.get(frame).map(|(parent, _)| parent.as_str()))
    }

    /// Root of the tree that holds a frame; `None` if the frame has no parent, or its ancestors form a cycle.
    pub(super) fn root<'a>(&'a self, frame: &'a str) -> Option<&'a str> {
        let mut at = self.parent(frame)?;
        for _ in 0..self.moving.len() + self.fixed.len() {
            match self.parent(at) {
                Some(parent) => at = parent,
                None => return Some(at),
            }
        }
        None
    }

    /// Pose of a frame in the root of its tree at a time, seconds; `None` where a transform of that time is
    /// missing.
    pub(super) fn root_from(&self, frame: &str, stamp_s: f64) -> Option<Isometry3<f64>> {
        self.root(frame)?;
        let mut root_from_frame = Isometry3::identity();
        let mut at = frame;
        while let Some(parent) = self.parent(at) {
            let parent_from_at = match (self.moving.get(at), self.fixed.get(at)) {
                (Some((_, poses)), _) => interpolated(poses, stamp_s, GAP_S)?,
                (None, Some((_, pose))) => *pose,
                (None, None) => return None,
            };
            root_from_frame = parent_from_at * root_from_frame;
            at = parent;
        }
        Some(root_from_frame)
    }

    /// Names of all frames that have a parent.
    pub(super) fn frames(&self) -> Vec<&str> {
        self.moving.keys().chain(self.fixed.keys()).map(String::as_str).collect()
    }
}
