//! What holds of every map, whatever it was told.

use cognitive_map::{CognitiveMap, Event, EventKind, Status};
use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix};

/// Farthest that anything is from the origin of the map, along an axis \[m\].
const FARTHEST_M: f64 = 1e8;
/// Rounding of an eigenvalue, as a part of the largest one.
const ROUNDING: f64 = 1e-9;

/// Says what does not hold of agents and landmarks of a map.
pub(crate) fn check(map: &CognitiveMap) -> Result<(), String> {
    for (id, agent) in map.agents() {
        let covariance = map.covariance(id).unwrap();
        check_pose(agent.pose(), &covariance).map_err(|what| format!("{id:?}: {what}"))?;
        let status = map.status(id).unwrap();
        let sd_m = covariance.position_sd_m();
        if sd_m > map.settings().lost_sd_m && status != Status::Lost {
            return Err(format!("{id:?}: {status:?} with a deviation of {sd_m} m"));
        }
        finite("odometry", agent.odometry().translation.vector.as_slice())?;
        finite(
            "travelled",
            &[
                agent.travelled_m(),
                agent.displacement_m(),
                agent.turning_rad(),
            ],
        )?;
        finite("evidence", &[agent.evidence().nis])?;
    }
    for (_, landmark) in map.landmarks() {
        let what = |what| format!("{}: {what}", landmark.label().as_str());
        check_position(landmark.position().coords.as_slice()).map_err(what)?;
        check_covariance(landmark.covariance()).map_err(what)?;
    }
    Ok(())
}

/// Says what does not hold of the memories of a map, and of its past once relaxed.
pub(crate) fn check_memory(map: &CognitiveMap) -> Result<(), String> {
    for (id, place) in map.places() {
        let what = |what| format!("{id:?}: {what}");
        check_position(place.position().coords.as_slice()).map_err(what)?;
        finite("deviation", place.position_sd_m().as_slice()).map_err(what)?;
        finite("strength", &[map.place_strength(id)]).map_err(what)?;
    }
    for (id, trip) in map.trips() {
        for leg in trip.legs() {
            let what = |what| format!("{id:?}: {what}");
            finite("leg", leg.relative().translation.vector.as_slice()).map_err(what)?;
            check_covariance(leg.covariance().matrix()).map_err(what)?;
        }
    }
    let refined = map.refined();
    for (number, agent) in refined.agents.iter().enumerate() {
        for pose in &agent.poses {
            let what = |what| format!("refined {number} at {}: {what}", pose.stamp_ns);
            check_isometry(&pose.pose).map_err(what)?;
        }
    }
    for landmark in &refined.landmarks {
        let what = |what| format!("refined {}: {what}", landmark.label.as_str());
        check_position(landmark.position.coords.as_slice()).map_err(what)?;
        if let Some(covariance) = &landmark.covariance {
            check_covariance(covariance).map_err(what)?;
        }
    }
    let restored = CognitiveMap::restore(map.settings().clone(), map.checkpoint(0))
        .map_err(|error| error.to_string())?;
    if restored.digest() != map.digest() {
        return Err("a restored map is another one".into());
    }
    Ok(())
}

/// Says what does not hold of an event.
pub(crate) fn check_event(event: &Event) -> Result<(), String> {
    match &event.kind {
        EventKind::PlaceRecruited { position, .. }
        | EventKind::LandmarkLearned { position, .. }
        | EventKind::AgentPlaced { position } => check_position(position.coords.as_slice()),
        EventKind::LoopsClosed(closed) => {
            finite("moved", &[closed.moved_m, closed.turned_rad])?;
            check_position(closed.position.coords.as_slice())
        }
        EventKind::PlaceEntered { confidence, .. } => finite("confidence", &[*confidence]),
        _ => Ok(()),
    }
}

fn check_pose(pose: &Isometry3<f64>, covariance: &PoseCovariance) -> Result<(), String> {
    check_isometry(pose)?;
    check_covariance(covariance.matrix())?;
    let in_map: Matrix6<f64> = covariance.in_map_axes(&pose.rotation);
    finite("covariance", in_map.as_slice())
}

fn check_isometry(pose: &Isometry3<f64>) -> Result<(), String> {
    check_position(pose.translation.vector.as_slice())?;
    let norm = pose.rotation.coords.norm();
    if (norm - 1.0).abs() > 1e-6 {
        return Err(format!("a rotation of norm {norm}"));
    }
    Ok(())
}

fn check_position(position: &[f64]) -> Result<(), String> {
    if position.iter().all(|x| x.abs() <= FARTHEST_M) {
        Ok(())
    } else {
        Err(format!("at {position:?}"))
    }
}

fn finite(what: &str, numbers: &[f64]) -> Result<(), String> {
    if numbers.iter().all(|x| x.is_finite()) {
        Ok(())
    } else {
        Err(format!("{what} {numbers:?}"))
    }
}

/// Symmetric, without negative eigenvalues beyond rounding, each component in units of its own
/// deviation.
fn check_covariance<const N: usize>(covariance: &SMatrix<f64, N, N>) -> Result<(), String>
where
    nalgebra::Const<N>: nalgebra::DimName,
    SMatrix<f64, N, N>: Eigenvalues,
{
    finite("covariance", covariance.as_slice())?;
    if *covariance != covariance.transpose() {
        return Err(format!("asymmetric {covariance}"));
    }
    if covariance.diagonal().iter().any(|&x| x < 0.0) {
        return Err(format!("negative variances {:?}", covariance.diagonal()));
    }
    let scale = covariance
        .diagonal()
        .map(|x| if x > 0.0 { x.sqrt().recip() } else { 0.0 });
    let unit = SMatrix::<f64, N, N>::from_fn(|r, c| covariance[(r, c)] * scale[r] * scale[c]);
    finite("correlation", unit.as_slice())?;
    let least = unit.least_eigenvalue();
    if least < -ROUNDING {
        return Err(format!(
            "eigenvalue {least} of the correlations of {covariance}"
        ));
    }
    Ok(())
}

/// Matrices whose eigenvalues can be asked for.
pub(crate) trait Eigenvalues {
    fn least_eigenvalue(&self) -> f64;
}

impl Eigenvalues for Matrix3<f64> {
    fn least_eigenvalue(&self) -> f64 {
        self.symmetric_eigenvalues().min()
    }
}

impl Eigenvalues for Matrix6<f64> {
    fn least_eigenvalue(&self) -> f64 {
        self.symmetric_eigenvalues().min()
    }
}
