//! Functions that JavaScript calls. Texts are passed byte by byte, so that neither side touches the other's memory.

// Exported names and the imported clock are what `unsafe` stands for here; no memory is handled by hand.
#![allow(unsafe_code)]

use std::cell::RefCell;

thread_local! {
    /// Texts received from the page, and the last answer.
    static TEXTS: RefCell<(Vec<Vec<u8>>, Vec<u8>)> = const { RefCell::new((Vec::new(), Vec::new())) };
}

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    /// Milliseconds since a fixed moment.
    safe fn now_ms() -> f64;
}

/// Begins the next text.
#[unsafe(no_mangle)]
extern "C" fn begin() {
    TEXTS.with_borrow_mut(|(texts, _)| texts.push(Vec::new()));
}

/// Appends a byte to the last text.
#[unsafe(no_mangle)]
extern "C" fn push(byte: u8) {
    TEXTS.with_borrow_mut(|(texts, _)| texts.last_mut().into_iter().for_each(|text| text.push(byte)));
}

/// Answers for the domain and the problem received: plans for at most `limit_ms` milliseconds, or only checks them if
/// that is 0. Returns the length of the answer, bytes.
#[unsafe(no_mangle)]
extern "C" fn answer(limit_ms: f64) -> usize {
    let mut texts = TEXTS.with_borrow_mut(|(texts, _)| std::mem::take(texts)).into_iter();
    let mut next = || String::from_utf8_lossy(&texts.next().unwrap_or_default()).into_owned();
    let (domain, problem) = (next(), next());
    let until = now_ms() + limit_ms;
    let answer = match limit_ms > 0.0 {
        true => crate::planned(&domain, &problem, &|| now_ms() > until),
        false => crate::checked(&domain, &problem),
    };
    TEXTS.with_borrow_mut(|(_, said)| {
        *said = answer.to_string().into_bytes();
        said.len()
    })
}

/// Byte of the answer at an index; 0 beyond the end.
#[unsafe(no_mangle)]
extern "C" fn byte(at: usize) -> u8 {
    TEXTS.with_borrow(|(_, said)| said.get(at).copied().unwrap_or_default())
}
