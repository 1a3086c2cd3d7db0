//! Hash that identifies an experiment (FNV-1a over its texts).

/// 64-bit FNV-1a (Fowler, Noll, Vo) of a sequence of texts, each with its length, as `fnv1a:` and 16
/// hexadecimal digits. It detects accidental differences; it does not protect against manipulation.
pub fn fnv1a<'a>(texts: impl Iterator<Item = &'a [u8]>) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |bytes: &[u8]| {
        for &byte in bytes {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for (n, text) in texts.enumerate() {
        if n > 0 {
            take(&(text.len() as u64).to_le_bytes());
        }
        take(text);
    }
    format!("fnv1a:{hash:016x}")
}
