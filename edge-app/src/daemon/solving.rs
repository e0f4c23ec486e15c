//! The thread that solves: it works on record after record until there are no more. It keeps its state, and begins with the
//! state that an earlier daemon kept.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError};
use flexid_pipeline::config::{Config, Fingerprint, Validity};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::text::count;
use flexid_pipeline::{Counts, Outcome, Record, Solver, State};
use flexid_wire::finding::Finding;
use flexid_wire::messages::{FromEdge, Phase, Progress};
use flexid_wire::state;
use tracing::{info, warn};

use super::epochs::Epochs;
use super::keeping::Keeping;
use super::order::{Order, UnusedRecords, lock};
use super::report_log::ReportLog;
use super::storing::Storing;
use crate::latest::Latest;
use crate::store::Store;

/// Shortest interval between messages about the work, except at a change of phase.
const WORK_NEWS: Duration = Duration::from_millis(100);
/// Longest time without an order after which the solver looks whether the state is to be written.
const LOOK: Duration = Duration::from_secs(60);

/// The solver and the receivers of its results.
pub(super) struct Solving<'a> {
    solver: Solver,
    reports: ReportLog,
    /// Records of an earlier run that the solver has still to be given.
    waiting: VecDeque<Arc<Record>>,
    /// Records that the solver will not be given in this run.
    left: Vec<Arc<Record>>,
    keeping: Keeping<'a>,
    epochs: Epochs<'a>,
    /// Counts of what had come in at the newest record.
    counts: Counts,
    store: Option<&'a Store>,
    /// State of another measurement that could not be written.
    unwritten: Option<State>,
    latest: &'a Latest,
    unused: &'a UnusedRecords,
    stop: &'a Stop,
}

impl<'a> Solving<'a> {
    /// Continues where the daemon before has ended, and works through the records that it left.
    pub(super) fn begin(
        config: &Config,
        stop: &'a Stop,
        store: Option<&'a Store>,
        latest: &'a Latest,
        unused: &'a UnusedRecords,
    ) -> io::Result<Self> {
        let mut waiting = VecDeque::new();
        let keeping = Keeping::new(store, stop);
        let kept = keeping.storing().map(Storing::load).transpose()?.flatten();
        let solver = match carried_over(kept, &mut None, config, keeping.storing()) {
            Some(mut state) => {
                waiting = state.take_waiting().into();
                Solver::resume(config, state, stop, news(latest))?
            }
            None => Solver::new(config)?,
        };
        let reports = ReportLog::default();
        let mut solving = Self {
            solver,
            reports,
            waiting,
            left: Vec::new(),
            keeping,
            epochs: Epochs::new(config, store, stop)?,
            counts: Counts::default(),
            store,
            unwritten: None,
            latest,
            unused,
            stop,
        };
        solving.publish(&Counts::default());
        solving.work_off(&Counts::default())?;
        Ok(solving)
    }

    /// Carries out the orders of the reader until there are no more.
    pub(super) fn run(mut self, orders: &Receiver<Order>) -> io::Result<Self> {
        loop {
            match orders.recv_timeout(self.keeping.until_due(LOOK)) {
                Ok(order) => self.obey(order, orders)?,
                Err(RecvTimeoutError::Timeout) => {
                    self.save_if_due();
                    self.reports.log_counts();
                }
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.epochs.write();
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
                self.take(&Arc::from(record), &counts, || !orders.is_empty())
            }
            // The next daemon reads the config itself.
            Order::Reload { .. } if self.stop.requested() => Ok(()),
            Order::Reload { config, counts, anew } => {
                let none = Counts::default();
                let (ended, current) = if anew { (&counts, &none) } else { (&none, &counts) };
                if anew {
                    self.counts = none;
                }
                self.reload(&config, ended, current)
            }
        }
    }

    /// Takes a record and works on all unsettled records, until they settle or `more` records are to join them. The record is
    /// saved before this work, or in its midst, as soon as a write is due. If the end was requested, it is left for the next
    /// daemon instead.
    fn take(
        &mut self,
        record: &Arc<Record>,
        counts: &Counts,
        more: impl Fn() -> bool,
    ) -> io::Result<()> {
        if !self.stop.requested() && self.epochs.ends(&self.solver, record) {
            self.end_epoch(record, counts)?;
        }
        if self.stop.requested() {
            self.left.push(Arc::clone(record));
            self.solver.leave(1);
            return Ok(());
        }
        self.counts = *counts;
        self.keeping.note_change(counts);
        let before = self.state(counts, Some(record));
        let Self { solver, keeping, latest, stop, .. } = self;
        let mut publish = news(latest);
        let mut on_progress = |progress: Option<&Progress>| {
            progress.into_iter().for_each(&mut publish);
            if keeping.due().is_some() {
                keeping.save(&before, counts);
            }
        };
        on_progress(None);
        solver.admit(record, stop, |progress| on_progress(Some(progress)));
        let settled = solver.work(stop, more, |progress| on_progress(Some(progress)));
        self.keeping.note_change(counts);
        // The state is saved first, so that a kill after the first report does not lose the record.
        self.save_if_due();
        if settled {
            self.publish(counts);
        }
        Ok(())
    }

