//! Where a sequence of samples was taken.

use nalgebra::Isometry3;

use super::CognitiveMap;
use crate::agent::{Agent, Status};
use crate::input::{AgentId, Record};
use crate::input::{Label, Sample};
use crate::keyframes::Guess;
use geometry::PoseCovariance;

/// Where samples were taken, by what the map knows.
#[derive(Clone, Debug, PartialEq)]
pub struct Localization {
    /// How well that is known at the end of the sequence.
    pub status: Status,
    /// Pose of the body in `map` after the last sample, with its covariance, once that is known.
    pub pose: Option<(Isometry3<f64>, PoseCovariance)>,
    /// Number of the sample with which it became known; samples are counted from 0.
    pub since: Option<usize>,
    /// Where it may be, the most probable first, while that is not known.
    pub guesses: Vec<Guess>,
}

impl CognitiveMap {
    /// Where a sequence of samples was taken: as an agent without a start pose finds out that takes
    /// them, in a map that does not change. Motions say how the moments of the sequence lie to one
    /// another; descriptors and labelled landmarks say where.
    ///
    /// No pose is answered that is not accepted: where the map does not know what was seen, or
    /// knows it of several places, the status is not [`Status::Localized`].
    pub fn localize<'a>(&self, samples: impl IntoIterator<Item = &'a Sample>) -> Localization {
        let nowhere = Localization {
            status: Status::Lost,
            pose: None,
            since: None,
            guesses: Vec::new(),
        };
        // No agent of a service has this name, so no target of a sighting is taken for it.
        let (true, Ok(name)) = (self.is_map_defined, Label::new("(localize)")) else {
            return nowhere;
        };
        let Ok(number) = u32::try_from(self.agents.len()) else {
            return nowhere;
        };
        let agent = AgentId(number);
        let mut map = self.clone();
        let mut events = Vec::new();
        map.apply(&Record::Enrol { agent, name }, &mut events);
        let mut since = None;
        for (seq, sample) in (0..).zip(samples) {
            let record = Record::Sample {
                agent,
                session: 1,
                seq,
                sample: sample.clone(),
            };
            map.apply(&record, &mut events);
            events.clear();
            if since.is_none() && map.agent(agent).is_some_and(Agent::placed) {
                since = usize::try_from(seq).ok();
            }
        }
        let placed = map.agent(agent).filter(|agent| agent.placed());
        let pose = placed.zip(map.covariance(agent));
        let status = map.status(agent).unwrap_or(Status::Lost);
        let guesses = map.keyframes.guesses(agent.0);
        Localization {
            // One place that is likely is more than nothing.
            status: if pose.is_none() && !guesses.is_empty() {
                Status::Uncertain
            } else {
                status
            },
            pose: pose.map(|(agent, covariance)| (*agent.pose(), covariance)),
            since,
            guesses,
        }
    }
}
