//! Cost of the work, and the method that has led to the estimate.

/// Cost of the work, by method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Effort {
    /// Searches begun.
    pub starts: u32,
    /// Number of them that are the paper's random searches; the others are descents.
    pub random_searches: u32,
    /// Branches of minima that have been refined.
    pub branches: u32,
    /// Steps of the descents and samples of the random searches.
    pub search_evaluations: u64,
    /// Refinement iterations.
    pub refine_iterations: u64,
}

/// Method that has led to an estimate; later records refine it from there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FoundBy {
    /// The refinement alone, from the middle of the bounds: of static tests.
    Refinement,
    /// A descent from low to high frequencies.
    Descent,
    /// The paper's random search.
    RandomSearch,
    /// The refinement of another minimum's branch.
    Branch,
}
