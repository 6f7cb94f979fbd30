//! Small plots in text.

/// A row of blocks, one per value; empty where a value is missing.
pub(crate) fn spark(values: &[f64], lo: f64, hi: f64) -> String {
    const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    values
        .iter()
        .map(|v| {
            if !v.is_finite() {
                return ' ';
            }
            let t = ((v - lo) / (hi - lo).max(1e-300)).clamp(0.0, 1.0);
            BLOCKS[(t * 7.999) as usize]
        })
        .collect()
}

/// A bar of at most `width` characters on a logarithmic scale, in eighths.
pub(crate) fn log_bar(v: f64, lo: f64, hi: f64, width: usize) -> String {
    const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let t = ((v.max(lo) / lo).ln() / (hi / lo).ln().max(1e-9)).clamp(0.0, 1.0);
    let eighths = (t * width as f64 * 8.0).round() as usize;
    format!("{}{}", "█".repeat(eighths / 8), EIGHTHS[eighths % 8])
}

/// Breaks text into lines of at most `width` characters, later lines indented by `indent`.
pub(crate) fn wrapped(text: &str, width: usize, indent: usize) -> String {
    let rest = " ".repeat(indent);
    let words: Vec<&str> = text.split(' ').filter(|w| !w.is_empty()).collect();
    textwrap::fill(&words.join(" "), textwrap::Options::new(width).subsequent_indent(&rest).break_words(false))
}

/// A table in columns; `right` marks columns of numbers. Where it is wider than `most`, the first column and a last one of words take more lines.
pub(crate) fn columns(rows: &[Vec<String>], right: &[bool], most: usize) -> Vec<String> {
    const LEAST: usize = 16;
    let last = right.len() - 1;
    let mut widths: Vec<usize> =
        (0..=last).map(|k| rows.iter().filter_map(|r| r.get(k)).map(|c| c.chars().count()).max().unwrap_or(0)).collect();
    let counted = if right[last] { last + 1 } else { last };
    let excess = (widths[..counted].iter().sum::<usize>() + 2 * counted).saturating_sub(most + 2);
    widths[0] = widths[0].min(widths[0].saturating_sub(excess).max(LEAST));
    if !right[last] && last > 0 {
        let before = widths[..last].iter().sum::<usize>() + 2 * last;
        widths[last] = widths[last].min(most.saturating_sub(before).max(LEAST));
    }
    let lines_of = |k: usize, cell: &String| -> Vec<String> {
        let breaks = (k == 0 || k == last && !right[last]) && cell.chars().count() > widths[k];
        let text = if breaks { wrapped(cell, widths[k], if k == 0 { 2 } else { 0 }) } else { cell.clone() };
        text.lines().map(str::to_owned).collect()
    };
    let mut out = Vec::new();
    for row in rows {
        let cells: Vec<Vec<String>> = row.iter().enumerate().map(|(k, c)| lines_of(k, c)).collect();
        for line in 0..cells.iter().map(Vec::len).max().unwrap_or(0).max(1) {
            let cells = cells.iter().enumerate().map(|(k, lines)| {
                let text = lines.get(line).map_or("", String::as_str);
                let gap = " ".repeat(widths[k].saturating_sub(text.chars().count()));
                if right[k] { format!("{gap}{text}") } else { format!("{text}{gap}") }
            });
            out.push(cells.collect::<Vec<_>>().join("  ").trim_end().to_owned());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_plots_are_as_wide_as_asked() {
        assert_eq!(spark(&[0.0, 0.5, 1.0, f64::NAN], 0.0, 1.0), "▁▄█ ");
        assert_eq!(log_bar(100.0, 1.0, 100.0, 10).chars().count(), 10);
        assert_eq!(log_bar(1.0, 1.0, 100.0, 10), "");
        assert_eq!(wrapped("aa bb cc", 5, 2), "aa bb\n  cc");
        assert_eq!(
            columns(&[vec!["a".into(), "1".into()], vec!["bb".into(), "10".into()]], &[false, true], 9),
            ["a    1", "bb  10"]
        );
        // Only where there is no room a name, or words at the end, take another line.
        let row = || [vec!["a name that is long".to_owned(), "10".to_owned()]];
        assert_eq!(columns(&row(), &[false, true], 23), ["a name that is long  10"]);
        assert_eq!(columns(&row(), &[false, true], 20), ["a name that is    10", "  long"]);
        let row = [vec!["a".to_owned(), "10".to_owned(), "more words than there is room for".to_owned()]];
        assert_eq!(columns(&row, &[false, true, false], 25), ["a  10  more words than", "       there is room for"]);
    }
}
