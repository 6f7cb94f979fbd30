//! Which formula a learned curve looks like.
//!
//! With c the coefficients of the curve and C their covariance, a formula Σ a_k g_k(x; s) whose functions have the coefficients G costs
//!
//!   min_{a,s} (c − G a)ᵀ C⁻¹ (c − G a)
//!
//! of the fit that the curve has: what D would rise by if the formula took its place, as far as the slopes foretell. Directions in which a parameter of
//! the machine could imitate the curve (a friction that is a line over speed) cost next to nothing, as C is wide there.

use im_model::effects::{COEFFICIENTS, FreeForm};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::format::number;

/// A formula fitted to a curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Formula {
    /// What it is called.
    pub name: &'static str,
    /// The formula with its numbers, x the variable in its unit.
    pub text: String,
    /// The same as an expression in Rust over `x`, with `a`, `b` … and `s`, `t` for its numbers.
    pub rust: &'static str,
    /// Factors of its functions.
    pub factors: Vec<f64>,
    /// Numbers inside its functions.
    pub shape: Vec<f64>,
    /// What it costs of the fit, in D.
    pub cost: f64,
    /// How far it is from the curve: root mean square over that of the curve.
    pub off: f64,
}

/// A formula of the dictionary: what multiplies each factor at x, for a shape.
struct Entry {
    name: &'static str,
    text: &'static str,
    rust: &'static str,
    /// Shapes tried, as parts of the range: a place, a width, or an exponent.
    shapes: &'static [Grid],
    functions: fn(f64, &[f64]) -> Vec<f64>,
}

/// What a number inside a formula is, and so where it is looked for.
#[derive(Clone, Copy)]
enum Grid {
    /// A scale of x, from a hundredth of the range to three times it.
    Scale,
    /// A place on the range.
    Place,
    /// An exponent from a half to six.
    Exponent,
}

impl Grid {
    fn points(self, (low, high): (f64, f64)) -> Vec<f64> {
        let largest = low.abs().max(high.abs());
        match self {
            Self::Scale => (0..24).map(|k| largest * 0.01 * 300f64.powf(f64::from(k) / 23.0)).collect(),
            Self::Place => (1..24).map(|k| low + (high - low) * f64::from(k) / 24.0).collect(),
            Self::Exponent => (0..23).map(|k| 0.5 + 0.25 * f64::from(k)).collect(),
        }
    }
}

use Grid::{Exponent, Place, Scale};

/// The dictionary for a curve over a range. {a}, {b}, {c} are factors, {s}, {t} what is inside.
const DICTIONARY: &[Entry] = &[
    Entry { name: "a constant", text: "{a}", rust: "a", shapes: &[], functions: |_, _| vec![1.0] },
    Entry { name: "in proportion", text: "{a} x", rust: "a * x", shapes: &[], functions: |x, _| vec![x] },
    Entry { name: "a line", text: "{a} + {b} x", rust: "a + b * x", shapes: &[], functions: |x, _| vec![1.0, x] },
    Entry { name: "a square", text: "{a} x|x|", rust: "a * x * x.abs()", shapes: &[], functions: |x, _| vec![x * x.abs()] },
    Entry {
        name: "a parabola",
        text: "{a} + {b} x + {c} x²",
        rust: "a + b * x + c * x * x",
        shapes: &[],
        functions: |x, _| vec![1.0, x, x * x],
    },
    Entry {
        name: "a power",
        text: "{a} |x|^{s}",
        rust: "a * x.abs().powf(s)",
        shapes: &[Exponent],
        functions: |x, s| vec![x.abs().powf(s[0])],
    },
    Entry {
        name: "a hyperbolic tangent: a jump at zero with soft corners",
        text: "{a} tanh(x/{s})",
        rust: "a * tanh(x / s)",
        shapes: &[Scale],
        functions: |x, s| vec![(x / s[0]).tanh()],
    },
    Entry {
        name: "a Langevin function: a slow saturation",
        text: "{a} L(x/{s})",
        rust: "a * langevin(x / s)",
        shapes: &[Scale],
        functions: |x, s| vec![langevin(x / s[0])],
    },
    Entry {
        name: "an exponential decay",
        text: "{a} exp(−x/{s})",
        rust: "a * (-x / s).exp()",
        shapes: &[Scale],
        functions: |x, s| vec![(-x / s[0]).exp()],
    },
    Entry {
        name: "an exponential approach",
        text: "{a} + {b} exp(−x/{s})",
        rust: "a + b * (-x / s).exp()",
        shapes: &[Scale],
        functions: |x, s| vec![1.0, (-x / s[0]).exp()],
    },
    Entry {
        name: "largest at a critical value, as an eddy-current brake or a slip",
        text: "{a} 2(x/{s})/(1 + (x/{s})²)",
        rust: "a * (x / s + x / s) / (one + x / s * x / s)",
        shapes: &[Scale],
        functions: |x, s| vec![2.0 * (x / s[0]) / (1.0 + (x / s[0]).powi(2))],
    },
    Entry {
        name: "a threshold: nothing before, a line beyond",
        text: "{a} max(0, x − {s})",
        rust: "a * positive(x - s)",
        shapes: &[Place],
        functions: |x, s| vec![(x - s[0]).max(0.0)],
    },
    Entry {
        name: "a step with soft corners: something switched or gave way",
        text: "{a} / (1 + exp(−(x − {s})/{t}))",
        rust: "a / (one + (-(x - s) / t).exp())",
        shapes: &[Place, Scale],
        functions: |x, s| vec![1.0 / (1.0 + (-(x - s[0]) / s[1]).exp())],
    },
    Entry {
        name: "a bump",
        text: "{a} exp(−((x − {s})/{t})²)",
        rust: "a * (-((x - s) / t * (x - s) / t)).exp()",
        shapes: &[Place, Scale],
        functions: |x, s| vec![(-((x - s[0]) / s[1]).powi(2)).exp()],
    },
];

