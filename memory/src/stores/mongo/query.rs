//! Translation of queries to MongoDB filters.

use super::number::Name;
use crate::document::{Document, Near, Order, Query};
use mongodb::bson::{Document as Fields, doc};

/// Filter for the conditions that the server decides, with bounding boxes for balls. Pending records are
/// excluded. If the query names no robot, `own` gives the robot, and all robots match if that has no name.
pub(super) fn filter(query: &Query, own: &Name) -> Fields {
    let mut all = vec![doc! { "pending": { "$exists": false } }];
    let whose = Some(own.robot.clone()).filter(|robot| !robot.is_empty());
    let robot = query.robot.clone().or(whose);
    for (field, value) in [("kind", &query.kind), ("frame", &query.frame), ("robot", &robot)] {
        all.extend(value.as_ref().map(|value| doc! { field: value.clone() }));
    }
    if let Some(from) = query.from_ns {
        all.push(doc! { "$or": [{ "stamp_ns": { "$gte": from } }, { "end_ns": { "$gte": from } }] });
    }
    if let Some(to) = query.to_ns {
        all.push(doc! { "stamp_ns": { "$lte": to } });
    }
    if let Some((stamp_ns, id)) = query.after {
        let beyond = if query.order == Order::Oldest { "$gt" } else { "$lt" };
        let same = doc! { "stamp_ns": stamp_ns, "_id": { beyond: own.inward(id) } };
        all.push(doc! { "$or": [{ "stamp_ns": { beyond: stamp_ns } }, same] });
    }
    if query.object.is_some() || query.min_confidence.is_some() {
        let mut sighting = doc! { "confidence": { "$gte": query.min_confidence.unwrap_or(0.0) } };
        if let Some(object) = &query.object {
            sighting.insert("object", object.clone());
        }
        all.push(doc! { "objects": { "$elemMatch": sighting } });
    }
    all.extend(query.seen_from.iter().flat_map(|near| within(near, ["seen_from_m", "seen_from_m"])));
    all.extend(query.covers.iter().flat_map(|near| within(near, ["covers_m.max_m", "covers_m.min_m"])));
    doc! { "$and": all }
}

/// Condition that a box meets the bounding box of a ball: each coordinate of its maximum corner (field
/// `greater`) is above the ball's lower bound, and of its minimum corner (`lesser`) below the upper one.
fn within<'a>(near: &'a Near, [greater, lesser]: [&'a str; 2]) -> impl Iterator<Item = Fields> + 'a {
    (0..3).map(move |i| {
        let (low, high) = (near.place_m[i] - near.radius_m, near.place_m[i] + near.radius_m);
        let (greater, lesser) = (format!("{greater}.{i}"), format!("{lesser}.{i}"));
        doc! { "$and": [{ greater: { "$gte": low } }, { lesser: { "$lte": high } }] }
    })
}

/// True if a query has a spatial condition, for which the server's results must be filtered again.
pub(super) fn is_of_places(query: &Query) -> bool {
    query.seen_from.is_some() || query.covers.is_some()
}

/// True if a document meets the spatial conditions of a query.
pub(super) fn is_there(query: &Query, document: &Document) -> bool {
    let seen = |near: &Near| {
        document.seen_from_m.is_some_and(|p| {
            (0..3).map(|i| (p[i] - near.place_m[i]).powi(2)).sum::<f64>().sqrt() <= near.radius_m
        })
    };
    let covered =
        |near: &Near| document.covers_m.is_some_and(|b| b.distance_m(near.place_m) <= near.radius_m);
    query.seen_from.as_ref().is_none_or(seen) && query.covers.as_ref().is_none_or(covered)
}
