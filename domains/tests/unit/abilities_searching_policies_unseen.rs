//! Tests of `abilities::searching::policies::unseen`.

use descry_domains::abilities::searching::policies::unseen::*;
use descry_domains::surface::KnownSurface;
use descry_perception::nalgebra::{Point3, Vector3};

#[test]
fn the_grid_fills_the_space_above_the_outline() {
    let outline =
        [(0.0, 0.0), (0.4, 0.0), (0.4, 0.2), (0.0, 0.2)].map(|(x, y)| Point3::new(x, y, 0.7)).to_vec();
    let (symbol, name) = ("table".into(), "table".into());
    let (room, floor, up) = (None, Vec::new(), Vector3::z());
    let surface = KnownSurface {
        symbol,
        name,
        room,
        floor,
        outline,
        up,
        whole: true,
        doubtful: None,
        placed: None,
        displaced_m: 0.0,
        sensor_doubt: 0.0,
    };
    let points = above(&surface);
    assert_eq!(points.len(), 9 * 5 * 6);
    assert!(points.iter().all(|p| p.z > 0.7 && p.z < 1.0 && p.x > -0.01 && p.x < 0.41));
    assert_eq!(above(&KnownSurface { outline: vec![], ..surface }), vec![]);
}
