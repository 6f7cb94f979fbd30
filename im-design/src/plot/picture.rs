//! One picture for each kind of design: what it covers and where it stands in it.

use super::{Series, chart, curves, pole_map, stability_map};
use crate::certificate::{Certificate, Design};
use crate::exact::Interval;
use crate::jadot::JadotDesign;
use crate::linalg;
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::mtpa::{AirGap, Aqdm, Circuit, CurrentLaw, MtpaDesign, SlipLaw, Witness};
use crate::sliding::UtkinRegion;
use crate::{kenne, model, thau_box};

/// The picture of a design, as SVG: poles over the region, the stability map, or the gain that the region asks for.
pub fn picture(certificate: &Certificate) -> String {
    let plant = certificate.plant;
    let c = plant.constants::<f64>();
    match &certificate.design {
        Design::Kubota(d) => pole_map(plant, d),
        Design::KubotaLoop(d) => {
            let cells: Vec<_> = d.cells.iter().map(|cell| [cell.speed_rad_s, cell.slip_rad_s]).collect();
            stability_map(plant, &d.gains, [d.speed_rad_s, d.slip_rad_s], d.flux_vs, &cells)
        }
        Design::SampledKubotaLoop(d) => {
            let cells: Vec<_> = d.cells.iter().map(|cell| [cell.speed_rad_s, cell.sampled_slip_rad_s]).collect();
            stability_map(plant, &d.gains, [d.speed_rad_s, d.slip_rad_s], d.flux_vs, &cells)
        }
        Design::Thau(d) => {
            let closed = &model::linear_part(&c) - &(&d.gain * &model::output());
            let open = model::linear_part(&c);
            poles("Poles of the linear part", vec![("A".into(), vec![open]), ("A - LC".into(), vec![closed])])
        }
        Design::ThauBox(d) => {
            let at = |v: &[f64; 6]| {
                let gain = &d.gain + &d.gain_per_frame_speed.scaled(&v[0]);
                &thau_box::jacobian(&c, v) - &(&gain * &model::output())
            };
            let vertices = d.region.vertices();
            let open = vertices.iter().map(|v| thau_box::jacobian(&c, v)).collect();
            let closed = vertices.iter().map(at).collect();
            let title = format!("Poles at the vertices of the box; proven rate {:.3} 1/s", d.rate_per_s);
            poles(&title, vec![("no gain".into(), open), ("with the gain".into(), closed)])
        }
        Design::Derdiyok(d) => {
            let need = |w: f64| d.flux_max_vs * c.eta.hypot(c.n_p * w);
            let top = d.speed_max_rad_s;
            needed("Smallest switching gain", "nu0, V", 1.3 * top, (top, d.nu0), &[("needed", &need)])
        }
        Design::Utkin(d) => {
            let at = |speed: f64, flux: f64| {
                smallest_omega0(&c, &UtkinRegion { speed_max_rad_s: speed, flux_min_vs: flux, ..d.region })
            };
            let top = d.region.speed_max_rad_s;
            let (less, same) = (|w: f64| at(w, 0.8 * d.region.flux_min_vs), |w: f64| at(w, d.region.flux_min_vs));
            let curves: [(&str, &dyn Fn(f64) -> f64); 2] = [("needed", &same), ("needed at 0.8 of the least flux", &less)];
            needed("Smallest switching amplitude", "omega0, mechanical rad/s", 1.3 * top, (top, d.omega0_rad_s), &curves)
        }
        Design::Kenne(d) => {
            let at = |speed: f64| kenne::needed(&c, &kenne::KenneRegion { speed_max_rad_s: speed, ..d.region });
            let top = d.region.speed_max_rad_s;
            let (q, k_d) = (|w: f64| at(w)[0], |w: f64| at(w)[1]);
            let curves: [(&str, &dyn Fn(f64) -> f64); 2] = [("k_sq of (25)", &q), ("k_sd of (26)", &k_d)];
            needed("Smallest switching voltages", "V", 1.3 * top, (top, d.k_sd.max(d.k_sq)), &curves)
        }
        Design::Jadot(d) => regulated(&c, d),
        Design::SampledJadot(d) => regulated(&c, &d.continuous),
        Design::SampledThauBox(d) => {
            let closed = d.region.vertices().iter().map(|v| d.step_matrix(&c, v)).collect();
            sampled_poles(d.period_s, d.contraction, closed)
        }
        Design::SampledThau(d) => {
            let closed = &model::linear_part(&c) - &(&d.gain * &model::output());
            let step = &Matrix::identity(5) + &closed.scaled(&d.period_s);
            sampled_poles(d.period_s, d.contraction, vec![step])
        }
        Design::SampledDerdiyok(d) => {
            let (nu0, reserve) = (d.continuous.nu0, d.continuous.reserve);
            let layer = |h: f64| h * c.beta * (2.0 * nu0 - reserve) / (1.0 - h * c.gamma);
            layers("A", d.period_s, &[("", d.boundary_layer_a, &layer)])
        }
        Design::SampledUtkin(d) => layers("A Wb", d.period_s, &[("", d.boundary_layer_avs, &|h| d.layer_at(&c, h))]),
        Design::SampledKenne(d) => {
            // Two units: each as a share of its own.
            let share = |k: usize, own: f64| move |h: f64| d.layers_at(&c, h)[k] / own;
            let (omega, lambda) = (share(0, d.boundary_omega), share(1, d.boundary_lambda));
            layers("share of this design's", d.period_s, &[("of s_omega", 1.0, &omega), ("of s_lambda", 1.0, &lambda)])
        }
        Design::Mtpa(d) => torque_curves(d),
        Design::Sampled(d) => {
            let closed = steps(d.speed_rad_s, 24).map(|speed| d.step_matrix(&c, speed)).collect();
            sampled_poles(d.period_s, d.contraction, closed)
        }
    }
}

