//! The experiments that a solver keeps: those of the measured receptances, and the newest records of each pose.

use std::sync::Arc;

use super::Solver;
use super::experiment::of_receptance;
use super::retention::{Entry, Room, find_room};
use crate::record::{Experiment, MAX_EXPERIMENTS, Record, same_pose};

impl Solver {
    /// Makes experiments of the measured receptances.
    pub(super) fn take_receptances(&mut self) {
        let config = Arc::clone(&self.config);
        for receptance in &config.receptances {
            self.came += 1;
            match of_receptance(&config, &self.chain, &self.stiffest, receptance) {
                Ok(experiment) => {
                    if let Some(ratio) = self.ratio(&experiment) {
                        self.scale.note(ratio);
                    }
                    self.experiments.push(experiment);
                    self.sources.push(None);
                    self.numbers.push(self.came);
                    (self.has_new_receptances, self.changed) = (true, true);
                }
                Err(fault) => self.refused.note(fault),
            }
        }
    }

    /// Returns where there is room for an experiment. Measured receptances stay.
    pub(super) fn room(&self, experiment: &Experiment) -> Room {
        fn entry(experiment: &Experiment) -> Entry<'_> {
            let has_force = |axis: usize| experiment.force_noise[axis].iter().any(|own| *own > 0.0);
            let measured = std::array::from_fn(|axis| match axis {
                0..3 => has_force(axis),
                _ => experiment.measures(axis - 3),
            });
            let Experiment { pose, point, spacing, divided, .. } = experiment;
            // That of the whole record, whose length counts.
            let spacing = spacing / *divided as f64;
            Entry { pose, point: *point, measured, spacing }
        }
        let receptances = self.experiments.len() - self.sources.iter().flatten().count();
        let kept: Vec<Entry> = self.experiments[receptances..].iter().map(entry).collect();
        match find_room(&kept, &entry(experiment), MAX_EXPERIMENTS - receptances) {
            Room::Instead(index) => Room::Instead(receptances + index),
            room => room,
        }
    }

    /// Keeps an experiment if there is room for it. Returns whether it is kept.
    pub(super) fn keep(&mut self, experiment: Experiment, record: &Record) -> bool {
        match self.room(&experiment) {
            Room::Free => {}
            Room::Instead(index) => self.give_up(index),
            Room::Nowhere => {
                self.too_short += 1;
                return false;
            }
        }
        self.experiments.push(experiment);
        let record = Arc::new(record.clone());
        self.sources.push(Some(Arc::clone(&record)));
        self.numbers.push(self.came);
        self.unsettled.push(record);
        self.changed = true;
        true
    }

    /// Removes an experiment. Its information stays, if the estimate is consistent and the rate of the record is not doubtful.
    pub(super) fn give_up(&mut self, index: usize) {
        let is_doubtful = self.sources[index].as_ref().is_some_and(|own| own.has_doubtful_rate);
        let retired = !is_doubtful && self.retire(index);
        let retiring = self.experiments.remove(index);
        self.sources.remove(index);
        let number = self.numbers.remove(index);
        let shares_pose = |other: &Experiment| same_pose(&other.pose, &retiring.pose);
        let last = !self.experiments.iter().any(shares_pose);
        if !retired {
            self.taken.forget(number);
        }
        self.dropped_poses += u64::from(last && !retired);
    }

    /// Adds the information of an experiment to that of the retired ones. Returns whether it has.
    fn retire(&mut self, index: usize) -> bool {
        let Self { identifier, experiments, plant, of_plant, .. } = self;
        match (plant, of_plant) {
            (Some(plant), Some(of_plant)) => {
                identifier.retire_on_plant(experiments, index, plant, of_plant)
            }
            (Some(_), None) => false,
            (None, _) => identifier.retire(&experiments[index]),
        }
    }
}
