//! Tests of `commands::recognise`.

use descry_cli::commands::recognise::*;
use descry_perception::Grid;
use descry_perception::nalgebra::Point3;
use descry_perception::{Cloud, View};

fn view(grid: Option<Grid>) -> View {
    let at = |i: i32| f32::from(i as i16);
    let points = (0..100).map(|i| Point3::new(at(i % 10 - 5) * 0.01, at(i / 10 - 5) * 0.01, 1.0)).collect();
    View::alone(Cloud { grid, ..Cloud::from_points(points) })
}

#[test]
fn where_the_sensor_stood_is_told_stated_or_asked_for() {
    let (told, stated) = (Point3::new(0.0, 0.0, 2.0), Point3::new(0.0, 3.0, 0.0));
    let check = |told: Option<Point3<f64>>, stated, eye: Point3<f64>, note: Option<&str>| {
        let (visibility, said) = seen_from(&view(None), told, stated);
        let eyes = visibility.viewpoints();
        assert!(eyes.len() == 1 && (eyes[0] - eye).norm() < 1e-9, "{eyes:?}");
        assert!(
            said.is_some() == note.is_some() && said.unwrap_or_default().contains(note.unwrap_or_default())
        );
    };
    check(Some(told), Some(stated), told, None);
    check(None, Some(stated), stated, None);
    check(None, None, Point3::origin(), Some("taken at the origin; give --viewpoint"));
    let pixels = Some(Grid { width: 10, height: 10 });
    assert_eq!(seen_from(&view(pixels), None, None).1, None);
    assert!(seen_from(&view(pixels), Some(told), None).1.is_some_and(|said| said.contains("left out")));
}

#[test]
fn places_and_directions_are_three_numbers() {
    assert_eq!(triple("0, -0.5,1.2"), Ok([0.0, -0.5, 1.2]));
    for wrong in ["", "1,2", "1,2,3,4", "1,nan,3", "a,b,c"] {
        assert!(triple(wrong).is_err(), "{wrong}");
    }
    assert!(direction("0,0,0").is_err() && direction("1e-300,0,0").is_err() && direction("0,0,-1").is_ok());
}
