//! Fig. 2 of Jadot et al. for any machine: which parameters an operating point says something about.
//!
//! Over speed and load torque, the share |Bᵢ|/‖B‖ of each parameter in the regressor (33) at a given flux. What lies near 1 dominates the
//! adaptation there; what lies near 0 is not seen.

use std::fmt::Write;

use super::jadot::{RegulationParameters, relative_sensitivity};

/// The plane, and the machine on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensitivityMap {
    /// The machine.
    pub parameters: RegulationParameters<f64>,
    /// Pole pairs.
    pub pole_pairs: u32,
    /// φ = (L_m/L_r)ψ_r, Vs.
    pub flux_vs: f64,
    /// The map reaches from zero to this mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// The map reaches from zero to this torque, Nm.
    pub torque_max_nm: f64,
}

/// Cells along each side.
const CELLS: usize = 32;
/// Shades from the paper's black, below 0.1, to its white, above 0.75.
const SHADES: usize = 8;
const SIDE: f64 = 220.0;
const MARGIN: f64 = 56.0;

impl SensitivityMap {
    /// |B|/‖B‖ for R_req, L, R_s, L_f at a mechanical speed, rad/s, and a torque, Nm.
    pub fn at(&self, speed_rad_s: f64, torque_nm: f64) -> [f64; 4] {
        let n_p = f64::from(self.pole_pairs);
        // (11), (14): i_q = τ/(1.5 n_p φ), ω_g = R_req i_q/φ.
        let slip = self.parameters.rotor_resistance_ohm * torque_nm / (1.5 * n_p * self.flux_vs * self.flux_vs);
        relative_sensitivity(&self.parameters, self.flux_vs, n_p * speed_rad_s, slip)
    }

    /// Four maps side by side two by two as SVG, white where a parameter dominates (0.75 and more), black where it is not seen (0.1 and less).
    pub fn svg(&self, title: &str) -> String {
        let (width, height) = (2.0 * (SIDE + MARGIN) + 20.0, 2.0 * (SIDE + MARGIN) + 66.0);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\" \
             shape-rendering=\"crispEdges\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n<text x=\"{MARGIN}\" y=\"20\" font-size=\"14\">{}</text>\n",
            escaped(title)
        );
        let cell = SIDE / CELLS as f64;
        for (k, symbol) in RegulationParameters::<f64>::SYMBOLS.into_iter().enumerate() {
            let (x0, y0) = (MARGIN + (k % 2) as f64 * (SIDE + MARGIN), 54.0 + (k / 2) as f64 * (SIDE + MARGIN));
            let _ = writeln!(out, "<text x=\"{x0}\" y=\"{}\">{symbol}</text>", y0 - 6.0);
            for row in 0..CELLS {
                // Torque upwards; neighbours of one shade are one rectangle.
                let torque = self.torque_max_nm * (CELLS - row) as f64 / CELLS as f64 - 0.5 * self.torque_max_nm / CELLS as f64;
                let shade = |column: usize| {
                    let share = self.at(self.speed_max_rad_s * (column as f64 + 0.5) / CELLS as f64, torque)[k];
                    ((share - 0.1) / 0.65 * SHADES as f64).clamp(0.0, SHADES as f64) as usize
                };
                let mut from = 0;
                for column in 1..=CELLS {
                    if column == CELLS || shade(column) != shade(from) {
                        let grey = 255 * shade(from) / SHADES;
                        let _ = writeln!(
                            out,
                            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#{grey:02x}{grey:02x}{grey:02x}\"/>",
                            x0 + cell * from as f64,
                            y0 + cell * row as f64,
                            cell * (column - from) as f64 + 0.3,
                            cell + 0.3
                        );
                        from = column;
                    }
                }
            }
            let _ = writeln!(
                out,
                "<rect x=\"{x0}\" y=\"{y0}\" width=\"{SIDE}\" height=\"{SIDE}\" fill=\"none\" stroke=\"black\"/>\n\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text><text x=\"{}\" y=\"{}\" text-anchor=\"end\">0</text>\n\
                 <text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                x0 - 4.0,
                y0 + 10.0,
                four_digits(self.torque_max_nm),
                x0 - 4.0,
                y0 + SIDE,
                x0 + SIDE,
                y0 + SIDE + 14.0,
                four_digits(self.speed_max_rad_s),
            );
        }
        let notes =
            ["across: speed, rad/s; up: load torque, Nm", "white: share of the regressor of 0.75 and more; black: 0.1 and less"];
        for (k, note) in notes.into_iter().enumerate() {
            let _ = writeln!(out, "<text x=\"{MARGIN}\" y=\"{}\">{note}</text>", height - 26.0 + 16.0 * k as f64);
        }
        out.push_str("</svg>\n");
        out
    }
}

