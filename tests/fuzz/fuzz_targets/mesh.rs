//! Bytes that call themselves a mesh: STL in text or binary, or COLLADA.
//!
//! A refusal is one line; a body that is found has a volume, and lies within its mesh.
#![no_main]

use flexid::mesh::{Solid, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    match read(bytes).and_then(|triangles| Ok((Solid::of_mesh(&triangles)?.0, triangles))) {
        Ok((solid, triangles)) => {
            assert!(solid.volume > 0.0, "{solid:?}");
            let corners = || triangles.iter().flatten().flatten();
            let largest = corners().fold(0.0_f64, |most, own| most.max(own.abs()));
            // Beyond these sizes volumes are no numbers any more.
            if largest < 1e30 {
                assert!(solid.centre.iter().all(|own| own.is_finite()), "{solid:?}");
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
