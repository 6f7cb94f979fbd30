//! The steps whose cost is measured, by name: for the benchmark (`cargo bench -p im-lab`), for `scripts/step-cost`, and for tables in the docs.

mod controller;
mod identifier;
mod machine;
mod observer;

/// A thousand steps; something of the result, so that nothing is optimized away.
pub type Thousand = Box<dyn FnMut() -> f64>;

/// A step with a name, settled where it is run.
pub struct Cost {
    pub name: String,
    prepare: Box<dyn FnOnce() -> Thousand>,
}

impl Cost {
    fn new<F: FnMut() -> f64 + 'static>(name: impl Into<String>, prepare: impl FnOnce() -> F + 'static) -> Self {
        Self { name: name.into(), prepare: Box::new(|| Box::new(prepare())) }
    }

    /// Brings it to where its steps are measured.
    pub fn prepared(self) -> Thousand {
        (self.prepare)()
    }
}

/// A kind of step with the function that makes its cases.
pub type Kind = (&'static str, fn() -> Vec<Cost>);

/// What there is to measure, and its steps.
pub const KINDS: [Kind; 4] = [
    ("machine", machine::costs),
    ("observer", observer::costs),
    ("controller", controller::costs),
    ("identifier", identifier::costs),
];

/// The steps of a kind; none of an unknown one.
pub fn of(kind: &str) -> Vec<Cost> {
    KINDS.iter().find(|(name, _)| *name == kind).map_or_else(Vec::new, |(_, costs)| costs())
}
