//! The machine on its test bench, in sampled time: commands held over the sample and possibly late, sensors in front of the outputs.

use num_complex::Complex;
use num_traits::Zero;

use crate::effects::{FILTER_STATES, Hook, MAX_CUSTOM, Memories};
use crate::instant::{Output, PlantInput};
use crate::machine::Machine;
use crate::plant::{Evaluation, Plant};
use crate::scalar::Scalar;
use crate::state::State;

/// Past commands kept for a transport delay.
const HISTORY: usize = 8;

/// A plant with its voltage path and its sensors, stepped sample by sample.
#[derive(Clone, Copy, Debug)]
pub struct Bench<T> {
    plant: Plant<T>,
    state: State<T>,
    sample_time: T,
    substep: f64,
    substeps: u32,
    /// Past commands, newest first.
    commands: [Complex<T>; HISTORY],
    /// The filters of the speed sensor.
    filters: [T; FILTER_STATES],
    /// What the user's effects remember.
    memories: Memories<T>,
    delay: T,
    /// Effects act in the sensors.
    sensed: bool,
}

impl<T: Scalar> Bench<T> {
    /// Puts a machine on the bench in a state. Commands before the start are taken as zero.
    pub fn new(machine: &Machine<T>, state: State<T>, sample_time_s: T) -> Self {
        let plant = Plant::new(machine);
        let substeps = plant.substeps(sample_time_s.value());
        let delay = plant.effects().transport_delay(plant.on(), T::zero());
        Self {
            state,
            sample_time: sample_time_s,
            substep: sample_time_s.value() / f64::from(substeps),
            substeps,
            commands: [Complex::zero(); HISTORY],
            filters: [state.omega_m; FILTER_STATES],
            memories: [None; MAX_CUSTOM],
            delay,
            sensed: plant.on().in_sensors(),
            plant,
        }
    }

    /// Uses at least `n` steps per sample.
    pub fn with_substeps(mut self, n: u32) -> Self {
        if n > self.substeps {
            self.substeps = n;
            self.substep = self.sample_time.value() / f64::from(n);
        }
        self
    }

    /// The plant.
    pub fn plant(&self) -> &Plant<T> {
        &self.plant
    }
    /// The state.
    pub fn state(&self) -> &State<T> {
        &self.state
    }
    /// Changes the state (a sensitivity seed, a disturbance).
    pub fn state_mut(&mut self) -> &mut State<T> {
        &mut self.state
    }
    /// Steps taken per sample.
    pub fn substeps(&self) -> u32 {
        self.substeps
    }
    /// Sets what was commanded before the start (a recording that begins in motion).
    pub fn set_past_command(&mut self, u: Complex<T>) {
        self.commands = [u; HISTORY];
    }

    /// What the sensors show now.
    #[inline(always)]
    pub fn output(&self) -> Output<T> {
        let i_s = self.current_before_memory(self.plant.currents(&self.state).i_s);
        self.recalled(Output { i_s, omega_m: self.speed_before_memory() })
    }

    #[inline(always)]
    fn current_before_memory(&self, i_s: Complex<T>) -> Complex<T> {
        if self.sensed { self.plant.measured_current(i_s) } else { i_s }
    }

    #[inline(always)]
    fn speed_seen(&self) -> T {
        self.recalled(Output { i_s: Complex::zero(), omega_m: self.speed_before_memory() }).omega_m
    }

    #[inline(always)]
    fn speed_before_memory(&self) -> T {
        let w = self.state.omega_m;
        if self.sensed {
            let (on, effects) = (self.plant.on(), self.plant.effects());
            effects.measured_speed(on, effects.shown_speed(on, w, self.state.theta_m), &self.filters)
        } else {
            w
        }
    }

    #[inline(always)]
    fn recalled(&self, shown: Output<T>) -> Output<T> {
        if self.remembers() { self.plant.effects().recalled(self.plant.on(), shown, &self.memories) } else { shown }
    }

    #[inline(always)]
    fn remembers(&self) -> bool {
        self.plant.on().any_custom_has(Hook::remember)
    }

    /// What is there to be shown, where an effect remembers it.
    #[inline(always)]
    fn true_reading(&self) -> Option<Output<T>> {
        self.remembers().then(|| Output { i_s: self.plant.currents(&self.state).i_s, omega_m: self.state.omega_m })
    }

    /// Runs one sample with the command and the load torque held.
    #[inline(always)]
    pub fn advance(&mut self, input: &PlantInput<T>) {
        self.advanced::<false>(input, |_, _| ());
    }

