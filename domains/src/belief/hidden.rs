//! Places on a surface where an object of a size may stand unseen, and the share of each that a view
//! settles. Cached from round to round while the observations there stay unchanged.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use descry_memory::belief::Track;
use descry_memory::space::Space;

use crate::belief::hypothesis::{Basis, Hypothesis};
use crate::belief::unnoticed::{Unnoticed, around, grid, unseen_volume};
use crate::situation::Situation;
use crate::surface::KnownSurface;

/// Likelihood ratio between a place with an unexplained measurement and an unobserved place: the
/// measurement belongs to some object, perhaps to another one.
const MEASURED_WEIGHT: f64 = 50.0;

/// Cache of the latest hidden places on one surface, by object size.
#[derive(Debug, Default)]
struct Places {
    kept: Mutex<Vec<(Given, Arc<Hidden>)>>,
}

/// Inputs from which the hidden places on a surface are derived.
#[derive(Debug, Clone)]
struct Given {
    space: Arc<Space>,
    surface: KnownSurface,
    standing: Vec<Track>,
    size_m: (f64, f64),
}

impl Given {
    fn is(&self, other: &Given) -> bool {
        Arc::ptr_eq(&self.space, &other.space)
            && self.size_m == other.size_m
            && self.surface == other.surface
            && self.standing == other.standing
    }
}

/// Places on one surface where an object of one size may stand unseen.
#[derive(Debug)]
pub(crate) struct Hidden {
    /// Number of places where the object can stand, seen or unseen.
    pub all: usize,
    /// Hypotheses of the places where the object may stand unseen, with relative weights.
    pub hypotheses: Vec<Hypothesis>,
    /// Cache of the share of each hypothesis that a view settles, by index of the viewpoint among those
    /// that see the surface.
    told: Vec<OnceLock<Arc<[f64]>>>,
}

impl Hidden {
    /// Hidden places on a surface for an object of a height and diameter, metres.
    pub fn on(situation: &Situation, on: usize, size_m: (f64, f64)) -> Arc<Hidden> {
        let places: &Places = situation.geometry.sight(on).derived.get(&Places::default);
        let basis = Given {
            space: Arc::clone(&situation.spaces[on]),
            surface: situation.surfaces[on].clone(),
            standing: situation.on_surface(on).cloned().collect(),
            size_m,
        };
        let kept = || places.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, hidden)) = kept().iter().find(|(known, _)| known.is(&basis)) {
            return Arc::clone(hidden);
        }
        let hidden = Arc::new(Hidden::find(situation, on, &basis));
        let mut kept = kept();
        kept.retain(|(known, _)| known.size_m != size_m);
        kept.push((basis, Arc::clone(&hidden)));
        hidden
    }

    fn find(situation: &Situation, on: usize, basis: &Given) -> Hidden {
        let Given { space, surface, standing, size_m } = basis;
        let standing: Vec<&Track> = standing.iter().collect();
        let places = grid(surface, size_m.1);
        let unseen = |centre| {
            let Unnoticed { points, likely } = unseen_volume(surface, space, &standing, &centre, *size_m)?;
            let (ground, weight) =
                if likely { (Basis::Measured, MEASURED_WEIGHT) } else { (Basis::NotSeen, 1.0) };
            Some(Hypothesis { weight, on, centre, points, facing: None, ground })
        };
        let hypotheses = places.iter().filter_map(|place| around(surface, place).find_map(unseen)).collect();
        let told = situation.viewers(on).iter().map(|_| OnceLock::new()).collect();
        Hidden { all: places.len(), hypotheses, told }
    }

    /// Share of each hypothesis that a view settles; `viewer` is an index among the viewpoints that see
    /// the surface.
    pub fn told(&self, situation: &Situation, viewer: usize, on: usize) -> &Arc<[f64]> {
        let from = situation.viewers(on)[viewer];
        let settled = |h: &Hypothesis| situation.would_settle(from, on, h, None);
        self.told[viewer].get_or_init(|| self.hypotheses.iter().map(settled).collect())
    }
}
