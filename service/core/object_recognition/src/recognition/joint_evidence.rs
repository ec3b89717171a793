//! What all contacts of an episode together tell of an object, against one that was never felt.

use std::f64::consts::PI;

use nalgebra::{DVector, Isometry3, Point3, Vector3};

use crate::contact::Contact;
use crate::gaussian_process::{factor, independent, log_density, matern};
use crate::indexed_model::IndexedModel;
use crate::indexed_place::Prediction;
use crate::interpolation::{BodyPoint, OpenRegion, PlacedLevel};
use crate::level_prior::LevelPrior;
use crate::tuning::{
    ERROR_REACH, JOINT_CONTACTS, JOINT_CONTACTS_MIN, JOINT_SDS, LEVEL_MAX, LOCAL_ERROR_SHARE,
    POSE_PRIOR_M, SHAPE_REACH, SHAPE_SD, WRONG_PERCEPT_SHARE,
};

/// How far a contact is off the surface that a model predicts, along one direction across it.
#[derive(Clone, Debug)]
struct SurfaceOffset {
    at: Point3<f64>,
    /// Unit vector.
    across: Vector3<f64>,
    off_m: f64,
    /// Standard deviation of what errs within a gap alone \[m\].
    local_m: f64,
    whole: WholeError,
    noise_m2: f64,
}

/// What errs over a whole side.
#[derive(Clone, Debug)]
enum WholeError {
    /// What places around predict, with this standard deviation \[m\].
    Around(f64),
    /// What a body predicts.
    Body(Box<BodyPoint>),
}

/// By how much contacts are likelier of a model, in this pose, than of an object that was never
/// felt \[nats\]: a logarithm of a Bayes factor. None of few contacts, and of a model that predicts
/// nothing.
///
/// Surface and levels are Gaussian processes over the model. The contacts of a walk are a sample of
/// one draw of each: those in one gap share its error, those on one side its distance. The known
/// object errs as it predicts, the unknown one differs by as much as objects of a size do, and its
/// levels as those of the model vary without what was learned of them. So evidence counts once.
pub(super) fn log_bayes_factor(
    indexed: &IndexedModel,
    level_prior: &[LevelPrior],
    map_from_episode: &Isometry3<f64>,
    contacts: &[Contact],
) -> Option<f64> {
    let count = contacts.len().min(JOINT_CONTACTS);
    if count < JOINT_CONTACTS_MIN || !indexed.shares_errors() {
        return None;
    }
    // All over the walk, with its first and its last one.
    let number = |k: usize| k * (contacts.len() - 1) / (count - 1);
    let chosen: Vec<&Contact> = (0..count).map(|k| &contacts[number(k)]).collect();
    let surface = surface_factor(indexed, map_from_episode, &chosen)?;
    let levels = indexed.level_processes.iter().filter_map(|process| {
        let level = |contact: &&Contact| {
            // A level of which nothing is known tells nothing.
            let reading = contact.level(process.channel)?;
            if reading.sd > LEVEL_MAX {
                return None;
            }
            Some(PlacedLevel {
                at: map_from_episode * contact.position_m,
                level: reading.value,
                sd: reading.sd,
            })
        };
        let levels: Vec<PlacedLevel> = chosen.iter().filter_map(level).collect();
        let usual = LevelPrior::of(level_prior, process.channel)?.usual();
        process.log_bayes_factor(&levels, usual)
    });
    Some(surface + levels.sum::<f64>()).filter(|log| log.is_finite())
}

/// The part of the surface.
fn surface_factor(
    indexed: &IndexedModel,
    map_from_episode: &Isometry3<f64>,
    contacts: &[&Contact],
) -> Option<f64> {
    let mut offsets: Vec<SurfaceOffset> = Vec::with_capacity(contacts.len());
    let (mut wrong, mut kept) = (Vec::new(), 0);
    for contact in contacts {
        let at = map_from_episode * contact.position_m;
        let is_beyond = |open: &OpenRegion| open.is_beyond(&at);
        // What was never felt of the object says nothing of it.
        if indexed.open.as_ref().is_some_and(is_beyond) {
            continue;
        }
        let own = surface_offsets(indexed, at, contact);
        let is_off = |own: &SurfaceOffset| {
            let variance_m2 = own.error_m2() + own.noise_m2;
            own.off_m.powi(2) > JOINT_SDS.powi(2) * variance_m2
        };
        if own.iter().any(is_off) {
            wrong.push(at);
        } else {
            kept += usize::from(!own.is_empty());
            offsets.extend(own);
        }
    }
    let wrong = independent(&wrong, indexed.gap_m) * WRONG_PERCEPT_SHARE.ln();
    if kept < JOINT_CONTACTS_MIN {
        return (wrong < 0.0).then_some(wrong);
    }
    let covariance = |row: usize, column: usize, is_known: bool| {
        let noise_m2 = if row == column {
            offsets[row].noise_m2
        } else {
            0.0
        };
        offsets[row].covariance_m2(&offsets[column], indexed, is_known) + noise_m2
    };
    let off = DVector::from_iterator(offsets.len(), offsets.iter().map(|own| own.off_m));
    let log = |is_known| {
        let factor = factor(offsets.len(), |row, column| {
            covariance(row, column, is_known)
        })?;
        Some(log_density(&factor, &off))
    };
    Some(log(true)? - log(false)? + wrong - parts_log(indexed))
}

