//! Transform tree over time: measured transforms, interpolated at the requested time.

use nalgebra::{Isometry3, Translation3};
use petgraph::algo::astar;
use petgraph::graphmap::UnGraphMap;
use std::collections::BTreeMap;

/// A transform that cannot be looked up or inserted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransformError {
    /// No transform mentions that frame.
    #[error("no transform names the frame `{frame}`; known are: {known}")]
    UnknownFrame {
        /// Name of the requested frame.
        frame: String,
        /// Names of the known frames.
        known: String,
    },
    /// Two frames are in different trees at that time.
    #[error(
        "at {stamp_ns} ns no chain links `{target}` to `{origin}`: `{origin}` ends at `{origin_root}` and `{target}` at `{target_root}`; record the transform between those two"
    )]
    NotLinked {
        /// Frame to transform into.
        target: String,
        /// Frame to transform from.
        origin: String,
        /// Root of the tree that holds `target`.
        target_root: String,
        /// Root of the tree that holds `origin`.
        origin_root: String,
        /// Requested time, nanoseconds.
        stamp_ns: i64,
    },
    /// Two linked frames have no measured transform near that time.
    #[error("the link `{parent}` <- `{child}` was not measured near {stamp_ns} ns: {}", gap_text(*stamp_ns, *before_ns, *after_ns, *max_gap_ns))]
    Gap {
        /// Parent frame.
        parent: String,
        /// Child frame.
        child: String,
        /// Requested time, nanoseconds.
        stamp_ns: i64,
        /// Time of the last measurement before, nanoseconds; `None` if there is none.
        before_ns: Option<i64>,
        /// Time of the first measurement after, nanoseconds; `None` if there is none.
        after_ns: Option<i64>,
        /// Maximum gap that is interpolated, nanoseconds.
        max_gap_ns: i64,
    },
    /// The parents form a cycle.
    #[error(
        "at {stamp_ns} ns the frames {frames} are each other's parents: one of these links is the wrong way round"
    )]
    Loop {
        /// Names of the frames in the cycle.
        frames: String,
        /// Requested time, nanoseconds.
        stamp_ns: i64,
    },
    /// An invalid transform.
    #[error("the transform `{parent}` <- `{child}` at {stamp_ns} ns {what}")]
    Invalid {
        /// Parent frame.
        parent: String,
        /// Child frame.
        child: String,
        /// Time, nanoseconds.
        stamp_ns: i64,
        /// Fault of the transform.
        what: &'static str,
    },
}

fn gap_text(stamp_ns: i64, before_ns: Option<i64>, after_ns: Option<i64>, max_gap_ns: i64) -> String {
    let seconds = |ns: i128| ns as f64 * 1e-9;
    let limit = seconds(max_gap_ns.into());
    match (before_ns, after_ns) {
        (Some(b), Some(a)) => format!(
            "a gap of {:.3} s, from {:.3} s before to {:.3} s after, where at most {limit:.3} s are bridged",
            seconds(i128::from(a) - i128::from(b)),
            seconds(i128::from(stamp_ns) - i128::from(b)),
            seconds(i128::from(a) - i128::from(stamp_ns))
        ),
        (Some(b), None) => {
            format!("the last is {:.3} s earlier", seconds(i128::from(stamp_ns) - i128::from(b)))
        }
        (None, Some(a)) => {
            format!("the first is {:.3} s later", seconds(i128::from(a) - i128::from(stamp_ns)))
        }
        (None, None) => "it was never measured".into(),
    }
}

/// Limits of interpolating and extrapolating transforms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// Maximum gap between two measurements for interpolation, nanoseconds. Paper 004's recorder restores 4 s
    /// around a stamp.
    pub max_gap_ns: i64,
    /// Time by which the first or last measurement holds beyond its stamp, nanoseconds.
    pub hold_ns: i64,
}

impl Default for Reach {
    fn default() -> Self {
        Reach { max_gap_ns: 4_000_000_000, hold_ns: 100_000_000 }
    }
}

/// Pose of a child frame in its parent at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The time, nanoseconds.
    pub stamp_ns: i64,
    /// Transform from the child frame to the parent frame.
    pub parent_from_child: Isometry3<f64>,
}

#[derive(Clone, Debug, Default)]
struct Link {
    fixed: Option<Isometry3<f64>>,
    samples: BTreeMap<i64, Isometry3<f64>>,
}

