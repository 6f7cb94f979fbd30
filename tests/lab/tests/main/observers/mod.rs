//! Observers on simulated machines.

mod claims;
mod corrections;
mod faults;
mod options;
mod starting;
mod stator_resistance;
mod symmetry;

/// docs/observers.md names every observer that is registered.
#[test]
fn every_observer_is_documented() {
    struct Titles(Vec<&'static str>);
    impl im_observers::Visit<f64> for Titles {
        fn visit<O: im_observers::Named<f64> + 'static>(&mut self) {
            self.0.push(O::TITLE);
        }
    }
    let mut titles = Titles(Vec::new());
    im_observers::each(&mut titles);
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/observers.md")).unwrap().to_lowercase();
    assert!(titles.0.iter().all(|t| page.contains(&t.to_lowercase())), "{:?}", titles.0);
}
