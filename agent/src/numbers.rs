//! Numbers in words for people.

/// A count with its noun in the singular or plural: `3 steps`.
pub fn count(n: usize, of: &str) -> String {
    let all = if n == 1 { "" } else { "s" };
    format!("{n} {of}{all}")
}

/// A share, a probability or a number of a domain: two digits, three below a tenth, four near 0 and 1.
pub fn share(value: f64) -> String {
    if (0.01..0.1).contains(&value) {
        return format!("{value:.3}").trim_end_matches('0').to_string();
    }
    let near_an_end = (5e-5..0.01).contains(&value) || value > 0.99 && value < 1.0 - 5e-5;
    if !near_an_end {
        return format!("{:.2}", value + 0.0).replace("-0.00", "0.00");
    }
    format!("{value:.4}").trim_end_matches('0').to_string()
}

/// Share for people next to a wanted one, with more digits if it is smaller and would look equal.
pub fn share_of(value: f64, wanted: f64) -> String {
    let said = share(value);
    if value < wanted && said == share(wanted) { below(value) } else { said }
}

/// Four digits, never more than the number is.
fn below(value: f64) -> String {
    format!("{:.4}", (value * 1e4).floor() / 1e4)
}

/// True if a number is displayed as a share: strictly between 0 and 1.
pub fn is_share(value: f64) -> bool {
    value > 0.0 && value < 1.0
}

/// Number of a domain as text: shares with their digits, others with at most three decimals.
pub fn number(value: f64) -> String {
    if is_share(value) {
        return share(value);
    }
    let digits = format!("{value:.3}");
    digits.trim_end_matches('0').trim_end_matches('.').to_string()
}
