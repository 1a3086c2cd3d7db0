//! What growing lists take in memory.

/// Bytes of a list of this length and capacity, with what its next growth takes once little room is left: until all is
/// copied, a list is there twice.
pub(crate) fn growing<T>(length: usize, capacity: usize) -> usize {
    let grows = length + length / 8 >= capacity;
    capacity * size_of::<T>() * if grows { 3 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::growing;

    #[test]
    fn a_full_list_counts_with_its_next_growth() {
        assert_eq!(growing::<u64>(100, 1000), 8000);
        assert_eq!(growing::<u64>(950, 1000), 24_000);
    }
}
