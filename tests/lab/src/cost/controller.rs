//! A step of each controller, alone (`controller`, `controller_f32`) and with averaged inverter and machine (`closed_controller`).

use super::Cost;
use im_control::jadot::JadotGains;
use im_control::{
    Drive, DriveLimits, FieldOriented, FieldOrientedGains, Jadot, Kenne, KenneGains, MachineData, Mtpa, MtpaGains, MtpaLaw,
};
use im_identify::online::Fixed;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Bench, Complex, Machine, PlantInput, Scalar, State, machines};

/// The closed loop.
struct Loop<T, C> {
    controller: C,
    /// None: the controller alone, on a measurement that stays.
    bench: Option<Bench<T>>,
    measured: Measured<T>,
    reference: Reference<T>,
}

impl<T: Scalar, C: Controller<T>> Loop<T, C> {
    /// `n` control steps; the last current, so that nothing is left out.
    #[inline(never)]
    fn run(&mut self, n: usize) -> T {
        for _ in 0..n {
            let command = self.controller.step(&self.measured, &self.reference);
            let (Command::Voltage(u) | Command::Current(u)) = command;
            if let Some(bench) = &mut self.bench {
                bench.advance(&PlantInput::new(u, self.reference.torque_nm));
                let shown = bench.output();
                self.measured = Measured { i_s: shown.i_s, omega_m: shown.omega_m, u_s: u, ..self.measured };
            } else {
                // The command is used, so that it is computed.
                self.measured.u_s = u;
            }
        }
        self.measured.i_s.re + self.measured.u_s.re
    }
}

const M: machines::NamedMachine = machines::JADOT_TABLE_I;

fn machine<T: Scalar>() -> Machine<T> {
    Machine::base(M.parameters(), M.pole_pairs).expect("a machine").cast()
}

fn known() -> MachineData<f64> {
    MachineData::of(&machine(), 1.5 * M.rating.current_peak_a(&M.parameters(), M.pole_pairs))
}

/// At 120 rad/s, magnetized and settled.
fn looped<T: Scalar, C: Controller<T>>(controller: C, closed: bool) -> Loop<T, C> {
    let c = T::from_f64;
    let start = State::turning(c(120.0));
    let mut l = Loop {
        controller,
        bench: Some(Bench::new(&machine(), start, T::from_f64(1e-4))),
        measured: Measured {
            i_s: Complex::new(T::zero(), T::zero()),
            omega_m: c(120.0),
            u_s: Complex::new(T::zero(), T::zero()),
            dc_voltage_v: c(560.0),
            sample_time_s: c(1e-4),
        },
        reference: Reference { omega_m: c(120.0), rotor_flux_vs: c(0.9), torque_nm: c(10.0) },
    };
    l.run(10_000);
    if !closed {
        l.bench = None;
    }
    l
}

fn cost<T: Scalar + 'static, C: Controller<T> + 'static>(name: &str, closed: bool, controller: C) -> Cost {
    let name = format!("{}{name}{}", if closed { "closed_" } else { "" }, if size_of::<T>() == 4 { "_f32" } else { "" });
    Cost::new(name, move || {
        let mut l = looped(controller, closed);
        move || l.run(1000).value()
    })
}

fn each<T: Scalar + 'static>(closed: bool) -> Vec<Cost> {
    let known64 = known();
    let known = known64.cast::<T>();
    let c = T::from_f64;
    let (flux, t) = (c(0.9), c(1e-4));
    let gains = FieldOrientedGains::typical(&known, flux, t);
    let indirect = FieldOriented::try_new(&known, &gains).expect("gains");
    let limits = DriveLimits::generous(&known, c(157.0), flux);
    let fixed = Fixed::try_new(machine::<T>().parameters().inverse_gamma().into()).expect("parameters");
    let j = JadotGains::typical(&known64, 0.9, 1e-4);
    let j = JadotGains {
        current_proportional_ohm: c(j.current_proportional_ohm),
        current_integral_per_s: c(j.current_integral_per_s),
        speed_proportional: c(j.speed_proportional),
        speed_integral_per_s: c(j.speed_integral_per_s),
        lambda: im_identify::online::Lambda::Scheduled,
        field_weakening: None,
    };
    let mut costs = vec![
        cost("indirect_field_orientation", closed, indirect),
        cost("direct_field_orientation", closed, FieldOriented::try_new(&known, &gains.direct()).expect("gains")),
        cost("kenne", closed, Kenne::try_new(&known, &KenneGains::typical(&known, flux, c(560.0), t)).expect("gains")),
        cost("jadot", closed, Jadot::try_new(&known, &j, fixed).expect("gains")),
    ];
    if !closed {
        // Its commands are currents: no averaged inverter.
        let law = MtpaLaw { torque_nm: [c(0.5), c(40.0)], ..MtpaLaw::kwon_printed() };
        costs.push(cost("mtpa", closed, Mtpa::try_new(&known, &law, &MtpaGains::typical(&known)).expect("gains")));
    }
    costs.push(cost("drive(indirect_field_orientation)", closed, Drive::try_new(indirect, &limits).expect("limits")));
    costs
}

pub fn costs() -> Vec<Cost> {
    [each::<f64>(false), each::<f64>(true), each::<f32>(false)].into_iter().flatten().collect()
}
