//! The speed that voltages and currents ask for: an extended Kalman filter finds it roughly, linear smoothing on the machine's own run refines it.

use im_model::{Complex, Machine, Plant, Rating, State};

use super::flux::{Electrical, Fluxes};
use super::inputs::SEEN;
use super::wandering::{Onward, Wandering};
use super::{Filter, FoundSpeed, MACHINE, Matrix, Of, SLOPE, SPEED, Unknown, UnsureInputs, Vector, unknown_speed};
use crate::offline::channel::ChannelKind;
use crate::offline::experiment::{Experiment, Start};
use crate::offline::load::Load;

/// How far the voltage of the rough search may be off, and the currents, over their root mean square: the machine is not known yet.
const MODEL_ERROR: f64 = 0.03;

/// Rounds of smoothing at most, and the change, in standard deviations, that ends them.
const ROUNDS: usize = 8;
const SETTLED: f64 = 0.3;

/// What a speed leaves of the currents, χ²/N, from which on it may be lost; a search more is all that it costs.
const LOST: f64 = 2.0;

/// Times four that the torque may be found to wander more, or less, and the machine to be off, in one round.
const WIDER: usize = 4;

/// Before the data: the torque wanders by the rated one in a twentieth of a second.
const STEPS_PER_S: f64 = 20.0;

impl Experiment {
    /// The same run with neither speed nor load known: the speed that voltages and currents ask for drives `machine`. What a speed sensor
    /// shows is left out.
    pub fn with_unmeasured_speed(mut self, machine: &Machine<f64>, rating: &Rating) -> Self {
        if self.is_table() || self.imposed_speed.is_some() {
            return self;
        }
        self.channels.retain(|c| c.kind != ChannelKind::Speed);
        let torque = rating.torque_nm / machine.parameters().inertia_kg_m2;
        first(self, machine, torque * torque * STEPS_PER_S)
    }

    /// The same run with its unmeasured speed as `machine` asks for it, or with what the noise of a measured speed does to the currents of `machine`
    /// taken for noise. Nothing changes where the load is known.
    pub fn with_speed_found_by(mut self, machine: &Machine<f64>, start: &State<f64>) -> Self {
        match &self.load {
            Load::Unseen(_) => found_anew(self, machine, start),
            Load::Unknown(shown) => {
                let mut shown = shown.clone();
                shown.unsure = on_its_speed(&self, machine, start).map(|run| {
                    let plant = Plant::new(machine);
                    let omega_m = (0..self.len()).map(|k| shown.behind(&plant, k));
                    let electrical = Electrical::of(&self.machine_of(machine, 0));
                    let speed = (omega_m, run.psi);
                    let unknown = Unknown::of_speed(shown.noise.clone());
                    UnsureInputs::new(&self.channels, electrical, speed, self.sample_time_s, unknown)
                });
                self.load = Load::Unknown(shown);
                self
            }
            _ => self,
        }
    }
}

/// Means with their covariances before and after a row.
struct Track {
    before: Vec<(Vector, Matrix)>,
    after: Vec<(Vector, Matrix)>,
    steps: Vec<Matrix>,
}

impl Track {
    /// Rauch, Tung and Striebel: means and variances after all rows.
    fn smoothed(&self, mut keep: impl FnMut(usize, &Vector, &Matrix)) {
        let n = self.after.len();
        let mut later: Option<(Vector, Matrix)> = None;
        for k in (0..n).rev() {
            let (x, p) = &self.after[k];
            let now = match &later {
                None => (*x, *p),
                Some((x_later, p_later)) => {
                    let (x_before, p_before) = &self.before[k + 1];
                    let to = p * self.steps[k].transpose();
                    match p_before.cholesky().or_else(|| (p_before + Matrix::identity() * (1e-12 * p_before.trace())).cholesky())
                    {
                        None => (*x, *p),
                        Some(c) => {
                            let g = c.solve(&to.transpose()).transpose();
                            (x + g * (x_later - x_before), p + g * (p_later - p_before) * g.transpose())
                        }
                    }
                }
            };
            keep(k, &now.0, &now.1);
            later = Some(now);
        }
    }
}

