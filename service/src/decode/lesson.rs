//! Lessons about objects, and questions which object was touched.

use std::collections::BTreeSet;

use cogmap_proto as wire;
use cogmap_proto::limits::{IDENTIFY_CONTACTS_MAX, LESSON_CONTACTS_MAX};
use cognitive_map::{InvalidSample, Lesson, Touch};
use object_recognition::Orientation;

use super::{contact, fault};

/// Why nothing can be learned or recognised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidContacts {
    /// There are none, or too many.
    #[error("contacts must be 1 to {0}, not {1}")]
    Count(usize, usize),
    /// A contact makes no sense; which field of which.
    #[error("{0}: {rule}", rule = fault::rule(.0, *.1))]
    Contact(String, InvalidSample),
    /// A contact has more than one level, or more than one descriptor, of a channel.
    #[error("{0}: {1:?} is there more than once")]
    Repeated(String, String),
    /// The noise, the spacing or the orientation makes no sense.
    #[error("{0}: {rule}", rule = fault::rule(.0, *.1))]
    Field(String, InvalidSample),
    /// A contact lacks a normal, where the orientation is free.
    #[error("{0}: a free orientation needs the normal of every contact")]
    Normal(String),
    /// The name is none.
    #[error("name: {0}")]
    Name(InvalidSample),
}

/// A lesson that has just come, as the map takes it.
///
/// # Errors
/// Says which rule it breaks.
pub fn lesson(lesson: &wire::ObjectLesson) -> Result<Lesson, InvalidContacts> {
    check_channels(&lesson.contacts)?;
    journaled_lesson(lesson)
}

/// A lesson of the journal: as [`lesson`], but for names of channels, which older versions took in
/// more forms.
///
/// # Errors
/// Says which rule it breaks.
pub(super) fn journaled_lesson(lesson: &wire::ObjectLesson) -> Result<Lesson, InvalidContacts> {
    check_count(lesson.contacts.len(), LESSON_CONTACTS_MAX)?;
    let spacing = contact::spacing(lesson.spacing_m);
    let spacing = spacing.map_err(|error| {
        InvalidContacts::Field(format!("spacing_m {}", lesson.spacing_m), error)
    })?;
    let noise = contact::touch_noise(&lesson.noise);
    let noise = noise.map_err(|error| of_noise(&lesson.noise, error))?;
    let touches = contact::touches(&lesson.contacts, noise);
    let touches = touches.map_err(|refused| of_contact(&lesson.contacts, refused))?;
    Ok(Lesson::new(spacing, touches))
}

/// A sequence of contacts whose object is asked for, and what is known of how it is turned.
///
/// # Errors
/// Says which rule the query breaks.
pub fn touches_to_identify(
    query: &wire::IdentifyQuery,
) -> Result<(Orientation, Vec<Touch>), InvalidContacts> {
    check_count(query.contacts.len(), IDENTIFY_CONTACTS_MAX)?;
    check_channels(&query.contacts)?;
    let orientation = contact::orientation(&query.orientation);
    let orientation =
        orientation.map_err(|error| InvalidContacts::Field("orientation".to_owned(), error))?;
    let noise = contact::touch_noise(&query.noise);
    let noise = noise.map_err(|error| of_noise(&query.noise, error))?;
    let touches = contact::touches(&query.contacts, noise);
    let touches = touches.map_err(|refused| of_contact(&query.contacts, refused))?;
    let bare = query.contacts.iter().position(|one| one.normal.is_none());
    match bare {
        Some(at) if orientation == Orientation::Free => {
            Err(InvalidContacts::Normal(format!("contacts[{at}].normal")))
        }
        _ => Ok((orientation, touches)),
    }
}

fn check_channels(contacts: &[wire::Contact]) -> Result<(), InvalidContacts> {
    let checked = contact::check_channels(contacts);
    checked.map_err(|refused| of_contact(contacts, refused))?;
    for (at, contact) in contacts.iter().enumerate() {
        let levels = contact.levels.iter().map(|level| &level.channel);
        let descriptors = contact.descriptors.iter().map(|seen| &seen.channel);
        check_once(|| format!("contacts[{at}].levels"), levels)?;
        check_once(|| format!("contacts[{at}].descriptors"), descriptors)?;
    }
    Ok(())
}

/// Checks that no channel is there twice: a contact has one value of each.
fn check_once<'a>(
    field: impl Fn() -> String,
    channels: impl Iterator<Item = &'a String>,
) -> Result<(), InvalidContacts> {
    let mut seen = BTreeSet::new();
    for channel in channels {
        if !seen.insert(channel) {
            return Err(InvalidContacts::Repeated(field(), channel.clone()));
        }
    }
    Ok(())
}

fn of_contact(contacts: &[wire::Contact], (at, error): (usize, InvalidSample)) -> InvalidContacts {
    InvalidContacts::Contact(fault::in_contact(at, &contacts[at]), error)
}

fn of_noise(noise: &wire::TouchNoise, error: InvalidSample) -> InvalidContacts {
    InvalidContacts::Field(fault::in_touch_noise(noise), error)
}

fn check_count(count: usize, most: usize) -> Result<(), InvalidContacts> {
    if (1..=most).contains(&count) {
        Ok(())
    } else {
        Err(InvalidContacts::Count(most, count))
    }
}
