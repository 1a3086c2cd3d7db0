//! Numeric comparisons in the text of a PDDL condition.

/// Comparison of a function with a number, such as `(>= (presence a-ring ?s) 0.8)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared<'c> {
    /// Name of the function.
    pub word: &'c str,
    /// Arguments of the function; variables begin with `?`.
    pub of: Vec<&'c str>,
    /// Right-hand side; `None` if it is not a number.
    pub wanted: Option<f64>,
    /// True for `<` and `<=`.
    pub less: bool,
    /// True if a variable of the comparison is bound by `forall`.
    pub of_all: bool,
}

/// All comparisons in a condition whose left side is a function, in text order.
pub fn all(condition: &str) -> impl Iterator<Item = Compared<'_>> {
    const SIGNS: [&str; 5] = ["(>= (", "(<= (", "(> (", "(< (", "(= ("];
    condition.match_indices('(').filter_map(move |(at, _)| {
        let sign = SIGNS.iter().find(|sign| condition[at..].starts_with(**sign))?;
        let (number, rest) = condition[at + sign.len()..].split_once(')')?;
        let wanted = rest.split(')').next().and_then(|wanted| wanted.trim().parse().ok());
        let mut words = number.split_whitespace();
        let (word, of): (_, Vec<&str>) = (words.next()?, words.collect());
        let of_all = of.iter().any(|variable| condition.contains(&format!("(forall ({variable}")));
        Some(Compared { word, of, wanted, less: sign.starts_with("(<"), of_all })
    })
}

/// Bound that a goal sets on a number; `None` if the goal does not compare this number with a
/// constant.
pub fn wanted(goal: &str, number: &str) -> Option<f64> {
    all(goal).filter(|compared| compared.fits(number)).find_map(|compared| compared.wanted)
}

/// Names in a number as written in PDDL: the function, then its arguments.
pub fn words(number: &str) -> impl Iterator<Item = &str> {
    number.trim_matches(['(', ')']).split_whitespace()
}

impl Compared<'_> {
    /// True if the comparison is about this number (written in PDDL); variables match any object.
    pub fn fits(&self, number: &str) -> bool {
        let mut own = words(number);
        let is_word = own.next() == Some(self.word);
        let own: Vec<&str> = own.collect();
        let same = |(named, is): (&&str, &&str)| named.starts_with('?') || named == is;
        is_word && self.of.len() == own.len() && self.of.iter().zip(&own).all(same)
    }
}
