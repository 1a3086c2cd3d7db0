//! English language around a domain's words: courtesies, function words, and synonymous verbs.

/// Opening phrases of requests, without meaning of their own.
const OPENINGS: [&str; 28] = [
    "please",
    "hey",
    "hi",
    "hello",
    "ok",
    "okay",
    "robot",
    "descry",
    "now",
    "could you",
    "can you",
    "would you",
    "will you",
    "i want you to",
    "i would like you to",
    "i need you to",
    "you should",
    "go and",
    "try to",
    "tell me",
    "let me know",
    "do you know",
    "help me",
    "help me to",
    "i want to know",
    "i would like to know",
    "can you tell me",
    "to",
];

/// Closing phrases of requests, without meaning of their own.
const ENDINGS: [&str; 8] = ["please", "for me", "for us", "thanks", "thank you", "now", "right now", ","];

/// Contractions that occur in requests and questions.
const CONTRACTIONS: [(&str, &str); 8] = [
    ("what's", "what is"),
    ("where's", "where is"),
    ("which's", "which is"),
    ("there's", "there is"),
    ("how's", "how is"),
    ("i'd", "i would"),
    ("you'd", "you would"),
    ("let's", ""),
];

/// Words and fixed expressions that request the same.
const SAME: [&[&str]; 12] = [
    &["find", "locate", "seek", "look for", "search for", "hunt for", "i lost"],
    &["pick up", "grab", "grasp", "take", "lift"],
    &["bring", "put", "place", "move", "carry", "take", "deliver", "set"],
    &["to", "on", "onto", "upon", "on top of"],
    &["in", "inside"],
    &["all", "every", "each", "all of"],
    &["identify", "recognise", "recognize", "name"],
    &["objects", "things", "items"],
    &["which", "what"],
    &["learn", "memorise", "memorize"],
    &["map", "explore", "survey"],
    &["is", "are"],
];

/// Semantic fields: words of one field are similar to each other, although they request different
/// things.
const RELATED: [&[&str]; 2] = [
    &["find", "see", "spot", "show", "locate", "seek", "where", "look for", "search for", "check"],
    &[
        "bring", "fetch", "get", "give", "hand", "put", "place", "move", "carry", "pick up", "grab", "take",
        "drop", "hold", "clear", "return",
    ],
];

/// Determiners, which do not identify an object.
const DETERMINERS: [&str; 9] = ["the", "any", "an", "a", "my", "our", "your", "some", "either"];

/// Negation words.
const DENIALS: [&str; 12] = [
    "not", "never", "no", "nor", "neither", "nothing", "nowhere", "without", "except", "cannot", "avoid",
    "stop",
];

/// True for a negation word.
pub(crate) fn is_denial(word: &str) -> bool {
    DENIALS.contains(&word) || word.ends_with("n't") || word.ends_with("n’t")
}

/// True if the words before a name denote a source: "from the", "off the", "out of".
pub(crate) fn is_left(before: &[String]) -> bool {
    let mut words = before.iter().rev().map(String::as_str).skip_while(|word| DETERMINERS.contains(word));
    match words.next() {
        Some("of") => words.next() == Some("out"),
        last => matches!(last, Some("from" | "off")),
    }
}

/// Words of a text in lower case, without punctuation; a comma is a word of its own.
pub(crate) fn words(said: &str) -> Vec<String> {
    let mut all = Vec::new();
    for word in said.split_whitespace() {
        let plain = bare(word).to_lowercase();
        all.extend((!plain.is_empty()).then_some(plain));
        let is_listed = word.trim_end_matches(['"', '\'']).ends_with(',');
        all.extend(is_listed.then(|| ",".to_string()));
    }
    all
}

/// Words without commas.
pub(crate) fn unlisted(words: &[String]) -> Vec<String> {
    words.iter().filter(|word| *word != ",").cloned().collect()
}