    /// Settles the epoch before `next`, leaves its finding, and begins anew. If the end was requested, the epoch is left for the next daemon.
    fn end_epoch(&mut self, next: &Arc<Record>, counts: &Counts) -> io::Result<()> {
        self.keeping.note_change(counts);
        let before = self.state(counts, Some(next));
        let Self { solver, keeping, latest, stop, .. } = self;
        let mut publish = news(latest);
        solver.work(
            stop,
            || false,
            |progress| {
                publish(progress);
                if keeping.due().is_some() {
                    keeping.save(&before, counts);
                }
            },
        );
        if self.stop.requested() {
            return Ok(());
        }
        self.epochs.take(&self.solver, &self.counts)?;
        self.solver = self.solver.anew(&self.counts)?;
        // From here on a restart begins with the next epoch.
        self.keeping.save(&self.state(counts, Some(next)), counts);
        Ok(())
    }

    /// Takes the records that wait.
    fn work_off(&mut self, counts: &Counts) -> io::Result<()> {
        while let Some(record) = self.waiting.pop_front() {
            let more = !self.waiting.is_empty();
            self.take(&record, counts, || more)?;
        }
        Ok(())
    }

    /// Continues under another config. `ended` counts what came in on a stream that ends with the old config, `current` what
    /// came in on a stream that goes on.
    fn reload(&mut self, config: &Config, ended: &Counts, current: &Counts) -> io::Result<()> {
        let state = self.state(ended, None);
        if matches!(state.validity(config), Validity::Nothing(_)) {
            // The file that is put aside holds the newest state.
            if !self.keeping.save(&state, ended) {
                self.unwritten = Some(state.clone());
            }
            self.latest.withdraw_finding();
        }
        let storing = self.keeping.storing();
        self.solver = match carried_over(Some(state), &mut self.unwritten, config, storing) {
            Some(mut state) => {
                self.waiting = state.take_waiting().into();
                Solver::resume(config, state, self.stop, news(self.latest))?
            }
            None => Solver::new(config)?,
        };
        self.epochs.follow(config, self.store)?;
        self.publish(current);
        self.work_off(current)?;
        self.keeping.save(&self.state(current, None), current);
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

    /// Saves the state if it has changed and a write is due.
    fn save_if_due(&mut self) {
        if let Some(counts) = self.keeping.due() {
            self.keeping.save(&self.state(&counts, None), &counts);
        }
    }

    /// Returns the state with all records that the solver has still to be given: `next`, and those that wait.
    fn state(&self, counts: &Counts, next: Option<&Arc<Record>>) -> State {
        let waiting = self.left.iter().chain(next).chain(&self.waiting);
        self.solver.state(counts, &waiting.map(Arc::clone).collect::<Vec<_>>())
    }

    /// Saves the state, adds the last finding to `outcome`, and publishes it.
    pub(super) fn end(mut self, outcome: &mut Outcome) {
        self.epochs.end();
        self.keeping.save(&self.state(&outcome.counts, None), &outcome.counts);
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

/// Returns `state` if any of it holds under `config`, or else the state of this measurement that was `unwritten` or put aside before.
fn carried_over(
    state: Option<State>,
    unwritten: &mut Option<State>,
    config: &Config,
    storing: Option<&Storing<'_>>,
) -> Option<State> {
    let is_of_config = |state: &mut State| !matches!(state.validity(config), Validity::Nothing(_));
    let holds = |state: &State| holds(state, config, storing);
    let aside = || storing?.take_back(Fingerprint::of(config));
    state.filter(holds).or_else(|| unwritten.take_if(is_of_config).or_else(aside).filter(holds))
}

/// Logs how much of a state holds under `config`. Returns whether any of it holds. A state of which nothing holds is put aside.
fn holds(state: &State, config: &Config, storing: Option<&Storing<'_>>) -> bool {
    if state.is_empty() {
        return !matches!(state.validity(config), Validity::Nothing(_));
    }
    let [kept, waiting] = state.records();
    let records = count((kept + waiting) as u64, "record");
    match state.validity(config) {
        Validity::Whole if state.lacks_fit() => warn!(
            "the fit is of another version of flexid-edge, or damaged: {records} are fitted anew, the information of older ones is given up"
        ),
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
            match storing {
                Some(storing) => storing.put_aside(state.fingerprint(), why),
                None => warn!("{records} {why}: starts anew, and keeps them in memory"),
            }
            return false;
        }
    }
    true
}
