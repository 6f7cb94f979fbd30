use im_diagnose::noise::white_sigma;
use im_identify::offline::*;
use im_model::space_vector::from_phases;
use im_model::{Complex, EffectId, Effects, Held, Machine, ParameterId, Rating, State, TParameters, steady_state};
use std::f64::consts::{PI, TAU};

fn read(name: &str) -> Vec<Vec<f64>> {
    let t = std::fs::read_to_string(format!("/work/shared/recordings/measured/direct_on_line_4kw/{name}.csv")).unwrap();
    let rows: Vec<Vec<f64>> = t.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    (0..rows[0].len()).map(|c| rows.iter().map(|r| r[c]).collect()).collect()
}
fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}
fn zero(x: &[f64]) -> Vec<f64> {
    let m = mean(x);
    x.iter().map(|v| v - m).collect()
}
fn minus(x: &[f64], m: f64) -> Vec<f64> {
    x.iter().map(|v| v - m).collect()
}
fn voltage(a: &[f64], b: &[f64], c: &[f64]) -> Vec<Complex<f64>> {
    let s: Vec<Complex<f64>> = (0..a.len()).map(|k| from_phases([a[k], b[k], c[k]])).collect();
    (0..s.len()).map(|k| (s[k] + s[(k + 1).min(s.len() - 1)]) * 0.5).collect()
}
fn channel(name: &str, phase: f64, v: Vec<f64>, valid: Option<Vec<bool>>) -> Channel {
    Channel {
        name: name.into(),
        kind: ChannelKind::Current { direction_rad: phase * TAU / 3.0 },
        sigma: 0.1f64.max(0.0 * white_sigma(&v)),
        values: v,
        valid,
    }
}
fn phasor(u: &[Complex<f64>], f: f64, ts: f64) -> Complex<f64> {
    u.iter().enumerate().map(|(k, u)| u * Complex::from_polar(1.0, -TAU * f * ts * k as f64)).sum::<Complex<f64>>()
        / u.len() as f64
}
fn main() {
    let ts = 2e-4;
    let l = read("Test_2_IM_Locked_Rotor");
    let n = read("Test_3_IM_No_Load");
    let d = read("Test_4_IM_Direct_Start");
    // base machine
    let (rs, f) = (1.267, 50.0);
    let w = TAU * f;
    let (x_lr, r_lr, x_nl) = (5.04, 2.397, 42.95);
    let ll = x_lr / 2.0 / w;
    let lm = x_nl / w - ll;
    let rr = (r_lr - rs) * ((x_nl / w) / lm).powi(2);
    let p = TParameters {
        stator_resistance_ohm: rs,
        rotor_resistance_ohm: rr,
        stator_leakage_inductance_h: ll,
        rotor_leakage_inductance_h: ll,
        magnetizing_inductance_h: lm,
        inertia_kg_m2: 0.054,
        viscous_friction_nm_s_per_rad: 0.004,
    };
    let rating = Rating { torque_nm: 26.0, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 325.0, rotor_flux_vs: 0.95 };
    let mut e = Effects::scaled(&rating, &p, 2);
    e.iron_loss.diffusion_time_s = 1e-4;
    let base = Machine::try_new(p, 2, e).unwrap();
    println!("{p:?}");
    let rows = 1500;
    let exp = |name: &str, u: Vec<Complex<f64>>, tau: Vec<f64>, ch: Vec<Channel>, start| Experiment {
        name: name.into(),
        sample_time_s: ts,
        u_s: u,
        tau_load: tau,
        imposed_speed: None,
        speed_pull: None,
        channels: ch,
        start,
    };
    let (uz, iz) = (
        |c: &Vec<Vec<f64>>| voltage(&zero(&c[1]), &zero(&c[2]), &zero(&c[3])),
        |c: &Vec<Vec<f64>>| [zero(&c[4]), zero(&c[5]), zero(&c[6])],
    );
    let start = |u: &[Complex<f64>], held| {
        let ph = phasor(u, f, ts);
        let x = steady_state(&base, ph.norm(), f, held).unwrap();
        // mean of the interval lies half a sample late
        let turn = Complex::from_polar(1.0, ph.arg() - PI * f * ts);
        State { psi_s: x.psi_s * turn, psi_r: x.psi_r * turn, ..x }
    };
    let cut = |v: &[f64]| v[..rows].to_vec();
    let u = uz(&l);
    let i = iz(&l);
    let st = start(&u, Held::Speed(0.0));
    let names = ["i_a_A", "i_b_A", "i_c_A"];
    let mut lr = exp(
        "locked",
        u[..rows].to_vec(),
        vec![0.0; rows],
        (0..3).map(|k| channel(names[k], k as f64, cut(&i[k]), None)).collect(),
        Start::State(st),
    );
    lr.imposed_speed = Some(vec![0.0; rows]);
    let u = uz(&n);
    let i = iz(&n);
    let t0_nl = 0.8;
    let st = start(&u, Held::Load(t0_nl));
    println!("nl speed {}", st.omega_m);
    let nl = exp(
        "noload",
        u[..rows].to_vec(),
        vec![t0_nl; rows],
        (0..3).map(|k| channel(names[k], k as f64, cut(&i[k]), None)).collect(),
        Start::State(st),
    );
    // direct start
    let k0: usize = std::env::var("K0").map_or(182, |s| s.parse().unwrap());
    let k1: usize = std::env::var("K1").map_or(8000, |s| s.parse().unwrap());
    let pre = |c: &Vec<f64>| mean(&c[..170]);
    let col = |c: usize| minus(&d[c], pre(&d[c]));
    let u = voltage(&col(1), &col(2), &col(3));
    let (i1, i2, i3, i6) = (col(4), col(5), col(6), col(11));
    let kt: f64 = std::env::var("KT").map_or(0.875, |s| s.parse().unwrap());
    let t0: f64 = std::env::var("T0").map_or(1.0, |s| s.parse().unwrap());
    let speed: Vec<f64> = col(10).iter().map(|v| v * 156.6 / 155.5).collect();
    let tau: Vec<f64> = (0..d[0].len())
        .map(|k| {
            let a = k.saturating_sub(10);
            let b = (k + 10).min(d[0].len());
            let m = |c: usize| mean(&d[c][a..b]);
            let wr = (speed[a..b].iter().sum::<f64>() / (b - a) as f64 / 5.0).clamp(0.0, 1.0);
            -kt * 1.485 * (m(8) + 0.11) + t0 * wr
        })
        .collect();
    // mask: blame those that went beyond 55 A since the sum was small
    let mut ok = [vec![true; i1.len()], vec![true; i1.len()]];
    let mut blamed = [false, false];
    for k in 0..i1.len() {
        let s = i1[k] + i2[k] + i6[k];
        if i1[k].abs() > 50.0 {
            blamed[0] = true;
        }
        if i2[k].abs() > 50.0 {
            blamed[1] = true;
        }
        if s.abs() < 1.5 && i1[k].abs() < 50.0 && i2[k].abs() < 50.0 {
            blamed = [false; 2];
        }
        for c in 0..2 {
            ok[c][k] = !blamed[c];
        }
    }
    println!("masked {} {}", ok[0].iter().filter(|x| !**x).count(), ok[1].iter().filter(|x| !**x).count());
    if std::env::var("DUMP").is_ok() {
        for k in 180..1000 {
            println!(
                "{:.4} {:7.2} {:7.2} {:7.2} {:7.2} sum {:7.2} {} {}",
                d[0][k],
                i1[k],
                i2[k],
                i3[k],
                i6[k],
                i1[k] + i2[k] + i6[k],
                ok[0][k],
                ok[1][k]
            );
        }
    }
    let sl = |v: &[f64]| v[k0..k1].to_vec();
    let bl = |v: &[bool]| Some(v[k0..k1].to_vec());
    let mut ch = vec![
        channel("i_a_A", 0.0, sl(&i1), bl(&ok[0])),
        channel("i_b_A", 1.0, sl(&i2), bl(&ok[1])),
        channel("i_c_A", 2.0, sl(&i6), None),
    ];
    let ssig: f64 = std::env::var("SS").map_or(1.0, |s| s.parse().unwrap());
    ch.push(Channel { name: "omega_m_rad_s".into(), kind: ChannelKind::Speed, values: sl(&speed), valid: None, sigma: ssig });
    let i0 = from_phases([i1[k0], -i1[k0] - i6[k0], i6[k0]]);
    let x0 = State { psi_s: i0 * (2.0 * ll), ..State::default() };
    let dol = exp("start", u[k0..k1].to_vec(), tau[k0..k1].to_vec(), ch, Start::State(x0));
    let wi: f64 = std::env::var("WI").map_or(0.3, |s| s.parse().unwrap());
    let mut all = vec![lr, nl, dol];
    for e in &mut all[..2] {
        for c in &mut e.channels {
            c.sigma = wi;
        }
    }
    for c in &mut all[2].channels[..3] {
        c.sigma = 1.0;
    }
    let report = |name: &str, m: &Machine<f64>, starts: &[State<f64>]| {
        let mut s = format!("{name:<60}");
        for (e, x) in all.iter().zip(starts) {
            let y = predict(m, e, x);
            let end = if e.name == "start" { 1000 - k0 } else { e.len() };
            let mut sum = 0.0;
            let mut cnt = 0.0;
            for (c, y) in e.channels.iter().zip(&y) {
                if c.kind != ChannelKind::Speed {
                    for k in 0..end {
                        if c.is_valid(k) {
                            sum += (c.values[k] - y[k]).powi(2);
                            cnt += 1.0;
                        }
                    }
                }
            }
            s += &format!(" {}: {:.3}", e.name, (sum / cnt as f64).sqrt());
            if e.name == "start" {
                let mut sum = 0.0;
                let mut cnt = 0.0;
                let mut sp = 0.0;
                for (c, y) in e.channels.iter().zip(&y) {
                    for k in end..e.len() {
                        if c.kind != ChannelKind::Speed {
                            if c.is_valid(k) {
                                sum += (c.values[k] - y[k]).powi(2);
                                cnt += 1.0;
                            }
                        } else {
                            sp += (c.values[k] - y[k]).powi(2);
                        }
                    }
                }
                s += &format!(" later {:.3} speed {:.3}", (sum / cnt as f64).sqrt(), (sp / (e.len() - end) as f64).sqrt());
            }
        }
        println!("{s}");
    };
    let starts: Vec<State<f64>> = all.iter().map(|e| e.start.state()).collect();
    report("given", &base, &starts);
    // base from LR + NL
    let initial = |k: usize, speed: bool| initial_state(k, 0.95, 150.0).into_iter().take(if speed { 5 } else { 4 });
    let mut free = base_parameters();
    free.truncate(4);
    free.extend(initial(0, false));
    free.extend(initial(1, true));
    let fb = fit(&base, &all[..2], &free, &FitOptions::near()).unwrap();
    let mut st = fb.starts.clone();
    st.push(starts[2]);
    report("base from LR+NL", &fb.machine, &st);
    for (k, e) in all.iter_mut().enumerate().take(2) {
        e.start = Start::State(st[k]);
    }
    let all = all;
    let report = |name: &str, m: &Machine<f64>, starts: &[State<f64>]| {
        let mut s = format!("{name:<60}");
        for (e, x) in all.iter().zip(starts) {
            let y = predict(m, e, x);
            let end = if e.name == "start" { 1000 - k0 } else { e.len() };
            let mut sum = 0.0;
            let mut cnt = 0.0;
            for (c, y) in e.channels.iter().zip(&y) {
                if c.kind != ChannelKind::Speed {
                    for k in 0..end {
                        if c.is_valid(k) {
                            sum += (c.values[k] - y[k]).powi(2);
                            cnt += 1.0;
                        }
                    }
                }
            }
            s += &format!(" {}: {:.3}", e.name, (sum / cnt as f64).sqrt());
            if e.name == "start" {
                let mut sum = 0.0;
                let mut cnt = 0.0;
                let mut sp = 0.0;
                for (c, y) in e.channels.iter().zip(&y) {
                    for k in end..e.len() {
                        if c.kind != ChannelKind::Speed {
                            if c.is_valid(k) {
                                sum += (c.values[k] - y[k]).powi(2);
                                cnt += 1.0;
                            }
                        } else {
                            sp += (c.values[k] - y[k]).powi(2);
                        }
                    }
                }
                s += &format!(" later {:.3} speed {:.3}", (sum / cnt as f64).sqrt(), (sp / (e.len() - end) as f64).sqrt());
            }
        }
        println!("{s}");
    };
    use EffectId::*;
    let sets: Vec<Vec<EffectId>> = vec![
        vec![],
        vec![LeakageFluxSaturation],
        vec![RotorSkinEffect],
        vec![MainFluxSaturation],
        vec![LeakageFluxSaturation, RotorSkinEffect],
        vec![LeakageFluxSaturation, MainFluxSaturation],
        vec![LeakageFluxSaturation, SpeedSensorLag],
        vec![LeakageFluxSaturation, RotorSkinEffect, MainFluxSaturation],
        vec![LeakageFluxSaturation, RotorSkinEffect, MainFluxSaturation, IronLoss, SpeedSensorLag],
    ];
    for set in sets {
        let mut m = fb.machine;
        for &s in &set {
            for (k, info) in s.parameters().iter().enumerate() {
                if info.role == im_model::effects::Role::Strength {
                    m = m
                        .with(&[(
                            ParameterId::Effect(s, k),
                            (info.typical.0 * info.typical.1).sqrt() * rating.unit_of(info.scale, m.parameters(), 2),
                        )])
                        .unwrap();
                }
            }
        }
        let mut free = base_parameters();
        for &s in &set {
            free.extend(effect_parameters(s, &m, &rating));
        }
        free.extend(initial(0, false));
        free.extend(initial(1, true));
        free.extend(initial(2, false));
        let t = std::time::Instant::now();
        match fit(&m, &all, &free, &FitOptions { iterations: 40, tolerance: 1e-5, horizons: vec![] }) {
            Ok(f) => {
                report(
                    &format!("{set:?} {:.0} it {} {:.1}s", f.cost, f.iterations, t.elapsed().as_secs_f64()),
                    &f.machine,
                    &f.starts,
                );
                let v = f.values();
                println!(
                    "     {}",
                    f.free
                        .iter()
                        .zip(&v)
                        .filter(|(f, _)| f.id().is_some())
                        .map(|(f, v)| format!("{}={v:.4}", f.name()))
                        .collect::<Vec<_>>()
                        .join(" ")
                );
                if set.is_empty() {
                    continue;
                }
            }
            Err(e) => println!("{set:?} {e}"),
        }
    }
}
