//! One run: a walk through a room, a map that learns on the way, and the measures of every step.

use std::collections::VecDeque;

use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, Event, EventKind, InvalidSample, Label, PerceptCue, PlaceId,
    RecallCue, Recalled, Record, Sample,
};
use geometry::{PoseCovariance, se3};
use grid::population::{TUNING_WIDTH, interference_pattern, population_vector};
use grid::similarity::{cosine, exponential_confidence};
use grid::{GridCode, GridModules, PartialCode, decode};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use pose_graph::PoseGraph;

use super::agent::{Agent, stamp_ns};
use super::curve::Curve;
use super::protocol::{InvalidProtocol, Percept, Protocol};
use super::quantity::{Each, Quantity};
use super::tally::Tally;
use super::territory::Territory;
use cogmap_worlds::Cube;
use cogmap_worlds::DeadReckoning;
use cogmap_worlds::{Reading, ReadingBody};
use trajectory::{StampedPose, Trajectory};

/// The only agent of a map.
const AGENT: AgentId = AgentId(0);
/// The one that explores the room before it, if one does.
const EXPLORER: AgentId = AgentId(1);
/// Growth is taken over this part of the walk.
const GROWTH_PARTS: u64 = 10;
/// Codes are decoded at every step whose number divides by this: to search a whole room costs half
/// a millisecond, ten times as much as everything else.
const STEPS_PER_DECODING: u64 = 10;
/// Progress is told after so many steps.
const STEPS_PER_REPORT: u64 = 100;

/// Why a run failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// The protocol makes no sense.
    #[error(transparent)]
    Protocol(#[from] InvalidProtocol),
    /// The map refused a sample.
    #[error("the walk made a sample that the map refuses: {0}")]
    Sample(#[from] InvalidSample),
}

/// What came out of one run.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) seed: u64,
    pub(super) tallies: Each<Tally>,
    pub(super) curves: Each<Curve>,
    /// Places gained in the last quarter of the walk, as a share of those before it.
    pub(super) growth_last_quarter: Option<f64>,
    /// RMSE of the refined positions, given the whole walk \[m\].
    pub(super) refined_rmse_m: Option<f64>,
    /// Revisits that are believed at the end.
    pub(super) closures: usize,
    pub(super) path: Option<Path>,
}

/// A run in full, for a picture of it.
#[derive(Clone, Debug, Default)]
pub struct Path {
    /// The true poses after each step.
    pub truth: Vec<StampedPose>,
    /// The poses that were published with each step.
    pub causal: Vec<StampedPose>,
    /// The winners' poses, at the steps that had one.
    pub recalled: Vec<StampedPose>,
    /// The places at the end \[m\].
    pub places_m: Vec<Vector3<f64>>,
    /// The obstacles.
    pub cubes: Vec<Cube>,
    /// What is remembered of the walk, relaxed.
    pub experience: PoseGraph,
}

/// Whether a run keeps its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keep {
    Path,
    Measures,
}

impl Run {
    /// Walks and measures. `walked` is told, now and then, of so many more steps.
    pub(super) fn new(
        protocol: &Protocol,
        seed: u64,
        keep: Keep,
        walked: impl Fn(u64),
    ) -> Result<Self, RunError> {
        protocol.check()?;
        let mut trial = Trial::new(protocol, seed)?;
        let mut run = Self {
            seed,
            tallies: Each::default(),
            curves: Each::from_fn(|_| Curve::new(protocol.steps)),
            growth_last_quarter: None,
            refined_rmse_m: None,
            closures: 0,
            path: (keep == Keep::Path).then(Path::default),
        };
        let before_last_quarter = protocol.steps - protocol.steps / 4;
        let mut places_before = 0;
        for step in 0..protocol.steps {
            if step == before_last_quarter {
                places_before = trial.map.place_count();
            }
            let values = trial.step(run.path.as_mut())?;
            run.take_in(step, &values);
            if (step + 1).is_multiple_of(STEPS_PER_REPORT) {
                walked(STEPS_PER_REPORT);
            }
        }
        walked(protocol.steps % STEPS_PER_REPORT);
        if places_before > 0 {
            let places = trial.map.place_count() as f64;
            run.growth_last_quarter = Some(places / places_before as f64 - 1.0);
        }
        run.refined_rmse_m = trial.refined_rmse_m();
        run.closures = trial.map.closure_count();
        if let Some(path) = &mut run.path {
            path.experience = trial.map.pose_graph();
            let places = trial.map.places();
            path.places_m = places.map(|(_, place)| place.position().coords).collect();
            path.cubes = trial.agent.world().cubes().to_vec();
        }
        Ok(run)
    }

