//! Comparison of settings run by run, where their runs share seeds.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::job::Row;
use crate::statistics::{self, Pair};
use crate::table::{Table, number, shown};

/// Rows of a setting's runs, by seed and by the number of whatever else settings share, such as the
/// goal.
pub(super) type Runs<'a> = BTreeMap<(u64, usize), &'a Row>;

const MEASURES: [(&str, usize); 4] = [("right", 3), ("views", 2), ("metres", 2), ("seconds", 1)];
const NOTE: &str = "Runs with the same seed, goal and faults in pairs, of which both ended without an error. The difference is this \
                    setting less the first, with an interval bootstrapped over arrangements, 95 %; p is that of the two-sided \
                    sign-flip permutation test over arrangements, not corrected for the number of rows.";

/// Compares each further setting with the first, by measure; `None` without pairs.
pub(super) fn table(of: &str, settings: &[(&str, Runs<'_>)]) -> Option<Table> {
    let ((first, reference), others) = settings.split_first()?;
    let mut table = Table::new(
        format!("Run by run against \"{first}\""),
        NOTE,
        &[of, "measure", "pairs", "this", "the first", "difference", "p"],
    );
    for (name, runs) in others {
        for (measure, decimals) in MEASURES {
            let value = |row: &Row| match row.get(measure)? {
                Value::Bool(holds) => Some(f64::from(*holds)),
                value => value.as_f64(),
            };
            let pair = |(at, row): (&(u64, usize), &&Row)| {
                Some(Pair { group: at.0, a: value(row)?, b: value(reference.get(at)?)? })
            };
            let pairs: Vec<Pair> = runs.iter().filter_map(pair).collect();
            let Some(p) = statistics::sign_flip(&pairs) else { continue };
            let mean = |of: fn(&Pair) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
            table.rows.push(vec![
                (*name).into(),
                measure.into(),
                pairs.len().to_string(),
                number(Some(mean(|pair| pair.a)), decimals),
                number(Some(mean(|pair| pair.b)), decimals),
                shown(statistics::difference(&pairs), decimals),
                number(Some(p), 3),
            ]);
        }
    }
    (!table.rows.is_empty()).then_some(table)
}
