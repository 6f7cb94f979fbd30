//! What would be feasible, when a request is not.

/// The largest share of a region, about its centre, for which `works`; to 2 %, none when even a hundredth does not.
pub(crate) fn largest_share(works: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut low, mut high) = (0.01, 1.0);
    if !works(low) {
        return None;
    }
    while high - low > 0.02 {
        let middle = 0.5 * (low + high);
        if works(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

/// A range with its width multiplied, about its centre.
pub(crate) fn shrunk([low, high]: [f64; 2], share: f64) -> [f64; 2] {
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low) * share);
    [centre - half, centre + half]
}

/// A range, for people.
pub(crate) fn range([low, high]: [f64; 2]) -> String {
    format!("{low:.4} to {high:.4}")
}