/// State of the link between two frames at a time: the transform, or the measurements around a gap.
enum At {
    Known(Isometry3<f64>),
    Gap { before_ns: Option<i64>, after_ns: Option<i64> },
}

impl Link {
    fn at(&self, stamp_ns: i64, reach: Reach) -> At {
        let before = self.samples.range(..=stamp_ns).next_back();
        let after = self.samples.range(stamp_ns..).next();
        match (before, after) {
            (Some((&b, iso)), _) if b == stamp_ns => At::Known(*iso),
            (Some((&b, from)), Some((&a, to))) if a.saturating_sub(b) <= reach.max_gap_ns => {
                At::Known(interpolate(from, to, (stamp_ns - b) as f64 / (a - b) as f64))
            }
            (Some((&b, iso)), _) if stamp_ns.saturating_sub(b) <= reach.hold_ns => At::Known(*iso),
            (_, Some((&a, iso))) if a.saturating_sub(stamp_ns) <= reach.hold_ns => At::Known(*iso),
            _ => match self.fixed {
                Some(iso) => At::Known(iso),
                None => At::Gap { before_ns: before.map(|(&b, _)| b), after_ns: after.map(|(&a, _)| a) },
            },
        }
    }

    /// Rank of this link among the links of one child to several parents at a time, greatest first: the one
    /// measured last before that time, else a static one, else the one measured next.
    fn precedence(&self, stamp_ns: i64) -> (u8, i64) {
        let before = self.samples.range(..=stamp_ns).next_back().map(|(&b, _)| b);
        let after = self.samples.range(stamp_ns..).next().map(|(&a, _)| a);
        match (before, after) {
            (Some(b), _) => (2, b),
            _ if self.fixed.is_some() => (1, 0),
            (None, Some(a)) => (0, -a),
            (None, None) => (0, i64::MIN),
        }
    }
}

/// Interpolates between two transforms at `t` (0 to 1): linearly in position, along the shorter arc in
/// orientation.
pub fn interpolate(from: &Isometry3<f64>, to: &Isometry3<f64>, t: f64) -> Isometry3<f64> {
    let position = from.translation.vector.lerp(&to.translation.vector, t);
    // Opposite orientations have no shorter arc; any is as good, as long as it is always the same.
    let rotation = from.rotation.try_slerp(&to.rotation, t, 1e-12).unwrap_or(if t < 0.5 {
        from.rotation
    } else {
        to.rotation
    });
    Isometry3::from_parts(Translation3::from(position), rotation)
}

/// Transform tree over time, in memory.
#[derive(Clone, Debug, Default)]
pub struct Transforms {
    /// Measured transforms by child frame, then parent frame: a child may change its parent over time.
    links: BTreeMap<String, BTreeMap<String, Link>>,
}

impl Transforms {
    /// Inserts a measured transform; a second one between the same frames at the same time replaces the
    /// first.
    ///
    /// # Errors
    /// [`TransformError::Invalid`] for numbers that are not finite, an invalid rotation, or a frame that is
    /// its own parent.
    pub fn insert(
        &mut self,
        stamp_ns: i64,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), TransformError> {
        check(stamp_ns, parent, child, parent_from_child)?;
        self.link(parent, child).samples.insert(stamp_ns, *parent_from_child);
        Ok(())
    }

    /// Inserts a static transform, which holds at all times without a measured one.
    ///
    /// # Errors
    /// As [`Transforms::insert`].
    pub fn insert_static(
        &mut self,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), TransformError> {
        check(0, parent, child, parent_from_child)?;
        self.link(parent, child).fixed = Some(*parent_from_child);
        Ok(())
    }

    fn link(&mut self, parent: &str, child: &str) -> &mut Link {
        if !self.links.contains_key(child) {
            self.links.insert(child.into(), BTreeMap::new());
        }
        self.links.entry(child.into()).or_default().entry(parent.into()).or_default()
    }