/// The first speed of a run, and the state it begins in where that is not known.
fn first(mut e: Experiment, machine: &Machine<f64>, intensity: f64) -> Experiment {
    let (found, begin) = searched(&e, machine, intensity);
    if let Start::Estimated(_) = e.start {
        e.start = Start::Estimated(begin);
    }
    e.load = Load::Unseen(found);
    let start = e.start_state();
    refined(e, machine, &start).0
}

/// A speed and a state to begin in by the rough search.
fn searched(e: &Experiment, machine: &Machine<f64>, intensity: f64) -> (FoundSpeed, State<f64>) {
    let electrical = Electrical::of(&e.machine_of(machine, 0));
    let n = e.len();
    let (track, psi_run) = rough(e, &electrical, intensity);
    let mut omega_m = vec![0.0; n];
    let mut fluxes = Vector::zeros();
    track.smoothed(|k, x, _| {
        omega_m[k] = x[SPEED];
        fluxes = *x;
    });
    let psi = |k: usize| Complex::new(fluxes[k], fluxes[k + 1]);
    let begin = State { psi_s: psi(0), psi_r: psi(2), ..State::turning(omega_m[0]) };
    let speed = (omega_m.iter().copied(), psi_run);
    let unknown = Unknown::of_speed(Wandering::free(intensity, e.sample_time_s, n));
    let wrong = Unknown { fluxes: wrong_fluxes(e), ..unknown.clone() };
    let unsure = UnsureInputs::new(&e.channels, electrical, speed, e.sample_time_s, unknown);
    (FoundSpeed { std: vec![0.0; n], omega_m, before: intensity, wrong, unsure }, begin)
}

/// The speed smoothed on the run of `machine` from where it is. Where that leaves more than noise, another machine's speed may have lost the
/// rotor: a new search then begins, too, and the currents choose.
fn found_anew(e: Experiment, machine: &Machine<f64>, start: &State<f64>) -> Experiment {
    let (on, cost) = refined(e, machine, start);
    let Load::Unseen(found) = &on.load else { return on };
    if cost.chi2 < LOST * on.count() as f64 {
        return on;
    }
    let load = Load::Unseen(searched(&on, machine, found.before).0);
    let (anew, cost_anew) = refined(Experiment { load, ..on.clone() }, machine, start);
    if cost_anew.run < cost.run { anew } else { on }
}

/// Root mean square over the rows of `e`, of these squares.
fn rms(e: &Experiment, squares: impl Iterator<Item = f64>) -> f64 {
    (squares.sum::<f64>() / e.len().max(1) as f64).sqrt()
}

fn voltage(e: &Experiment) -> f64 {
    rms(e, e.u_s.iter().map(|u| u.norm_sqr()))
}

/// Variance that each row adds to each flux of a machine that is not known yet, (Vs)².
fn wrong_fluxes(e: &Experiment) -> f64 {
    (MODEL_ERROR * voltage(e) * e.sample_time_s).powi(2)
}

/// Variance that each row may add to the fluxes before it is seen in the currents, (Vs)².
fn seen_fluxes(e: &Experiment, electrical: &Electrical) -> f64 {
    let t = e.sample_time_s;
    let by_one = electrical.noise_by(1.0 / t, t);
    let currents = e.channels.iter().filter(|c| matches!(c.kind, ChannelKind::Current { .. }));
    currents.map(|c| SEEN * c.sigma.powi(2) / by_one).fold(f64::INFINITY, f64::min)
}

