//! PDDL symbols of names.

/// PDDL symbol of a name: lower case, with hyphens for everything but letters and digits.
pub fn symbol(name: &str) -> String {
    let words: Vec<String> = name
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    let symbol = words.join("-");
    // A PDDL symbol must not begin with a digit.
    if symbol.starts_with(|c: char| c.is_ascii_digit()) { format!("n-{symbol}") } else { symbol }
}

/// PDDL type of the body's senses.
pub const SENSE: &str = "sense";
