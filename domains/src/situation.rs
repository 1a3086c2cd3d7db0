//! Snapshot of the world model that grounds the symbols of one planning round.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use descry_memory::belief::Track;
use descry_perception::nalgebra::Point3;
use descry_planner::{Call, CallError, FactValue};
use descry_robots::Place;

use crate::config::Thresholds;
use crate::known::Known;
use crate::states::Derived;

/// Snapshot of the world model that grounds one planning round: [`Known`] and values derived from it.
/// Reading it moves nothing.
pub struct Situation {
    known: Known,
    /// Thresholds of confidence.
    pub thresholds: Thresholds,
    travel: Travel,
    /// Derived values, computed on demand.
    pub(crate) derived: Derived,
}

/// Index of the candidate that a drive starts from, and indices of the doors that are shut then.
type Departure = (usize, Vec<usize>);

/// Lookups and routes, computed on demand and cached.
#[derive(Default)]
struct Travel {
    /// Candidate indices by symbol.
    candidates: OnceLock<HashMap<String, usize>>,
    travel_s: Vec<OnceLock<Vec<f64>>>,
    /// Indices of the candidates that the round's plans may use, in ascending order, once chosen.
    focused: OnceLock<Vec<usize>>,
    /// Travel times to the chosen candidates only, by start.
    travel_to_focused_s: Vec<OnceLock<Vec<f64>>>,
    travel_past_s: Mutex<BTreeMap<Departure, Arc<Vec<f64>>>>,
    /// Indices of the objects on each surface, by surface index.
    standing: OnceLock<Vec<Vec<usize>>>,
}

impl std::ops::Deref for Situation {
    type Target = Known;

    fn deref(&self) -> &Known {
        &self.known
    }
}

impl Situation {
    /// Takes a snapshot of the current knowledge for a round.
    pub fn new(mut known: Known, thresholds: Thresholds) -> Self {
        known.geometry =
            Arc::new(known.geometry.renewed(&known.candidates, &known.surfaces, &known.shut, &|surface| {
                known.own_map.has(surface)
            }));
        let travel = Travel {
            travel_s: cells(known.candidates.len()),
            travel_to_focused_s: cells(known.candidates.len()),
            ..Travel::default()
        };
        Self { known, thresholds, travel, derived: Derived::default() }
    }

    /// Index of the candidate with a symbol.
    ///
    /// # Errors
    ///
    /// [`CallError::Failed`] if there is none.
    pub fn candidate(&self, name: &str) -> Result<usize, CallError> {
        let symbols = self.travel.candidates.get_or_init(|| {
            // Of two of one name the first is meant.
            self.candidates.iter().enumerate().rev().map(|(n, c)| (c.symbol.clone(), n)).collect()
        });
        let found = symbols.get(name).copied();
        found.ok_or_else(|| CallError::Failed(format!("`{name}` is not a pose to look from")))
    }

    /// Index of the surface with a symbol.
    ///
    /// # Errors
    ///
    /// [`CallError::Failed`] if there is none.
    pub fn surface(&self, name: &str) -> Result<usize, CallError> {
        find(self.surfaces.iter().map(|s| &s.symbol), name, "a surface")
    }

