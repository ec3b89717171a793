//! What happens between the beginning of a relaxation and its end does not go astray.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Vector6};
use proptest::prelude::*;

use super::*;
use crate::estimator::{Calibrated, ExternalEstimate};
use crate::input::{PoseNoise, Relation, RelativePose, StartPose};
use crate::keyframes::constraint::ClosureState;
use crate::keyframes::keyframe::Keyframe;
use crate::keyframes::moment::Moment;
use crate::keyframes::settings::KeyframeSettings;
use geometry::PoseCovariance;
use state::Digest;

/// Agents, the last of which is in no map until it is told where it is.
const AGENTS: u32 = 3;

/// What the relaxation finds: all that it knows lies so far to the left \[m\].
const SHIFT_M: f64 = 100.0;

#[derive(Clone, Copy, Debug)]
enum Step {
    Go,
    Close(u64),
    Start,
    SetAside,
    Restart,
}

fn steps(most: usize) -> impl Strategy<Value = Vec<(u32, Step)>> {
    let step = prop_oneof![
        12 => Just(Step::Go),
        4 => (0..40_u64).prop_map(Step::Close),
        1 => Just(Step::Start),
        1 => Just(Step::SetAside),
        1 => Just(Step::Restart),
    ];
    prop::collection::vec((0..AGENTS, step), 1..most)
}

/// A graph that is soon full. The x of a pose is the number of its step, and nothing but the
/// relaxation gives one another y than 0.
struct Team {
    map: KeyframeMap,
    step: u64,
    /// Numbers of the closures that were added since it was emptied.
    closed: BTreeSet<u32>,
    /// Numbers of the keyframes that were.
    added: BTreeSet<u32>,
}

impl Team {
    fn new() -> Self {
        let settings = KeyframeSettings {
            keyframes_max: 14,
            constraints_max: 5,
            ..KeyframeSettings::default()
        };
        let mut map = KeyframeMap::new(settings);
        let graph = &mut map.graph;
        for agent in 0..AGENTS {
            graph.enrol();
            if agent + 1 < AGENTS {
                graph.found(agent);
            }
        }
        Self {
            map,
            step: 0,
            closed: BTreeSet::new(),
            added: BTreeSet::new(),
        }
    }

    fn take(&mut self, (agent, step): (u32, Step)) {
        self.step += 1;
        let moment = Moment {
            agent,
            seq: self.step,
            stamp_ns: i64::try_from(self.step).unwrap() * 100_000_000,
            pose: Isometry3::translation(self.step as f64, 0.0, 0.0),
        };
        let (before, keyframes) = (self.closures(), self.keyframes());
        let graph = &mut self.map.graph;
        match step {
            Step::Go => {
                let ahead = Isometry3::translation(1.0, 0.0, 0.0);
                let variance = Vector6::repeat(1e-4);
                graph.motion(&moment, &ahead, &variance, &Calibrated::default());
            }
            Step::Close(earlier) => {
                let noise = PoseNoise::new([0.1; 3], [0.1; 3]).unwrap();
                // Each closure says something else.
                let at = [0.0, 0.0, self.step as f64];
                let at = RelativePose::new(at, [0.0, 0.0, 0.0, 1.0], noise).unwrap();
                graph.closure(&moment, earlier, &Relation::Pose(at));
                let is_new = |(number, says): (u32, _)| before.get(&number) != Some(&says);
                let new = self.closures().into_iter();
                self.closed
                    .extend(new.filter(|one| is_new(*one)).map(|(number, _)| number));
            }
            Step::Start => {
                let noise = PoseNoise::none();
                let at = moment.pose.translation.vector.into();
                let start = StartPose::new(at, [0.0, 0.0, 0.0, 1.0], noise).unwrap();
                graph.start_pose(&moment, &start);
            }
            Step::SetAside => graph.set_aside(agent),
            Step::Restart => graph.restart(agent, &Vector6::repeat(0.1)),
        }
        // With a closure the agent's latest keyframe takes over its pose.
        let is_closure = matches!(step, Step::Close(_));
        let is_new = |&(number, is): &(u32, (u32, u64, u64))| {
            let was = keyframes.get(&number);
            was.is_none_or(|was| (was.0, was.1) != (is.0, is.1) || (was.2 != is.2 && !is_closure))
        };
        let new = self.keyframes().into_iter().filter(is_new);
        self.added.extend(new.map(|(number, _)| number));
    }

    /// Agent, sample and place of each keyframe, by number.
    fn keyframes(&self) -> BTreeMap<u32, (u32, u64, u64)> {
        let all = self.map.graph.chains.keyframes.iter();
        let told_apart = |keyframe: &Keyframe| {
            let x = keyframe.pose.translation.x.to_bits();
            (keyframe.agent, keyframe.seq, x)
        };
        all.map(|(number, keyframe)| (number, told_apart(keyframe)))
            .collect()
    }

    /// What each closure says, by number.
    fn closures(&self) -> BTreeMap<u32, Isometry3<f64>> {
        let all = self.map.graph.constraints.slab.iter();
        all.filter(|(_, one)| one.is_closure())
            .map(|(number, one)| (number, one.transform))
            .collect()
    }

