//! What Python calls: the crates of the workspace with Python's types. Names, units and defaults are the crates'; results that have many
//! parts cross as the JSON that the program prints, arrays as NumPy arrays. The package that people import is in `python/imkit`.

mod arrays;
mod compare;
mod control;
mod design;
mod diagnose;
mod errors;
mod fit;
mod fleet;
mod motor;
mod next_test;
mod observe;
mod recording;
mod signals;
mod simulate;
mod validate;
mod work;

use pyo3::prelude::*;

#[pymodule]
fn _native(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("InputError", m.py().get_type::<errors::InputError>())?;
    m.add("OBSERVERS", im_observers::NAMES.to_vec())?;
    m.add("CONTROLLERS", im_control::named::NAMES.map(|(name, _)| name).to_vec())?;
    m.add("DESIGNS", im_design::request::Kind::ALL.map(|(_, name)| name).to_vec())?;
    m.add_class::<motor::Motor>()?;
    m.add_class::<recording::Recording>()?;
    m.add_class::<compare::Comparison>()?;
    m.add_class::<diagnose::Diagnosis>()?;
    m.add_class::<fit::Fit>()?;
    m.add_class::<design::Certificate>()?;
    m.add_class::<observe::Observer>()?;
    m.add_class::<control::Controller>()?;
    m.add_function(wrap_pyfunction!(simulate::simulate, m)?)?;
    m.add_function(wrap_pyfunction!(compare::compare, m)?)?;
    m.add_function(wrap_pyfunction!(diagnose::diagnose, m)?)?;
    m.add_function(wrap_pyfunction!(fit::fit, m)?)?;
    m.add_function(wrap_pyfunction!(validate::validate, m)?)?;
    m.add_function(wrap_pyfunction!(next_test::next_test, m)?)?;
    m.add_function(wrap_pyfunction!(design::design, m)?)?;
    m.add_function(wrap_pyfunction!(design::example_region, m)?)?;
    m.add_function(wrap_pyfunction!(design::check, m)?)?;
    m.add_function(wrap_pyfunction!(fleet::fleet_jobs, m)?)?;
    m.add_function(wrap_pyfunction!(fleet::fleet_row, m)?)?;
    m.add_function(wrap_pyfunction!(fleet::fleet_failed_row, m)?)?;
    m.add_function(wrap_pyfunction!(fleet::fleet_kept, m)?)?;
    m.add_function(wrap_pyfunction!(fleet::fleet_keep, m)?)?;
    m.add_function(wrap_pyfunction!(fleet::fleet_write, m)?)?;
    m.add_function(wrap_pyfunction!(motor::effects, m)?)
}
