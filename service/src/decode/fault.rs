//! Which field breaks a rule, for whoever asked. Each field is tried by itself by the rules that
//! refused the whole; so nothing is decided here, and what makes sense pays nothing for it.

use std::fmt::Debug;

use cogmap_proto as wire;
use cogmap_proto::limits::{
    DESCRIPTOR_LEN_MAX, DESCRIPTOR_LEN_MIN, DURATION_S_MAX, LABEL_BYTES_MAX, METRES_MAX,
    NAME_BYTES_MAX, RADIANS_PER_SECOND_MAX, ROTATIONS_MAX,
};
use cognitive_map::{
    Descriptor, InvalidSample, Label, Level, Motion, PoseNoise, Spacing, StartPose, Touch,
    TouchNoise,
};
use serde::Serialize;

use super::contact::{check_channels, orientation, spacing, touch, touch_noise};
use super::motion::noise;
use super::name::check_name;
use super::sighting::relation;

/// Most characters of a value that are shown.
const SHOWN_MAX: usize = 80;

/// A rotation by nothing.
const IDENTITY_XYZW: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// The first field that is refused, with its value; nothing where each by itself makes sense.
struct Fault(Option<String>);

impl Fault {
    /// Goes on to the next field: its name and value, and what the rules say of it alone.
    fn or<T, E>(self, name: &str, value: &dyn Debug, alone: Result<T, E>) -> Self {
        match (self.0, alone) {
            (None, Err(_)) => Self(Some(format!("{name} {}", cut(&format!("{value:?}"))))),
            (found, _) => Self(found),
        }
    }

    /// The same of a value with fields of its own, which is shown as JSON.
    fn or_json<T, E>(self, name: &str, value: &impl Serialize, alone: Result<T, E>) -> Self {
        let shown = match alone {
            Err(_) => serde_json::to_string(value).unwrap_or_default(),
            Ok(_) => String::new(),
        };
        self.or(name, &format_args!("{shown}"), alone)
    }

    /// The path of the field and its value, or the path of the whole.
    fn within(self, whole: &str) -> String {
        match self.0 {
            Some(field) => format!("{whole}.{field}"),
            None => whole.to_owned(),
        }
    }
}