/// Extended Kalman filter of fluxes and speed on the linear circuit, whose fluxes are corrected, too.
fn rough(e: &Experiment, electrical: &Electrical, intensity: f64) -> (Track, Vec<Fluxes>) {
    let n = e.len();
    let t = e.sample_time_s;
    let wandering = wrong_fluxes(e);
    let currents = e.channels.iter().filter(|c| matches!(c.kind, ChannelKind::Current { .. }));
    let noise: Vec<(Vector, f64)> =
        currents.map(|c| (electrical.shown_by(c), c.sigma.max(MODEL_ERROR * rms(e, c.values.iter().map(|i| i * i))))).collect();
    let moving = matches!(e.start, Start::Estimated(_));
    let free = Onward::free(intensity, t);
    let mut p = unknown_speed(&Wandering::free(intensity, t, 0).first);
    let mut x = Vector::zeros();
    if moving {
        x[SPEED] = field_speed(e) / electrical.pole_pairs();
        let flux = (voltage(e) / (electrical.pole_pairs() * x[SPEED].abs()).max(1.0)).max(1e-3);
        (0..4).for_each(|k| p[(k, k)] = flux * flux);
    } else {
        // At rest, to what a machine of any size runs up to in a tenth of a second.
        p[(SPEED, SPEED)] = 1.0;
    }
    let (mut before, mut after, mut steps) = (Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n));
    let mut psi = Vec::with_capacity(n);
    for k in 0..n {
        before.push((x, p));
        for (c, (h, sigma)) in e.channels.iter().filter(|c| matches!(c.kind, ChannelKind::Current { .. })).zip(&noise) {
            if c.is_valid(k) {
                let ph = p * h;
                let variance = h.dot(&ph) + sigma * sigma;
                x += ph * ((c.values[k] - h.dot(&x)) / variance);
                p -= ph * ph.transpose() / variance;
            }
        }
        after.push((x, p));
        let fluxes: Fluxes = [Complex::new(x[0], x[1]), Complex::new(x[2], x[3])];
        psi.push(fluxes);
        let step = electrical.step(x[SPEED], fluxes, t, free, false);
        let [s, r] = electrical.driven(fluxes, x[SPEED] + 0.5 * t * x[SLOPE], e.u_s[k], t);
        let omega = x[SPEED] + t * x[SLOPE];
        x = Vector::from([s.re, s.im, r.re, r.im, omega, x[SLOPE]]);
        steps.push(step.matrix(&[]));
        p = step.carried(&p, 0.0, &[]);
        (0..4).for_each(|k| p[(k, k)] += wandering);
    }
    (Track { before, after, steps }, psi)
}

/// Angular frequency at which the currents turn in the first rows, rad/s.
fn field_speed(e: &Experiment) -> f64 {
    let rows = ((0.04 / e.sample_time_s) as usize).clamp(4, e.len());
    let i: Vec<Complex<f64>> = (0..rows).filter_map(|k| e.current_vector(k, |c| e.channels[c].values[k])).collect();
    let turned: Complex<f64> = i.windows(2).map(|w| w[1] * w[0].conj()).sum();
    turned.arg() / e.sample_time_s
}

/// Smooths the speed on the run of `machine` itself until it settles.
fn refined(mut e: Experiment, machine: &Machine<f64>, start: &State<f64>) -> (Experiment, Cost) {
    let mut best: Option<Round> = None;
    for _ in 0..ROUNDS {
        let Load::Unseen(found) = &e.load else { break };
        let Some(round) = Round::on(&e, found, machine, start) else { break };
        let better = best.as_ref().is_none_or(|best| round.run.chi2 < best.run.chi2);
        let settled = round.change.iter().zip(&round.found.std).all(|(d, s)| d.abs() < SETTLED * s);
        if settled || !better {
            if better {
                best = Some(round);
            }
            break;
        }
        e.load = Load::Unseen(round.moved());
        best = Some(round);
    }
    let Some(best) = best else { return (e, Cost { run: f64::INFINITY, chi2: f64::INFINITY }) };
    let (found, cost) = best.judged(&e, machine);
    e.load = Load::Unseen(found);
    (e, cost)
}

