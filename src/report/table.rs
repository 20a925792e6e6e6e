//! The table that closes a study in the terminal.
//!
//! Plain text, aligned, at most 100 columns: whoever prints it decides about colour.

use crate::stats::few_seeds_warning;

use super::summary::VariantSummary;

/// How wide a table may be, in terminal columns.
pub const WIDTH: usize = 100;

/// Names and verdicts are shortened to make room, but not below this.
const SHORTEST: usize = 12;

/// The columns; of text the first and the last, else of numbers.
const HEADINGS: [&str; COLUMNS] = [
    "variant",
    "final mean",
    "final IQM [95 %]",
    "solved after",
    "value error [95 %]",
    "overest.",
    "steps/s",
    "audit",
];
const COLUMNS: usize = 8;
const LAST: usize = COLUMNS - 1;

/// What the table shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StudyTable {
    /// One row per variant.
    pub rows: Vec<TableRow>,
    /// Lines below the table, beside those the rows call for themselves (too few seeds).
    pub notes: Vec<String>,
}

/// One variant's row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TableRow {
    /// The variant's name.
    pub name: String,
    /// Number of seeds.
    pub seeds: usize,
    /// Final return, native: the mean over seeds.
    pub mean: f64,
    /// Final return: the interquartile mean over seeds.
    pub iqm: f64,
    /// The 95 % interval of the IQM.
    pub interval: Option<(f64, f64)>,
    /// How many seeds solved the task, and the median number of episodes it took them; `None`
    /// without a threshold.
    pub solved: Option<(usize, Option<f64>)>,
    /// The error of a predictor's values after the last episode: the interquartile mean over seeds,
    /// and its 95 % interval.
    pub value_error: Option<(f64, Option<(f64, f64)>)>,
    /// What a network believes of first states beyond what they bring: the interquartile mean.
    pub overestimation: Option<f64>,
    /// Steps per second while training; `None` if nothing was run (all results were there).
    pub steps_per_second: Option<f64>,
    /// The audit's verdict in a few words; empty if there was nothing to audit.
    pub verdict: String,
}

impl TableRow {
    /// The row of a summary; speed and verdict come from elsewhere.
    pub fn new(summary: &VariantSummary, steps_per_second: Option<f64>, verdict: String) -> Self {
        Self {
            name: summary.name.clone(),
            seeds: summary.seeds,
            mean: summary.final_return.mean,
            iqm: summary.final_return.iqm,
            interval: summary.final_return.limits(),
            solved: summary.solved.as_ref().map(|s| (s.seeds, s.median_episode)),
            value_error: summary.value_error.as_ref().map(|e| (e.iqm, e.limits())),
            overestimation: summary.overestimation.as_ref().map(|e| e.iqm),
            steps_per_second,
            verdict,
        }
    }
}

impl StudyTable {
    /// The table and its notes, each line ended by a newline. Columns without content are left out.
    pub fn render(&self) -> String {
        let decimals = self.decimals();
        let mut cells = vec![HEADINGS.map(str::to_owned)];
        cells.extend(self.rows.iter().map(|row| row.cells(decimals, self.error_decimals())));
        let mut widths = [0; COLUMNS];
        for row in &cells {
            for (w, cell) in widths.iter_mut().zip(row) {
                *w = (*w).max(width(cell));
            }
        }
        // A column of empty cells has no heading to show either.
        for column in 1..COLUMNS {
            if cells[1..].iter().all(|row| row[column].is_empty()) {
                widths[column] = 0;
            }
        }
        let columns = widths.iter().filter(|&&w| w > 0).count();
        let total: usize = widths.iter().sum::<usize>() + 2 * columns.saturating_sub(1);
        let mut excess = total.saturating_sub(WIDTH);
        // Names and verdicts give way, the longer one first: nobody wants to lose a number.
        while excess > 0 && widths[0].max(widths[LAST]) > SHORTEST {
            let longer = if widths[LAST] > widths[0] { LAST } else { 0 };
            widths[longer] -= 1;
            excess -= 1;
        }
        let mut out = String::new();
        for (i, row) in cells.iter().enumerate() {
            out.push_str(&line(row, &widths));
            if i == 0 {
                let ruled = widths.iter().sum::<usize>() + 2 * columns.saturating_sub(1);
                out.push_str(&"─".repeat(ruled));
                out.push('\n');
            }
        }
        for note in self.all_notes() {
            out.push_str(&wrapped(&format!("note: {note}"), WIDTH));
        }
        out
    }