/// A text as far as a line shows it.
fn cut(text: &str) -> String {
    match text.char_indices().nth(SHOWN_MAX) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// The field of a sample.
pub(super) fn in_sample(sample: &wire::Sample) -> String {
    match &sample.body {
        wire::SampleBody::Increment(body) => in_increment(body).within("body.increment"),
        wire::SampleBody::Velocity(body) => in_velocity(body).within("body.velocity"),
        wire::SampleBody::Level(level) => in_level(level).within("body.level"),
        wire::SampleBody::Descriptor(body) => in_descriptor(body).within("body.descriptor"),
        wire::SampleBody::Sighting(body) => Fault(None)
            .or_json("target", &body.target, name_of(&body.target))
            .or_json("relation", &body.relation, relation(&body.relation))
            .within("body.sighting"),
        wire::SampleBody::StartPose(body) => Fault(None)
            .or(
                "translation_m",
                &body.translation_m,
                pose(body.translation_m, IDENTITY_XYZW),
            )
            .or(
                "rotation_xyzw",
                &body.rotation_xyzw,
                pose([0.0; 3], body.rotation_xyzw),
            )
            .or_json("noise", &body.noise, noise(body.noise))
            .within("body.start_pose"),
        wire::SampleBody::Marker(marker) => Fault(None)
            .or("label", &marker.label, Label::new(&marker.label))
            .within("body.marker"),
        wire::SampleBody::Object(mark) => in_object_mark(mark),
        wire::SampleBody::SessionEnd {} => "body.session_end".to_owned(),
    }
}

/// Why a sample that has just come is refused: its field, the value and the rule. Nothing of one
/// that makes sense.
pub fn refusal(sample: &wire::Sample) -> Option<String> {
    let error = super::sample::sample(sample).err()?;
    let field = in_sample(sample);
    let rule = rule(&field, error);
    Some(format!("{field}: {rule}"))
}

/// Whether what was seen can be called so, as of a sample that has just come.
fn name_of(target: &wire::Target) -> Result<(), InvalidSample> {
    match target {
        wire::Target::Agent(name) => check_name(name),
        wire::Target::Landmark(label) => Label::new(label).map(drop),
        wire::Target::OwnSample(_) => Ok(()),
    }
}

/// What a field must be, where the core's word for it has no limits.
pub(super) fn rule(field: &str, error: InvalidSample) -> String {
    let path = field.split(' ').next().unwrap_or_default();
    let name = path.rsplit('.').next().unwrap_or_default();
    match (error, name) {
        (InvalidSample::NumberOutOfRange, "duration_s") => {
            format!("must be 0 to {DURATION_S_MAX} s")
        }
        (InvalidSample::NumberOutOfRange, "angular_rad_s") => {
            format!("must be finite, and at most {RADIANS_PER_SECOND_MAX} rad/s")
        }
        (InvalidSample::NumberOutOfRange, "translation_m" | "linear_m_s" | "offset_m") => {
            format!("must be finite, and at most {METRES_MAX:e}")
        }
        (InvalidSample::NumberOutOfRange, "position_m") => {
            format!("must be finite, and at most {:e}", Touch::POSITION_MAX_M)
        }
        (InvalidSample::NumberOutOfRange, "spacing_m") => {
            let (least, most) = (Spacing::RANGE_M.start(), Spacing::RANGE_M.end());
            format!("must be {least:e} to {most} m")
        }
        (InvalidSample::NumberOutOfRange, "orientation") => {
            format!("must have 1 to {ROTATIONS_MAX} rotations")
        }
        (InvalidSample::NumberOutOfRange, "value") => "must be finite".to_owned(),
        (InvalidSample::NumberOutOfRange, "relation") => {
            format!("must have finite numbers of at most {METRES_MAX:e}, and no negative range")
        }
        (InvalidSample::NonUnitQuaternion, _) => {
            "must be a unit quaternion [x, y, z, w]".to_owned()
        }
        (InvalidSample::InvalidDescriptor, _) => format!(
            "must be {DESCRIPTOR_LEN_MIN} to {DESCRIPTOR_LEN_MAX} numbers that are not all zero"
        ),
        (InvalidSample::InvalidLabel, "channel") => name_rule(),
        (InvalidSample::InvalidLabel, "levels" | "descriptors") => {
            format!("a channel {}", name_rule())
        }
        (InvalidSample::InvalidLabel, "target") if field.contains("{\"agent\":") => name_rule(),
        (InvalidSample::InvalidLabel, "label" | "target") => {
            format!("must be 1 to {LABEL_BYTES_MAX} bytes without control characters")
        }
        _ => error.to_string(),
    }
}

/// What a name of an agent or a channel is.
fn name_rule() -> String {
    format!(
        "must be a name: 1 to {NAME_BYTES_MAX} of A-Z a-z 0-9 _ . -, the first a letter or digit"
    )
}

/// The field of a motion that is asked about.
pub(super) fn in_motion(motion: &wire::MotionBody) -> String {
    match motion {
        wire::MotionBody::Increment(body) => in_increment(body).within("motion.increment"),
        wire::MotionBody::Velocity(body) => in_velocity(body).within("motion.velocity"),
    }
}

/// The field of a percept that is a cue.
pub(super) fn in_percept(cue: &wire::PerceptCue) -> String {
    match cue {
        wire::PerceptCue::Level(level) => in_level(level).within("percept.level"),
        wire::PerceptCue::Descriptor(body) => in_descriptor(body).within("percept.descriptor"),
    }
}

/// The field of a contact that stands at a place of a list.
pub(super) fn in_contact(at: usize, contact: &wire::Contact) -> String {
    let plain = || TouchNoise::new(0.001, 0.1, 0.1);
    let at_origin = || plain().and_then(|noise| Touch::new([0.0; 3], noise));
    let normal = contact.normal.map(|normal| {
        let touch = at_origin()?;
        touch.with_normal(normal)
    });
    let drift = at_origin().and_then(|touch| touch.with_drift(contact.drift_sd_m));
    let position = plain().and_then(|noise| Touch::new(contact.position_m, noise));
    // Its percepts of one kind.
    let felt = |levels: &[wire::ContactLevel], descriptors: &[wire::Descriptor]| {
        let felt = wire::Contact {
            position_m: [0.0; 3],
            normal: None,
            drift_sd_m: 0.0,
            levels: levels.to_vec(),
            descriptors: descriptors.to_vec(),
            reached: contact.reached,
        };
        check_channels(std::slice::from_ref(&felt)).map_err(|(_, error)| error)?;
        plain().and_then(|noise| touch(&felt, noise))
    };
    Fault(None)
        .or("position_m", &contact.position_m, position)
        .or_json("normal", &contact.normal, normal.transpose())
        .or("drift_sd_m", &contact.drift_sd_m, drift)
        .or_json("levels", &contact.levels, felt(&contact.levels, &[]))
        .or_json(
            "descriptors",
            &contact.descriptors,
            felt(&[], &contact.descriptors),
        )
        .within(&format!("contacts[{at}]"))
}

/// The field of a mark of an episode.
fn in_object_mark(mark: &wire::ObjectMark) -> String {
    let (given, touch, spacing_m) = match mark {
        wire::ObjectMark::Learn {
            orientation,
            noise,
            spacing_m,
            ..
        } => (orientation, noise, Some(*spacing_m)),
        wire::ObjectMark::Identify { orientation, noise }
        | wire::ObjectMark::Recognise { orientation, noise } => (orientation, noise, None),
        wire::ObjectMark::End {} => return "body.object".to_owned(),
    };
    let fault = Fault(None)
        .or_json("spacing_m", &spacing_m, spacing_m.map(spacing).transpose())
        .or_json("orientation", given, orientation(given));
    match fault.0 {
        None if touch_noise(touch).is_err() => format!("body.object.{}", in_touch_noise(touch)),
        found => Fault(found).within("body.object"),
    }
}

/// The field of the noise of contacts.
pub(super) fn in_touch_noise(given: &wire::TouchNoise) -> String {
    let alone = |position_sd_m, normal_sd_rad, level_sd| {
        touch_noise(&wire::TouchNoise {
            position_sd_m,
            normal_sd_rad,
            level_sd,
        })
    };
    let plain = wire::TouchNoise::default();
    let wire::TouchNoise {
        position_sd_m: position,
        normal_sd_rad: normal,
        level_sd: level,
    } = *given;
    Fault(None)
        .or(
            "position_sd_m",
            &position,
            alone(position, plain.normal_sd_rad, plain.level_sd),
        )
        .or(
            "normal_sd_rad",
            &normal,
            alone(plain.position_sd_m, normal, plain.level_sd),
        )
        .or(
            "level_sd",
            &level,
            alone(plain.position_sd_m, plain.normal_sd_rad, level),
        )
        .within("noise")
}

fn in_increment(body: &wire::Increment) -> Fault {
    let turned = Motion::from_increment([0.0; 3], body.rotation_xyzw, None);
    let moved = Motion::from_increment(body.translation_m, IDENTITY_XYZW, None);
    Fault(None)
        .or("translation_m", &body.translation_m, moved)
        .or("rotation_xyzw", &body.rotation_xyzw, turned)
        .or_json("noise", &body.noise, noise(body.noise))
}

fn in_velocity(body: &wire::Velocity) -> Fault {
    let (linear, angular) = (body.linear_m_s, body.angular_rad_s);
    let still = [0.0; 3];
    let held = Motion::from_velocity(still, still, body.duration_s, None);
    Fault(None)
        .or(
            "linear_m_s",
            &linear,
            Motion::from_velocity(linear, still, 0.0, None),
        )
        .or(
            "angular_rad_s",
            &angular,
            Motion::from_velocity(still, angular, 0.0, None),
        )
        .or("duration_s", &body.duration_s, held)
        .or_json("noise", &body.noise, noise(body.noise))
}

fn in_level(level: &wire::Level) -> Fault {
    let alone = |value, offset_m, normal| Level::new(Label::new("level")?, value, offset_m, normal);
    Fault(None)
        .or("channel", &level.channel, check_name(&level.channel))
        .or("value", &level.value, alone(level.value, [0.0; 3], None))
        .or(
            "offset_m",
            &level.offset_m,
            alone(0.0, level.offset_m, None),
        )
        .or_json("normal", &level.normal, alone(0.0, [0.0; 3], level.normal))
}

fn in_descriptor(body: &wire::Descriptor) -> Fault {
    let alone = Label::new("view").and_then(|label| Descriptor::new(label, &body.vector));
    Fault(None)
        .or("channel", &body.channel, check_name(&body.channel))
        // All of its numbers would hide what is said.
        .or(
            "vector",
            &format_args!("of {} numbers", body.vector.len()),
            alone,
        )
}

fn pose(translation_m: [f64; 3], rotation_xyzw: [f64; 4]) -> Result<StartPose, InvalidSample> {
    StartPose::new(translation_m, rotation_xyzw, PoseNoise::none())
}
