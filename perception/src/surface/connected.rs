//! Connected sets of cells in a plane.

/// Largest set of connected cells, up to two cells apart (shadows of objects); of equal ones the
/// first in order. `cells`: each once, with its number of returns.
pub fn largest_part(cells: Vec<([i32; 2], u32)>) -> Vec<[i32; 2]> {
    parts(cells).into_iter().next().unwrap_or_default()
}

/// Sets of connected cells, up to two cells apart, the one with most returns first; of equal ones
/// the first in order. `cells`: each once, with its number of returns.
pub fn parts(mut cells: Vec<([i32; 2], u32)>) -> Vec<Vec<[i32; 2]>> {
    cells.sort_unstable_by_key(|(cell, _)| rank(*cell));
    let mut parts: Vec<(u32, Vec<[i32; 2]>)> = Vec::new();
    let mut numbers = vec![0; cells.len()];
    for (i, ((cell, count), first)) in cells.iter().zip(first_of_part(&cells)).enumerate() {
        if first == i {
            numbers[i] = parts.len();
            parts.push((0, Vec::new()));
        }
        let part = &mut parts[numbers[first]];
        part.0 += count;
        part.1.push(*cell);
    }
    parts.retain(|(count, _)| *count > 0);
    parts.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    parts.into_iter().map(|(_, cells)| cells).collect()
}

/// Key that sorts cells by x, then by y.
fn rank(cell: [i32; 2]) -> u64 {
    let [x, y] = cell.map(|at| u64::from(at.cast_unsigned() ^ 1 << 31));
    x << 32 | y
}

/// Connected cells of one column: one x, successive y.
struct Run {
    x: i32,
    /// First and last y.
    ends: [i32; 2],
    /// Index of the run's first cell among all cells in order.
    at: usize,
    /// Number of cells.
    len: usize,
}

/// Index of the first cell of the connected set of each cell, for all cells in order.
fn first_of_part(order: &[([i32; 2], u32)]) -> Vec<usize> {
    /// Maximum distance of connected cells, in cells: shadows of objects. From: chosen.
    const GAP: i32 = 2;
    let mut at = 0;
    let in_column = order.chunk_by(|([x, y], _), ([next, on], _)| x == next && on.saturating_sub(*y) <= GAP);
    let run = |cells: &[([i32; 2], u32)]| {
        let (([x, first], _), ([_, last], _)) = (cells[0], cells[cells.len() - 1]);
        at += cells.len();
        Run { x, ends: [first, last], at: at - cells.len(), len: cells.len() }
    };
    let runs: Vec<Run> = in_column.map(run).collect();
    let mut first: Vec<usize> = (0..runs.len()).collect();
    // The runs that follow within reach, in the next columns. No gap in a run is wider than that reach.
    let mut ahead = [0; GAP as usize];
    for (i, Run { x, ends: [low, high], .. }) in runs.iter().enumerate() {
        let mut own = root(&mut first, i);
        for (dx, start) in (1..).zip(&mut ahead) {
            let column = x.saturating_add(dx);
            let from = [column, low.saturating_sub(GAP)];
            while runs.get(*start).is_some_and(|run| [run.x, run.ends[1]] < from) {
                *start += 1;
            }
            let to = [column, high.saturating_add(GAP)];
            let near = runs[*start..].iter().take_while(|run| [run.x, run.ends[0]] <= to);
            for j in (*start..).take(near.count()) {
                let other = root(&mut first, j);
                first[own.max(other)] = own.min(other);
                own = own.min(other);
            }
        }
    }
    let of_cells = |(i, run): (usize, &Run)| std::iter::repeat_n(runs[root(&mut first, i)].at, run.len);
    runs.iter().enumerate().flat_map(of_cells).collect()
}

fn root(first: &mut [usize], mut i: usize) -> usize {
    while first[i] != i {
        first[i] = first[first[i]];
        i = first[i];
    }
    i
}
