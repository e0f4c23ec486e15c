//! The robots of a fleet, each with its newest result.

use std::path::{Path, PathBuf};

use flexid_pipeline::input::BadInput;
use flexid_pipeline::text::count;
use flexid_prediction::document::Found;
use flexid_prediction::fleet::OTHERS;

use crate::compare::{differing, is_of_kinematics};
use crate::findings::{Read, by_date, entries, is_result};

/// Robots that a fleet rests on.
pub(crate) struct Robots {
    /// In the order in which they are named.
    pub(crate) used: Vec<Robot>,
    /// What was left out and why, and what differs, a line each.
    pub(crate) notes: Vec<String>,
}

/// A robot and its newest result.
pub(crate) struct Robot {
    pub(crate) name: String,
    pub(crate) file: PathBuf,
    pub(crate) found: Found,
}

impl Robots {
    /// Reads the results of robots. Each path is a robot: a result, or a folder with its results. A folder alone stands for what is in it.
    ///
    /// # Errors
    /// A file that is named is no result, the robots are of more than one type, or they are too few.
    pub(crate) fn load(paths: &[PathBuf]) -> Result<Self, BadInput> {
        let mut read = Read::default();
        // Paths of robots, and the number of results of each.
        let mut robots: Vec<(PathBuf, usize)> = Vec::new();
        let mut add = |read: &mut Read, path: &Path, is_named: bool| {
            let before = read.used.len();
            match is_named || path.is_dir() {
                true => read.add(path)?,
                false if is_result(path) => read.add_if_result(path.to_owned()),
                false => {}
            }
            robots.push((path.to_owned(), read.used.len() - before));
            Ok(())
        };
        match paths {
            [plant] if plant.is_dir() => {
                entries(plant)?.iter().try_for_each(|path| add(&mut read, path, false))?;
            }
            _ => paths.iter().try_for_each(|path| add(&mut read, path, true))?,
        }
        let Read { used, mut notes, .. } = read;
        let mut results = used.into_iter();
        let (mut used, mut several) = (Vec::new(), 0);
        for (path, number) in robots {
            let mut own: Vec<(PathBuf, Found)> = results.by_ref().take(number).collect();
            if own.len() > 1 {
                several += 1;
                if by_date(&mut own).is_none() {
                    let folder = path.display();
                    notes.push(format!(
                        "{folder}: not all results have a date of their own: the last one by its name counts"
                    ));
                }
            }
            if own.is_empty() && path.is_dir() {
                notes.push(format!("left out: {}: has no result that counts", path.display()));
            }
            used.extend(own.pop().map(|(file, found)| Robot { name: name(&path), file, found }));
        }
        if several > 0 {
            let of = count(several, "robot");
            notes.push(format!("the newest result counts of {of} with several"));
        }
        are_enough(&used, paths)?;
        notes.extend(of_models(&used)?);
        let lacking = used.iter().filter(|own| own.found.shared.is_none()).count();
        if lacking > 0 {
            let of = count(lacking as u64, "result");
            notes.push(format!(
                "{of} of an older flexid: errors that robots share do not cancel between them, and intervals are wider"
            ));
        }
        distinguish(&mut used);
        Ok(Self { used, notes })
    }
}

/// The name of a robot: that of its folder, or of its file without the ending.
fn name(path: &Path) -> String {
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
    name.map_or_else(|| path.display().to_string(), |own| own.to_string_lossy().into_owned())
}

/// Names robots by their files where two have one name, as of `R1/found.json` and `R2/found.json`.
fn distinguish(robots: &mut [Robot]) {
    let names: Vec<String> = robots.iter().map(|own| own.name.clone()).collect();
    for own in robots {
        if names.iter().filter(|name| **name == own.name).count() > 1 {
            own.name = own.file.display().to_string();
        }
    }
}

fn are_enough(robots: &[Robot], paths: &[PathBuf]) -> Result<(), BadInput> {
    if robots.len() > OTHERS {
        return Ok(());
    }
    let which = paths.first().map_or(Path::new(""), PathBuf::as_path);
    let (needed, of) = (OTHERS + 1, count(robots.len() as u64, "robot"));
    let why = format!(
        "{of} can be compared, and a fleet needs {needed}: name a result of `flexid identify --json`, whose fit is consistent, or a folder of such for each robot, or one folder with all of these"
    );
    Err(BadInput::new(which, why))
}

/// What differs in the models of robots of one type, a line each.
///
/// # Errors
/// A robot is of another type.
fn of_models(robots: &[Robot]) -> Result<Vec<String>, BadInput> {
    let mut notes = Vec::new();
    let Some((first, others)) = robots.split_first() else { return Ok(notes) };
    for own in others {
        let [model, of_first] = [own, first].map(|own| own.found.robot.model());
        let differing = differing(of_first, model);
        let (file, keys) = (own.file.display(), differing.join(", "));
        if differing.iter().any(|key| is_of_kinematics(key)) {
            let name = first.file.display();
            let why = format!(
                "is of another type than {name}: their models differ in {keys}: name results of robots of one type"
            );
            return Err(BadInput::new(&own.file, why));
        }
        if !differing.is_empty() {
            notes.push(format!(
                "{file}: the model has another {keys} than the first: what differs in a model shows in the parameters"
            ));
        }
    }
    Ok(notes)
}