    /// Index of the thing with a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn thing(&self, name: &str) -> Result<usize, CallError> {
        find(self.things.iter().map(|t| &t.symbol), name, "something that is looked for")
    }

    /// Index of the door with a symbol.
    ///
    /// # Errors
    ///
    /// [`CallError::Failed`] if there is none.
    pub fn door(&self, name: &str) -> Result<usize, CallError> {
        find(self.doors.iter().map(|d| &d.symbol), name, "a door")
    }

    /// Driving time on the map past doors believed shut, seconds; infinite where no route leads.
    pub fn travel_s(&self, from: usize, to: usize) -> f64 {
        let whole = &self.travel.travel_s[from];
        let focused = self.travel.focused.get().filter(|_| whole.get().is_none());
        if let Some((focused, at)) = focused.and_then(|all| Some((all, all.binary_search(&to).ok()?))) {
            let row = || self.travel_row(from, focused.iter().copied(), &self.shut);
            return self.travel.travel_to_focused_s[from].get_or_init(row)[at];
        }
        whole.get_or_init(|| self.travel_row(from, 0..self.candidates.len(), &self.shut))[to]
    }

    /// Driving time past a given set of shut doors, seconds; infinite where no route leads.
    pub fn travel_past_s(&self, from: usize, to: usize, shut: &BTreeSet<usize>) -> f64 {
        if *shut == self.shut {
            return self.travel_s(from, to);
        }
        let key = (from, shut.iter().copied().collect());
        let known =
            self.travel.travel_past_s.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
        let row = known.unwrap_or_else(|| {
            let row = Arc::new(self.travel_row(from, 0..self.candidates.len(), shut));
            let mut rows = self.travel.travel_past_s.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(rows.entry(key).or_insert(row))
        });
        row[to]
    }

    /// Sets the candidates that the round's plans may use; routes between them are computed together.
    pub(crate) fn focus_on(&self, candidates: Vec<usize>) {
        self.travel.focused.get_or_init(|| candidates);
    }

    fn travel_row(&self, from: usize, to: impl Iterator<Item = usize>, shut: &BTreeSet<usize>) -> Vec<f64> {
        let places: Vec<Place> = to.map(|to| self.candidates[to].place.clone()).collect();
        let shut: Vec<String> = shut.iter().map(|&n| self.doors[n].door.name.clone()).collect();
        let travel = self.own_map.travel(&*self.robot, &self.candidates[from].place, &places, &shut);
        travel.into_iter().map(|t| t.map_or(f64::INFINITY, |t| t.duration_s)).collect()
    }

    /// True if the body can drive to a candidate from its pose without opening anything.
    pub fn can_drive_to(&self, to: usize) -> bool {
        to == self.at || (!self.out_of_reach.contains(&to) && self.travel_s(self.at, to).is_finite())
    }

    /// True if the body can reach a candidate from its pose, opening doors if needed.
    pub fn can_reach(&self, to: usize) -> bool {
        let through_doors =
            || !self.shut.is_empty() && self.travel_past_s(self.at, to, &BTreeSet::new()).is_finite();
        self.can_drive_to(to) || (!self.out_of_reach.contains(&to) && through_doors())
    }

    /// Index of the kind with a symbol.
    ///
    /// # Errors
    /// [`CallError::Failed`] if there is none.
    pub fn kind(&self, name: &str) -> Result<usize, CallError> {
        find(self.kinds.iter().map(|t| &t.symbol), name, "a kind of which all are looked for")
    }

    /// Objects on a surface.
    pub fn on_surface(&self, on: usize) -> impl Iterator<Item = &Track> {
        let standing = self.travel.standing.get_or_init(|| {
            let by_symbol: HashMap<&str, usize> =
                self.surfaces.iter().enumerate().map(|(n, s)| (s.symbol.as_str(), n)).collect();
            let mut standing = vec![Vec::new(); self.surfaces.len()];
            for (n, track) in self.belief.tracks.iter().enumerate() {
                if let Some(&on) = by_symbol.get(track.on.as_str()) {
                    standing[on].push(n);
                }
            }
            standing
        });
        standing[on].iter().map(|&n| &self.belief.tracks[n])
    }

    /// Index of the surface that an object stands on; `None` for an object in the hand or lost.
    pub fn surface_of(&self, track: &Track) -> Option<usize> {
        self.surfaces.iter().position(|s| s.symbol == track.on)
    }

    /// Point of the map in the localised frame, in which the hand moves.
    pub(crate) fn as_localised(&self, p: &Point3<f64>) -> Point3<f64> {
        self.errs_by.map_or(*p, |map_from_localised| map_from_localised.inverse() * p)
    }

    /// Views (candidate, surface) that the plan takes before a call, from the `observed` facts that the
    /// call reads.
    pub(crate) fn planned_looks(&self, call: &Call) -> Vec<(usize, usize)> {
        let look = |r: &descry_planner::Reading| {
            let from = self.candidate(r.arguments.first()?).ok()?;
            let on = self.surface(r.arguments.get(1)?).ok()?;
            (!self.observed.contains(&(from, on))).then_some((from, on))
        };
        holding(call, "observed").filter_map(look).collect()
    }
}

/// Facts of a predicate that hold, among those that a call reads.
pub(crate) fn holding<'a>(
    call: &'a Call,
    predicate: &'a str,
) -> impl Iterator<Item = &'a descry_planner::Reading> {
    call.readings.iter().filter(move |r| &*r.symbol == predicate && r.value == FactValue::Truth(true))
}

/// Index of a symbol among objects of one kind; `expected` names the kind in the error.
pub(crate) fn find<'a>(
    mut symbols: impl Iterator<Item = &'a String>,
    name: &str,
    expected: &str,
) -> Result<usize, CallError> {
    symbols.position(|s| s == name).ok_or_else(|| CallError::Failed(format!("`{name}` is not {expected}")))
}

/// Empty cells for values computed on demand.
pub(crate) fn cells<T>(n: usize) -> Vec<OnceLock<T>> {
    (0..n).map(|_| OnceLock::new()).collect()
}
