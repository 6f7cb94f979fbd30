//! Controllers: their code with its machine, against the certified rates and surfaces.

use super::{C, decays, size};
use crate::designs::support::{cases, machine, modelled, region};
use im_control::kenne::LoadTorqueSource;
use im_control::{Jadot, JadotGains, Kenne, KenneGains, MachineData};
use im_design::certificate::Design;
use im_design::request::{Kind, Period, design_sampled};
use im_design::{DesignModel, LinearMachine};
use im_identify::online::{Fixed, Lambda};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::dot;
use im_model::{PlantInput, State};
use proptest::prelude::*;

/// Jadot's controller with its machine, the speed held by a brake.
struct Regulated {
    plant: im_model::Plant<f64>,
    x: State<f64>,
    controller: Jadot<f64, Fixed<f64>>,
    u: C,
    k_r: f64,
}

impl Regulated {
    /// One sample; (Δφ, Δi) at its beginning.
    fn step(&mut self, speed: f64, flux_vs: f64, h: f64) -> [C; 2] {
        self.x.change_speed(|w| *w = speed);
        let i_s = self.plant.currents(&self.x).i_s;
        let back = self.controller.direction().conj();
        let (phi_ref, i_ref) = self.controller.references();
        let error = [self.x.psi_r * self.k_r * back - phi_ref, i_s * back - i_ref];
        let m = Measured { i_s, omega_m: speed, u_s: self.u, dc_voltage_v: 1e5, sample_time_s: h };
        let reference = Reference { omega_m: speed, rotor_flux_vs: flux_vs, torque_nm: 0.0 };
        let Command::Voltage(u) = self.controller.step(&m, &reference) else { panic!("a voltage") };
        self.u = u;
        self.x = self.plant.step(&self.x, &PlantInput::new(u, 0.0), h);
        error
    }
}

