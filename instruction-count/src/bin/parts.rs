//! Observers, controllers and modulation alone.

#![no_std]
#![no_main]

use core::hint::black_box;

use im_control::modulation::{ZeroSequence, duty_cycles};
use im_control::{DirectTorque, DirectTorqueGains, VoltsPerHertz, VoltsPerHertzGains};
use im_model::Machine;
use im_observers::{Basis, Input, Named, Observer, StartingGains, Visit, each};
use instruction_count::{
    M, SYST, Samples, T, around, controlled, count_drive, counted, data, field_oriented, hprintln, machine, no_samples, program,
    recorded,
};

struct Observers<'a> {
    timer: &'a mut SYST,
    samples: &'a Samples,
    machine: Machine<f64>,
    around: f32,
}

impl Visit<f32> for Observers<'_> {
    fn visit<O: Named<f32> + 'static>(&mut self) {
        let made = Basis::try_new(&self.machine, &M.rating, T)
            .ok()
            .and_then(|b| O::made(b, &self.machine, &M.rating, &StartingGains).ok());
        let Some(observer) = made else { return hprintln!("observer {}: not made", O::NAME) };
        let n = observed(self.timer, self.samples, &observer) - self.around;
        hprintln!("observer {} {:.0}", O::NAME, n);
    }
}

#[inline(never)]
fn observed<O: Observer<f32>>(timer: &mut SYST, samples: &Samples, observer: &O) -> f32 {
    let mut state = O::State::default();
    counted(timer, samples, |m| {
        black_box(observer.step(&mut state, &Input::new(m.u_s, m.i_s).with_speed(m.omega_m)));
    })
}

fn parts(timer: &mut SYST) -> Option<()> {
    let machine = machine()?;
    count_drive(timer, "controller field_oriented", field_oriented(&machine))?;
    let (data, flux) = (data(&machine), M.rating.rotor_flux_vs as f32);
    let mut samples = no_samples();
    let around = around(timer, &samples);
    let mut vhz = VoltsPerHertz::try_new(&data, &VoltsPerHertzGains::typical(&data, flux), T as f32).ok()?;
    let (mut vhz, _) = recorded(&machine, &mut vhz, &mut samples);
    hprintln!("controller volts_per_hertz {:.0}", controlled(timer, &samples, &mut vhz) - around);
    let mut dtc = DirectTorque::try_new(&data, &DirectTorqueGains::typical(&data, flux, 560.0, T as f32)).ok()?;
    let (mut dtc, _) = recorded(&machine, &mut dtc, &mut samples);
    hprintln!("controller direct_torque {:.0}", controlled(timer, &samples, &mut dtc) - around);
    let duty = counted(timer, &samples, |m| {
        black_box(duty_cycles(m.u_s, m.dc_voltage_v, ZeroSequence::Centred));
    });
    hprintln!("modulation duty_cycles {:.0}", duty - around);
    each(&mut Observers { timer, samples: &samples, machine, around });
    Some(())
}

#[cortex_m_rt::entry]
fn main() -> ! {
    program(parts)
}
