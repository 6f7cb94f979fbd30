//! A claim: what is said, where, under which assumptions; the cases it is tried on; the property that tries it.

use im_model::{Complex, DerivedConstants, Machine, Rating, TParameters};

use crate::random::Draws;
use crate::subject::{MACHINE, Machines, Subject};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// Where a claim comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paper {
    /// Kwon, Sudhoff, Żak, Hui (2005).
    Kwon,
    /// Kenné, Ahmed-Ali, Nkwawo, Lamnabhi-Lagarrigue (2005).
    Kenne,
    /// Jadot, Malrait, Moreno-Valenzuela, Sepulchre (2009).
    Jadot,
}

impl Paper {
    /// All, in the order of the claims.
    pub const ALL: [Self; 3] = [Self::Kwon, Self::Kenne, Self::Jadot];

    /// The name to choose claims by.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kwon => "kwon",
            Self::Kenne => "kenne",
            Self::Jadot => "jadot",
        }
    }

    /// The authors.
    pub const fn authors(self) -> &'static str {
        match self {
            Self::Kwon => "Kwon, Sudhoff, Żak, Hui (2005)",
            Self::Kenne => "Kenné, Ahmed-Ali, Nkwawo, Lamnabhi-Lagarrigue (2005)",
            Self::Jadot => "Jadot, Malrait, Moreno-Valenzuela, Sepulchre (2009)",
        }
    }
}

/// Whose statement a claim is, with the paper's exact words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The paper says this, and the cases lie in the range that it says it for.
    Says(&'static str),
    /// The paper says this; what is tried goes further: another range, another machine, a correction, a question that it leaves open.
    Extends(&'static str),
}

impl Origin {
    /// The paper's words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Says(words) | Self::Extends(words) => words,
        }
    }

    /// Whether it is an extension.
    pub const fn is_extension(self) -> bool {
        matches!(self, Self::Extends(_))
    }
}

/// What was found, as `docs/background/claims.md` states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// No case violates it.
    Holds,
    /// No case violates it under an assumption that the paper does not make; the cases meet it.
    HoldsIf,
    /// It has counterexamples.
    Fails {
        /// The share of random cases that are counterexamples, no more than what was found: how many cases it takes to meet one.
        rate: f64,
    },
}

impl Found {
    /// Whether counterexamples are known.
    pub const fn fails(self) -> bool {
        matches!(self, Self::Fails { .. })
    }
}

/// What a case costs, and with it how many are tried and how they are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// A few evaluations of equations: microseconds.
    Equation,
    /// A short run of an observer or of equations: up to milliseconds.
    Run,
    /// Seconds of machine time in closed loop: tens of milliseconds.
    Study,
    /// Minutes of machine time: the better part of a second.
    Long,
}

impl Cost {
    /// Cases in a block, the unit of sharing out and of resuming.
    pub const fn block(self) -> u64 {
        match self {
            Self::Equation => 5000,
            Self::Run => 50,
            Self::Study => 5,
            Self::Long => 1,
        }
    }

    /// Cases tried when no number is given.
    pub const fn cases(self) -> u64 {
        match self {
            Self::Equation => 100_000,
            Self::Run => 1000,
            Self::Study => 200,
            Self::Long => 30,
        }
    }

    /// Cases tried in the tests of this crate.
    pub const fn test_cases(self) -> u64 {
        match self {
            Self::Equation => 10_000,
            Self::Run => 100,
            Self::Study => 10,
            Self::Long => 2,
        }
    }

    /// Time of a case, roughly, over that of an equation.
    pub(crate) const fn effort(self) -> u64 {
        match self {
            Self::Equation => 1,
            Self::Run => 500,
            Self::Study => 20_000,
            Self::Long => 500_000,
        }
    }

    /// Evaluations that shrinking may take.
    pub(crate) const fn shrinking(self) -> u32 {
        match self {
            Self::Equation => 4000,
            Self::Run => 600,
            Self::Study => 150,
            Self::Long => 25,
        }
    }
}