proptest! {
    #![proptest_config(cases(1))]

    /// `jadot`, sampled: two machines under two controllers, one pushed off; what stands between their errors has no part of the feedforward.
    #[test]
    fn jadots_electrical_errors(m in machine(), at in -0.9..0.9f64, push in prop::array::uniform4(-1.0..1.0f64)) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let h = 5e-5_f64.min(0.05 / c.gamma);
        let text = region(Kind::Jadot, &m);
        let made = design_sampled(Kind::Jadot, plant, &text, Period::At(h)).unwrap();
        let Design::SampledJadot(d) = &made.design else { unreachable!() };
        let j = &d.continuous;
        let gains = JadotGains {
            current_proportional_ohm: j.current_proportional_ohm,
            current_integral_per_s: j.current_integral_per_s,
            speed_proportional: j.speed_proportional,
            speed_integral_per_s: j.speed_integral_per_s,
            lambda: Lambda::Constant(j.lambda_h),
            field_weakening: None,
        };
        let machine = modelled(&m);
        let known = MachineData::of(&machine, 1e3);
        let fixed = Fixed::try_new(machine.parameters().inverse_gamma().into()).unwrap();
        let k_r = m.mutual_inductance_h / m.rotor_inductance_h;
        let electrical = at * j.electrical_speed_rad_s[1];
        let speed = electrical / c.n_p;
        let mut one = Regulated {
            plant: im_model::Plant::new(&machine),
            x: State::default(),
            controller: Jadot::try_new(&known, &gains, fixed).unwrap(),
            u: C::new(0.0, 0.0),
            k_r,
        };
        let flux = j.flux_vs / k_r;
        for _ in 0..(3.0 / c.eta / h) as usize {
            one.step(speed, flux, h);
        }
        let mut other = Regulated { plant: im_model::Plant::new(&machine), x: one.x, controller: one.controller, ..one };
        other.x.psi_r += C::new(push[0], push[1]) * 0.05;
        other.x.psi_s += C::new(push[2], push[3]) * 0.05;
        let (mut eta, mut sizes) = (C::new(0.0, 0.0), Vec::new());
        let inside = |r: [f64; 2], x: f64| r[0] <= x && x <= r[1];
        let cell = d.electrical.iter().find(|cell| inside(cell.electrical_speed_rad_s, electrical) && inside(cell.slip_rad_s, 0.0)).unwrap();
        for _ in 0..(2.0 / cell.proof.rate_per_s / h) as usize {
            let (a, b) = (one.step(speed, flux, h), other.step(speed, flux, h));
            let (phi, i) = (b[0] - a[0], b[1] - a[1]);
            sizes.push(size(&cell.proof.p, &[phi.re, phi.im, i.re, i.im, eta.re, eta.im]));
            eta += i * (j.current_integral_per_s * h);
        }
        decays(&sizes, (-cell.proof.rate_per_s * h).exp(), 0.0)?;
    }

    /// `kenne`, sampled: outside its layer the flux's surface falls by hη per sample, inside both stay, on a machine whose R_s is not the law's.
    #[test]
    fn kennes_surfaces(m in machine(), at in -0.5..0.5f64, r_s in 0.9..1.1f64, down in 0.02..0.06f64) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let h = 1e-5_f64.min(0.02 / c.gamma);
        let text = region(Kind::Kenne, &m)
            .replace("stator_resistance_ratio = [0.8, 1.4]", "stator_resistance_ratio = [0.9, 1.1]")
            .replace("rotor_resistance_ratio = [0.8, 1.5]", "rotor_resistance_ratio = [1.0, 1.0]")
            .replace("voltage_max_v = 380.0", "voltage_max_v = 1000.0");
        let made = design_sampled(Kind::Kenne, plant, &text, Period::At(h)).unwrap();
        let Design::SampledKenne(d) = &made.design else { unreachable!() };
        let (k, region) = (&d.continuous, &d.continuous.region);
        let truth = modelled(&LinearMachine { stator_resistance_ohm: r_s * m.stator_resistance_ohm, ..m });
        let known = MachineData::of(&modelled(&m), 1e4);
        let typical = KenneGains::typical(&known, 0.95, 1e5, h);
        let gains = KenneGains {
            k_sq: k.k_sq,
            k_sd: k.k_sd,
            c_omega: region.c_omega,
            c_lambda: region.c_lambda,
            boundary_omega: d.boundary_omega,
            boundary_lambda: d.boundary_lambda,
            equivalent_bandwidth_per_s: 0.0,
            load_torque: LoadTorqueSource::Given,
            ..typical
        };
        let mut drive = Kenne::try_new(&known, &gains).unwrap();
        let model = im_model::Plant::new(&truth);
        let speed = at * region.speed_max_rad_s;
        let mut x = State::turning(speed);
        let (mut u, mut before): (C, Option<[f64; 2]>) = (C::new(0.0, 0.0), None);
        let (mut checked, mut outside) = (0, 0);
        let magnetized = (4.0 / c.eta / h) as usize;
        for n in 0..magnetized + 2000 {
            let i = model.currents(&x).i_s;
            let measured = Measured { i_s: i, omega_m: x.omega_m, u_s: u, dc_voltage_v: 1e5, sample_time_s: h };
            // Less flux at once: the surface is left.
            let wanted = if n < magnetized { 0.96 } else { 0.96 - down };
            let friction = m.viscous_friction_n_m_s * speed;
            drive.set_load_torque(-friction, 0.0);
            let Command::Voltage(next) = drive.step(&measured, &Reference { omega_m: speed, rotor_flux_vs: wanted, torque_nm: 0.0 }) else { panic!("a voltage") };
            u = next;
            let l = drive.rotor_flux_vs();
            let w = known.windings;
            let f2 = l.norm_sqr();
            let rate = 2.0 * c.eta * (w.mutual_inductance_h * dot(l, i) - f2);
            let s_lambda = rate + region.c_lambda * (f2 - wanted * wanted);
            let a = drive.torque_nm() / m.inertia_kg_m2;
            let s_omega = a + region.c_omega * (x.omega_m - drive.shaped_speed_rad_s());
            let inside = i.norm() <= region.current_max_a && u.norm() <= region.voltage_max_v
                && (region.flux_vs[0]..=region.flux_vs[1]).contains(&l.norm()) && a.abs() <= region.acceleration_max_rad_s2;
            if let (Some([omega, lambda]), true) = (before, n > magnetized + 1) {
                let fallen = |s: f64, layer: f64, reach: f64| (s - 0.99 * h * reach).max(layer);
                prop_assert!(s_lambda.abs() <= fallen(lambda, d.boundary_lambda, region.reach_lambda), "{lambda} {s_lambda} layer {}", d.boundary_lambda);
                prop_assert!(s_omega.abs() <= fallen(omega, d.boundary_omega, region.reach_omega), "{omega} {s_omega} layer {}", d.boundary_omega);
                checked += 1;
                outside += usize::from(lambda > d.boundary_lambda);
            }
            before = (inside && n >= magnetized).then_some([s_omega.abs(), s_lambda.abs()]);
            x = model.step(&x, &PlantInput::new(u, -friction), h);
        }
        prop_assert!(checked > 100, "{checked} samples inside the region, {outside} outside the layer");
    }
}