/// Log of the number of parts of a surface that differ, on any of which the contacts may lie: of
/// many the likeliest explains them well by chance. A body has but one such pose: it differs from
/// another by a few numbers, whatever the part.
fn parts_log(indexed: &IndexedModel) -> f64 {
    if indexed.body.is_some() {
        return 0.0;
    }
    // A circle, or a ball, as large as the model.
    let dimensions = if indexed.is_curve { 1 } else { 2 };
    (PI / SHAPE_REACH.powi(dimensions)).ln()
}

impl SurfaceOffset {
    /// Variance of the prediction \[m²\].
    fn error_m2(&self) -> f64 {
        let whole_m2 = match &self.whole {
            WholeError::Around(sd_m) => sd_m * sd_m,
            WholeError::Body(point) => point.covariance_m2(point),
        };
        self.local_m * self.local_m + whole_m2
    }

    /// Covariance of two, of the object that is known or of another one, without noise \[m²\].
    fn covariance_m2(&self, other: &Self, indexed: &IndexedModel, is_known: bool) -> f64 {
        let apart_m = (self.at - other.at).norm();
        let common = self.across.dot(&other.across);
        let local = matern(apart_m / (ERROR_REACH * indexed.gap_m).max(f64::MIN_POSITIVE));
        let local_m2 = self.local_m * other.local_m * local + POSE_PRIOR_M * POSE_PRIOR_M;
        let whole_m2 = match (&self.whole, &other.whole) {
            (WholeError::Body(own), WholeError::Body(other)) => {
                let apart_m2 = if is_known { 0.0 } else { own.apart_m2(other) };
                own.covariance_m2(other) + apart_m2
            }
            (WholeError::Around(own_m), WholeError::Around(other_m)) => {
                let shape_m2 = (SHAPE_SD * indexed.extent_m).powi(2);
                let apart_m2 = if is_known { 0.0 } else { shape_m2 };
                common
                    * (own_m * other_m + apart_m2)
                    * matern(apart_m / (SHAPE_REACH * indexed.extent_m))
            }
            _ => 0.0,
        };
        common * local_m2 + whole_m2
    }
}

/// How far a contact is off the surface: of the body, or across that at the nearest place.
fn surface_offsets(
    indexed: &IndexedModel,
    at: Point3<f64>,
    contact: &Contact,
) -> Vec<SurfaceOffset> {
    // No contact tells what those that were learned could not.
    let noise_m2 = contact.variance_m2().max(indexed.noise_m2);
    if let Some(body) = &indexed.body {
        let point = body.about(&at);
        return vec![SurfaceOffset {
            at,
            across: point.across,
            off_m: point.off_m,
            local_m: point.surface_m2.sqrt(),
            whole: WholeError::Body(Box::new(point)),
            noise_m2,
        }];
    }
    let Some(nearest) = nearest(indexed, &at, |_| true) else {
        return Vec::new();
    };
    let place = &indexed.places[nearest];
    // A place that was felt lies on the surface of what was predicted beside it.
    let across = match &place.prediction {
        Some(prediction) => Some(prediction),
        None => self::nearest(indexed, &place.position, Option::is_some)
            .and_then(|beside| indexed.places[beside].prediction.as_ref()),
    };
    let Some(prediction) = across else {
        return Vec::new();
    };
    let offset = at - place.position;
    // Another outline in a plane lies in it as well.
    let mut projection = prediction.across.projection;
    if let Some(normal) = &indexed.plane {
        let out = projection * normal;
        projection -= out * out.transpose() / out.norm_squared().max(f64::MIN_POSITIVE);
    }
    let axes = projection.symmetric_eigen();
    let across = { axes.eigenvalues.iter() }.zip(axes.eigenvectors.column_iter());
    let across = across.filter(|(value, _)| **value > 0.5);
    let error_m2 = prediction.across_m2();
    let own = across.map(|(_, axis)| SurfaceOffset {
        at,
        across: axis.into_owned(),
        off_m: axis.dot(&offset),
        local_m: (LOCAL_ERROR_SHARE * error_m2).sqrt(),
        whole: WholeError::Around(((1.0 - LOCAL_ERROR_SHARE) * error_m2).sqrt()),
        noise_m2,
    });
    own.collect()
}

/// The place nearest to a point, among those with such a prediction.
fn nearest(
    indexed: &IndexedModel,
    point: &Point3<f64>,
    is_such: impl Fn(&Option<Prediction>) -> bool,
) -> Option<usize> {
    let places = indexed.places.iter().enumerate();
    let such = places.filter(|(_, place)| is_such(&place.prediction));
    let apart = such.map(|(number, place)| (number, (place.position - point).norm_squared()));
    let nearest = apart.min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map(|(number, _)| number)
}