/// A request in plain words: contractions written out, courtesies left out, fixed groups of words joined.
pub(crate) fn plain(words: &[String]) -> Vec<String> {
    let written_out = |word: &String| match CONTRACTIONS.iter().find(|(short, _)| short == word) {
        Some((_, long)) => long.split_whitespace().map(str::to_string).collect(),
        None => vec![word.clone()],
    };
    let words: Vec<String> = words.iter().flat_map(written_out).collect();
    let mut rest = without_endings(&words);
    while let Some(opening) = OPENINGS.iter().filter_map(|o| begins(rest, o)).max() {
        rest = &rest[opening..];
        while let Some((",", behind)) = rest.split_first().map(|(word, behind)| (word.as_str(), behind)) {
            rest = behind;
        }
    }
    let mut rest = rest.to_vec();
    // "find me …", "bring us …"
    if rest.get(1).is_some_and(|word| word == "me" || word == "us") && rest.len() > 2 {
        rest.remove(1);
    }
    // "pick … up"
    if rest.len() > 2 && rest[0] == "pick" && rest[rest.len() - 1] == "up" {
        rest.rotate_right(1);
        rest.swap(0, 1);
    }
    // "look in the kitchen for …"
    if let Some(at) = rest.iter().position(|word| word == "for").filter(|at| *at > 1)
        && ["look", "search", "hunt"].contains(&rest[0].as_str())
        && ["in", "on", "inside"].contains(&rest[1].as_str())
    {
        rest[1..].rotate_left(at - 1);
    }
    // "whether … is …" asks "is … …".
    if let Some(at) = rest.iter().position(is_verb).filter(|_| rest[0] == "whether" || rest[0] == "if") {
        rest[..=at].rotate_right(1);
        rest.remove(1);
    }
    rest.retain(|word| word != "please" && word != "both");
    joined(&rest)
}

fn is_verb(word: &String) -> bool {
    word == "is" || word == "are"
}

/// Words without closing courtesies.
pub(crate) fn without_endings(words: &[String]) -> &[String] {
    let mut rest = words;
    let ends = |rest: &[String], ending: &str| {
        let ending: Vec<&str> = ending.split(' ').collect();
        let is_end = rest.len() > ending.len() && rest[rest.len() - ending.len()..] == ending[..];
        is_end.then_some(ending.len())
    };
    while let Some(ending) = ENDINGS.iter().find_map(|e| ends(rest, e)) {
        rest = &rest[..rest.len() - ending];
    }
    rest
}

fn begins(words: &[String], opening: &str) -> Option<usize> {
    let opening: Vec<&str> = opening.split(' ').collect();
    (words.len() > opening.len() && words[..opening.len()] == opening[..]).then_some(opening.len())
}

/// Words with fixed expressions joined to one word each, longest first.
pub(crate) fn joined(words: &[String]) -> Vec<String> {
    let groups = || SAME.iter().chain(&RELATED).flat_map(|list| list.iter()).filter(|w| w.contains(' '));
    let mut out: Vec<String> = Vec::new();
    let mut rest = words;
    while let Some((first, behind)) = rest.split_first() {
        let longest = groups().filter_map(|group| begins(rest, group)).max();
        match longest {
            Some(n) => {
                out.push(rest[..n].join(" "));
                rest = &rest[n..];
            }
            None => {
                out.push(first.clone());
                rest = behind;
            }
        }
    }
    out
}

/// True if two words request the same.
pub(crate) fn is_same(one: &str, other: &str) -> bool {
    one == other || in_one(&SAME, one, other)
}

/// True if two words are of one semantic field.
pub(crate) fn is_related(one: &str, other: &str) -> bool {
    is_same(one, other) || in_one(&RELATED, one, other)
}

fn in_one(lists: &[&[&str]], one: &str, other: &str) -> bool {
    lists.iter().any(|list| list.contains(&one) && list.contains(&other))
}

