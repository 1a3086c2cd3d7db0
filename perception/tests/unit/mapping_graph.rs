//! Tests of `mapping::graph`.

use descry_perception::mapping::graph::*;
use nalgebra::{Isometry2, Matrix3, Vector2, Vector3};

fn square_loop(wrong: bool) -> (PoseGraph, Vec<Isometry2<f64>>) {
    let step = Isometry2::new(Vector2::new(1.0, 0.0), 0.1);
    let truth: Vec<_> = (0..63)
        .scan(Isometry2::identity(), |p, _| {
            let at = *p;
            *p *= step;
            Some(at)
        })
        .collect();
    let off = Isometry2::new(Vector2::new(1.02, 0.01), 0.104);
    let spread = |way: f64, turn: f64| {
        Matrix3::from_diagonal(&Vector3::new(way.powi(-2), way.powi(-2), turn.powi(-2)))
    };
    let mut edges: Vec<Edge> = (1..63)
        .map(|to| Edge {
            from: to - 1,
            to,
            from_from_to: off,
            information: spread(0.03, 0.01),
            doubtful: false,
        })
        .collect();
    for (from, to) in [(0, 60), (1, 61), (2, 62)] {
        let from_from_to = truth[from].inv_mul(&truth[to]);
        edges.push(Edge { from, to, from_from_to, information: spread(0.02, 0.005), doubtful: true });
    }
    if wrong {
        let from_from_to = Isometry2::new(Vector2::new(0.4, 0.2), 0.3);
        edges.push(Edge { from: 10, to: 40, from_from_to, information: spread(0.02, 0.005), doubtful: true });
    }
    let poses = (0..63)
        .scan(Isometry2::identity(), |p, _| {
            let at = *p;
            *p *= off;
            Some(at)
        })
        .collect();
    (PoseGraph { poses, edges }, truth)
}

#[test]
fn a_closed_loop_comes_right_though_one_closure_is_wrong() {
    for wrong in [false, true] {
        let (graph, truth) = square_loop(wrong);
        let settled = graph.settle().unwrap();
        assert!(settled.converged, "{settled:?}");
        let off = |poses: &[Isometry2<f64>]| {
            let apart =
                poses.iter().zip(&truth).map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
            apart.fold(0.0, f64::max)
        };
        assert!(
            off(&graph.poses) > 0.8 && off(&settled.poses) < 0.5,
            "{} {}",
            off(&graph.poses),
            off(&settled.poses)
        );
        if wrong {
            assert!(settled.weights[65] < 0.05 && settled.weights[62] > 0.5, "{:?}", &settled.weights[62..]);
        }
    }
}

#[test]
fn a_bad_graph_is_told() {
    let (good, _) = square_loop(false);
    let with = |edge: Edge| PoseGraph { poses: good.poses.clone(), edges: vec![edge] }.settle().unwrap_err();
    let edge = good.edges[0].clone();
    assert_eq!(
        with(Edge { to: 63, ..edge.clone() }),
        GraphError::Station { edge: 0, from: 0, to: 63, stations: 63 }
    );
    assert_eq!(
        with(Edge { to: 0, ..edge.clone() }),
        GraphError::Station { edge: 0, from: 0, to: 0, stations: 63 }
    );
    assert_eq!(
        with(Edge { information: Matrix3::repeat(f64::NAN), ..edge.clone() }),
        GraphError::NotFinite { what: "edge", index: 0 }
    );
    assert_eq!(with(edge), GraphError::Loose { station: 2 });
}