/// A claim with its property.
#[derive(Clone, Copy, Debug)]
pub struct Claim {
    /// Number in `docs/background/claims.md`; cases depend on it.
    pub number: u32,
    /// Name, as tests have it.
    pub name: &'static str,
    /// The paper.
    pub paper: Paper,
    /// Section, and equation, figure or sentence in it.
    pub place: &'static str,
    /// Whose statement it is, in the paper's words.
    pub origin: Origin,
    /// What is tried.
    pub statement: &'static str,
    /// In which range and under which assumptions; what the cases are.
    pub assumptions: &'static str,
    /// What was found.
    pub found: Found,
    /// What was found, in words.
    pub finding: &'static str,
    /// What a case costs.
    pub cost: Cost,
    /// What varies besides the machine.
    pub variables: &'static [Variable],
    /// The property.
    pub check: fn(&ClaimCase) -> Verdict,
}

/// Where a case lies: values of [`MACHINE`], if the machine is a random one, and of the claim's variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The random machine; none for a machine that is given.
    pub machine: Option<[f64; 8]>,
    /// The claim's own variables, in their order.
    pub values: Vec<f64>,
}

/// A machine and values: all that a property needs.
#[derive(Clone, Debug)]
pub struct ClaimCase {
    /// The machine.
    pub subject: Subject,
    values: Vec<f64>,
}

impl ClaimCase {
    /// The same values on another machine: for claims about one machine only.
    pub(crate) fn on(&self, machine: &im_model::machines::NamedMachine) -> Self {
        Self { subject: Subject::named(machine), values: self.values.clone() }
    }

    /// The values of the claim's variables, in their order.
    ///
    /// # Panics
    /// When the claim has another number of variables: a mistake in the claim.
    pub fn values<const N: usize>(&self) -> [f64; N] {
        self.values.as_slice().try_into().expect("a property reads the variables of its claim")
    }

    /// The machine.
    pub fn machine(&self) -> &Machine<f64> {
        &self.subject.machine
    }

    /// Its T circuit.
    pub fn parameters(&self) -> &TParameters<f64> {
        self.subject.machine.parameters()
    }

    /// The derived constants of Kwon et al., Table II.
    pub fn constants(&self) -> DerivedConstants<f64> {
        self.parameters().windings().derived(self.subject.machine.pole_pairs())
    }

    /// The rating.
    pub fn rating(&self) -> &Rating {
        &self.subject.rating
    }

    /// Synchronous speed at rated frequency, mechanical rad/s: what speeds are given in shares of.
    pub fn speed(&self) -> f64 {
        self.rating().synchronous_speed_rad_s(self.subject.machine.pole_pairs())
    }

    /// Slip frequency at rated torque and flux, electrical rad/s: what slips are given in shares of.
    pub fn slip(&self) -> f64 {
        let (p, r) = (self.parameters(), self.rating());
        r.torque_nm * p.rotor_resistance_ohm / (1.5 * f64::from(self.machine().pole_pairs()) * r.rotor_flux_vs * r.rotor_flux_vs)
    }

    /// Peak current at rated torque and flux, A.
    pub fn current(&self) -> f64 {
        self.rating().current_peak_a(self.parameters(), self.machine().pole_pairs())
    }
}

/// A complex number.
pub type C = Complex<f64>;

impl Claim {
    /// The case of an index, its machine a random one or the one given.
    pub fn draw(&self, seed: u64, index: u64, machines: &Machines) -> Point {
        let draws = Draws::new(seed, self.number, index);
        let at = |k: usize, v: &Variable| v.at(draws.unit(k as u64));
        let values = self.variables.iter().enumerate().map(|(k, v)| at(MACHINE.len() + k, v)).collect();
        let machine = match machines {
            Machines::Random => Some(std::array::from_fn(|k| at(k, &MACHINE[k]))),
            Machines::One(_) => None,
        };
        Point { machine, values }
    }

    /// Tries a point.
    pub fn verdict(&self, point: &Point, machines: &Machines) -> Verdict {
        match self.case(point, machines) {
            Ok(case) => (self.check)(&case),
            Err(e) => Verdict::refused(e),
        }
    }

    /// The case of a point.
    fn case(&self, point: &Point, machines: &Machines) -> Result<ClaimCase, String> {
        let subject = match (&point.machine, machines) {
            (Some(values), _) => Subject::random(values).map_err(|e| e.to_string())?,
            (None, Machines::One(subject)) => Subject::clone(subject),
            (None, Machines::Random) => return Err("the case names no machine".into()),
        };
        Ok(ClaimCase { subject, values: point.values.clone() })
    }
}