/// What a speed costs.
struct Cost {
    /// Σ r² of what the machine leaves when it is driven by it: what is linear in a change of speed is no measure of a large one.
    run: f64,
    /// Σ ε² of the innovations.
    chi2: f64,
}

/// A run on the speed that drives it.
struct Run {
    /// Per channel and row, in σ.
    residuals: Vec<Vec<f64>>,
    /// The sum of their squares.
    chi2: f64,
    /// Fluxes, a pair per row.
    psi: Vec<Fluxes>,
}

/// A run of `machine`; nothing where it runs away.
fn on_its_speed(e: &Experiment, machine: &Machine<f64>, start: &State<f64>) -> Option<Run> {
    let n = e.len();
    let mut residuals = vec![vec![0.0; n]; e.channels.len()];
    let mut psi = Vec::with_capacity(n);
    let mut bench = e.bench(machine, start);
    for k in 0..n {
        let i = bench.output().i_s;
        let x = bench.state();
        psi.push([x.psi_s, x.psi_r]);
        for (c, r) in e.channels.iter().zip(&mut residuals) {
            if let (true, ChannelKind::Current { direction_rad }) = (c.is_valid(k), c.kind) {
                r[k] = (c.values[k] - i.re * direction_rad.cos() - i.im * direction_rad.sin()) / c.sigma;
            }
        }
        let input = e.input(k, bench.plant());
        bench.advance(&input);
    }
    let chi2 = residuals.iter().flatten().map(|r| r * r).sum::<f64>();
    chi2.is_finite().then_some(Run { residuals, chi2, psi })
}

/// A round of smoothing.
struct Round {
    /// The speed as it was, and what is not known of it.
    found: FoundSpeed,
    run: Run,
    /// How much the speed should change, rad/s.
    change: Vec<f64>,
}

impl Round {
    /// On the speed that was found so far, which wanders as much as is likeliest, as does the machine.
    fn on(e: &Experiment, found: &FoundSpeed, machine: &Machine<f64>, start: &State<f64>) -> Option<Self> {
        let run = on_its_speed(e, machine, start)?;
        let electrical = Electrical::of(&e.machine_of(machine, 0));
        let with = |unknown: Unknown| Smoothing::of(e, &found.omega_m, &run, electrical, unknown);
        let seen = seen_fluxes(e, &electrical);
        let mut smoothing = with(found.wrong.clone());
        smoothing.likelier(with, |u, by| Unknown { fluxes: times(by * by, u.fluxes, seen), ..u.clone() });
        smoothing.likelier(with, |u, by| Unknown { speed: u.speed.scaled(by), ..u.clone() });
        smoothing.deviance.is_finite().then(|| smoothing.round(found, run))
    }

    /// The speed with the change.
    fn moved(&self) -> FoundSpeed {
        let mut moved = self.found.clone();
        moved.omega_m.iter_mut().zip(&self.change).for_each(|(w, d)| *w += d);
        moved
    }

    /// The speed as it was, beside which the machine is judged as if it were right.
    fn judged(self, e: &Experiment, machine: &Machine<f64>) -> (FoundSpeed, Cost) {
        let Self { mut found, run, .. } = self;
        let electrical = Electrical::of(&e.machine_of(machine, 0));
        let unknown = Unknown { fluxes: 0.0, ..found.wrong.clone() };
        let speed = (found.omega_m.iter().copied(), run.psi);
        found.unsure = UnsureInputs::new(&e.channels, electrical, speed, e.sample_time_s, unknown);
        let mut left = run.residuals;
        found.unsure.whiten(&mut left, &e.channels, Of::Residuals);
        let chi2 = left.iter().flatten().map(|r| r * r).sum();
        (found, Cost { run: run.chi2, chi2 })
    }
}