    /// What the sensors show now, and then one sample: [`output`](Self::output) and [`advance`](Self::advance) in one. The currents of the first
    /// stage are those that the sensors show, and are found once.
    #[inline(always)]
    pub fn show_and_advance(&mut self, input: &PlantInput<T>) -> Output<T> {
        let on = self.plant.on();
        if self.remembers() || on.any_custom_has(Hook::added_currents) {
            let shown = self.output();
            self.advance(input);
            return shown;
        }
        let (omega_m, mut i_s) = (self.speed_before_memory(), None);
        self.advanced::<false>(input, |_, stage| {
            i_s.get_or_insert(stage.currents.i_s);
        });
        Output { i_s: self.current_before_memory(i_s.unwrap_or_else(Complex::zero)), omega_m }
    }

    /// As [`advance`](Self::advance); `observe` sees every stage with its weight (see [`Plant::step_observed`]).
    #[inline(always)]
    pub fn advance_observed(&mut self, input: &PlantInput<T>, observe: impl FnMut(f64, &Evaluation<T>)) {
        self.advanced::<true>(input, observe);
    }

    /// The same; without `POWERS`, `observe` sees none.
    #[inline(always)]
    fn advanced<const POWERS: bool>(&mut self, input: &PlantInput<T>, mut observe: impl FnMut(f64, &Evaluation<T>)) {
        let u_s = self.arriving(input.u_s);
        let (before, reading) = (self.state.omega_m, self.true_reading());
        let mut input = PlantInput { u_s, ..*input };
        if let Some([target, _]) = &mut input.speed_nudge {
            // The target is what a sensor shows: the speed is nudged by what that sensor would show of it, not by the truth behind it.
            *target += before - self.speed_seen();
        }
        let (whole, rise) = (input.imposed_speed, input.u_rise);
        for k in 0..self.substeps {
            if let Some(rise) = rise {
                let part = T::from_f64(1.0 / f64::from(self.substeps));
                input.u_s = u_s + rise.scale(part.scale(f64::from(k) + 0.5) - T::from_f64(0.5));
                input.u_rise = Some(rise.scale(part));
            }
            if let Some([a, b]) = whole {
                let at = |k: u32| a + (b - a).scale(f64::from(k) / f64::from(self.substeps));
                input.imposed_speed = Some([at(k), at(k + 1)]);
            }
            self.plant.stepped::<POWERS>(&mut self.state, &input, self.substep, &mut observe);
        }
        self.filter(before);
        self.remember(reading);
    }

    /// Transport delay of the voltage, s.
    pub fn transport_delay(&self) -> T {
        self.delay
    }

    /// Runs one sample whose voltage is not held: `integrate` carries the state over the sample, given the command that the voltage
    /// delay leaves of `command`. The speed sensor sees the change.
    pub fn advance_with(&mut self, command: Complex<T>, integrate: impl FnOnce(&Plant<T>, &mut State<T>, Complex<T>)) {
        let arriving = self.arriving(command);
        let (before, reading) = (self.state.omega_m, self.true_reading());
        integrate(&self.plant, &mut self.state, arriving);
        self.filter(before);
        self.remember(reading);
    }

    /// The sensors' filters follow the speed of the sample that has passed.
    #[inline(always)]
    fn filter(&mut self, before: T) {
        if self.sensed {
            let (now, on) = (self.state.omega_m, self.plant.on());
            self.plant.effects().filter(on, &mut self.filters, before, now, self.sample_time);
        }
    }

    /// So do the memories of the user's effects.
    #[inline(always)]
    fn remember(&mut self, before: Option<Output<T>>) {
        if let Some((before, now)) = before.zip(self.true_reading()) {
            self.plant.effects().remember(self.plant.on(), &mut self.memories, [before, now], self.sample_time);
        }
    }

    /// The mean over this sample of what arrives of a command held over it.
    #[inline(always)]
    fn arriving(&mut self, u: Complex<T>) -> Complex<T> {
        let past = self.commands[0];
        let late = if self.delay.is_zero() { u } else { self.late(u) };
        if !self.plant.on().any_custom_has(Hook::passed_voltage) {
            return late;
        }
        self.plant.effects().passed_voltage(self.plant.on(), [past, late], &mut self.memories, self.sample_time)
    }

    /// The mean over this sample of the command delayed by D = (n + f)T.
    fn late(&mut self, u: Complex<T>) -> Complex<T> {
        self.commands.copy_within(0..HISTORY - 1, 1);
        self.commands[0] = u;
        let samples = self.delay / self.sample_time;
        let n = (samples.value().max(0.0) as usize).min(HISTORY - 2);
        let f = (samples - T::from_f64(n as f64)).min(T::one());
        self.commands[n] * (T::one() - f) + self.commands[n + 1] * f
    }
}