    fn take_in(&mut self, step: u64, values: &Each<Option<f64>>) {
        for (quantity, tally) in self.tallies.iter_mut() {
            if let Some(value) = values[quantity] {
                tally.add(value);
                self.curves[quantity].add(step, value);
            }
        }
    }
}

/// A run under way.
struct Trial {
    agent: Agent,
    map: CognitiveMap,
    reckoning: DeadReckoning,
    territory: Territory,
    next_seq: u64,
    steps: u64,
    /// Numbers of places after the latest steps, oldest first, one more than growth is taken over.
    recent_places: VecDeque<usize>,
    growth_steps: u64,
    /// σ of the pseudo-activation.
    sigma: f64,
    /// The true positions after each step \[m\], if the agent perceives anything that may refine
    /// its own.
    truth_m: Vec<Vector3<f64>>,
    perceives: bool,
    /// Radius of the ball around the room's centre in which codes are decoded \[m\].
    room_radius_m: f64,
}

impl Trial {
    fn new(protocol: &Protocol, seed: u64) -> Result<Self, RunError> {
        let settings = protocol.settings(seed).map_err(InvalidProtocol::from)?;
        let field_radius_m = settings.field_radius_m;
        let map = CognitiveMap::new(settings);
        // A checked protocol has valid noise, and the middle of every room is free.
        let agent = Agent::new(protocol, seed).ok_or(InvalidProtocol::Odometry)?;
        let mut trial = Self {
            sigma: pseudo_activation_sigma(map.modules(), field_radius_m),
            room_radius_m: agent.world().centre_m().norm(),
            agent,
            map,
            reckoning: DeadReckoning::default(),
            truth_m: Vec::new(),
            perceives: protocol.percept != Percept::None || protocol.explored.is_some(),
            territory: Territory::new(field_radius_m),
            next_seq: 0,
            steps: 0,
            recent_places: VecDeque::from([0]),
            growth_steps: (protocol.steps / GROWTH_PARTS).max(1),
        };
        let enrol = Record::Enrol {
            agent: AGENT,
            name: Label::new("agent")?,
        };
        trial.map.apply(&enrol, &mut Vec::new());
        if let Some(explored) = &protocol.explored {
            let explorer = Agent::explorer(protocol, seed).ok_or(InvalidProtocol::Odometry)?;
            trial.explore(explorer, explored.steps)?;
        }
        for reading in trial.agent.start() {
            trial.apply(&reading, &mut Vec::new())?;
        }
        Ok(trial)
    }

    /// Lets an explorer walk through the room.
    fn explore(&mut self, mut explorer: Agent, steps: u64) -> Result<(), RunError> {
        let enrol = Record::Enrol {
            agent: EXPLORER,
            name: Label::new("explorer")?,
        };
        let mut events = Vec::new();
        self.map.apply(&enrol, &mut events);
        let mut readings = explorer.start();
        let mut seq = 0;
        for _ in 0..steps {
            readings.extend(explorer.step());
            for reading in readings.drain(..) {
                let record = Record::Sample {
                    agent: EXPLORER,
                    session: 1,
                    seq,
                    sample: Sample::try_from(&reading)?,
                };
                seq += 1;
                self.map.apply(&record, &mut events);
            }
            events.clear();
        }
        Ok(())
    }

    /// Applies a reading to the map and to dead reckoning.
    fn apply(&mut self, reading: &Reading, events: &mut Vec<Event>) -> Result<(), RunError> {
        self.reckoning.apply(reading)?;
        let sample = Sample::try_from(reading)?;
        let record = Record::Sample {
            agent: AGENT,
            session: 1,
            seq: self.next_seq,
            sample,
        };
        self.next_seq += 1;
        self.map.apply(&record, events);
        Ok(())
    }

    /// Makes a step and measures.
    fn step(&mut self, path: Option<&mut Path>) -> Result<Each<Option<f64>>, RunError> {
        let places_before = self.map.places_recruited();
        let mut values = Each::default();
        let mut events = Vec::new();
        for reading in self.agent.step() {
            if let ReadingBody::Descriptor { channel, vector } = &reading.body {
                let view = Descriptor::new(Label::new(channel)?, vector)?;
                self.measure_view(view, &mut values);
            }
            self.apply(&reading, &mut events)?;
        }
        self.steps += 1;
        let pose = self.agent.pose();
        let truth_m = pose.translation.vector;
        if self.perceives {
            self.truth_m.push(truth_m);
        }
        let mut surprises = events.iter().filter_map(|event| match event.kind {
            EventKind::PerceptCompared { surprise, .. } => Some(surprise),
            _ => None,
        });
        values[Quantity::ViewSurprise] = surprises.next_back();
        self.measure_pose(&truth_m, &mut values);
        let winner = self.measure_recall(&truth_m, places_before, &mut values);
        self.measure_memory(&truth_m, &mut values);
        if let Some(path) = path {
            self.note(&pose, winner, path);
        }
        Ok(values)
    }

