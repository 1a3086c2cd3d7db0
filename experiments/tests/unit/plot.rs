//! Tests of `plot`.

use descry_experiments::plot::*;

fn series(values: &[f64]) -> Series {
    let points = values.iter().zip(0..);
    let points = points.map(|(&value, at)| Point {
        at: f64::from(at),
        value,
        interval: Some([value - 0.1, value + 0.1]),
    });
    Series { name: "a & b".into(), points: points.collect(), broken: false }
}

fn numbers_are_finite(svg: &str) {
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    assert_eq!(svg.matches("<svg").count(), 1);
    assert!(svg.ends_with("</svg>\n"));
}

#[test]
fn a_plot_says_everything() {
    let plot = Plot::Lines {
        name: "p".into(),
        title: "T <1>".into(),
        x: Axis::free("views"),
        y: Axis::fixed("recall", 0.0, 1.0),
        series: vec![series(&[0.5, 0.75, 1.0])],
        diagonal: true,
        counts: vec![(1.0, 7)],
    };
    let svg = plot.svg();
    for part in ["T &lt;1&gt;", "a &amp; b", ">views<", ">recall<", "<polyline", ">7<", "stroke-dasharray"] {
        assert!(svg.contains(part), "{part} is not in\n{svg}");
    }
    assert_eq!(svg.matches("<circle").count(), 4, "three points and one in the legend");
    assert!(svg.contains(r#"viewBox="0 0 480 "#), "legible on a telephone: {svg}");
    numbers_are_finite(&svg);
}

#[test]
fn no_data_and_one_value_are_plots_too() {
    for values in [&[][..], &[3.0], &[2.0, 2.0]] {
        let dots = Plot::Dots {
            name: "d".into(),
            title: "D".into(),
            categories: values.iter().map(ToString::to_string).collect(),
            x: Axis::free("m"),
            series: vec![series(values)],
        };
        numbers_are_finite(&dots.svg());
        let lines = Plot::Lines {
            name: "l".into(),
            title: "L".into(),
            x: Axis::free("s"),
            y: Axis::free("m"),
            series: vec![series(values)],
            diagonal: false,
            counts: vec![],
        };
        numbers_are_finite(&lines.svg());
    }
}
