//! `(last-seen ?what ?on)` and `(hours-since ?what)`: place and age of an earlier run's last
//! sighting of a sought object.

use descry_memory::remember::Recollection;

use crate::situation::Situation;

/// Sought things that an earlier run saw: symbol, last sighting, and the current Unix time in seconds.
fn remembered(s: &Situation) -> impl Iterator<Item = (&str, &Recollection, f64)> {
    let past = s.past.as_ref();
    let own = s.things.iter().filter(|t| t.track.is_none());
    own.filter_map(move |thing| {
        let (recollection, _) = past?.remembered.last_seen(&thing.name)?;
        Some((thing.symbol.as_str(), recollection, past?.now_unix_s))
    })
}

pub(super) fn place(situation: &Situation) -> Vec<String> {
    let is_known = |on: &str| situation.surfaces.iter().any(|s| s.symbol == on);
    remembered(situation)
        .filter(|(_, r, _)| is_known(&r.track.on))
        .map(|(thing, r, _)| format!("(last-seen {thing} {})", r.track.on))
        .collect()
}

pub(super) fn hours(situation: &Situation) -> Vec<String> {
    let since = |(thing, r, now_unix_s): (&str, &Recollection, f64)| {
        format!("(= (hours-since {thing}) {:.3})", (now_unix_s - r.seen_unix_s).max(0.0) / 3600.0)
    };
    remembered(situation).map(since).collect()
}
