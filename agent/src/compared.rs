//! What a condition in PDDL asks of numbers.

/// A number that is compared: `(>= (presence a-ring ?s) 0.8)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared<'c> {
    /// Its word.
    pub word: &'c str,
    /// What it is of; variables begin with `?`.
    pub of: Vec<&'c str>,
    /// What it is held against, if that is written as a number.
    pub wanted: Option<f64>,
    /// Whether less of it is wanted, not more.
    pub less: bool,
    /// Whether it is wanted of all that its variables may stand for, not of one.
    pub of_all: bool,
}

/// All numbers that a condition compares, as it writes them.
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

/// What a goal wants of a number, if it compares it so.
pub fn wanted(goal: &str, number: &str) -> Option<f64> {
    all(goal).filter(|compared| compared.fits(number)).find_map(|compared| compared.wanted)
}

/// The words of a number as it is written in PDDL.
pub fn words(number: &str) -> impl Iterator<Item = &str> {
    number.trim_matches(['(', ')']).split_whitespace()
}

impl Compared<'_> {
    /// Whether it is about a number; what is said of a variable is said of any.
    pub fn fits(&self, number: &str) -> bool {
        let mut own = words(number);
        let is_word = own.next() == Some(self.word);
        let own: Vec<&str> = own.collect();
        let same = |(named, is): (&&str, &&str)| named.starts_with('?') || named == is;
        is_word && self.of.len() == own.len() && self.of.iter().zip(&own).all(same)
    }
}