/// 26, 157.1, 0.001234.
fn four_digits(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// Text within XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table_i() -> SensitivityMap {
        let m = im_model::machines::JADOT_TABLE_I;
        SensitivityMap {
            parameters: m.parameters().inverse_gamma().into(),
            pole_pairs: m.pole_pairs,
            flux_vs: 0.93,
            speed_max_rad_s: 157.0,
            torque_max_nm: 26.0,
        }
    }

    /// The four conclusions that the paper draws from Fig. 2.
    #[test]
    fn the_papers_four_conclusions_hold_on_its_machine() {
        let map = table_i();
        let [r_req, l, r_s, l_f] = [0, 1, 2, 3].map(|k| move |w: f64, t: f64| map.at(w, t)[k]);
        // R_req: high except at low speed and at low load. L: high except at low speed.
        assert!(r_req(120.0, 20.0) > 0.7 && r_req(120.0, 1.0) < 0.1);
        assert!(l(120.0, 1.0) > 0.9 && l(120.0, 20.0) > 0.4 && l(0.5, 1.0) < 0.5);
        // R_s: low except at low speed.
        assert!(r_s(120.0, 20.0) < 0.15 && r_s(0.5, 1.0) > 0.75);
        // L_f: low except at high load and sufficient speed.
        assert!(l_f(120.0, 1.0) < 0.1 && l_f(120.0, 26.0) > l_f(120.0, 2.0));
    }

    #[test]
    fn shares_are_those_of_a_unit_vector() {
        let map = table_i();
        for (w, t) in [(1.0, 0.1), (30.0, 20.0), (157.0, 26.0), (-80.0, 5.0)] {
            let squares: f64 = map.at(w, t).iter().map(|x| x * x).sum();
            assert!((squares - 1.0).abs() < 1e-12);
        }
        assert!(map.at(0.0, 0.0)[2] > 0.999, "at standstill only R_s shows");
    }

    #[test]
    fn axes_end_in_numbers_of_four_digits_at_most() {
        let svg = SensitivityMap { speed_max_rad_s: 50.0 * core::f64::consts::PI, ..table_i() }.svg("a");
        assert!(svg.contains(">26</text>") && svg.contains(">157.1</text>"));
        assert!(SensitivityMap { torque_max_nm: 0.001_234_4, ..table_i() }.svg("a").contains(">0.001234</text>"));
    }

    #[test]
    fn picture_is_small_and_escapes_its_title() {
        let svg = table_i().svg("a < b & c");
        assert!(svg.len() < 60_000, "{}", svg.len());
        assert!(svg.contains("a &lt; b &amp; c") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"));
    }

    /// What stands behind `key="` in a line of the picture.
    fn number(line: &str, key: &str) -> f64 {
        line.split(&format!(" {key}=\"")).nth(1).and_then(|r| r.split('"').next()).unwrap().parse().unwrap()
    }

    /// Read as a reader does: under every point of each square there is the shade of the parameter's share there, from black at 0.1 to white at
    /// 0.75, torque upwards; the squares lie side by side, each under its symbol and with the ends of its axes beside it.
    #[test]
    fn picture_shows_the_share_of_each_parameter_at_speed_and_torque() {
        let map = table_i();
        let svg = map.svg("a");
        let cell = |line: &str| {
            let grey: Vec<u8> = (0..3)
                .map(|k| u8::from_str_radix(&line.split("fill=\"#").nth(1).unwrap()[2 * k..2 * k + 2], 16).unwrap())
                .collect();
            assert!(grey[0] == grey[1] && grey[1] == grey[2], "{line}");
            (["x", "y", "width", "height"].map(|key| number(line, key)), f64::from(grey[0]) / 255.0)
        };
        let cells: Vec<_> = svg.lines().filter(|l| l.starts_with("<rect x=") && l.contains("fill=\"#")).map(cell).collect();
        let texts: Vec<&str> = svg.lines().flat_map(|l| l.split_inclusive("</text>")).filter(|l| l.contains("<text")).collect();
        let said = |words: &str, x: f64, y: f64| {
            let near =
                |t: &&&str| t.contains(&format!(">{words}</text>")) && (number(t, "x") - x).hypot(number(t, "y") - y) < 20.0;
            assert_eq!(texts.iter().filter(near).count(), 1, "{words} at {x}, {y}");
        };
        for (k, symbol) in RegulationParameters::<f64>::SYMBOLS.into_iter().enumerate() {
            let (left, top) = (MARGIN + [0.0, SIDE + MARGIN][k % 2], 54.0 + [0.0, SIDE + MARGIN][k / 2]);
            assert!(svg.contains(&format!("<rect x=\"{left}\" y=\"{top}\" width=\"{SIDE}\" height=\"{SIDE}\" fill=\"none\"")));
            said(symbol, left, top - 6.0);
            said("26", left - 4.0, top + 10.0);
            said("157", left + SIDE, top + SIDE + 14.0);
            said("0", left - 4.0, top + SIDE);
            for column in 0..CELLS {
                for row in 0..CELLS {
                    let (x, y) = ((column as f64 + 0.5) / CELLS as f64, (row as f64 + 0.5) / CELLS as f64);
                    let share = map.at(x * map.speed_max_rad_s, (1.0 - y) * map.torque_max_nm)[k];
                    let (x, y) = (left + x * SIDE, top + y * SIDE);
                    let under = cells
                        .iter()
                        .filter(|([left, top, width, height], _)| *left < x && x < left + width && *top < y && y < top + height);
                    let here: Vec<f64> = under.map(|c| c.1).collect();
                    assert_eq!(here.len(), 1, "{symbol} at {x}, {y}");
                    // A step of eight between black and white.
                    let ideal = ((share - 0.1) / 0.65).clamp(0.0, 1.0);
                    let got = here[0];
                    assert!(got <= ideal + 0.01 && got > ideal - 0.135, "{symbol} at {x}, {y}: {got} for {share}");
                    assert!(ideal < 1.0 || got == 1.0);
                }
            }
        }
        // The cells reach the right and lower ends of the squares and do not go beyond.
        let most = |at: usize, size: usize| cells.iter().map(|(c, _)| c[at] + c[size]).fold(0.0, f64::max);
        let square = [2.0 * (MARGIN + SIDE), 54.0 + 2.0 * SIDE + MARGIN];
        assert!([most(0, 2), most(1, 3)].iter().zip(square).all(|(e, s)| (e - s).abs() < 0.5));
        // Nothing lies outside of the paper, and the notes below the maps.
        let paper = svg.lines().next().unwrap().split("viewBox=\"0 0 ").nth(1).unwrap();
        let size: Vec<f64> = paper.split('"').next().unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
        assert!(texts.iter().all(|t| number(t, "x") < size[0] && number(t, "y") < size[1]), "{size:?}");
        let [first, second] = ["across: ", "white: "].map(|n| number(texts.iter().find(|t| t.contains(n)).unwrap(), "y"));
        assert!(54.0 + 2.0 * SIDE + MARGIN + 14.0 < first && first + 10.0 < second, "{first} {second}");
    }
}
