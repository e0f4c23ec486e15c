//! News of the bus: its health for the wire, and log lines about its faults.

use flexid_pipeline::Counts;
use flexid_pipeline::source::{ErrorCounts, LinkState, SourceHealth};
use flexid_wire::messages::{BusErrors, BusHealth, BusState};
use tracing::{info, warn};

/// Returns the state of the bus and its counters. `given_up` is the number of samples for which the solver had no room.
pub(super) fn bus_health(
    counts: &Counts,
    health: &SourceHealth,
    given_up: u64,
    frames_per_second: f64,
) -> BusHealth {
    let stream = &counts.stream;
    BusHealth {
        state: match health.link {
            LinkState::Up => BusState::Up,
            LinkState::Down => BusState::Down,
            LinkState::BusOff => BusState::BusOff,
            LinkState::Gone => BusState::Gone,
        },
        frames: stream.frames,
        frames_lost: stream.frames_lost,
        bridged: stream.bridged,
        restarts: stream.restarts,
        repeated: stream.repeated,
        frames_wrong_length: counts.wrong_length,
        frames_unknown: counts.unknown,
        frames_not_data: counts.not_data,
        frames_clipped: counts.clipped,
        kernel_dropped: health.kernel_dropped,
        receive_buffer_bytes: health.receive_buffer_bytes,
        samples_discarded: stream.samples_discarded + given_up,
        refused: stream.refused,
        wrong_rate: stream.wrong_rate,
        measured_rate_hz: stream.measured_rate_hz,
        frames_per_second,
        fault: health.fault.clone(),
        errors: bus_errors(&health.errors),
        doubtful_rate: stream.doubtful_rate,
        measured_rate_std_hz: stream.measured_rate_std_hz,
    }
}

/// Converts the error counts for the wire.
fn bus_errors(errors: &ErrorCounts) -> BusErrors {
    BusErrors {
        bus_off: errors.bus_off,
        restarted: errors.restarted,
        controller_passive: errors.controller_passive,
        controller_warning: errors.controller_warning,
        controller_overflow: errors.controller_overflow,
        protocol: errors.protocol,
        no_acknowledgement: errors.no_acknowledgement,
        transceiver: errors.transceiver,
        lost_arbitration: errors.lost_arbitration,
        transmit_timeout: errors.transmit_timeout,
    }
}

/// Logs each fault of the bus when it comes and when it is over. Returns `now`.
pub(super) fn log_changes(before: &SourceHealth, now: SourceHealth) -> SourceHealth {
    if now.fault != before.fault {
        match (&now.fault, &before.fault) {
            (Some(fault), _) => warn!("{fault}"),
            (None, Some(fault)) if before.link == LinkState::Up => info!("over: {fault}"),
            (None, _) => info!("the link is up again"),
        }
    }
    let errors = now.errors.bus_off - before.errors.bus_off;
    if errors > 0 && now.link != LinkState::BusOff {
        warn!("the controller was bus-off in the meantime, {errors} times");
    }
    if now.kernel_dropped > before.kernel_dropped {
        let dropped = now.kernel_dropped - before.kernel_dropped;
        warn!("the kernel dropped {dropped} frames: raise net.core.rmem_max");
    }
    now
}
