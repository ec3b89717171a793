//! Why it is this object and not another, and how much of it was explored.

use nalgebra::Point3;

use crate::contact::Contact;
use crate::library::ObjectLibrary;
use crate::model::ObjectModel;
use crate::object_id::ObjectId;
use crate::orientation::Orientation;
use crate::posterior::{PoseEstimate, Posterior};
use crate::recognition::Recognition;
use crate::tuning::{EXPLORED_SDS, LISTED_SHARE_MIN};

/// What is behind a posterior.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Explanation {
    /// Share of the places of the most probable object that a contact has come near; none where its
    /// pose is not known.
    pub explored: Option<f64>,
    /// The second most probable object, and how much each contact speaks for the first against it
    /// \[nats\]; none where there is only one.
    pub rival: Option<(ObjectId, Vec<f64>)>,
}

/// Explains what the contacts of an episode say, in their order.
pub fn explain(
    library: &ObjectLibrary,
    orientation: &Orientation,
    contacts: &[Contact],
    posterior: &Posterior,
) -> Explanation {
    let pose = { posterior.pose.as_ref() }.filter(|pose| pose.share > LISTED_SHARE_MIN);
    let explored = pose.and_then(|pose| Some(explored(library.get(pose.object)?, pose, contacts)));
    let rival = match posterior.objects[..] {
        [(first, _), (second, _), ..] => {
            let said = said_for(library, orientation, contacts, [first, second]);
            Some((second, said))
        }
        _ => None,
    };
    Explanation { explored, rival }
}

/// Share of a model's places that a contact has come near.
fn explored(model: &ObjectModel, pose: &PoseEstimate, contacts: &[Contact]) -> f64 {
    let near = contacts.iter().map(|contact| {
        let reach_m = model.spacing_m() + EXPLORED_SDS * contact.variance_m2().sqrt();
        (pose.map_from_episode * contact.position_m, reach_m)
    });
    let near: Vec<_> = near.collect();
    let places = model.places();
    let is_explored =
        |at: Point3<f64>| { near.iter() }.any(|(contact, m)| (contact - at).norm() <= *m);
    let count = places.iter().filter(|place| is_explored(place.position_m));
    count.count() as f64 / places.len().max(1) as f64
}

/// How much each contact speaks for the first of two objects against the second, given those before
/// it \[nats\]. The sum is the log ratio of their evidence, one contact after the other.
fn said_for(
    library: &ObjectLibrary,
    orientation: &Orientation,
    contacts: &[Contact],
    objects: [ObjectId; 2],
) -> Vec<f64> {
    let library = library.select(objects.map(|object| (object, object)));
    let mut recognition = Recognition::new(orientation);
    let mut before = 0.0;
    let said = contacts.iter().map(|contact| {
        recognition.touch(&library, contact.clone());
        let logs = recognition.object_logs(&library);
        let log = |object| { logs.iter() }.find_map(|&(id, log)| (id == object).then_some(log));
        let [first, second] = objects.map(|object| log(object).unwrap_or(f64::NEG_INFINITY));
        let lead = first - second;
        // Without a pose of both nothing is known of the one that has none.
        if !lead.is_finite() {
            return 0.0;
        }
        let said = lead - before;
        before = lead;
        said
    });
    said.collect()
}
