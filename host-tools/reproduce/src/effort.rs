//! Amount of work.

use super::method::{METHODS, Method, SAMPLES};

/// Amount of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of robots that every method meets. `None`: each method meets its own number
    /// ([`Method::robots`]).
    pub robots: Option<usize>,
    /// Iterations of the random search.
    pub iterations: u32,
    /// Samples of the global sensitivity analysis. It costs this number times P + 1 evaluations.
    pub sobol_samples: u32,
}

impl Effort {
    /// A full reproduction: ten minutes on two cores.
    pub const FULL: Self = Self { seed: 2, robots: None, iterations: 500, sobol_samples: 256 };
    /// The report with rough numbers, in less than a minute.
    pub const QUICK: Self = Self { seed: 2, robots: Some(3), iterations: 50, sobol_samples: 16 };

    /// Number of robots that `method` meets, from the first on.
    pub fn robots_of(&self, method: &Method) -> usize {
        self.robots.unwrap_or(method.robots)
    }

    /// Number of robots altogether.
    pub fn robots(&self) -> usize {
        METHODS.iter().map(|method| self.robots_of(method)).max().unwrap_or(0)
    }

    /// Number of robots on whose unseen experiments fits are tested: those that all methods meet whose fits are
    /// tested.
    pub fn validated(&self) -> usize {
        let tried = METHODS.iter().filter(|method| method.is_validated());
        tried.map(|method| self.robots_of(method)).min().unwrap_or(0)
    }

    /// Number of trials: one method on one robot each.
    pub fn trials(&self) -> usize {
        METHODS.iter().map(|method| self.robots_of(method)).sum()
    }

    /// Number of evaluations of every method.
    pub fn evaluations(&self) -> u64 {
        u64::from(self.iterations) * u64::from(SAMPLES)
    }
}
