//! One lane that counts what is computed in it: the operations that a kernel needs, whatever becomes of them.
//!
//! A multiplication counts one, alone or fused with an addition; so does a division, of which there are six a joint. Lone
//! additions are counted apart: some processors have units of their own for them. A change of sign counts nothing: it
//! becomes part of the next operation. So a complex multiply-add counts four.

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use flexid_core::receptance::lanes::{Kernel, Lanes};

thread_local! {
    static MULTIPLICATIONS: Cell<u64> = const { Cell::new(0) };
    static ADDITIONS: Cell<u64> = const { Cell::new(0) };
}

/// The result of a kernel.
pub(crate) struct Operations {
    /// Multiplications, fused multiply-adds and divisions.
    pub(crate) multiplications: u64,
    /// Additions and subtractions alone.
    pub(crate) additions: u64,
}

/// Those of `kernel`, one bin after the other.
pub(crate) fn operations(kernel: impl Kernel<f32>) -> Operations {
    MULTIPLICATIONS.set(0);
    ADDITIONS.set(0);
    kernel.run(Counted(0.0));
    Operations { multiplications: MULTIPLICATIONS.get(), additions: ADDITIONS.get() }
}

#[derive(Clone, Copy)]
struct Counted(f32);

fn multiplied(result: f32) -> Counted {
    MULTIPLICATIONS.set(MULTIPLICATIONS.get() + 1);
    Counted(result)
}

fn added(result: f32) -> Counted {
    ADDITIONS.set(ADDITIONS.get() + 1);
    Counted(result)
}

impl Lanes for Counted {
    type Scalar = f32;
    const WIDTH: usize = 1;
    const REGISTERS: usize = 1;
    type Each<T: Copy> = [T; 1];
    fn each<T: Copy>(value: T) -> [T; 1] {
        [value]
    }
    fn fill(self, value: f32) -> Self {
        Self(value)
    }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        multiplied(self.0 * factor.0 + term.0)
    }
    fn load(self, values: &[f32]) -> Self {
        Self(values[0])
    }
    fn store(self, values: &mut [f32]) {
        values[0] = self.0;
    }
}

impl Add for Counted {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        added(self.0 + other.0)
    }
}

impl Sub for Counted {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        added(self.0 - other.0)
    }
}

impl Mul for Counted {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        multiplied(self.0 * other.0)
    }
}

impl Div for Counted {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        multiplied(self.0 / other.0)
    }
}

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}
