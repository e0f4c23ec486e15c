//! Linear algebra of symmetric matrices in place, on the packed triangle.
//!
//! | file     | what                                                                    |
//! | -------- | ----------------------------------------------------------------------- |
//! | `packed` | where the rows of a triangle begin                                      |
//! | `gram`   | `RᵀR` of many rows, in register tiles                                   |
//! | `normal` | normal equations: their Cholesky factor, Schur complement, solution     |
//! | `jacobi` | eigenvalues and eigenvectors                                            |

pub(crate) mod gram;
pub(crate) mod jacobi;
pub(crate) mod normal;
pub(crate) mod packed;