/// So many times a variance of fluxes, which is none below what is `seen`.
fn times(by: f64, variance: f64, seen: f64) -> f64 {
    let changed = by * variance;
    match changed < seen {
        false => changed,
        true if by > 1.0 => seen,
        true => 0.0,
    }
}

/// A filter over what a run leaves.
struct Smoothing {
    before: Vec<(Vector, Matrix)>,
    after: Vec<(Vector, Matrix)>,
    filter: Filter<MACHINE>,
    unknown: Unknown,
    /// −2 log L = Σ (ε² + ln S), of innovations ε in their standard deviations and their variances S.
    deviance: f64,
}

impl Smoothing {
    fn of(e: &Experiment, omega_m: &[f64], run: &Run, electrical: Electrical, mut unknown: Unknown) -> Self {
        let (n, t) = (e.len(), e.sample_time_s);
        let (mut before, mut after) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let keep = |b: &Matrix, a: &Matrix| {
            before.push((Vector::zeros(), *b));
            after.push((Vector::zeros(), *a));
        };
        let steps = electrical.steps(omega_m, &run.psi, t, &unknown);
        let filter = Filter::new(&e.channels, &electrical, steps, &unknown, keep);
        // Innovations are linear in what the torque does.
        let innovations = |mut left: Vec<Vec<f64>>, bends: &[f64]| {
            filter.run(&mut left, &e.channels, bends, |_| ());
            left.concat()
        };
        let without = innovations(run.residuals.clone(), &electrical.bends(omega_m, &run.psi, t, 0.0));
        let pushes: Vec<f64> = electrical.pushes(&run.psi).collect();
        let by = innovations(vec![vec![0.0; n]; e.channels.len()], &pushes);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let push = (-dot(&without, &by) / dot(&by, &by).max(f64::MIN_POSITIVE)).max(0.0);
        unknown.speed.push = Some(push);
        let bends = electrical.bends(omega_m, &run.psi, t, push);
        let mut left = run.residuals.clone();
        let mut k = 0;
        filter.run(&mut left, &e.channels, &bends, |x| {
            after[k].0 = *x;
            if k + 1 < n {
                let next = &mut before[k + 1].0;
                *next = filter.steps[k].next(x, &[]);
                next[SLOPE] += bends.get(k).copied().unwrap_or(0.0);
            }
            k += 1;
        });
        let chi2: f64 = left.iter().flatten().map(|r| r * r).sum();
        let ln_s: f64 = filter.gains.iter().flatten().flatten().map(|(_, deviation)| 2.0 * deviation.ln()).sum();
        Self { before, after, filter, unknown, deviance: chi2 + ln_s }
    }

    /// The likeliest of what comes `with` other sizes, which `scaled` makes in factors of four up or down from these.
    fn likelier(&mut self, with: impl Fn(Unknown) -> Self, scaled: impl Fn(&Unknown, f64) -> Unknown) {
        for by in [4.0, 0.25] {
            let mut found = false;
            for _ in 0..WIDER {
                let unknown = scaled(&self.unknown, by);
                if unknown == self.unknown {
                    break;
                }
                let next = with(unknown);
                if next.deviance.is_nan() || next.deviance >= self.deviance {
                    break;
                }
                *self = next;
                found = true;
            }
            if found {
                break;
            }
        }
    }

    fn round(self, found: &FoundSpeed, run: Run) -> Round {
        let Self { before, after, filter, unknown, .. } = self;
        let n = found.omega_m.len();
        let (mut change, mut std) = (vec![0.0; n], vec![0.0; n]);
        let steps = filter.steps.iter().map(|s| s.matrix(&[])).collect();
        Track { before, after, steps }.smoothed(|k, x, p| {
            change[k] = x[SPEED];
            std[k] = p[(SPEED, SPEED)].max(0.0).sqrt();
        });
        let found = FoundSpeed { std, wrong: unknown, ..found.clone() };
        Round { found, run, change }
    }
}