    /// True if no transform was inserted.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Names of all frames, sorted.
    pub fn frames(&self) -> Vec<&str> {
        let mut all: Vec<&str> = self
            .links
            .iter()
            .flat_map(|(c, parents)| parents.keys().chain([c]).map(String::as_str))
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Transform from `origin` to `target` at a time, through the tree of that time.
    ///
    /// # Errors
    /// An unknown frame, a missing link (named by the two frames that it would join), a gap in time, or a
    /// loop.
    pub fn lookup(
        &self,
        target: &str,
        origin: &str,
        stamp_ns: i64,
        reach: Reach,
    ) -> Result<Isometry3<f64>, TransformError> {
        let frames = self.frames();
        for frame in [target, origin] {
            if target != origin && !frames.contains(&frame) {
                return Err(TransformError::UnknownFrame { frame: frame.into(), known: listed(&frames) });
            }
        }
        let tree = self.tree_at(stamp_ns);
        let chain = astar(&tree, origin, |f| f == target, |_| 1_u32, |_| 0);
        let Some((_, chain)) = chain else {
            let root = |frame| self.root(frame, stamp_ns);
            return Err(TransformError::NotLinked {
                target: target.into(),
                origin: origin.into(),
                target_root: root(target)?,
                origin_root: root(origin)?,
                stamp_ns,
            });
        };
        chain.windows(2).try_fold(Isometry3::identity(), |here_from_origin, pair| {
            Ok(self.step(pair[0], pair[1], stamp_ns, reach)? * here_from_origin)
        })
    }

    /// Transform from `here` to `next`, two neighbours in the tree.
    fn step(
        &self,
        here: &str,
        next: &str,
        stamp_ns: i64,
        reach: Reach,
    ) -> Result<Isometry3<f64>, TransformError> {
        let up = self.parent_at(here, stamp_ns).is_some_and(|(parent, _)| parent == next);
        let (child, parent) = if up { (here, next) } else { (next, here) };
        let link = self.links.get(child).and_then(|parents| parents.get(parent));
        match link.map(|l| l.at(stamp_ns, reach)) {
            Some(At::Known(parent_from_child)) if up => Ok(parent_from_child),
            Some(At::Known(parent_from_child)) => Ok(parent_from_child.inverse()),
            gap => {
                let (before_ns, after_ns) = match gap {
                    Some(At::Gap { before_ns, after_ns }) => (before_ns, after_ns),
                    _ => (None, None),
                };
                Err(TransformError::Gap {
                    parent: parent.into(),
                    child: child.into(),
                    stamp_ns,
                    before_ns,
                    after_ns,
                    max_gap_ns: reach.max_gap_ns,
                })
            }
        }
    }

    fn parent_at(&self, child: &str, stamp_ns: i64) -> Option<(&str, &Link)> {
        let parents = self.links.get(child)?;
        parents.iter().max_by_key(|(_, link)| link.precedence(stamp_ns)).map(|(p, link)| (p.as_str(), link))
    }

    fn tree_at(&self, stamp_ns: i64) -> UnGraphMap<&str, ()> {
        let mut tree = UnGraphMap::new();
        for child in self.links.keys() {
            if let Some((parent, _)) = self.parent_at(child, stamp_ns) {
                tree.add_edge(child.as_str(), parent, ());
            }
        }
        tree
    }

    fn root(&self, frame: &str, stamp_ns: i64) -> Result<String, TransformError> {
        let mut chain = vec![frame];
        while let Some((parent, _)) = self.parent_at(chain[chain.len() - 1], stamp_ns) {
            if chain.contains(&parent) {
                chain.push(parent);
                return Err(TransformError::Loop { frames: listed(&chain), stamp_ns });
            }
            chain.push(parent);
        }
        Ok(chain[chain.len() - 1].into())
    }
}

/// Rejects anything but a rigid transform between two frames.
pub(crate) fn check(
    stamp_ns: i64,
    parent: &str,
    child: &str,
    iso: &Isometry3<f64>,
) -> Result<(), TransformError> {
    let fail =
        |what| Err(TransformError::Invalid { parent: parent.into(), child: child.into(), stamp_ns, what });
    if parent.is_empty() || child.is_empty() {
        return fail("has a frame without a name: name both");
    }
    if parent == child {
        return fail("joins a frame to itself: name the frame that it is given in");
    }
    if !iso.translation.vector.iter().chain(iso.rotation.coords.iter()).all(|v| v.is_finite()) {
        return fail("is not finite: leave out poses that are not known");
    }
    if (iso.rotation.coords.norm() - 1.0).abs() > 1e-6 {
        return fail("has a quaternion that is not of length 1: normalise it");
    }
    Ok(())
}

fn listed(frames: &[&str]) -> String {
    if frames.is_empty() {
        "none".into()
    } else {
        frames.iter().map(|f| format!("`{f}`")).collect::<Vec<_>>().join(", ")
    }
}
