//! Changes of texts: what people mistype, what loggers get wrong, and what nobody would write.

/// Random choices: SplitMix64.
pub struct Dice(pub u64);

impl Dice {
    /// The next number.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// From 0 to below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// One of several.
    pub fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

const NUMBERS: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "1e30",
    "-1e30",
    "1e-30",
    "nan",
    "inf",
    "-inf",
    "1e400",
    "",
    "1,5",
    "0x10",
    "1e6",
    "1e-6",
    "1000",
    "0.001",
    "1.7320508",
    "99999999999999999999",
];

/// One or two changes of a text.
pub fn mutated(text: &str, dice: &mut Dice) -> String {
    let mut out = text.to_owned();
    for _ in 0..dice.below(3).max(1) {
        // Mostly numbers: what is no text of its kind is soon refused.
        out = match dice.below(12) {
            0..=5 => number(&out, dice),
            6 => line(&out, dice),
            7 | 8 => column(&out, dice),
            9 => bytes(&out, dice),
            10 => out[..cut(&out, dice)].to_owned(),
            _ => key(&out, dice),
        };
    }
    out
}

/// The same of bytes: of a text as such, of anything else one to eight bytes or lengths of it.
pub fn mutated_bytes(data: &[u8], dice: &mut Dice) -> Vec<u8> {
    if let Ok(text) = std::str::from_utf8(data) {
        return mutated(text, dice).into_bytes();
    }
    let mut out = data.to_vec();
    for _ in 0..=dice.below(8) {
        let at = dice.below(out.len());
        match dice.below(4) {
            0 if at < out.len() => out[at] ^= 1 << dice.below(8),
            1 if at < out.len() => out[at] = dice.one(&[0, 1, 0x7f, 0x80, 0xff]),
            2 => out.truncate(at),
            _ => out.insert(at, dice.next() as u8),
        }
    }
    out
}

fn cut(text: &str, dice: &mut Dice) -> usize {
    let mut at = dice.below(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Where numbers stand.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let is = |b: u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+');
    let mut found = Vec::new();
    let b = text.as_bytes();
    let mut k = 0;
    while k < b.len() {
        let start = k;
        while k < b.len() && (is(b[k]) || (k > start && matches!(b[k], b'e' | b'E') && k + 1 < b.len() && is(b[k + 1]))) {
            k += 1;
        }
        if b[start..k].iter().any(u8::is_ascii_digit) {
            found.push((start, k));
        }
        k = k.max(start + 1);
    }
    found
}

fn number(text: &str, dice: &mut Dice) -> String {
    let all = numbers(text);
    if all.is_empty() {
        return text.to_owned();
    }
    let (a, b) = all[dice.below(all.len())];
    let x = text[a..b].parse::<f64>().unwrap_or(1.0);
    let new = match dice.below(3) {
        0 => dice.one(&NUMBERS).to_owned(),
        1 => format!("{:e}", x * 10f64.powi(dice.below(41) as i32 - 20)),
        _ => format!("{}", -x),
    };
    format!("{}{new}{}", &text[..a], &text[b..])
}

fn line(text: &str, dice: &mut Dice) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    let n = lines.len();
    let (a, b) = (dice.below(n), dice.below(n));
    match dice.below(4) {
        0 if n > 0 => drop(lines.remove(a)),
        1 if n > 0 => lines.insert(b, lines[a]),
        2 if n > 0 => lines.swap(a, b),
        _ => lines.truncate(a + 1),
    }
    lines.join("\n") + "\n"
}

/// A column of a table scaled, turned, held or lost; of other files nothing.
fn column(text: &str, dice: &mut Dice) -> String {
    let columns = text.lines().next().map_or(0, |l| l.split(',').count());
    if columns < 3 {
        return number(text, dice);
    }
    let (k, factor) = (dice.below(columns), 10f64.powi(dice.below(13) as i32 - 6));
    let how = dice.below(6);
    let field = |n: usize, x: &str| {
        let v: f64 = x.trim().parse().unwrap_or(0.0);
        match how {
            0 => format!("{}", v * factor),
            1 => format!("{}", -v),
            2 => "0".into(),
            3 => "7.5".into(),
            4 => String::new(),
            _ if n % 50 == 0 => format!("{}", v * 1e4),
            _ => x.to_owned(),
        }
    };
    let mut out = String::with_capacity(text.len());
    for (n, row) in text.lines().enumerate() {
        if n == 0 {
            out += row;
        } else {
            let fields: Vec<String> =
                row.split(',').enumerate().map(|(j, x)| if j == k { field(n, x) } else { x.to_owned() }).collect();
            out += &fields.join(",");
        }
        out.push('\n');
    }
    out
}

fn bytes(text: &str, dice: &mut Dice) -> String {
    let at = cut(text, dice);
    let junk =
        dice.one(&["\0", "\u{1b}[31m", "\"", "}", "[", "<!--<script>", "é", "\r", ",", ";", "=", "\u{feff}", "../..", "#"]);
    format!("{}{junk}{}", &text[..at], &text[at..])
}

/// A key misspelt, or doubled with another value.
fn key(text: &str, dice: &mut Dice) -> String {
    let keys: Vec<usize> = text.match_indices('=').map(|(k, _)| k).collect();
    if keys.is_empty() {
        return bytes(text, dice);
    }
    let at = keys[dice.below(keys.len())];
    match dice.below(2) {
        0 => format!("{}x {}", text[..at].trim_end(), &text[at..]),
        _ => format!("{}= \"text\"\n#{}", &text[..at], &text[at..]),
    }
}
