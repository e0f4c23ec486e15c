//! The equation of motion and its integrator, against what shares no code with them.

mod convergence;
mod dynamics;
mod energy;
mod linear;
mod mechanics;
mod mujoco;
#[rustfmt::skip]
mod reference;
mod travel;
