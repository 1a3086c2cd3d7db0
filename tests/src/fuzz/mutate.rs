//! Inputs that differ from those of a corpus by a few edits of bits, bytes, words and numbers.

use std::ops::Range;

/// Seeded random numbers (SplitMix64).
#[derive(Debug, Clone, Copy)]
pub struct Draw(pub u64);

impl Draw {
    /// A number below `end`; 0 where that is 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }

    /// A short range of places in an input.
    fn range(&mut self, length: usize, most: usize) -> Range<usize> {
        let begin = self.below(length + 1);
        begin..(begin + self.below(most + 1)).min(length)
    }
}

/// Numbers at the ends of what a reader may take for one.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "9223372036854775808",
    "1e308",
    "-1e-308",
    "1e999",
    "nan",
    "inf",
    "0.1",
];

/// An input made from one of a corpus by one to six edits.
///
/// # Panics
/// If the corpus is empty.
pub fn mutate(draw: &mut Draw, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut input = draw.of(corpus).clone();
    for _ in 0..=draw.below(6) {
        edit(draw, &mut input, corpus);
    }
    input
}

fn edit(draw: &mut Draw, input: &mut Vec<u8>, corpus: &[Vec<u8>]) {
    let length = input.len();
    match draw.below(10) {
        0 if length > 0 => input[draw.below(length)] ^= 1 << draw.below(8),
        1 if length > 0 => {
            input[draw.below(length)] = *draw.of(&[0, 1, 0x7f, 0x80, 0xff, b'(', b')', b'"', b'\n'])
        }
        2 => drop(input.drain(draw.range(length, 40))),
        3 => {
            let copied = input[draw.range(length, 200)].to_vec();
            let at = draw.below(length + 1);
            input.splice(at..at, copied);
        }
        4 => {
            let other = draw.of(corpus);
            let piece = other[draw.range(other.len(), 200)].to_vec();
            let replaced = draw.range(length, 20);
            input.splice(replaced, piece);
        }
        5 => input.truncate(draw.below(length + 1)),
        6 if length >= 4 => {
            let at = draw.below(length - 3);
            let value = *draw.of(&[0_u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff]);
            input[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        7 => replace_word(
            draw,
            input,
            |draw| draw.of(&NUMBERS).as_bytes().to_vec(),
            |word| word.iter().all(|c| c.is_ascii_digit() || b".-e".contains(c)),
        ),
        _ => {
            let other = draw.of(corpus).clone();
            let words = words(&other);
            let word = |draw: &mut Draw| match words.is_empty() {
                true => Vec::new(),
                false => other[draw.of(&words).clone()].to_vec(),
            };
            replace_word(draw, input, word, |_| true);
        }
    }
}

/// Words as the languages here have them: between spaces, brackets and quotation marks.
fn words(text: &[u8]) -> Vec<Range<usize>> {
    let is_between = |c: &u8| c.is_ascii_whitespace() || b"()[]{}\",=".contains(c);
    let mut words = Vec::new();
    let mut begin = 0;
    for end in 0..=text.len() {
        if end == text.len() || is_between(&text[end]) {
            if begin < end {
                words.push(begin..end);
            }
            begin = end + 1;
        }
    }
    words
}

fn replace_word(
    draw: &mut Draw,
    input: &mut Vec<u8>,
    by: impl FnOnce(&mut Draw) -> Vec<u8>,
    fits: impl Fn(&[u8]) -> bool,
) {
    let fitting: Vec<Range<usize>> =
        words(input).into_iter().filter(|word| fits(&input[word.clone()])).collect();
    if !fitting.is_empty() {
        let replaced = draw.of(&fitting).clone();
        let word = by(draw);
        input.splice(replaced, word);
    }
}
