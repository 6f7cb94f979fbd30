//! Energy is neither made nor lost, whatever is switched on.

use im_model::effects::Role;
use im_model::space_vector::unit;
use im_model::{Bench, Complex, EffectId, Effects, Ledger, Machine, PlantInput, TParameters, machines};
use proptest::prelude::*;

/// A machine: one of the named ones with every parameter changed by up to a factor of two either way, and each effect on with an
/// even chance, every parameter anywhere in its typical range, of either sign where the bound allows it.
fn any_machine() -> impl Strategy<Value = Machine<f64>> {
    let count = EffectId::ALL.iter().map(|id| id.parameters().len()).sum::<usize>();
    let sizes = prop::collection::vec((any::<bool>(), 0.0..1.0f64, any::<bool>()), count);
    (
        0..machines::ALL.len(),
        prop::array::uniform7(-1.0..1.0f64),
        prop::collection::vec(any::<bool>(), EffectId::ALL.len()),
        sizes,
    )
        .prop_map(|(which, factors, on, sizes)| {
            let named = &machines::ALL[which];
            let mut values = named.parameters().values();
            for (v, f) in values.iter_mut().zip(factors) {
                *v *= 2f64.powf(f);
            }
            let p = TParameters::from_values(values);
            let mut e = Effects::scaled(&named.rating, &p, named.pole_pairs);
            let mut sizes = sizes.into_iter();
            for (&id, on) in EffectId::ALL.iter().zip(on) {
                for (k, info) in id.parameters().iter().enumerate() {
                    let (present, place, negative) = sizes.next().unwrap();
                    if !on || matches!(info.role, Role::Order | Role::Fixed) || (info.role == Role::Strength && !present) {
                        continue;
                    }
                    let (lo, hi) = info.typical;
                    let size = (lo + (hi - lo) * place) * named.rating.unit_of(info.scale, &p, named.pole_pairs);
                    let signed = if negative && info.bound.check(info.key, -size).is_ok() { -size } else { size };
                    e.set(id, k, signed);
                }
            }
            Machine::try_new(p, named.pole_pairs, e).unwrap()
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Voltage of any amplitude and frequency, changed at random instants, any load: input, losses, load and what is stored close
    /// to 5e-6 of the energy that came in: the flux map of a saturated machine is a table, which far beyond rated flux stores 2e-6 too
    /// much or too little (without saturation 1e-6 holds).
    #[test]
    fn power_balance_closes_for_any_set_of_effects(
        m in any_machine(),
        voltage in prop::collection::vec((0.0..1.2f64, -1.2..1.2f64, 0.0..6.3f64), 4),
        load in prop::collection::vec(-1.0..1.0f64, 4),
        which_rating in 0..machines::ALL.len(),
    ) {
        let rating = &machines::ALL[which_rating].rating;
        let sample = 1e-4;
        let mut bench = Bench::new(&m, im_model::State::default(), sample);
        // RK4 misses (λh)⁴/120 of the energy of a transient with rate λ: λh = 0.05 leaves 5e-8, with room for the kinks of dead
        // time and friction, whose higher derivatives exceed what the rate alone says.
        let fine = (bench.plant().fastest_rate() * sample / 0.05).ceil() as u32;
        bench = bench.with_substeps(fine.max(4));
        let plant = *bench.plant();
        let mut ledger = Ledger::new(&plant, bench.state());
        let mut input = 0.0;
        let samples = 400;
        let mut angle = 0.0;
        for k in 0..samples {
            let part = k * voltage.len() / samples;
            let (amplitude, frequency, phase) = voltage[part];
            angle += frequency * rating.electrical_frequency_hz * 2.0 * std::f64::consts::PI * sample;
            let u: Complex<f64> = unit(angle + phase) * (amplitude * rating.phase_voltage_peak_v);
            let held = PlantInput::new(u, load[part] * rating.torque_nm);
            bench.advance_observed(&held, |weight, e| {
                ledger.add(weight, e);
                // Energy comes in through the terminals, or through the shaft when the load drives.
                input += weight * (e.powers.electrical_input.max(0.0) + (-e.powers.load).max(0.0));
            });
        }
        prop_assert!(bench.state().is_finite());
        let miss = ledger.imbalance(&plant, bench.state());
        let saturated = m.effects().is_on(EffectId::MainFluxSaturation) || m.effects().is_on(EffectId::LeakageFluxSaturation);
        let least = if saturated { 5e-6 } else { 1e-6 };
        prop_assert!(miss.abs() <= least * input, "{miss:e} J of {input} J is missing, {:?}", m.effects().active().collect::<Vec<_>>());
    }
}
