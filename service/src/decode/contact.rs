//! Contacts with objects, and marks of episodes.

use cogmap_proto as wire;
use cogmap_proto::limits::ROTATIONS_MAX;
use cognitive_map::{
    InvalidSample, Label, ObjectMark, PoseNoise, Spacing, StartPose, Touch, TouchLevel, TouchNoise,
};
use object_recognition::{Orientation, Reached};

use super::name::{check_name, object_name};
use super::percept::descriptor;

pub(super) fn object_mark(mark: &wire::ObjectMark) -> Result<ObjectMark, InvalidSample> {
    Ok(match mark {
        wire::ObjectMark::Learn {
            name,
            spacing_m,
            orientation: turned,
            noise,
        } => ObjectMark::Learn {
            name: name.as_deref().map(object_name).transpose()?,
            spacing: spacing(*spacing_m)?,
            orientation: orientation(turned)?,
            noise: touch_noise(noise)?,
        },
        wire::ObjectMark::Identify {
            orientation: turned,
            noise,
        } => ObjectMark::Identify {
            orientation: orientation(turned)?,
            noise: touch_noise(noise)?,
            learns: true,
        },
        wire::ObjectMark::Recognise {
            orientation: turned,
            noise,
        } => ObjectMark::Identify {
            orientation: orientation(turned)?,
            noise: touch_noise(noise)?,
            learns: false,
        },
        wire::ObjectMark::End {} => ObjectMark::End,
    })
}

/// Checks the names of channels of contacts that have just come.
///
/// # Errors
/// Says which contact names none, by its place in the list.
pub(super) fn check_channels(contacts: &[wire::Contact]) -> Result<(), (usize, InvalidSample)> {
    for (at, contact) in contacts.iter().enumerate() {
        let levels = contact.levels.iter().map(|level| &level.channel);
        let descriptors = contact.descriptors.iter().map(|seen| &seen.channel);
        for channel in levels.chain(descriptors) {
            check_name(channel).map_err(|error| (at, error))?;
        }
    }
    Ok(())
}

/// Reads how far apart the places of an object are \[m\].
///
/// # Errors
/// It is out of range.
pub(super) fn spacing(spacing_m: f64) -> Result<Spacing, InvalidSample> {
    Spacing::new(spacing_m)
}

/// Reads how exactly is felt.
///
/// # Errors
/// A deviation is negative or out of range.
pub(super) fn touch_noise(noise: &wire::TouchNoise) -> Result<TouchNoise, InvalidSample> {
    TouchNoise::new(noise.position_sd_m, noise.normal_sd_rad, noise.level_sd)
}

/// Reads how a frame may be turned.
///
/// # Errors
/// A rotation is not a unit quaternion, or there are none or too many.
pub(super) fn orientation(orientation: &wire::Orientation) -> Result<Orientation, InvalidSample> {
    Ok(match orientation {
        wire::Orientation::Known {} => Orientation::Known,
        wire::Orientation::Cube {} => Orientation::cube(),
        wire::Orientation::Free {} => Orientation::Free,
        wire::Orientation::Yaw {} => Orientation::Yaw,
        wire::Orientation::Finite { rotations_xyzw } => {
            if !(1..=ROTATIONS_MAX).contains(&rotations_xyzw.len()) {
                return Err(InvalidSample::NumberOutOfRange);
            }
            let rotations = rotations_xyzw.iter().map(|xyzw| {
                let pose = StartPose::new([0.0; 3], *xyzw, PoseNoise::none())?;
                Ok(pose.pose().rotation)
            });
            Orientation::Finite(rotations.collect::<Result<_, _>>()?)
        }
    })
}

/// Reads contacts.
///
/// # Errors
/// Says which contact makes no sense, by its place in the list, and why.
pub(super) fn touches(
    contacts: &[wire::Contact],
    noise: TouchNoise,
) -> Result<Vec<Touch>, (usize, InvalidSample)> {
    let touches = contacts.iter().enumerate();
    touches
        .map(|(at, contact)| touch(contact, noise).map_err(|error| (at, error)))
        .collect()
}

pub(super) fn touch(contact: &wire::Contact, noise: TouchNoise) -> Result<Touch, InvalidSample> {
    let levels = contact
        .levels
        .iter()
        .map(|level| TouchLevel::new(Label::new(&level.channel)?, level.value, noise.level_sd()));
    let levels: Vec<_> = levels.collect::<Result<_, _>>()?;
    let descriptors: Vec<_> = { contact.descriptors.iter() }
        .map(descriptor)
        .collect::<Result<_, _>>()?;
    let mut touch = Touch::new(contact.position_m, noise)?
        .with_levels(levels)
        .with_descriptors(descriptors)
        .with_drift(contact.drift_sd_m)?;
    if let Some(normal) = contact.normal {
        touch = touch.with_normal(normal)?;
    }
    Ok(touch.reached(match contact.reached {
        wire::Reached::Found => Reached::Found,
        wire::Reached::Aimed => Reached::Aimed,
        wire::Reached::Drawn => Reached::Drawn,
    }))
}