/// Name without leading determiners.
pub(crate) fn without_determiners(words: &[String]) -> &[String] {
    let mut rest = words;
    while let Some((_, behind)) = rest.split_first().filter(|(word, behind)| {
        !behind.is_empty() && (DETERMINERS.contains(&word.as_str()) || *word == "the" || *word == "of")
    }) {
        rest = behind;
    }
    rest
}

/// True if a name consists of function words only.
pub(crate) fn is_function_word(name: &str) -> bool {
    words(name).iter().all(|word| ["and", "or", "it", "not", "please"].contains(&word.as_str()))
}

/// Forms of a phrase: as given, and as an indirect question ("where is X": "where X is").
pub(crate) fn forms(pattern: &[String]) -> Vec<Vec<String>> {
    let mut indirect = pattern.to_vec();
    match pattern.iter().position(is_verb) {
        Some(at) if at > 0 && at + 1 < pattern.len() => indirect.swap(at, at + 1),
        _ => return vec![indirect],
    }
    vec![pattern.to_vec(), indirect]
}

/// Word without surrounding punctuation.
pub(crate) fn bare(word: &str) -> &str {
    word.trim_matches(|c: char| "\"'.,!?".contains(c))
}

pub(crate) fn without_article(name: &str) -> &str {
    ["the ", "any ", "an ", "a "].iter().find_map(|article| name.strip_prefix(article)).unwrap_or(name)
}

/// Known name nearest to a misspelt one; `None` if all are far.
pub fn nearest<'n>(found: &str, names: &[&'n str]) -> Option<&'n str> {
    let distance = |name: &&'n str| strsim::levenshtein(name, found);
    let nearest = names.iter().copied().min_by_key(distance)?;
    (distance(&nearest) <= 3.min(found.len() / 2)).then_some(nearest)
}

/// Position for people, to the centimetre, without negative zeros.
pub fn position(metres: [f64; 3]) -> String {
    let [x, y, z] = metres.map(|m| (m * 100.0).round() / 100.0 + 0.0);
    format!("({x:.2}, {y:.2}, {z:.2}) m")
}

/// Probability in percent, rounded down: whole percents, tenths near 0 and 1.
pub fn percent(p: f64) -> String {
    let tenths = (p * 1000.0 + 1e-9).floor().max(0.0) + 0.0;
    match tenths {
        0.0 if p > 0.0 => "less than 0.1 %".into(),
        0.0 => "0 %".into(),
        10.0..=990.0 | 1000.0 => format!("{:.0} %", (tenths / 10.0).floor()),
        _ => format!("{:.1} %", tenths / 10.0),
    }
}

/// Number with at most two decimals, without trailing zeros.
pub fn number(n: f64) -> String {
    let digits = format!("{:.2}", n + 0.0);
    digits.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// Name with its definite article: the mug, the dell box. Proper names, which have a capital or a digit,
/// have none: cup A.
pub fn the(name: &str) -> String {
    let is_proper = |c: char| c.is_uppercase() || c.is_numeric();
    if name.contains(is_proper) { name.to_string() } else { format!("the {name}") }
}

/// Name with its indefinite article: a cup, an apple.
pub fn one(name: &str) -> String {
    let is_vowel = name.starts_with(['a', 'e', 'i', 'o', 'u', 'A', 'E', 'I', 'O', 'U']);
    format!("{} {name}", if is_vowel { "an" } else { "a" })
}

/// Plural of a name: cups, boxes, berries.
pub fn plural(name: &str) -> String {
    const HISSING: [&str; 5] = ["s", "x", "z", "ch", "sh"];
    let before_y = name.strip_suffix('y').filter(|stem| !stem.ends_with(['a', 'e', 'i', 'o', 'u']));
    match before_y.filter(|stem| !stem.is_empty()) {
        Some(stem) => format!("{stem}ies"),
        None if HISSING.iter().any(|end| name.ends_with(end)) => format!("{name}es"),
        None => format!("{name}s"),
    }
}

/// Number of times in words: "once", "3 times".
pub(crate) fn times(count: usize) -> String {
    if count == 1 { "once".into() } else { format!("{count} times") }
}
