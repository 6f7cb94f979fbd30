//! Gains of Kenné et al.'s law, and the conditions (25), (26) on them.

use im_model::{ModelError, Scalar};

use crate::current_regulator::CurrentRegulator;
use crate::field_weakening::FieldWeakening;
use crate::guard;
use crate::machine_data::MachineData;
use crate::reference::ReferenceShaper;

/// Where the load torque in (48) comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadTorqueSource {
    /// [`Kenne::set_load_torque`](super::Kenne::set_load_torque), as in the paper's simulations.
    Given,
    /// Estimated from speed and T̂_e.
    Estimated,
}

/// The gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KenneGains<T> {
    /// k_vsq of (15), (25), V.
    pub k_sq: T,
    /// k_vsd of (16), (26), V.
    pub k_sd: T,
    /// c_ω of (17), 1/s.
    pub c_omega: T,
    /// c_λ of (17), 1/s.
    pub c_lambda: T,
    /// Half width of the boundary layer of sign(s_ω), rad/s²; zero for the sign itself.
    pub boundary_omega: T,
    /// Half width of the boundary layer of sign(s_λ), Vs²/s; zero for the sign itself.
    pub boundary_lambda: T,
    /// a_e, 1/s: how fast the mean of the switching terms is fed back; zero for the paper's law.
    pub equivalent_bandwidth_per_s: T,
    /// Where the load torque comes from.
    pub load_torque: LoadTorqueSource,
    /// Double pole of the load torque observer, 1/s.
    pub load_bandwidth_per_s: T,
    /// Largest load torque estimated, Nm.
    pub load_limit_nm: T,
    /// Bandwidth of the current regulator that builds up the flux, rad/s.
    pub magnetizing_bandwidth_rad_s: T,
    /// How the speed reference is shaped.
    pub reference: ReferenceShaper<T>,
    /// How the flux gives way to the voltage.
    pub field_weakening: FieldWeakening<T>,
}

/// The smallest switching gain that satisfies (25), (26): k ≥ (F + η)/b_min + |1 − b_max/b_min| |v̂|.
///
/// `uncertainty` F bounds |f̂ − f|, `reach` is η of (24), `b` are the bounds (23) of the input gain and `equivalent_v` the
/// largest |v̂|. F and η in rad/s³ (or Vs²/s²), b in rad/s³/V (or Vs²/s²/V). The bound holds with v̂ made by any b̂ in `b`.
pub fn switching_gain<T: Scalar>(uncertainty: T, reach: T, b: [T; 2], equivalent_v: T) -> T {
    let [b_min, b_max] = b;
    (uncertainty + reach) / b_min + (T::one() - b_max / b_min).abs() * equivalent_v.abs()
}

impl<T: Scalar> KenneGains<T> {
    /// Gains that suit a sampling time: the slopes inside the boundary layers make error rates of 0.2 over sampling time plus delay;
    /// switching gains of a tenth of `dc_voltage_v`; c_ω = 40 1/s, c_λ = 30 1/s; load torque estimated.
    ///
    /// `rotor_flux_vs` in the reference of the machine's windings.
    pub fn typical(machine: &MachineData<T>, rotor_flux_vs: T, dc_voltage_v: T, sample_time_s: T) -> Self {
        let c = T::from_f64;
        let lag = sample_time_s + machine.voltage_delay_s;
        let w = &machine.windings;
        let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
        let torque_max = c(1.5) * machine.n_p() * k_r * rotor_flux_vs * machine.current_max_a;
        let (k_sq, k_sd) = (dc_voltage_v * c(0.1), dc_voltage_v * c(0.1));
        let rate = (c(0.2) / lag).min(c(1500.0));
        let mut gains = Self {
            k_sq,
            k_sd,
            c_omega: (rate * c(0.05)).min(c(40.0)),
            c_lambda: (rate * c(0.05)).min(c(30.0)),
            boundary_omega: T::zero(),
            boundary_lambda: T::zero(),
            equivalent_bandwidth_per_s: rate * c(0.1),
            load_torque: LoadTorqueSource::Estimated,
            load_bandwidth_per_s: (rate * c(0.1)).min(c(100.0)),
            load_limit_nm: torque_max * c(1.5),
            magnetizing_bandwidth_rad_s: CurrentRegulator::bandwidth_for(lag),
            reference: ReferenceShaper {
                bandwidth_rad_s: (rate * c(0.1)).min(c(100.0)),
                acceleration_max_rad_s2: torque_max * c(0.8) / w.inertia_kg_m2,
            },
            field_weakening: FieldWeakening { bandwidth_per_s: c(15.0), voltage_share: c(0.92) },
        };
        gains.set_boundary_layers(machine, rotor_flux_vs, rate);
        gains
    }

    /// Boundary layers Φ = b k/rate, inside which s decays at `rate` (1/s) at the flux `rotor_flux_vs`: ṡ = −b k s/Φ with
    /// b_ω = μ|λ|/σL_s and b_λ = 2(R_r/L_r)M|λ|/σL_s. Sampled, `rate` times sampling time and delay must stay below about 0.3.
    pub fn set_boundary_layers(&mut self, machine: &MachineData<T>, rotor_flux_vs: T, rate: T) {
        let [b_omega, b_lambda] = input_gains(machine, rotor_flux_vs);
        self.boundary_omega = b_omega * self.k_sq / rate;
        self.boundary_lambda = b_lambda * self.k_sd / rate;
    }

    pub(super) fn validate(&self) -> Result<(), ModelError> {
        guard::SIZE.check("k_sq", self.k_sq.value())?;
        guard::SIZE.check("k_sd", self.k_sd.value())?;
        guard::SIZE.check("c_omega", self.c_omega.value())?;
        guard::SIZE.check("c_lambda", self.c_lambda.value())?;
        guard::SIZE_OR_ZERO.check("boundary_omega", self.boundary_omega.value())?;
        guard::SIZE_OR_ZERO.check("boundary_lambda", self.boundary_lambda.value())?;
        guard::SIZE_OR_ZERO.check("equivalent_bandwidth_per_s", self.equivalent_bandwidth_per_s.value())?;
        guard::SIZE.check("load_bandwidth_per_s", self.load_bandwidth_per_s.value())?;
        guard::SIZE.check("load_limit_nm", self.load_limit_nm.value())?;
        guard::SIZE.check("magnetizing_bandwidth_rad_s", self.magnetizing_bandwidth_rad_s.value())?;
        self.reference.validate()?;
        self.field_weakening.validate()
    }
}

/// b_ω and b_λ of (20), (21) at a flux: rad/s³ and Vs²/s² per volt.
pub fn input_gains<T: Scalar>(machine: &MachineData<T>, rotor_flux_vs: T) -> [T; 2] {
    let c = machine.windings.derived(machine.pole_pairs);
    [c.mu * rotor_flux_vs / c.sigma_l_s, T::from_f64(2.0) * c.eta_l_m * rotor_flux_vs / c.sigma_l_s]
}