/// The dictionary for a curve over an angle, x being order × angle.
const ANGLES: &[Entry] = &[
    Entry {
        name: "one harmonic",
        text: "{a} cos x + {b} sin x",
        rust: "a * cos(x) + b * sin(x)",
        shapes: &[],
        functions: |x, _| vec![x.cos(), x.sin()],
    },
    Entry {
        name: "the second harmonic alone",
        text: "{a} cos 2x + {b} sin 2x",
        rust: "a * cos(x + x) + b * sin(x + x)",
        shapes: &[],
        functions: |x, _| vec![(2.0 * x).cos(), (2.0 * x).sin()],
    },
    Entry {
        name: "two harmonics",
        text: "{a} cos x + {b} sin x + {c} cos 2x + {d} sin 2x",
        rust: "a * cos(x) + b * sin(x) + c * cos(x + x) + d * sin(x + x)",
        shapes: &[],
        functions: |x, _| vec![x.cos(), x.sin(), (2.0 * x).cos(), (2.0 * x).sin()],
    },
    Entry {
        name: "odd harmonics: a wave with flanks and flats",
        text: "{a} cos x + {b} sin x + {c} cos 3x + {d} sin 3x",
        rust: "a * cos(x) + b * sin(x) + c * cos(x + x + x) + d * sin(x + x + x)",
        shapes: &[],
        functions: |x, _| vec![x.cos(), x.sin(), (3.0 * x).cos(), (3.0 * x).sin()],
    },
];

/// L(y) = coth y − 1/y.
fn langevin(y: f64) -> f64 {
    if y.abs() < 1e-3 { y / 3.0 } else { 1.0 / y.tanh() - 1.0 / y }
}

/// The formulas of the dictionary, the cheapest first, by what they cost and a `price` for each number in them.
pub(super) fn formulas(form: &FreeForm, values: &[f64], covariance: &DMatrix<f64>, grid: &[f64], price: f64) -> Vec<Formula> {
    let c = DVector::from_column_slice(&values[..COEFFICIENTS]);
    // A direction that the data do not show at all must not come out as known exactly.
    let variance = covariance.diagonal().max().max(1e-300);
    let covariance = covariance + DMatrix::identity(COEFFICIENTS, COEFFICIENTS) * (1e-10 * variance);
    let Some(inverse) = covariance.cholesky().map(|l| l.inverse()) else { return Vec::new() };
    let weights = DMatrix::from_fn(grid.len(), COEFFICIENTS, |n, k| form.weights(values, grid[n])[k]);
    let Some(onto) = (weights.tr_mul(&weights)).cholesky().map(|l| l.inverse() * weights.transpose()) else { return Vec::new() };
    let shown = &weights * &c;
    let range = (grid[0], grid[grid.len() - 1]);
    let over_angle = form.over().is_angle();
    let order = values[FreeForm::SPREAD + 1];
    let x_of = |x: f64| if over_angle { order * x } else { x };
    let of = |e: &Entry, shape: &[f64]| -> Option<Formula> {
        let rows: Vec<Vec<f64>> = grid.iter().map(|x| (e.functions)(x_of(*x), shape)).collect();
        let functions = DMatrix::from_fn(grid.len(), rows[0].len(), |n, k| rows[n][k]);
        let g = &onto * &functions;
        let weighted = g.tr_mul(&inverse);
        let factors = (&weighted * &g).cholesky()?.solve(&(&weighted * &c));
        let rest = &c - &g * &factors;
        let cost = (rest.transpose() * &inverse * &rest)[(0, 0)];
        let off = (&shown - &functions * &factors).norm() / shown.norm().max(1e-300);
        let factors: Vec<f64> = factors.iter().copied().collect();
        let text = written(e.text, &factors, shape);
        cost.is_finite().then(|| Formula { name: e.name, text, rust: e.rust, factors, shape: shape.to_vec(), cost, off })
    };
    let dictionary = if over_angle { ANGLES } else { DICTIONARY };
    let best = |e: &Entry| {
        let all = shapes(e.shapes, range).into_iter().filter_map(|s| of(e, &s));
        all.min_by(|a, b| a.cost.total_cmp(&b.cost))
    };
    let mut found: Vec<Formula> = dictionary.iter().filter_map(best).collect();
    let judged = |f: &Formula| f.cost + price * (f.factors.len() + f.shape.len()) as f64;
    found.sort_by(|a, b| judged(a).total_cmp(&judged(b)));
    found
}

/// Every shape of the grid.
fn shapes(grids: &[Grid], range: (f64, f64)) -> Vec<Vec<f64>> {
    grids.iter().fold(vec![Vec::new()], |all, g| {
        let points = g.points(range);
        all.iter().flat_map(|s| points.iter().map(|p| s.iter().copied().chain([*p]).collect())).collect()
    })
}

fn written(text: &str, factors: &[f64], shape: &[f64]) -> String {
    let mut out = text.to_owned();
    for (name, x) in ["{a}", "{b}", "{c}", "{d}"].iter().zip(factors).chain(["{s}", "{t}"].iter().zip(shape)) {
        out = out.replace(name, &number(*x, 3));
    }
    out.replace("+ −", "− ").replace("+ -", "− ")
}
