//! The thread that solves: it works on record after record until there are no more. It keeps its state, and begins with the
//! state that an earlier daemon kept.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError};
use flexid_pipeline::config::{Config, Validity};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::text::count;
use flexid_pipeline::{Counts, Outcome, Record, Solver, State};
use flexid_wire::finding::Finding;
use flexid_wire::messages::{FromEdge, Phase, Progress};
use flexid_wire::state;
use tracing::{info, warn};

use super::report_log::ReportLog;
use super::{Daemon, Order, UnusedRecords, WORK_NEWS, lock};
use crate::latest::Latest;
use crate::store::Store;

/// Shortest interval between two writes of the state. A state has some MB, and a robot that mills brings a record every few
/// seconds.
const SAVE_EVERY: Duration = Duration::from_secs(60);

/// The solver and the receivers of its results.
pub(super) struct Solving<'a> {
    solver: Solver,
    reports: ReportLog,
    /// Records of an earlier run that the solver has still to be given.
    waiting: VecDeque<Arc<Record>>,
    /// Records that the solver will not be given in this run.
    left: Vec<Arc<Record>>,
    /// Time of the last write of the state.
    saved: Option<Instant>,
    /// Counts of what had come in at the last change since that write. `None` without a change.
    unsaved: Option<Counts>,
    latest: &'a Latest,
    unused: &'a UnusedRecords,
    stop: &'a Stop,
    store: Option<&'a Store>,
}

impl<'a> Solving<'a> {
    /// Continues where the daemon before has ended, and works through the records that it left.
    pub(super) fn begin(
        daemon: &Daemon<'a>,
        latest: &'a Latest,
        unused: &'a UnusedRecords,
    ) -> io::Result<Self> {
        let Daemon { config, stop, store, .. } = *daemon;
        let mut waiting = VecDeque::new();
        let solver = match store.and_then(Store::load) {
            Some(mut state) if carries_over(&state, config, store) => {
                waiting = state.take_waiting().into();
                Solver::resume(config, state, stop, news(latest))?
            }
            _ => Solver::new(config)?,
        };
        let reports = ReportLog::default();
        let mut solving = Self {
            solver,
            reports,
            waiting,
            left: Vec::new(),
            saved: None,
            unsaved: None,
            latest,
            unused,
            stop,
            store,
        };
        solving.publish(&Counts::default());
        solving.work_off(&Counts::default());
        Ok(solving)
    }

