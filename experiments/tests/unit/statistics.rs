//! Tests of `statistics`.

use descry_experiments::statistics::*;

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 5e-4, "{found} is not {expected}");
}

fn alone(values: &[f64]) -> Vec<Observation> {
    values.iter().zip(0..).map(|(&value, group)| Observation { group, value }).collect()
}

#[test]
fn wilson_by_hand() {
    // Hits, trials, and the bounds worked out from the formula by other means.
    for (hits, n, low, high) in [(8, 10, 0.4902, 0.9433), (0, 20, 0.0, 0.1611), (49, 50, 0.8950, 0.9965)] {
        let Some(Estimate { value, interval: Some([l, h]), .. }) = rate(hits, n) else {
            panic!("no interval")
        };
        close(value, hits as f64 / n as f64);
        close(l, low);
        close(h, high);
    }
    assert_eq!(rate(0, 0), None);
}

#[test]
fn a_share_of_all_or_nothing_is_not_sure() {
    let pairs = |a: f64| (0..16).map(|group| Pair { group, a, b: 3.0 }).collect::<Vec<_>>();
    let interval = |a: f64| ratio(&pairs(a)).and_then(|e| e.interval).expect("an interval");
    let wilson = |hits: usize| rate(hits, 16).and_then(|e| e.interval).expect("an interval");
    assert_eq!((interval(3.0), interval(0.0)), (wilson(16), wilson(0)));
    assert_eq!(ratio(&pairs(3.0)[..2]).and_then(|e| e.interval), rate(2, 2).and_then(|e| e.interval));
    assert!((interval(3.0)[0] - 0.806).abs() < 1e-3 && interval(3.0)[1] == 1.0, "{:?}", interval(3.0));
    assert_eq!(interval(1.5), [0.5, 0.5]);
}

#[test]
fn few_groups_have_no_bootstrap_interval() {
    for (n, has) in [(0, false), (1, false), (2, false), (7, false), (8, true)] {
        let values: Vec<f64> = (0..n).map(f64::from).collect();
        let found = mean(&alone(&values));
        assert_eq!(found.map(|e| e.n), (n > 0).then_some(values.len()));
        assert_eq!(found.is_some_and(|e| e.interval.is_some()), has, "{n} groups");
    }
}

#[test]
fn signs_are_flipped_by_hand() {
    let pairs = |differences: &[f64]| -> Vec<Pair> {
        differences.iter().zip(0..).map(|(&a, group)| Pair { group, a, b: 0.0 }).collect()
    };
    // Of the 8 sums of +-1 +-2 +-3 two are as far from 0 as 6, and four as far as 4.
    assert_eq!(sign_flip(&pairs(&[1.0, 2.0, 3.0])), Some(0.25));
    assert_eq!(sign_flip(&pairs(&[-1.0, 2.0, 3.0])), Some(0.5));
    assert_eq!((sign_flip(&pairs(&[0.0, 0.0])), sign_flip(&[])), (Some(1.0), None));
    let many = sign_flip(&pairs(&[1.0; 20])).unwrap_or(1.0);
    assert!(many < 1e-3, "{many}");
    // Copies in one group flip together.
    let copies: Vec<Pair> = (0..20).map(|n| Pair { group: n / 10, a: 1.0, b: 0.0 }).collect();
    assert_eq!(sign_flip(&copies), Some(0.5));
}

#[test]
fn bootstrap_agrees_with_the_normal_interval_of_a_large_sample() {
    // 400 values 0..=19: mean 9.5, standard deviation 5.766, so 9.5 +- 1.96 * 5.766 / 20 = 9.5 +- 0.565.
    let values: Vec<f64> = (0..400).map(|i| f64::from(i % 20)).collect();
    let Some(Estimate { interval: Some([low, high]), .. }) = mean(&alone(&values)) else {
        panic!("no interval")
    };
    assert!((low - 8.935).abs() < 0.1 && (high - 10.065).abs() < 0.1, "[{low}, {high}]");
}

#[test]
fn runs_of_one_group_stay_together() {
    // Ten copies in each of eight groups say no more than eight observations.
    let values: Vec<f64> = (0..8).map(f64::from).collect();
    let copies: Vec<Observation> =
        (0..80).map(|i| Observation { group: i / 10, value: values[(i / 10) as usize] }).collect();
    let interval = |observed: &[Observation]| mean(observed).and_then(|e| e.interval);
    assert_eq!(interval(&copies), interval(&alone(&values)));
}

#[test]
fn pairs() {
    let pairs: Vec<Pair> =
        [(2.0, 4.0), (3.0, 4.0)].iter().zip(0..).map(|(&(a, b), group)| Pair { group, a, b }).collect();
    close(difference(&pairs).map_or(f64::NAN, |e| e.value), -1.5);
    close(saving(&pairs).map_or(f64::NAN, |e| e.value), 0.375);
    close(ratio(&pairs).map_or(f64::NAN, |e| e.value), 0.625);
    assert_eq!(ratio(&[Pair { group: 0, a: 0.0, b: 0.0 }]), None);
}

#[test]
fn calibration_by_hand() {
    let forecasts = [(0.9, true), (0.8, true), (0.95, false), (0.1, false)];
    // (.01 + .04 + .9025 + .01) / 4
    close(brier(&forecasts).unwrap_or(f64::NAN), 0.240_625);
    let bins = reliability(&forecasts, 5);
    assert_eq!(bins.len(), 2);
    assert_eq!((bins[1].observed.n, bins[1].observed.value), (3, 2.0 / 3.0));
    close(bins[1].stated, 0.8833);
    // 1/4 * .1 + 3/4 * (.8833 - .6667)
    close(calibration_error(&forecasts, 5).unwrap_or(f64::NAN), 0.1875);
    assert_eq!(reliability(&[(1.0, true)], 10).first().map(|b| b.to), Some(1.0));
    assert_eq!((brier(&[]), calibration_error(&[], 10)), (None, None));
}

#[test]
fn medians() {
    assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
    assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
    assert_eq!(median(&[]), None);
}
