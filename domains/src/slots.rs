//! Slots of phrases, and texts with filled slots.

use crate::objective::Filled;

/// The type that fills a slot: `thing` of `thing` and of `first:thing`.
pub fn type_of_slot(slot: &str) -> &str {
    slot.rsplit(':').next().unwrap_or(slot)
}

/// Slots of a text, in order.
pub fn slots_of(text: &str) -> Vec<&str> {
    let mut slots = Vec::new();
    let mut rest = text;
    while let Some((_, behind)) = rest.split_once('<') {
        let Some((slot, after)) = behind.split_once('>') else { break };
        // A comparison is no slot.
        if !slot.is_empty() && slot.chars().all(|c| c.is_alphanumeric() || "-_:".contains(c)) {
            slots.push(slot);
        }
        rest = if slots.last() == Some(&slot) { after } else { behind };
    }
    slots
}

/// Fills slots in a text: the n-th value of a name replaces its n-th mention; if the counts differ,
/// every mention stands for the only value.
///
/// # Errors
/// A slot that the phrase does not have, or one that the phrase and the text have in different numbers.
pub fn put_in(text: &str, slots: &[Filled], with: impl Fn(&Filled) -> String) -> Result<String, String> {
    let mut out = text.to_string();
    let mentioned = slots_of(text);
    for (n, slot) in mentioned.iter().enumerate().filter(|(n, slot)| !mentioned[..*n].contains(slot)) {
        let fitting: Vec<&Filled> = slots.iter().filter(|f| f.slot == *slot).collect();
        let mentions = mentioned[n..].iter().filter(|m| *m == slot).count();
        let tag = format!("<{slot}>");
        match fitting.as_slice() {
            [] => {
                let known: Vec<String> = slots.iter().map(|f| format!("<{}>", f.slot)).collect();
                let known = if known.is_empty() { "none".into() } else { known.join(", ") };
                return Err(format!("there is no slot {tag}; it has {known}"));
            }
            [only] => out = out.replace(&tag, &with(only)),
            several if several.len() == mentions => {
                for one in several {
                    out = out.replacen(&tag, &with(one), 1);
                }
            }
            several => {
                return Err(format!(
                    "it says {tag} {} times and \"{text}\" {mentions} times; name them, as <first:{slot}> and <second:{slot}>",
                    several.len()
                ));
            }
        }
    }
    Ok(out)
}