/// A design's own layer with its name, and the smallest over the period.
type Layer<'a> = (&'a str, f64, &'a dyn Fn(f64) -> f64);

/// The smallest boundary layers over the period, and those of a design.
fn layers(unit: &str, period_s: f64, of: &[Layer<'_>]) -> String {
    let mut series = Vec::new();
    for (name, own, smallest) in of {
        series.extend(curves([0.0, 1.5e6 * period_s], &[(format!("needed {name}").trim(), &|us| smallest(1e-6 * us))]));
        let name = format!("this design {name}");
        series.push(Series::crosses(name.trim(), [(1e6 * period_s, *own)]));
    }
    chart("Smallest boundary layer", "sampling period, us", &format!("boundary layer, {unit}"), &series)
}

/// Poles of both loops of Jadot's controller over its region.
fn regulated(c: &Constants<f64>, d: &JadotDesign) -> String {
    let mut inner = Vec::new();
    for slip in steps(d.slip_rad_s, 4) {
        inner.extend(steps(d.electrical_speed_rad_s, 12).map(|speed| d.electrical(c, speed, slip)));
    }
    let outer = steps(d.slip_rad_s, 12).map(|slip| d.outer(c, slip)).collect();
    poles("Poles over speed and slip", vec![("electrical errors".into(), inner), ("speed, flux, reference".into(), outer)])
}

/// Laws and witnesses over torque, current and slip one below the other.
fn torque_curves(d: &MtpaDesign) -> String {
    let torques: Vec<f64> = steps(d.torque_n_m.map(f64::ln), 80).map(f64::exp).collect();
    let kwon = d.torque_n_m[1] > 100.0 && matches!(d.circuit, Circuit::Aqdm(c) if c == Aqdm::kwon_table_v());
    let chart_of = |k: usize, title: &str, y_label: &str, printed: &dyn Fn(f64) -> f64| {
        let line = |f: &dyn Fn(f64) -> f64| torques.iter().map(|t| (*t, f(*t))).collect::<Vec<_>>();
        let best = |w: &Witness| {
            let e = d.circuit.enclose(w.at.map(Interval::point));
            (w.torque_n_m, [e.current_rms_a, e.slip_rad_s][k].low)
        };
        let mut series = vec![
            Series::line("law", line(&|t| d.law.at(d.torque_n_m, t)[k])),
            Series::crosses("optimum", d.points.iter().map(best)),
        ];
        if kwon {
            // Where the printed law leaves the picture it would squeeze everything else.
            let most = 1.5 * series[0].points.iter().fold(0.0f64, |m, p| m.max(p.1));
            let points = line(printed).into_iter().filter(|p| p.1 < most);
            series.push(Series::line("as printed", points));
        }
        chart(title, "torque, N m", y_label, &series)
    };
    let current = chart_of(0, "Least current", "stator current, A rms", &|t| CurrentLaw::KWON.at(t));
    let slip = chart_of(1, "Slip of least current", "slip, electrical rad/s", &|t| SlipLaw::KWON.at(t));
    super::stacked(&current, &slip)
}

fn steps([low, high]: [f64; 2], n: u32) -> impl Iterator<Item = f64> {
    (0..=n).map(move |k| low + (high - low) * f64::from(k) / f64::from(n))
}

fn poles(title: &str, families: Vec<(String, Vec<Matrix<f64>>)>) -> String {
    let eigenvalues = |(name, matrices): (String, Vec<_>)| Series::crosses(name, matrices.iter().flat_map(linalg::eigenvalues));
    let series: Vec<_> = families.into_iter().map(eigenvalues).collect();
    chart(title, "real part, 1/s", "imaginary part, rad/s", &series)
}

/// Poles z of a sampled loop as those of a continuous one, ln(z)/h, with the line that the proven contraction draws.
fn sampled_poles(period_s: f64, contraction: f64, matrices: Vec<Matrix<f64>>) -> String {
    let rates = |(x, y): (f64, f64)| (x.hypot(y).ln() / period_s, y.atan2(x) / period_s);
    let poles: Vec<_> = matrices.iter().flat_map(linalg::eigenvalues).map(rates).filter(|(x, _)| x.is_finite()).collect();
    let top = poles.iter().fold(1.0f64, |m, (_, y)| m.max(y.abs()));
    let proven = contraction.ln() / period_s;
    let series = [
        Series::line(format!("proven: {:.3} 1/s", -proven), [(proven, -top), (proven, top)]),
        Series::crosses("ln(z)/h of the poles", poles),
    ];
    chart(&format!("Poles, sampled every {:.1} us", 1e6 * period_s), "real part, 1/s", "imaginary part, rad/s", &series)
}

/// Curves of what is needed over the speed covered, with the design as a cross.
fn needed(title: &str, y_label: &str, top: f64, design: (f64, f64), curves_of: &[(&str, &dyn Fn(f64) -> f64)]) -> String {
    let mut series = curves([0.0, top], curves_of);
    series.push(Series::crosses("this design", [design]));
    chart(title, "largest mechanical speed, rad/s", y_label, &series)
}

/// ω₀ that a region asks for; NaN where none is enough.
fn smallest_omega0(c: &Constants<f64>, region: &UtkinRegion) -> f64 {
    crate::sliding::utkin_bound(c, region).map_or(f64::NAN, |b| b.0)
}