    /// RMSE of the positions after relaxation \[m\]; `None` where nothing but motion was read.
    fn refined_rmse_m(&self) -> Option<f64> {
        if !self.perceives {
            return None;
        }
        let refined = self.map.refined();
        let poses: Vec<StampedPose> = refined
            .agents
            .first()?
            .poses
            .iter()
            .map(|row| StampedPose {
                stamp_ns: row.stamp_ns,
                pose: row.pose,
            })
            .collect();
        let trajectory = Trajectory::from_poses(&poses).ok()?;
        let mut tally = Tally::default();
        for (step, truth_m) in (1..).zip(&self.truth_m) {
            if let Some(position_m) = trajectory.at(stamp_ns(step)) {
                tally.add((position_m - truth_m).norm());
            }
        }
        tally.rmse()
    }

    /// How far the estimates of the pose lie from the truth.
    fn measure_pose(&self, truth_m: &Vector3<f64>, values: &mut Each<Option<f64>>) {
        let Some(agent) = self.map.agent(AGENT) else {
            return;
        };
        let causal_m = agent.pose().translation.vector;
        values[Quantity::CausalError] = Some((causal_m - truth_m).norm());
        if let Some(covariance) = self.map.covariance(AGENT) {
            let off = agent.pose().inv_mul(&self.agent.pose());
            let [position, rotation, pose] = normalised_squares(&off, &covariance);
            values[Quantity::PositionNees] = position;
            values[Quantity::RotationNees] = rotation;
            values[Quantity::PoseNees] = pose;
        }
        let reckoned_m = self.reckoning.pose().translation.vector;
        values[Quantity::DeadReckoningError] = Some((reckoned_m - truth_m).norm());
        if self.steps.is_multiple_of(STEPS_PER_DECODING) {
            let code = PartialCode::from(&agent.grid().code());
            let centre = Point3::from(self.agent.world().centre_m());
            let decoded = decode(self.map.modules(), &code, Some(centre), self.room_radius_m);
            values[Quantity::DecodedError] = Some((decoded.position.coords - truth_m).norm());
        }
        let live = agent.place().and_then(|(place, _)| self.map.place(place));
        values[Quantity::LiveError] = live.map(|place| (place.position().coords - truth_m).norm());
        values[Quantity::LiveAnswers] = Some(f64::from(u8::from(live.is_some())));
    }

    /// What the memory makes of the agent's grid code; answers with the winner.
    fn measure_recall(
        &self,
        truth_m: &Vector3<f64>,
        places_before: usize,
        values: &mut Each<Option<f64>>,
    ) -> Option<PlaceId> {
        let grid = self.map.agent(AGENT)?.grid();
        let code = grid.code();
        // Two, because the first may be the place that was recruited at this step.
        let recalled = recall(&self.map, &code, 2);
        let known = recalled
            .iter()
            .find(|recalled| (recalled.place.0 as usize) < places_before);
        values[Quantity::PredictionError] =
            known.and_then(|known| self.distance_m(known.place, truth_m));
        let winner = recalled.first()?;
        values[Quantity::RecallError] = self.distance_m(winner.place, truth_m);
        let nearest = self.map.nearest_place(&Point3::from(*truth_m));
        values[Quantity::OracleError] = nearest.map(|(_, distance_m)| distance_m);
        values[Quantity::Confidence] = winner.confidence;

        let modules = self.map.modules();
        let place = self.map.place(winner.place)?;
        let stored = place.code(modules);
        let likeness = cosine(
            &population_vector(modules, &code),
            &population_vector(modules, &stored),
        );
        values[Quantity::Cosine] = Some(likeness);
        let distance = 1.0 - likeness;
        values[Quantity::PseudoActivation] = Some(exponential_confidence(distance, self.sigma));
        let here = interference_pattern(modules, &code, &grid.decode(modules));
        let there = interference_pattern(modules, &stored, place.position());
        values[Quantity::InterferenceScore] =
            Some(cosine(here.pattern.as_slice(), there.pattern.as_slice()));
        Some(winner.place)
    }

