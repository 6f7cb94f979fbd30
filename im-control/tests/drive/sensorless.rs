//! The drive of Kwon et al. with the speed of an observer in place of the sensor's, as in the paper's Fig. 12.

use im_control::{MachineData, Mtpa, MtpaGains};
use im_design::mtpa::{for_torque, of_machine};
use im_model::machines;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_observers::{Basis, Derdiyok, DerdiyokGains, Input, Kubota, KubotaGains, Observer, Utkin, UtkinGains};

use crate::mtpa::{law, machine, scenario, settled};

/// Until then the sensor's speed is used, s: the observer needs flux to see by.
const CHANGE_OVER_S: f64 = 1.0;

struct Sensorless<O: Observer<f64>> {
    observer: O,
    state: O::State,
    inner: Mtpa<f64>,
    time_s: f64,
    speed: f64,
}

impl<O: Observer<f64>> Controller<f64> for Sensorless<O> {
    fn step(&mut self, m: &Measured<f64>, r: &Reference<f64>) -> Command<f64> {
        self.speed = self.observer.step(&mut self.state, &Input::new(m.u_s, m.i_s)).omega_m;
        self.time_s += m.sample_time_s;
        let omega_m = if self.time_s < CHANGE_OVER_S { m.omega_m } else { self.speed };
        self.inner.step(&Measured { omega_m, ..*m }, r)
    }
}

/// Torque, current over the least for it, and estimated speed at the end.
fn with<O: Observer<f64>>(observer: O) -> [f64; 3] {
    let machine = machine();
    let known = MachineData::of(&machine, 30.0);
    let state = observer.state_at(Default::default(), Default::default(), 60.0);
    let inner = Mtpa::try_new(&known, &law(&machine), &MtpaGains::typical(&known)).unwrap();
    let mut drive = Sensorless { observer, state, inner, time_s: 0.0, speed: 60.0 };
    let mut s = scenario(15.0);
    // The paper measures the voltage at the terminals; here the command stands for it, so nothing may come in between.
    if let im_model::simulation::Inverter::DeltaModulation(_, bridge) = &mut s.inverter {
        bridge.dead_time_s = 0.0;
    }
    let [torque, current] = settled(&machine, &mut drive, &s);
    let least = for_torque(&of_machine(&machine), torque).unwrap().current_rms_a;
    [torque, current / least, drive.speed]
}

#[test]
fn the_current_is_the_least_with_the_speed_of_observers_too() {
    let (m, machine) = (machines::JADOT_TABLE_I, machine());
    let basis = Basis::try_new(&machine, &m.rating, 1e-4).unwrap().with_saturation(&machine);
    for (name, [torque, excess, speed]) in [
        ("kubota", with(Kubota::try_new(basis, KubotaGains::for_machine(&machine, &m.rating).unwrap()).unwrap())),
        ("derdiyok", with(Derdiyok::try_new(basis, DerdiyokGains::for_machine(&machine, &m.rating)).unwrap())),
        ("utkin", with(Utkin::try_new(basis, UtkinGains::for_machine(&machine, &m.rating)).unwrap())),
    ] {
        assert!((excess - 1.0).abs() < 0.01, "{name}: {excess} of the least current, {torque} Nm, {speed} rad/s");
    }
}
