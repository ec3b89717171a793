//! The live joint estimate of agents and landmarks.
//!
//! One error state holds the poses of all agents of a frame, what their odometry gets wrong all the
//! time, and the positions of the landmarks that they see, with all correlations. Motion moves one
//! agent's part of it; a sighting corrects everything that is correlated with what it shows.
//!
//! ```text
//! agent      ξ 6     pose T = T̂ exp(ξ)                   landmark   δ 3   l = l̂ + δ
//!            c 6     relative error of lengths, of angles; bias about the body axes; veer
//!
//! motion     ξ ← Ad(Δ⁻¹) ξ + B c + n     Δ = what odometry read, corrected by ĉ
//! sighting   ν = z − h(x̂)     S = H P Hᵀ + R     δx = P Hᵀ S⁻¹ ν     P ← P − P Hᵀ S⁻¹ H P
//! ```
//!
//! - **Consistency.** Errors are carried over to the corrected estimate as those of the
//!   right-invariant filter.
//! - **Cost.** Between sightings an agent keeps its own covariance and its transition only, so that
//!   a motion costs the same in every map. A sighting costs the square of the number of components,
//!   which is bounded: at most 32 agents and 96 landmarks of a frame are held jointly. Agents that
//!   neither see nor are seen go on by themselves, and further landmarks are archived, up to 65,536
//!   a frame. A clone shares what it holds.
//! - **Dropped correlations.** A landmark that is archived stays tied to its nearest anchors, which
//!   are held jointly (`landmark_anchors`); an agent that comes back counts for a ninth of what it
//!   knew.
//! - **Doubt.** Components far from what is expected lose weight, sightings farther off are
//!   refused; an agent whose sightings are refused again and again is put where what it saw lately
//!   agrees that it is (`relocation`), or searches farther around, and a landmark is forgotten that
//!   refused sightings agree to see elsewhere (`landmark_evidence`).
//! - **Noise.** That of each agent's sensor is learned, upwards from what it states, by the map and
//!   by how its sightings repeat (`understated_noise`); that of its odometry, from pairs of
//!   sightings (`odometry_noise`); what was assumed of it too much before is taken back
//!   (`noise_share`).
//! - **Absurd evidence.** What a doubted agent sees corrects itself alone; one that contradicts
//!   everything for long, or may be anywhere, is set aside in a frame of its own, with its
//!   landmarks (`set_aside`).
//! - **Frames.** Agents whose place in the map is unknown have frames of their own until enough
//!   points are known in both, or their landmarks have one arrangement, whatever their names
//!   (`registration`).

mod agent_filter;
mod agent_sighting;
mod agent_slot;
mod archived_landmark;
mod associations;
mod assumed_noise;
mod bias_measurement;
mod calibration;
mod consensus;
mod covariance;
mod doubtful_motion;
mod effect;
mod external_pose;
mod frame;
mod frame_alignment;
mod frame_match;
mod frame_merge;
mod frame_registration;
mod gauge_free;
mod innovation;
mod jacobian;
mod joint;
mod landmark_anchors;
mod landmark_archive;
mod landmark_association;
mod landmark_evidence;
mod landmark_initialisation;
mod landmark_return;
mod landmark_sighting;
mod landmark_votes;
mod level;
mod measurement_update;
mod merging;
mod motion;
mod noise_part;
mod noise_share;
mod observers;
mod odometry_history;
mod odometry_noise;
mod odometry_reading;
mod outcome;
mod parameters;
mod placement;
mod range_hypotheses;
mod range_places;
mod range_sensor;
mod range_update;
mod ranging;
mod recent_sightings;
mod registration;
mod relocation;
mod removal;
mod sensor;
mod set_aside;
mod sighting_pair;
mod sightings;
mod standing;
mod state;
mod tuning;
mod understated_noise;
mod verdict;

pub use calibration::{Calibrated, Calibration, LASTING_DIM, LastingErrors};
pub use effect::{AgentSighted, Effect, FramesMerged};
pub use external_pose::ExternalEstimate;
pub use joint::Estimator;
pub use level::LevelRow;
pub(crate) use observers::Observers;
pub use outcome::{Evidence, LandmarkOutcome, Step};
pub use parameters::Parameters;

#[cfg(test)]
mod tests;