    /// Carries out the orders of the reader until there are no more.
    pub(super) fn run(mut self, orders: &Receiver<Order>) -> io::Result<Self> {
        loop {
            match orders.recv_timeout(SAVE_EVERY) {
                Ok(order) => self.obey(order, orders)?,
                Err(RecvTimeoutError::Timeout) => self.save_if_due(),
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        self.solver.work(self.stop, || false, news(self.latest));
        if let Some(records) = self.solver.unused() {
            warn!("{records}");
        }
        Ok(self)
    }

    fn obey(&mut self, order: Order, orders: &Receiver<Order>) -> io::Result<()> {
        match order {
            Order::Record(record, counts) => {
                self.take(&Arc::from(record), &counts, || !orders.is_empty());
                Ok(())
            }
            // The next daemon reads the config itself.
            Order::Reload { .. } if self.stop.requested() => Ok(()),
            Order::Reload { config, counts, anew } => {
                let none = Counts::default();
                let (ended, current) = if anew { (&counts, &none) } else { (&none, &counts) };
                self.reload(&config, ended, current)
            }
        }
    }

    /// Takes a record and works on all unsettled records, until they settle or `more` records are to join them. If the end was
    /// requested, it leaves the record for the next daemon instead.
    fn take(&mut self, record: &Arc<Record>, counts: &Counts, more: impl Fn() -> bool) {
        if self.stop.requested() {
            self.left.push(Arc::clone(record));
            self.solver.leave(1);
            return;
        }
        self.solver.admit(record, self.stop, news(self.latest));
        self.unsaved = Some(*counts);
        let settled = self.solver.work(self.stop, more, news(self.latest));
        // The state is saved first, so that a kill after the first report does not lose the record.
        self.save_if_due();
        if settled {
            self.publish(counts);
        }
    }

    /// Takes the records that wait.
    fn work_off(&mut self, counts: &Counts) {
        while let Some(record) = self.waiting.pop_front() {
            let more = !self.waiting.is_empty();
            self.take(&record, counts, || more);
        }
    }

    /// Continues under another config. `ended` counts what came in on a stream that ends with the old config, `current` what
    /// came in on a stream that goes on.
    fn reload(&mut self, config: &Config, ended: &Counts, current: &Counts) -> io::Result<()> {
        let mut state = self.solver.state(ended, &[]);
        if !carries_over(&state, config, self.store) {
            self.solver = Solver::new(config)?;
            self.latest.withdraw_finding();
            self.publish(current);
            return Ok(());
        }
        self.waiting = state.take_waiting().into();
        self.solver = Solver::resume(config, state, self.stop, news(self.latest))?;
        self.publish(current);
        self.work_off(current);
        self.save(current);
        Ok(())
    }

    /// Sends the progress, and the present finding with its spectra, to clients and the log.
    fn publish(&mut self, counts: &Counts) {
        self.latest.publish(FromEdge::Progress(self.solver.progress()));
        let finding = self.solver.finding(counts, &[]);
        *lock(self.unused) = if finding.is_none() { self.solver.unused() } else { None };
        if let Some(finding) = finding {
            self.reports.log(&finding.report);
            self.publish_finding(finding);
        }
    }

    /// Sends a finding, after the spectra that belong to it.
    fn publish_finding(&mut self, finding: Finding) {
        if let Some(spectra) = self.solver.spectra() {
            self.latest.publish(FromEdge::Spectra(spectra));
        }
        self.latest.publish(FromEdge::Finding(finding));
    }

    /// Saves the state if it has changed, unless it was saved a short time ago.
    fn save_if_due(&mut self) {
        let due = self.saved.is_none_or(|saved| saved.elapsed() >= SAVE_EVERY);
        if let Some(counts) = self.unsaved.filter(|_| due) {
            self.save(&counts);
        }
    }

    fn save(&mut self, counts: &Counts) {
        let Some(store) = self.store else { return };
        (self.saved, self.unsaved) = (Some(Instant::now()), None);
        let waiting: Vec<_> = self.left.iter().chain(&self.waiting).map(Arc::clone).collect();
        let state = self.solver.state(counts, &waiting);
        if state.is_empty() {
            return;
        }
        if let Err(error) = store.save(&state) {
            warn!("{}: cannot be written: {error}: a restart forgets", store.file().display());
        }
    }

    /// Saves the state, adds the last finding to `outcome`, and publishes it.
    pub(super) fn end(mut self, outcome: &mut Outcome) {
        self.save(&outcome.counts);
        outcome.finding = self.solver.finding(&outcome.counts, &outcome.troubles);
        if let Some(records) = self.solver.unused() {
            outcome.state = state::State::Unused(records);
        }
        if let Some(finding) = &mut outcome.finding {
            finding.explain(&outcome.state);
            let finding = finding.clone();
            self.publish_finding(finding);
        }
    }
}

/// Returns a function that publishes progress, at every change of phase and otherwise not too often.
fn news(latest: &Latest) -> impl FnMut(&Progress) {
    let (mut published, mut phase) = (Instant::now(), Phase::Waiting);
    move |progress| {
        if progress.phase != phase || published.elapsed() >= WORK_NEWS {
            latest.publish(FromEdge::Progress(*progress));
            (published, phase) = (Instant::now(), progress.phase);
        }
    }
}

/// Logs how much of a state holds under `config`. Returns whether any of it holds. A state of which nothing holds is put aside.
fn carries_over(state: &State, config: &Config, store: Option<&Store>) -> bool {
    if state.is_empty() {
        return true;
    }
    let [kept, waiting] = state.records();
    let records = count((kept + waiting) as u64, "record");
    match state.validity(config) {
        Validity::Whole => info!("goes on with {records} kept"),
        Validity::Records(changed) => {
            let changed = changed.join(", ");
            info!("{changed} changed: {records} are fitted anew");
            if state.retired() > 0 {
                let retired = count(state.retired(), "older record");
                warn!("{changed} changed: the information of {retired} is given up");
            }
        }
        Validity::Nothing(changed) => {
            let why = format!("of another measurement ({} changed)", changed.join(", "));
            match store {
                Some(store) => store.put_aside(&why),
                None => warn!("{records} {why}: starts anew"),
            }
            return false;
        }
    }
    true
}
