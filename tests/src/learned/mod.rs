//! Effects as `im learn --rust` writes them: the test `learned_rust` holds them to that, and to what their curves do.

#[rustfmt::skip]
pub mod own_torque_over_speed;
#[rustfmt::skip]
pub mod own_torque_over_shaft_angle;
#[rustfmt::skip]
pub mod own_stator_resistance_over_time;
#[rustfmt::skip]
pub mod own_magnetizing_current_over_flux;
pub mod own_magnetizing_current_over_shaft_angle;
#[rustfmt::skip]
pub mod own_current_sensor_over_current;
#[rustfmt::skip]
pub mod own_speed_sensor_over_shaft_angle;
#[rustfmt::skip]
pub mod own_voltage_over_current;
#[rustfmt::skip]
pub mod own_leakage_current_over_current;