    /// As many decimals as the numbers need to differ in: 0.7312 and 0.7405, but 487 and −113.5.
    fn decimals(&self) -> usize {
        let numbers = self.rows.iter().flat_map(|r| [r.mean, r.iqm]);
        let largest = numbers.filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()));
        match largest {
            l if l < 10.0 => 3,
            l if l < 100.0 => 2,
            l if l < 10_000.0 => 1,
            _ => 0,
        }
    }

    /// Three significant digits of the largest error.
    fn error_decimals(&self) -> usize {
        let errors = self.rows.iter().filter_map(|r| r.value_error).map(|(error, _)| error);
        let mut largest = errors.filter(|e| e.is_finite()).fold(0.0, f64::max);
        let mut decimals = 0;
        while largest > 0.0 && largest < 100.0 && decimals < 12 {
            largest *= 10.0;
            decimals += 1;
        }
        decimals
    }

    /// What the rows call for, then what was passed in.
    fn all_notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(fewest) = self.rows.iter().map(|r| r.seeds).min() {
            notes.extend(few_seeds_warning(fewest));
        }
        notes.extend(self.notes.iter().cloned());
        notes
    }
}

impl TableRow {
    fn cells(&self, decimals: usize, error_decimals: usize) -> [String; COLUMNS] {
        let value_error = self.value_error;
        let value_error = value_error.map(|(iqm, limits)| bounded(iqm, limits, error_decimals));
        let solved = match self.solved {
            None => String::new(),
            Some((solved, Some(median))) => format!("{median:.0} ({solved}/{})", self.seeds),
            Some((solved, None)) => format!("never ({solved}/{})", self.seeds),
        };
        let speed = self.steps_per_second.map_or_else(String::new, si);
        [
            self.name.clone(),
            fixed(self.mean, decimals),
            bounded(self.iqm, self.interval, decimals),
            solved,
            value_error.unwrap_or_default(),
            self.overestimation.map_or_else(String::new, |x| fixed(x, decimals)),
            speed,
            self.verdict.clone(),
        ]
    }
}

fn fixed(v: f64, decimals: usize) -> String {
    if v.is_nan() { "–".to_owned() } else { format!("{v:.decimals$}") }
}

/// A number with the limits of its interval.
fn bounded(v: f64, limits: Option<(f64, f64)>, decimals: usize) -> String {
    let v = fixed(v, decimals);
    match limits {
        Some((low, high)) => format!("{v} [{}, {}]", fixed(low, decimals), fixed(high, decimals)),
        None => v,
    }
}

/// A rate with three significant digits and a metric prefix: `12.3M`.
fn si(value: f64) -> String {
    // The bounds are where rounding to three digits reaches the next prefix.
    let (scaled, suffix) = match value {
        v if v < 999.5 => (v, ""),
        v if v < 999.5e3 => (v / 1e3, "k"),
        v if v < 999.5e6 => (v / 1e6, "M"),
        v => (v / 1e9, "G"),
    };
    let decimals = match scaled {
        s if s < 9.995 => 2,
        s if s < 99.95 => 1,
        _ => 0,
    };
    format!("{scaled:.decimals$}{suffix}")
}

