//! Static geometry of a map, cached from round to round: walls, cameras at the viewpoints, and the
//! viewpoints that see each surface. Only changed parts, such as a grown surface or a shut door,
//! are recomputed.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

use descry_perception::nalgebra::{Isometry3, Point3};
use descry_robots::{Door, Place};

use crate::states::Derived;
use crate::surface::KnownSurface;
use crate::viewpoint::Candidate;
use crate::walls::Walls;

/// Geometry of a map for one set of viewpoints, surfaces and shut doors.
#[derive(Debug, Default)]
pub struct Geometry {
    walls: Arc<Walls>,
    viewpoints: Arc<[Place]>,
    shut: BTreeSet<usize>,
    sights: Vec<Arc<Sight>>,
}

/// Visibility of one surface from each viewpoint.
#[derive(Debug)]
pub(crate) struct Sight {
    outline: Vec<Point3<f64>>,
    is_whole: bool,
    /// True if the surface is on a map of the body's own making, which changes with every view.
    is_charted: bool,
    /// Camera pose in the map, by viewpoint; `None` if the surface cannot be looked at from there.
    pub cameras: Vec<OnceLock<Option<Isometry3<f64>>>>,
    /// Indices of the viewpoints that see any part of the surface, in order.
    pub viewers: OnceLock<Vec<usize>>,
    /// Derived values of the surface, kept while its geometry is unchanged.
    pub derived: Derived,
}

impl Geometry {
    /// Geometry of a body's map before anything is known.
    pub fn of_map(rooms: &[descry_robots::Room], doors: &[Door]) -> Geometry {
        Geometry { walls: Arc::new(Walls::new(rooms, doors)), ..Geometry::default() }
    }

    /// Walls of the map.
    pub(crate) fn walls(&self) -> &Walls {
        &self.walls
    }

    /// Visibility of the surface with an index.
    pub(crate) fn sight(&self, on: usize) -> &Sight {
        &self.sights[on]
    }

    /// Geometry for the current viewpoints, surfaces and shut doors (indices); unchanged parts are kept.
    pub(crate) fn renewed(
        &self,
        viewpoints: &[Candidate],
        surfaces: &[KnownSurface],
        shut: &BTreeSet<usize>,
        is_charted: &dyn Fn(&str) -> bool,
    ) -> Geometry {
        let is_kept = self.viewpoints.len() == viewpoints.len()
            && self.viewpoints.iter().zip(viewpoints).all(|(kept, now)| *kept == now.place);
        let same = is_kept && self.shut == *shut;
        let sights = surfaces.iter().enumerate().map(|(n, surface)| {
            let is_charted = is_charted(&surface.symbol);
            let fits = |sight: &&Arc<Sight>| {
                same && !is_charted
                    && !sight.is_charted
                    && sight.is_whole == surface.whole
                    && sight.outline == surface.outline
            };
            let fresh = || {
                Arc::new(Sight {
                    outline: surface.outline.clone(),
                    is_whole: surface.whole,
                    is_charted,
                    cameras: viewpoints.iter().map(|_| OnceLock::new()).collect(),
                    viewers: OnceLock::new(),
                    derived: Derived::default(),
                })
            };
            self.sights.get(n).filter(fits).cloned().unwrap_or_else(fresh)
        });
        let sights = sights.collect();
        let places = || viewpoints.iter().map(|c| c.place.clone()).collect();
        let kept = if is_kept { Arc::clone(&self.viewpoints) } else { places() };
        Geometry { walls: Arc::clone(&self.walls), viewpoints: kept, shut: shut.clone(), sights }
    }
}
