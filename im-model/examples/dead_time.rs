//! What dead time does to the current at low speed: a bridge that switches, with 4 µs of dead time, against one without, and against the
//! averaged effect `inverter_nonlinearity` that stands for it in the model. Prints current and mean speed, and draws one period:
//!
//!     cargo run --release -p im-model --example dead_time -- dead_time.svg

use im_chart::{Panel, Series, panels};
use im_model::simulation::{Bridge, CarrierPwm, Inverter, Scenario, Simulation, Source, Start, VoltsPerHertz};
use im_model::{Effects, Held, Machine, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::MOTULATOR_2_2_KW;
    let machine = Machine::base(m.parameters(), m.pole_pairs)?;
    let (frequency, period) = (5.0, 1e-4);
    let ideal = Bridge::ideal(560.0);
    let dead = Bridge { dead_time_s: 4e-6, ..ideal };
    let carrier = |bridge| Inverter::CarrierPwm(CarrierPwm { half_period_s: 0.5 * period }, bridge);
    // A leg loses U_dc·t_d/T_sw against its current: the averaged law with U_d of that size.
    let mut effects = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    effects.inverter_nonlinearity.voltage_v = dead.dc_voltage_v * dead.dead_time_s / period;
    let averaged = Inverter::Averaged { dc_voltage_v: Some(560.0) };
    let cases = [
        ("no dead time", machine, carrier(ideal)),
        ("switched, 4 µs", machine, carrier(dead)),
        ("averaged effect", machine.with_effects(effects)?, averaged),
    ];

    let supply = VoltsPerHertz {
        voltage_peak_v: m.rating.phase_voltage_peak_v,
        frequency_hz: m.rating.electrical_frequency_hz,
        boost_v: 12.0,
        ramp_hz_per_s: 1e3,
    };
    let mut series = Vec::new();
    for (name, machine, inverter) in cases {
        let scenario = Scenario {
            source: Source::VoltsPerHertz(supply, frequency.into()),
            inverter,
            sample_time_s: period,
            start: Start::SteadyState(Held::Load(0.0)),
            ..Scenario::direct_on_line(0.0, frequency, 2.0)
        };
        let run = Simulation::new(&machine, &scenario).run()?;
        let (r, last) = (&run.recording, run.recording.len() - 2000..run.recording.len());
        let rms = (r.i_s[last.clone()].iter().map(|i| i.norm_sqr()).sum::<f64>() / 4000.0).sqrt();
        let speed = r.omega_m[last.clone()].iter().sum::<f64>() / 2000.0;
        println!("{name:16} {rms:.2} A rms, {speed:.2} rad/s");
        series.push(Series::line(name, last.map(|k| (r.time_s(k), r.i_s[k].re))));
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, panels("5 Hz, no load", "time, s", &[Panel::new("current of phase a, A", series)]))?;
    }
    Ok(())
}