    /// How far the place lies that a view recalls by itself, before the map learns the view.
    fn measure_view(&self, view: Descriptor, values: &mut Each<Option<f64>>) {
        let recalled = self.map.recall(&RecallCue {
            percept: Some(PerceptCue::Descriptor(view)),
            ..nothing(1)
        });
        let truth_m = self.agent.pose().translation.vector;
        values[Quantity::ViewRecallError] = recalled
            .first()
            .and_then(|recalled| self.distance_m(recalled.place, &truth_m));
    }

    /// How much the memory holds.
    fn measure_memory(&mut self, truth_m: &Vector3<f64>, values: &mut Each<Option<f64>>) {
        self.territory.visit(truth_m);
        let unique = self.territory.count();
        values[Quantity::UniqueLocations] = Some(unique as f64);
        values[Quantity::Revisits] = Some((self.steps - unique) as f64);
        values[Quantity::Landmarks] = Some(self.map.landmark_count() as f64);
        let places = self.map.place_count();
        values[Quantity::Places] = Some(places as f64);
        self.recent_places.push_back(places);
        let spanned = self.steps.min(self.growth_steps);
        if self.recent_places.len() as u64 > self.growth_steps + 1 {
            self.recent_places.pop_front();
        }
        if spanned == self.growth_steps {
            let before = self.recent_places.front().copied().unwrap_or(0);
            values[Quantity::Growth] = Some((places - before) as f64 / spanned as f64);
        }
    }

    /// Adds this instant to the path.
    fn note(&self, pose: &Isometry3<f64>, winner: Option<PlaceId>, path: &mut Path) {
        let stamped = |pose: Isometry3<f64>| StampedPose {
            stamp_ns: self.agent.stamp_ns(),
            pose,
        };
        path.truth.push(stamped(*pose));
        let agent = self.map.agent(AGENT);
        path.causal
            .extend(agent.map(|agent| stamped(*agent.pose())));
        let place = winner.and_then(|winner| self.map.place(winner));
        let recalled =
            place.map(|place| Isometry3::from_parts((*place.position()).into(), *place.rotation()));
        path.recalled.extend(recalled.map(stamped));
    }

    /// Distance of a place's stored position from the truth \[m\].
    fn distance_m(&self, place: PlaceId, truth_m: &Vector3<f64>) -> Option<f64> {
        let place = self.map.place(place)?;
        Some((place.position().coords - truth_m).norm())
    }
}

/// Squared errors of position, rotation and pose in their deviations, per component; none of what
/// is promised without error.
fn normalised_squares(off: &Isometry3<f64>, covariance: &PoseCovariance) -> [Option<f64>; 3] {
    let (error, covariance) = (se3::twist(off), covariance.matrix());
    let of = |from: usize| {
        let error: Vector3<f64> = error.fixed_rows::<3>(from).into_owned();
        let own: Matrix3<f64> = covariance.fixed_view::<3, 3>(from, from).into_owned();
        Some(error.dot(&(own.try_inverse()? * error)) / 3.0)
    };
    let pose = covariance.try_inverse();
    let pose = pose.map(|inverse| error.dot(&(inverse * error)) / 6.0);
    [of(0), of(3), pose]
}

/// The places that a grid code recalls, best first, and nothing but the code.
fn recall(map: &CognitiveMap, code: &GridCode, limit: usize) -> Vec<Recalled> {
    map.recall(&RecallCue {
        code: Some(PartialCode::from(code)),
        ..nothing(limit)
    })
}

/// A cue that says nothing.
fn nothing(limit: usize) -> RecallCue {
    RecallCue {
        position: None,
        code: None,
        percept: None,
        radius_m: None,
        founder: None,
        since_ns: None,
        until_ns: None,
        limit,
    }
}

/// σ of seed Eq. 9 that makes exp(−d/σ) one half for the cosine distance d that codes a field
/// radius apart have on average.
fn pseudo_activation_sigma(modules: &GridModules, field_radius_m: f64) -> f64 {
    let lattices = modules.lattices();
    let similarity = |spacing_m: f64| {
        let ratio = field_radius_m / (2.0 * TUNING_WIDTH * spacing_m);
        (-ratio * ratio).exp()
    };
    let sum: f64 = lattices.iter().map(|l| similarity(l.spacing_m())).sum();
    (1.0 - sum / lattices.len() as f64) / std::f64::consts::LN_2
}