    /// Begins a relaxation that moves all keyframes of the map, accepts all closures, and corrects
    /// all agents.
    fn begin(&mut self) -> RelaxationOutcome {
        let shift = Isometry3::translation(0.0, SHIFT_M, 0.0);
        let (chains, closures) = (&self.map.graph.chains, &self.map.graph.constraints.slab);
        let pose = |(number, _)| Some((number, shift * chains.in_map(number)?));
        let corrections = (0..AGENTS).filter_map(|agent| {
            let track = chains.track(agent).filter(|track| track.is_in_map())?;
            let newest = chains.in_map(track.newest)?;
            Some(Correction {
                agent,
                estimate: ExternalEstimate {
                    pose: shift * newest * track.since.motion(),
                    covariance: PoseCovariance::zero(),
                    calibration: None,
                    prevails: true,
                },
            })
        });
        let outcome = RelaxationOutcome {
            turn_noises: vec![(0, 0.5)],
            matches: None,
            learned: None,
            view_maps: None,
            poses: chains.keyframes.iter().filter_map(pose).collect(),
            states: { closures.iter() }
                .filter(|(_, closure)| closure.is_candidate())
                .map(|(number, _)| (number, ClosureState::Accepted))
                .collect(),
            corrections: corrections.collect(),
        };
        let job = RelaxationJob::restored(Digest(0), outcome.clone());
        self.map.pending = Some(PendingRelaxation::Awaited(job));
        self.map.graph.meanwhile = Some(Box::default());
        outcome
    }

    /// Brings the outcome into force; answers where the agents are by it.
    fn bring_into_force(&mut self, outcome: &RelaxationOutcome) -> Vec<Correction> {
        let corrections = self.map.graph.bring_into_force(outcome);
        self.map.pending = Some(PendingRelaxation::InForce(outcome.clone().into(), 0));
        corrections
    }

    /// Moves some keyframes of an outcome in force; answers whether all have moved.
    fn move_some(&mut self) -> bool {
        self.map.move_keyframes(2);
        self.map.pending.is_none()
    }

    /// The numbers of the keyframes that an outcome knows, and of those that go on from there.
    fn to_be_moved(&self, outcome: &RelaxationOutcome) -> BTreeSet<u32> {
        let chains = &self.map.graph.chains;
        let mut moved = BTreeSet::new();
        for agent in 0..AGENTS {
            let is_in_map = chains.track(agent).unwrap().is_in_map();
            let chain: Vec<_> = chains.of_agent(agent).collect();
            let mut goes_on = false;
            for &(number, keyframe) in chain.iter().rev() {
                let is_known = outcome.pose(number).is_some()
                    && !self.added.contains(&number)
                    && chains.in_map(number).is_some();
                goes_on = is_known || (goes_on && is_in_map && !keyframe.begins);
                moved.extend(goes_on.then_some(number));
            }
        }
        moved
    }
}

/// Each step is followed by a motion, so that few keyframes are of one sample.
fn go(team: &mut Team, steps: &[(u32, Step)]) {
    for &(agent, step) in steps {
        team.take((agent, step));
        team.take((agent, Step::Go));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// What the relaxation knew moves as it says; what came meanwhile moves with it as long as the
    /// agent went on from there. Numbers that became others' move nobody, and judge nothing.
    #[test]
    fn what_came_meanwhile_goes_along(before in steps(60), meanwhile in steps(30)) {
        let mut team = Team::new();
        go(&mut team, &before);
        let outcome = team.begin();
        team.closed.clear();
        team.added.clear();
        go(&mut team, &meanwhile);
        let expected = team.to_be_moved(&outcome);
        let corrections = team.bring_into_force(&outcome);
        while !team.move_some() {}
        prop_assert!(team.map.graph.is_sound());
        let chains = &team.map.graph.chains;
        for (number, keyframe) in chains.keyframes.iter() {
            let (y, is_expected) = (keyframe.pose.translation.y, expected.contains(&number));
            let expected_m = if is_expected { SHIFT_M } else { 0.0 };
            prop_assert!((y - expected_m).abs() < 1e-6, "{number} {is_expected}: {keyframe:?}");
        }
        for (number, closure) in team.map.graph.constraints.slab.iter() {
            let is_known = outcome.states.iter().any(|(known, _)| *known == number);
            let expected = if !closure.is_closure() {
                closure.state
            } else if is_known && !team.closed.contains(&number) {
                ClosureState::Accepted
            } else {
                ClosureState::Pending
            };
            prop_assert_eq!(closure.state, expected, "{}", number);
        }
        // Whoever was not put elsewhere is corrected, and nobody else.
        let is_put = |agent: u32| {
            let mut steps = meanwhile.iter().filter(|step| step.0 == agent);
            steps.any(|(_, step)| matches!(step, Step::Start | Step::SetAside))
        };
        let stayed = outcome.corrections.iter().filter(|one| !is_put(one.agent));
        let stayed: Vec<_> = stayed.map(|one| one.agent).collect();
        let corrected: Vec<_> = corrections.iter().map(|one| one.agent).collect();
        prop_assert_eq!(corrected, stayed);
        for correction in corrections {
            let at = correction.estimate.pose.translation;
            prop_assert!((at.y - SHIFT_M).abs() < 1e-6, "{}", at);
        }
    }

    /// What comes while keyframes still move stays where it is.
    #[test]
    fn what_comes_afterwards_stays(
        before in steps(60), meanwhile in steps(10), after in steps(20),
    ) {
        let mut team = Team::new();
        go(&mut team, &before);
        let outcome = team.begin();
        go(&mut team, &meanwhile);
        team.bring_into_force(&outcome);
        let in_force = team.step as f64;
        for step in after {
            team.move_some();
            go(&mut team, &[step]);
        }
        while !team.move_some() {}
        prop_assert!(team.map.graph.is_sound());
        for (_, keyframe) in team.map.graph.chains.keyframes.iter() {
            let at = keyframe.pose.translation;
            prop_assert!(at.x <= in_force || at.y == 0.0, "{}", at);
        }
    }
}