/// One row: text to the left, numbers to the right, two spaces between.
fn line(cells: &[String; COLUMNS], widths: &[usize; COLUMNS]) -> String {
    let mut out = String::new();
    for (column, (cell, &w)) in cells.iter().zip(widths).enumerate() {
        if w == 0 {
            continue;
        }
        if column > 0 {
            out.push_str("  ");
        }
        let cell = shorten(cell, w);
        let space = " ".repeat(w - width(&cell));
        if matches!(column, 0 | LAST) {
            out.push_str(&cell);
            out.push_str(&space);
        } else {
            out.push_str(&space);
            out.push_str(&cell);
        }
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

/// A paragraph broken at spaces into lines of at most `most` columns, continued with an indent.
fn wrapped(paragraph: &str, most: usize) -> String {
    let mut out = String::new();
    let mut column = 0;
    for word in paragraph.split_whitespace() {
        if column > 0 && column + 1 + width(word) > most {
            out.push_str("\n     ");
            column = 5;
        }
        if column > 0 {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += width(word);
    }
    out.push('\n');
    out
}

/// The terminal columns of a text, for simple cases: East Asian wide characters and emoji take
/// two, combining marks and other zero-width characters none.
pub(super) fn width(text: &str) -> usize {
    text.chars().map(char_width).sum()
}

fn char_width(c: char) -> usize {
    match c {
        '\u{0}'..='\u{1f}'
        | '\u{7f}'..='\u{9f}'
        | '\u{300}'..='\u{36f}'
        | '\u{200b}'..='\u{200f}'
        | '\u{fe00}'..='\u{fe0f}'
        | '\u{feff}' => 0,
        '\u{1100}'..='\u{115f}'
        | '\u{2e80}'..='\u{303e}'
        | '\u{3041}'..='\u{a4cf}'
        | '\u{ac00}'..='\u{d7a3}'
        | '\u{f900}'..='\u{faff}'
        | '\u{fe30}'..='\u{fe6f}'
        | '\u{ff00}'..='\u{ff60}'
        | '\u{ffe0}'..='\u{ffe6}'
        | '\u{1f300}'..='\u{1faff}'
        | '\u{20000}'..='\u{3fffd}' => 2,
        _ => 1,
    }
}

/// A text cut to at most `most` columns. Its middle goes, for an ellipsis: the names of a sweep's
/// variants begin alike and differ at their ends.
pub(super) fn shorten(text: &str, most: usize) -> String {
    if width(text) <= most {
        return text.to_owned();
    }
    if most == 0 {
        return String::new();
    }
    let take = |chars: &mut dyn Iterator<Item = char>, room: usize| -> Vec<char> {
        let mut used = 0;
        chars
            .take_while(|&c| {
                used += char_width(c);
                used <= room
            })
            .collect()
    };
    let tail_room = (most - 1) / 2;
    let head = take(&mut text.chars(), most - 1 - tail_room);
    let tail = take(&mut text.chars().rev(), tail_room);
    head.into_iter().chain(['…']).chain(tail.into_iter().rev()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, iqm: f64, interval: (f64, f64), solved: (usize, Option<f64>)) -> TableRow {
        TableRow {
            name: name.into(),
            seeds: 20,
            mean: iqm - 1.25,
            iqm,
            interval: Some(interval),
            solved: Some(solved),
            steps_per_second: Some(12_345_678.0),
            verdict: "preserves the policy".into(),
            value_error: None,
            overestimation: None,
        }
    }

    #[test]
    fn a_study() {
        let mut nothing_to_audit = row("plain", -200.0, (-200.0, -200.0), (0, None));
        nothing_to_audit.verdict = String::new();
        let rows = vec![
            nothing_to_audit,
            row("height", -143.52, (-151.0, -136.04), (3, Some(1722.0))),
            row("höhe 高さ", -121.0, (-124.5, -118.25), (20, Some(803.5))),
        ];
        let notes = vec!["files are in results/mountain-car".into()];
        insta::assert_snapshot!(StudyTable { rows, notes }.render(), @r"
        variant    final mean         final IQM [95 %]  solved after  steps/s  audit
        ───────────────────────────────────────────────────────────────────────────────────────────
        plain          -201.2  -200.0 [-200.0, -200.0]  never (0/20)    12.3M
        height         -144.8  -143.5 [-151.0, -136.0]   1722 (3/20)    12.3M  preserves the policy
        höhe 高さ      -122.2  -121.0 [-124.5, -118.2]   804 (20/20)    12.3M  preserves the policy
        note: files are in results/mountain-car
        ");
    }

    #[test]
    fn long_names_lose_their_middle() {
        let rows = vec![
            row(
                "plain: alpha=0.05, epsilon=exponential(1.0, 0.99, 0.01), bins=40",
                487.1,
                (480.0, 491.9),
                (20, Some(312.0)),
            ),
            row(
                "plain: alpha=0.10, epsilon=exponential(1.0, 0.99, 0.01), bins=20",
                500.0,
                (500.0, 500.0),
                (20, Some(120.0)),
            ),
        ];
        let table = StudyTable { rows, notes: vec![] }.render();
        assert!(table.lines().all(|line| width(line) <= WIDTH), "{table}");
        insta::assert_snapshot!(table, @r"
        variant                final mean      final IQM [95 %]  solved after  steps/s  audit
        ────────────────────────────────────────────────────────────────────────────────────────────────────
        plain: alp…), bins=40       485.9  487.1 [480.0, 491.9]   312 (20/20)    12.3M  preserves the policy
        plain: alp…), bins=20       498.8  500.0 [500.0, 500.0]   120 (20/20)    12.3M  preserves the policy
        ");
    }

    #[test]
    fn few_seeds_no_threshold_nothing_run() {
        let mut rows = vec![
            row("a", 0.7312, (0.5, 0.9), (0, None)),
            row("b", f64::NAN, (0.0, 0.0), (0, None)),
        ];
        for r in &mut rows {
            (r.seeds, r.solved, r.steps_per_second, r.verdict) = (5, None, None, String::new());
        }
        rows[1].interval = None;
        insta::assert_snapshot!(StudyTable { rows, notes: vec![] }.render(), @r"
        variant  final mean      final IQM [95 %]
        ─────────────────────────────────────────
        a            -0.519  0.731 [0.500, 0.900]
        b                 –                     –
        note: with 5 seeds a 95 % interval is only a rough guide: where a few runs go much better or worse
              than the rest, it misses the truth far more often than 5 % of the time; use 20
        ");
    }

    #[test]
    fn errors_of_values_have_three_digits() {
        let mut rows = vec![
            row("td0", 0.5, (0.4, 0.6), (0, None)),
            row("monte carlo", 0.5, (0.4, 0.6), (0, None)),
        ];
        for r in &mut rows {
            (r.solved, r.steps_per_second, r.verdict) = (None, None, String::new());
        }
        rows[0].value_error = Some((0.034_56, Some((0.03, 0.041))));
        insta::assert_snapshot!(StudyTable { rows, notes: vec![] }.render(), @r"
        variant      final mean      final IQM [95 %]       value error [95 %]
        ──────────────────────────────────────────────────────────────────────
        td0              -0.750  0.500 [0.400, 0.600]  0.0346 [0.0300, 0.0410]
        monte carlo      -0.750  0.500 [0.400, 0.600]
        ");
    }

    #[test]
    fn columns_of_a_terminal() {
        assert_eq!(width("plain"), 5);
        assert_eq!(width("高さ"), 4);
        assert_eq!(width("e\u{301}"), 1);
    }

    #[test]
    fn shortening_keeps_both_ends_and_never_exceeds() {
        assert_eq!(shorten("abcdefghij", 10), "abcdefghij");
        assert_eq!(shorten("abcdefghij", 7), "abc…hij");
        assert_eq!(shorten("abcdefghij", 1), "…");
        assert_eq!(shorten("abc", 0), "");
        for most in 0..12 {
            assert!(width(&shorten("ab高さcd高さef", most)) <= most);
        }
    }

    #[test]
    fn rates_have_three_digits() {
        let rates = [0.5, 12.0, 999.0, 1_234.0, 45_600.0, 12_345_678.0, 2e9].map(si);
        assert_eq!(rates, ["0.50", "12.0", "999", "1.23k", "45.6k", "12.3M", "2.00G"]);
        // Rounding up must not leave four digits before the point.
        assert_eq!(si(999_999.0), "1.00M");
    }
}
