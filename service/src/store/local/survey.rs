//! Verification of a store: every block of every space, read while the service runs or not.

use std::path::Path;

use super::super::log::Survey;
use super::super::{SpaceNumber, StoreError};
use super::{SPACES, numbers, opening, stored_space};

/// What verification has found of one space.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpaceSurvey {
    /// Its number.
    pub number: SpaceNumber,
    /// Its name.
    pub name: String,
    /// Whether its record, which holds name and settings, can be read.
    pub has_record: bool,
    /// What can be read of its journal.
    pub survey: Survey,
}

/// Reads the journals of all spaces of the store in `directory`, or of one. Changes nothing and
/// needs no lock, so a service may run on it.
///
/// # Errors
/// There is no store, no such space, or files that cannot be opened.
pub fn verify(directory: &Path, space: Option<&str>) -> Result<Vec<SpaceSurvey>, StoreError> {
    if !opening::is_store(directory)? {
        opening::refuse_foreign(directory)?;
        return Err(StoreError::Io(format!(
            "there is no store at {}",
            directory.display()
        )));
    }
    let spaces = directory.join(SPACES);
    let mut surveys = Vec::new();
    for number in numbers(&spaces).map_err(|error| StoreError::on_disk(&error, &spaces))? {
        let number = SpaceNumber(number);
        let stored = stored_space(&spaces, number)?;
        if space.is_some_and(|wanted| wanted != stored.name) {
            continue;
        }
        let own = spaces.join(number.0.to_string());
        let survey = match Survey::of(&own, number) {
            // Deleted meanwhile.
            Err(_) if !own.exists() => continue,
            survey => survey.map_err(|error| StoreError::on_disk(&error, &own))?,
        };
        surveys.push(SpaceSurvey {
            number,
            name: stored.name,
            has_record: stored.settings.is_some(),
            survey,
        });
    }
    match space {
        Some(name) if surveys.is_empty() => {
            Err(StoreError::Io(format!("the store has no space {name:?}")))
        }
        _ => Ok(surveys),
    }
}
