//! What every chart is made of: ranges, round ticks, lines thinned to what can be seen, text.

/// The range of values with a little room around them; a range of its own where there is none.
pub(crate) fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.filter(|x| x.is_finite()).fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
    match high - low {
        span if span > 1e-6 * high.abs().max(low.abs()) && span.is_finite() => [low - 0.03 * span, high + 0.03 * span],
        _ if low.is_finite() => {
            let room = if low == 0.0 { 1.0 } else { low.abs() };
            [low - room, low + room]
        }
        _ => [0.0, 1.0],
    }
}

/// Round numbers within a range, about as many as wanted (20 at most), each with the words for it.
pub fn ticks([low, high]: [f64; 2], wanted: f64) -> Vec<(f64, String)> {
    let rough = (high - low) / wanted.max(1.0);
    let power = 10f64.powf(rough.log10().floor());
    let count = |step: f64| (high / step + 1e-6).floor() - (low / step - 1e-6).ceil() + 1.0;
    let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|s| s * power);
    let large = steps.iter().position(|s| *s >= rough).unwrap_or(steps.len() - 1);
    // One tick is no scale: then the next smaller step.
    let step = steps[if large > 0 && count(steps[large]) < 2.0 { large - 1 } else { large }];
    let place = (step.log10() + 1e-9).floor();
    let most = low.abs().max(high.abs());
    // Large and small numbers as powers; what differs in a late place, with that place.
    let powers = most >= 1e5 || place < -4.0 && most < 1e-2;
    let words = |x: f64| {
        let digits = if powers { (x.abs().log10() + 1e-9).floor() - place } else { -place }.max(0.0) as usize;
        match x {
            0.0 if powers => "0".into(),
            _ if powers => format!("{x:.digits$e}"),
            _ => format!("{x:.digits$}"),
        }
        .replace('-', "−")
    };
    // Adding zero leaves no negative zero.
    let round = |k: i64| k as f64 * step + 0.0;
    let first = (low / step - 1e-6).ceil() as i64;
    (first..).map(round).take_while(|x| *x <= high + 1e-6 * step).take(20).map(|x| (x, words(x))).collect()
}

/// Of many points along x, the lowest and the highest of each column of the picture, in their order. Nothing that could be seen is lost.
pub fn thinned(points: &[[f64; 2]], column: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for part in points.chunk_by(|a, b| column(a[0]).floor() == column(b[0]).floor()) {
        let by = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        if let (Some(low), Some(high)) = (part.iter().min_by(by), part.iter().max_by(by)) {
            out.extend(if low[0] <= high[0] { [*low, *high] } else { [*high, *low] });
        }
    }
    out.dedup();
    out
}

/// A path through points in pixels, which breaks where one is not a number.
pub(crate) fn path(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    let mut d = String::new();
    let mut pen = false;
    for [x, y] in points {
        let there = x.is_finite() && y.is_finite();
        if there {
            d += if pen { "L" } else { "M" };
            d += &format!("{} {}", short(x), short(y));
        }
        pen = there;
    }
    d
}

/// Pixels to one decimal, without a zero behind the point.
pub fn short(x: f64) -> String {
    // Adding zero leaves no negative zero.
    format!("{}", (x * 10.0).round() / 10.0 + 0.0)
}

/// Where something holds along x: the first and the last x of each stretch.
pub fn spans(x: impl IntoIterator<Item = f64>, holds: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
    let mut found: Vec<[f64; 2]> = Vec::new();
    let mut within = false;
    for (k, x) in x.into_iter().enumerate() {
        match (holds(k), within, found.last_mut()) {
            (true, true, Some(last)) => last[1] = x,
            (true, ..) => found.push([x, x]),
            _ => {}
        }
        within = holds(k);
    }
    found
}

/// Text as it stands in SVG and HTML, attributes included.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let words = |low, high| ticks([low, high], 5.0).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(words(-3.0, 7.0), ["−2", "0", "2", "4", "6"]);
        assert_eq!(words(0.0, 0.5), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(words(0.0, 1.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(words(0.0011, 0.0029), ["0.0015", "0.0020", "0.0025"]);
        assert_eq!(words(5.640_01, 5.640_03), ["5.640010", "5.640015", "5.640020", "5.640025", "5.640030"]);
        assert_eq!(words(0.0, 2.0e-6), ["0", "5e−7", "1.0e−6", "1.5e−6", "2.0e−6"]);
        assert_eq!(words(1.0e5, 1.02e5), ["1.000e5", "1.005e5", "1.010e5", "1.015e5", "1.020e5"]);
        assert_eq!(words(-2.0e198, 2.0e198), ["−2e198", "−1e198", "0", "1e198", "2e198"]);
    }

    #[test]
    fn ranges_hold_what_is_finite_and_are_never_empty() {
        assert_eq!(bounds([f64::NAN, 0.0, 100.0, f64::INFINITY].into_iter()), [-3.0, 103.0]);
        assert_eq!(bounds([2.0, 2.0].into_iter()), [0.0, 4.0]);
        assert_eq!(bounds([f64::NAN].into_iter()), [0.0, 1.0]);
    }

    #[test]
    fn thinning_keeps_extremes() {
        let mut points: Vec<[f64; 2]> = (0..50_000).map(|k| [f64::from(k), 0.0]).collect();
        points[31_007][1] = 9.0;
        points[31_008][1] = -9.0;
        let few = thinned(&points, |x| x / 125.0);
        assert!(few.len() <= 800 && few.windows(2).any(|p| p[0][1] == 9.0 && p[1][1] == -9.0));
    }

    #[test]
    fn stretches_begin_and_end_where_it_holds() {
        let holds = [true, true, false, false, true];
        assert_eq!(spans([0.0, 0.1, 0.2, 0.3, 0.4], |k| holds[k]), [[0.0, 0.1], [0.4, 0.4]]);
    }
}
