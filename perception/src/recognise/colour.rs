//! Colours of bodies: names as ranges of a perceptual space.
//!
//! The space is Oklab (Ottosson 2020) in polar form: lightness, saturation (chroma over lightness) and hue.

use super::model::Range;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// Range of colours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColourRange {
    /// Oklab lightness: 0 is black, 1 is white.
    #[serde(default = "any_share")]
    pub lightness: Range,
    /// Oklab chroma over lightness: 0 is grey; a pure red has 0.41.
    #[serde(default = "any_share")]
    pub saturation: Range,
    /// Hue, degrees: red is near 27, yellow near 108, green near 139, blue near 250, pink near 0.
    #[serde(default = "any_hue")]
    pub hue_deg: Range,
}

/// Whole range of lightness or saturation. From: derived, all there is.
fn any_share() -> Range {
    Range { low: 0.0, high: 1.0 }
}

/// Whole range of hue, degrees. From: derived, the whole circle.
fn any_hue() -> Range {
    Range { low: 0.0, high: 360.0 }
}

/// Degrees of a circle. From: derived, by definition.
pub(super) const CIRCLE_DEG: f64 = 360.0;

/// The eleven basic colour terms of English (Berlin and Kay 1969): lightness, saturation and hue of each.
/// From: paper, the XKCD colour survey (Munroe 2010), quantiles of 5 and 95 % over those of its 949 colours whose name ends in the
/// term, in Oklab; the hues of black, white and grey are left open, and the lightness of black and white, in which two names end each, is
/// chosen.
pub(super) const BASIC: [(&str, [f64; 2], [f64; 2], [f64; 2]); 11] = [
    ("black", [0.0, 0.26], [0.0, 0.10], [0.0, CIRCLE_DEG]),
    ("white", [0.90, 1.0], [0.0, 0.06], [0.0, CIRCLE_DEG]),
    ("grey", [0.35, 0.87], [0.0, 0.10], [0.0, CIRCLE_DEG]),
    ("red", [0.39, 0.65], [0.27, 0.41], [7.0, 34.0]),
    ("orange", [0.57, 0.80], [0.18, 0.34], [35.0, 72.0]),
    ("yellow", [0.75, 0.97], [0.15, 0.24], [87.0, 123.0]),
    ("green", [0.35, 0.93], [0.13, 0.34], [117.0, 159.0]),
    ("blue", [0.24, 0.96], [0.05, 0.67], [176.0, 283.0]),
    ("purple", [0.24, 0.74], [0.11, 0.50], [287.0, 350.0]),
    ("pink", [0.60, 0.87], [0.08, 0.41], [330.0, 386.0]),
    ("brown", [0.26, 0.73], [0.09, 0.35], [30.0, 103.0]),
];

/// Basic colour term that a word is, spelt as in models and percepts; `None` for other words.
pub fn basic(word: &str) -> Option<&'static str> {
    let word = if word == "gray" { "grey" } else { word };
    BASIC.iter().map(|(name, ..)| *name).find(|name| *name == word)
}

/// Splits a name that begins with a basic colour ("red cup", "red-cup") into colour and rest;
/// `None` for other names.
pub fn coloured(name: &str) -> Option<(&'static str, &str)> {
    let (first, rest) = name.split_once([' ', '-'])?;
    Some((basic(first)?, rest))
}

/// A colour that an object model states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Colour {
    /// A basic colour term.
    Name(&'static str),
    /// A range of colours that the model gives.
    Own(ColourRange),
}

impl Colour {
    pub(super) fn range(&self) -> ColourRange {
        let range = |[low, high]: [f64; 2]| Range { low, high };
        match self {
            Colour::Own(own) => *own,
            Colour::Name(name) => {
                let n = BASIC.iter().position(|(other, ..)| other == name).unwrap_or_default();
                let (_, lightness, saturation, hue_deg) = BASIC[n];
                ColourRange {
                    lightness: range(lightness),
                    saturation: range(saturation),
                    hue_deg: range(hue_deg),
                }
            }
        }
    }
}

impl<'de> Deserialize<'de> for Colour {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Colour, D::Error> {
        from.deserialize_any(OneColour)
    }
}

struct OneColour;

impl<'de> Visitor<'de> for OneColour {
    type Value = Colour;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(
            f,
            "a colour, as in \"red\", or ranges, as in {{ hue_deg = [350, 390], saturation = [0.1, 0.4] }}"
        )
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Colour, E> {
        let names = || BASIC.iter().map(|(name, ..)| *name);
        basic(word).map(Colour::Name).ok_or_else(|| {
            let near = names().min_by_key(|name| strsim::damerau_levenshtein(name, word));
            let near = near.filter(|name| strsim::damerau_levenshtein(name, word) <= word.len() / 2);
            let meant = near.map(|name| format!("did you mean `{name}`? ")).unwrap_or_default();
            let all = names().collect::<Vec<_>>().join(", ");
            E::custom(format!("`{word}` is no colour name: {meant}known are {all}, and ranges of your own"))
        })
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Colour, A::Error> {
        let own = ColourRange::deserialize(MapAccessDeserializer::new(map))?;
        let ranges = [("lightness", own.lightness, 0.0, 1.0), ("saturation", own.saturation, 0.0, 1.0)];
        let hue = ("hue_deg", own.hue_deg, -CIRCLE_DEG, 2.0 * CIRCLE_DEG);
        let is_bad = |(_, r, least, most): &(&str, Range, f64, f64)| {
            !(r.low >= *least && r.low <= r.high && r.high <= *most)
        };
        match ranges.into_iter().chain([hue]).find(is_bad) {
            Some((key, Range { low, high }, least, most)) => Err(A::Error::custom(format!(
                "`{key}` = [{low}, {high}] holds no colour: write [least, greatest], both from {least} to {most}"
            ))),
            None => Ok(Colour::Own(own)),
        }
    }
}

/// Reads one colour, or a list of them.
pub(super) fn one_or_more<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Colour>, D::Error> {
    struct OneOrMore;

    impl<'de> Visitor<'de> for OneOrMore {
        type Value = Vec<Colour>;

        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            OneColour.expecting(f)?;
            write!(f, ", or a list of them")
        }

        fn visit_str<E: Error>(self, word: &str) -> Result<Vec<Colour>, E> {
            OneColour.visit_str(word).map(|colour| vec![colour])
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Vec<Colour>, A::Error> {
            OneColour.visit_map(map).map(|colour| vec![colour])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<Colour>, A::Error> {
            let mut colours = Vec::new();
            while let Some(colour) = list.next_element()? {
                colours.push(colour);
            }
            Ok(colours)
        }
    }

    from.deserialize_any(OneOrMore)
}
