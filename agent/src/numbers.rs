//! Numbers as text for people.

/// Count with its noun in singular or plural, such as `3 steps`.
pub fn count(n: usize, of: &str) -> String {
    let all = if n == 1 { "" } else { "s" };
    format!("{n} {of}{all}")
}

/// Probability or other number between 0 and 1 as text: two decimals, up to three below 0.1, up to
/// four very near 0 and 1.
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

/// Probability as text, shown next to the required one: with four decimals, rounded down, if it is
/// smaller and would otherwise look equal.
pub fn share_of(value: f64, wanted: f64) -> String {
    let said = share(value);
    if value < wanted && said == share(wanted) { below(value) } else { said }
}

/// Number with four decimals, rounded down.
fn below(value: f64) -> String {
    format!("{:.4}", (value * 1e4).floor() / 1e4)
}

/// True if a number is strictly between 0 and 1, and so is displayed as a probability.
pub fn is_share(value: f64) -> bool {
    value > 0.0 && value < 1.0
}

/// Number as text: like a probability if strictly between 0 and 1, otherwise with at most three
/// decimals.
pub fn number(value: f64) -> String {
    if is_share(value) {
        return share(value);
    }
    let digits = format!("{value:.3}");
    digits.trim_end_matches('0').trim_end_matches('.').to_string()
}
