//! Benchmark of the number of states that each search engine evaluates per second, translation and
//! grounding included: `cargo bench -p descry-planner`.
//!
//! The tasks are generated, and so large that the limit on evaluations, or the improvement of
//! plans, ends the search.

use descry_planner::{Attachments, Options, Source, Task, plan};
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

/// Classical task: a sliding-tile puzzle of 4 × 4, with the tiles in the order of powers of three.
fn puzzle() -> (String, String) {
    let domain = "(define (domain sliding) (:requirements :typing) (:types tile place)
      (:predicates (on ?t - tile ?p - place) (free ?p - place) (beside ?a ?b - place))
      (:action slide :parameters (?t - tile ?a ?b - place)
        :precondition (and (on ?t ?a) (free ?b) (beside ?a ?b))
        :effect (and (on ?t ?b) (free ?a) (not (on ?t ?a)) (not (free ?b)))))";
    let place = |n: usize| format!("p{}-{}", n / 4, n % 4);
    let beside = |a: usize, b: usize| (a / 4).abs_diff(b / 4) + (a % 4).abs_diff(b % 4) == 1;
    let pairs = (0..16).flat_map(|a| (0..16).map(move |b| (a, b))).filter(|&(a, b)| beside(a, b));
    let beside: String = pairs.map(|(a, b)| format!("(beside {} {})", place(a), place(b))).collect();
    let tiles = |order: &[usize]| -> String {
        order.iter().enumerate().map(|(at, tile)| format!("(on t{tile} {})", place(at))).collect()
    };
    // Powers of three modulo 17 go through 1 to 16, which stands for the free place and is put last: an even permutation of the rest.
    let mut order: Vec<usize> =
        (1..=16).map(|n| (0..n).fold(1, |power, _| power * 3 % 17)).filter(|&t| t != 16).collect();
    let inversions = |order: &[usize]| -> usize {
        (0..15).flat_map(|a| (a..15).map(move |b| (a, b))).filter(|&(a, b)| order[a] > order[b]).count()
    };
    if inversions(&order) % 2 == 1 {
        order.swap(0, 1);
    }
    let all: Vec<usize> = (1..=15).collect();
    let names: String = all.iter().map(|t| format!("t{t} ")).collect();
    let places: String = (0..16).map(|n| format!("{} ", place(n))).collect();
    let problem = format!(
        "(define (problem p) (:domain sliding) (:objects {names} - tile {places} - place)
           (:init {beside} {} (free {})) (:goal (and {})))",
        tiles(&order),
        place(15),
        tiles(&all)
    );
    (domain.into(), problem)
}

/// Temporal task: vans carry parcels along a ring of towns, with roads of different lengths.
fn parcels() -> (String, String) {
    let domain = "(define (domain parcels) (:requirements :typing :durative-actions :numeric-fluents)
      (:types town van parcel)
      (:predicates (at ?v - van ?t - town) (lies ?p - parcel ?t - town) (aboard ?p - parcel ?v - van) (road ?a ?b - town))
      (:functions (far ?a ?b - town))
      (:durative-action drive :parameters (?v - van ?a ?b - town) :duration (= ?duration (far ?a ?b))
        :condition (and (at start (at ?v ?a)) (at start (road ?a ?b)))
        :effect (and (at start (not (at ?v ?a))) (at end (at ?v ?b))))
      (:durative-action load :parameters (?p - parcel ?v - van ?t - town) :duration (= ?duration 1)
        :condition (and (over all (at ?v ?t)) (at start (lies ?p ?t)))
        :effect (and (at start (not (lies ?p ?t))) (at end (aboard ?p ?v))))
      (:durative-action unload :parameters (?p - parcel ?v - van ?t - town) :duration (= ?duration 1)
        :condition (and (over all (at ?v ?t)) (at start (aboard ?p ?v)))
        :effect (and (at start (not (aboard ?p ?v))) (at end (lies ?p ?t)))))";
    let towns = 9;
    let road = |a: usize, b: usize| format!("(road c{a} c{b}) (= (far c{a} c{b}) {}) ", 2 + (a + b) % 5);
    let roads: String =
        (0..towns).map(|a| (a, (a + 1) % towns)).map(|(a, b)| road(a, b) + &road(b, a)).collect();
    let parcels = 8;
    let lie: String = (0..parcels).map(|n| format!("(lies q{n} c{}) ", n * 4 % towns)).collect();
    let goal: String = (0..parcels).map(|n| format!("(lies q{n} c{}) ", (n * 7 + 3) % towns)).collect();
    let names =
        |letter: char, many: usize| -> String { (0..many).map(|n| format!("{letter}{n} ")).collect() };
    let problem = format!(
        "(define (problem p) (:domain parcels) (:objects {}- town {}- van {}- parcel)
           (:init (at v0 c0) (at v1 c4) (at v2 c7) {roads} {lie}) (:goal (and {goal})))",
        names('c', towns),
        names('v', 3),
        names('q', parcels)
    );
    (domain.into(), problem)
}

/// Numeric task: counters that must get increasing values from left to right, and begin with
/// decreasing ones.
fn counters() -> (String, String) {
    let domain = "(define (domain counters) (:requirements :typing :numeric-fluents) (:types counter)
      (:functions (value ?c - counter) (most))
      (:action up :parameters (?c - counter) :precondition (<= (+ (value ?c) 1) (most)) :effect (increase (value ?c) 1))
      (:action down :parameters (?c - counter) :precondition (>= (value ?c) 1) :effect (decrease (value ?c) 1)))";
    let many = 24;
    let names: String = (0..many).map(|n| format!("c{n} ")).collect();
    let values: String = (0..many).map(|n| format!("(= (value c{n}) {})", many - n)).collect();
    let goal: String = (1..many).map(|n| format!("(<= (+ (value c{}) 1) (value c{n}))", n - 1)).collect();
    let problem = format!(
        "(define (problem p) (:domain counters) (:objects {names}- counter)
           (:init (= (most) {}) {values}) (:goal (and {goal})))",
        2 * many
    );
    (domain.into(), problem)
}

fn run(bencher: Bencher, (domain, problem): (String, String)) {
    let task = Task::read(&Source::new("domain.pddl", domain), &Source::new("problem.pddl", problem))
        .expect("it reads");
    let nobody = Attachments::new();
    let options = Options { evaluation_limit: Some(20_000), ..Options::default() };
    let planned = || plan(&task, &nobody, &options, &|| false, &mut |_| {}).expect("it is planned for");
    let evaluated = planned().statistics().evaluated;
    bencher.counter(ItemsCount::new(evaluated)).bench_local(planned);
}

#[divan::bench(sample_count = 10)]
fn classical(bencher: Bencher) {
    run(bencher, puzzle());
}

#[divan::bench(sample_count = 10)]
fn temporal(bencher: Bencher) {
    run(bencher, parcels());
}

#[divan::bench(sample_count = 10)]
fn numeric(bencher: Bencher) {
    run(bencher, counters());
}
