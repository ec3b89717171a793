//! Laws of the keyframes.

use crate::as_read;
use cognitive_map::keyframes::{KeyframeMap, KeyframeSettings, Moment, Refined};
use cognitive_map::{Label, PoseNoise, Relation, RelativePosition, StartPose};
use geometry::PoseCovariance;
use nalgebra::{Isometry3, Point3, SVector, Vector3, Vector6};
use pose_graph::{
    Freedom, Kernel, Link, PoseGraph, PoseInformation, PositionInformation, RelaxationSettings,
    Scale, SightingTarget,
};

/// Numbers in [−1, 1) from a fixed sequence (splitmix64).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Length of a step \[m\].
const STEP_M: f64 = 0.25;
/// Deviations of a step \[m, rad\] and of a sighting \[m\].
const STEP_SD: (f64, f64) = (0.01, 0.01);
const SEEN_SD_M: f64 = 0.05;

/// Robots that walk on circles among landmarks, what they tell, and the truth.
struct Walk {
    keyframes: KeyframeMap,
    noise: Noise,
    /// Of each robot: its true pose, and by motion alone.
    truth: Vec<Isometry3<f64>>,
    told: Vec<Isometry3<f64>>,
    start: Vec<Isometry3<f64>>,
    paths: Vec<Vec<Isometry3<f64>>>,
    landmarks: Vec<Point3<f64>>,
    seq: u64,
}

impl Walk {
    fn new(robots: usize, settings: KeyframeSettings, frame: &Isometry3<f64>) -> Self {
        let mut keyframes = KeyframeMap::new(settings);
        let start: Vec<_> = (0..robots)
            .map(|k| frame * Isometry3::translation(0.0, 2.0 * k as f64, 0.0))
            .collect();
        for pose in &start {
            let agent = keyframes.graph.enrol();
            let told = StartPose::new(
                pose.translation.vector.into(),
                pose.rotation.coords.into(),
                PoseNoise::none(),
            );
            let moment = moment(agent, 0, pose);
            keyframes.start_pose(&moment, &told.unwrap());
        }
        let landmarks = (0..12)
            .map(|k| {
                let angle = f64::from(k) * std::f64::consts::TAU / 12.0;
                frame * Point3::new(6.0 * angle.cos(), 4.0 + 6.0 * angle.sin(), 0.5)
            })
            .collect();
        Self {
            keyframes,
            noise: Noise(5),
            truth: start.clone(),
            told: start.clone(),
            paths: start.iter().map(|pose| vec![*pose]).collect(),
            start,
            landmarks,
            seq: 0,
        }
    }

    /// Every robot makes a step and sees what is near.
    fn step(&mut self) {
        self.seq += 1;
        for robot in 0..self.truth.len() {
            let turn = STEP_M / (4.0 + robot as f64);
            let step = Isometry3::new(Vector3::x() * STEP_M, Vector3::z() * turn);
            self.truth[robot] *= step;
            let error = Isometry3::new(
                Vector3::new(self.noise.next(), self.noise.next(), 0.0) * STEP_SD.0,
                Vector3::z() * (self.noise.next() * STEP_SD.1),
            );
            let read = step * error;
            self.told[robot] *= read;
            let (t, r) = STEP_SD;
            let variance = Vector6::new(t * t, t * t, 0.0, 0.0, 0.0, r * r) / 3.0;
            let moment = self.moment(robot);
            self.keyframes
                .graph
                .motion(&moment, &read, &variance, &as_read(&read));
            self.paths[robot].push(self.truth[robot]);
        }
        if self.seq.is_multiple_of(3) {
            for robot in 0..self.truth.len() {
                self.look(robot);
            }
        }
    }

    fn look(&mut self, robot: usize) {
        let here = self.truth[robot];
        for k in 0..self.landmarks.len() {
            let seen = here.inverse_transform_point(&self.landmarks[k]).coords;
            if seen.norm() < 5.0 {
                let relation = self.relation(seen);
                let label = Label::new(&format!("landmark {k}")).unwrap();
                let variance = Vector3::repeat(SEEN_SD_M * SEEN_SD_M / 3.0);
                let moment = self.moment(robot);
                self.keyframes
                    .graph
                    .landmark(&moment, &label, &relation, &variance);
            }
        }
        for other in 0..self.truth.len() {
            let seen = here.inv_mul(&self.truth[other]).translation.vector;
            if other != robot && seen.norm() < 5.0 {
                let relation = self.relation(seen);
                let variance = Vector3::repeat(SEEN_SD_M * SEEN_SD_M / 3.0);
                let stamp_ns = self.moment(robot).stamp_ns;
                let [robot, other] = [robot, other].map(|k| u32::try_from(k).unwrap());
                self.keyframes
                    .graph
                    .sighted(robot, other, stamp_ns, &relation, &variance);
            }
        }
    }

    fn relation(&mut self, seen: Vector3<f64>) -> Relation {
        let error = Vector3::new(self.noise.next(), self.noise.next(), self.noise.next());
        let position = seen + error * SEEN_SD_M;
        let sd = [SEEN_SD_M / 3.0_f64.sqrt(); 3];
        Relation::Position(RelativePosition::new(position.into(), sd).unwrap())
    }

    fn moment(&self, robot: usize) -> Moment {
        moment(u32::try_from(robot).unwrap(), self.seq, &self.told[robot])
    }

    /// Root mean square distance of the refined positions from the truth \[m\].
    fn error_m(&self, refined: &Refined) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (agent, path) in refined.agents.iter().zip(&self.paths) {
            for row in &agent.poses {
                let truth = &path[usize::try_from(row.stamp_ns / 1_000_000_000).unwrap()];
                sum += (row.pose.translation.vector - truth.translation.vector).norm_squared();
                count += 1.0;
            }
        }
        (sum / count).sqrt()
    }
}

fn moment(agent: u32, seq: u64, pose: &Isometry3<f64>) -> Moment {
    Moment {
        agent,
        seq,
        stamp_ns: i64::try_from(seq).unwrap() * 1_000_000_000,
        pose: *pose,
    }
}

fn walked(robots: usize, steps: u32, settings: KeyframeSettings) -> Walk {
    let mut walk = Walk::new(robots, settings, &Isometry3::identity());
    for _ in 0..steps {
        walk.step();
    }
    walk
}

fn roomy() -> KeyframeSettings {
    KeyframeSettings::default()
}

fn tight() -> KeyframeSettings {
    KeyframeSettings {
        keyframes_max: 150,
        sightings_max: 1500,
        ..KeyframeSettings::default()
    }
}

#[test]
fn the_refined_past_is_closer_to_the_truth_than_motion_alone() {
    let walk = walked(3, 400, roomy());
    let refined = walk.keyframes.graph.refine();
    assert!(refined.relaxed.has_converged);
    let motion_m: f64 = (0..3)
        .map(|robot| {
            let off = walk.told[robot].translation.vector - walk.truth[robot].translation.vector;
            off.norm()
        })
        .fold(0.0, f64::max);
    let refined_m = walk.error_m(&refined);
    assert!(motion_m > 0.3, "{motion_m}");
    assert!(refined_m < 0.03, "{refined_m}");
    assert_eq!(refined.landmarks.len(), 12);
    for landmark in &refined.landmarks {
        let k: usize = landmark.label.as_str()[9..].parse().unwrap();
        let off = landmark.position - walk.landmarks[k];
        let covariance = landmark.covariance.unwrap();
        let squared = off.dot(&(covariance.try_inverse().unwrap() * off));
        assert!(squared < 25.0, "{squared}");
    }
}

/// All samples as nodes, all measurements as links, by the experience map alone.
#[test]
fn refined_equals_the_batch_of_all_samples() {
    // Odometry that is always right but for its noise.
    let settings = KeyframeSettings {
        calibration_sd: SVector::zeros(),
        ..roomy()
    };
    let mut walk = Walk::new(1, settings, &Isometry3::identity());
    let mut map = PoseGraph::new();
    let mut nodes = vec![map.add_pose(walk.start[0], Freedom::Held)];
    let mut points = vec![None; walk.landmarks.len()];
    for _ in 0..60 {
        let before = walk.told[0];
        // The walk's own noise is drawn a second time for the oracle.
        let mut noise = Noise(walk.noise.0);
        walk.step();
        let mut sd = Vector6::new(STEP_SD.0, STEP_SD.0, 1.0, 1.0, 1.0, STEP_SD.1);
        sd *= (1.0_f64 / 3.0).sqrt();
        let mut information = *PoseInformation::of_covariance(&PoseCovariance::from_sd(&sd))
            .unwrap()
            .matrix();
        for k in 2..5 {
            information[(k, k)] = 0.0;
        }
        let node = map.add_pose(walk.told[0], Freedom::Planar);
        let step = Link::Between {
            from: nodes[nodes.len() - 1],
            to: node,
            transform: before.inv_mul(&walk.told[0]),
            information: PoseInformation::new(&information).unwrap(),
        };
        map.add_link(step, Kernel::Gaussian).unwrap();
        nodes.push(node);
        for _ in 0..3 {
            noise.next();
        }
        if !walk.seq.is_multiple_of(3) {
            continue;
        }
        let here = walk.truth[0];
        for (landmark, point) in walk.landmarks.iter().zip(&mut points) {
            let seen = here.inverse_transform_point(landmark).coords;
            if seen.norm() >= 5.0 {
                continue;
            }
            let error = Vector3::new(noise.next(), noise.next(), noise.next());
            let position = seen + error * SEEN_SD_M;
            let at = map.pose(node) * Point3::from(position);
            let point = *point.get_or_insert_with(|| map.add_point(at, Freedom::Full));
            let spread = nalgebra::Matrix3::identity() * (SEEN_SD_M * SEEN_SD_M / 3.0 + 1e-6);
            let sighting = Link::Sighting {
                from: node,
                target: SightingTarget::Point(point),
                position,
                information: PositionInformation::of_covariance(&spread).unwrap(),
            };
            map.add_link(sighting, Kernel::Cauchy(Scale::new(3.0).unwrap()))
                .unwrap();
        }
    }
    map.relax(&RelaxationSettings::default());
    let refined = walk.keyframes.graph.refine();
    for row in &refined.agents[0].poses {
        let node = nodes[usize::try_from(row.stamp_ns / 1_000_000_000).unwrap()];
        let off = map.pose(node).inv_mul(&row.pose);
        assert!(off.translation.vector.norm() < 1e-3 && off.rotation.angle() < 1e-3);
    }
    assert!(refined.agents[0].poses.len() > 60);
}

#[test]
fn moving_the_starts_moves_everything() {
    let frame = Isometry3::new(Vector3::new(-40.0, 70.0, 0.0), Vector3::z() * 2.5);
    let here = walked(2, 120, roomy());
    let mut there = Walk::new(2, roomy(), &frame);
    for _ in 0..120 {
        there.step();
    }
    let (here, there) = (
        here.keyframes.graph.refine(),
        there.keyframes.graph.refine(),
    );
    for (a, b) in here.agents.iter().zip(&there.agents) {
        assert_eq!(a.poses.len(), b.poses.len());
        for (a, b) in a.poses.iter().zip(&b.poses) {
            let off = (frame * a.pose).inv_mul(&b.pose);
            assert!(off.translation.vector.norm() < 1e-4 && off.rotation.angle() < 1e-4);
        }
    }
}

#[test]
fn thinning_keeps_the_loops() {
    let whole = walked(2, 1500, roomy());
    let thinned = walked(2, 1500, tight());
    assert!(whole.keyframes.graph.n_keyframes() > 2500);
    assert!(thinned.keyframes.graph.n_keyframes() <= 150);
    let rows_at_keyframes = |walk: &Walk| walk.error_m(&walk.keyframes.graph.refine());
    let (whole_m, thinned_m) = (rows_at_keyframes(&whole), rows_at_keyframes(&thinned));
    let motion = whole.told[0].translation.vector - whole.truth[0].translation.vector;
    assert!(motion.norm() > 0.5, "{}", motion.norm());
    assert!(thinned_m < 2.0 * whole_m, "{thinned_m} {whole_m}");
}

/// Keyframes may go without a sighting less: when room for sightings ran out first, what was seen
/// from then on was not taken in, and the way went on by motion alone.
#[test]
fn what_is_seen_is_taken_in_though_there_is_room_for_keyframes_only() {
    let whole = walked(1, 1500, roomy());
    let bounded = KeyframeSettings {
        sightings_max: 500,
        ..roomy()
    };
    let bounded = walked(1, 1500, bounded);
    assert!(whole.keyframes.graph.n_sightings() > 1000);
    assert!(bounded.keyframes.graph.n_sightings() <= 500);
    let error_m = |walk: &Walk| walk.error_m(&walk.keyframes.graph.refine());
    // Without room for what is seen anew it was 0.17 m.
    let (whole_m, bounded_m) = (error_m(&whole), error_m(&bounded));
    assert!(bounded_m < 0.12, "{bounded_m} {whole_m}");
}

#[test]
fn memory_stays_flat() {
    let mut walk = walked(2, 2000, tight());
    let bytes = walk.keyframes.bytes();
    for _ in 0..3000 {
        walk.step();
    }
    assert!(walk.keyframes.bytes() <= bytes + bytes / 4);
    assert!(walk.keyframes.graph.n_keyframes() <= 150);
}

#[test]
fn a_checkpoint_goes_on_identically() {
    for settings in [roomy(), tight()] {
        let mut walk = walked(3, 200, settings);
        let mut pages: Vec<_> = walk.keyframes.checkpoint(0).collect();
        let snapshot = walk.keyframes.clone();
        walk.keyframes.set_revision(7);
        for _ in 0..50 {
            walk.step();
        }
        pages.extend(walk.keyframes.checkpoint(6));
        let mut restored = KeyframeMap::restore(settings, 7, pages.clone()).unwrap();
        assert_eq!(restored.digest(), walk.keyframes.digest());
        assert_ne!(restored.digest(), snapshot.digest());
        assert_eq!(restored.graph.refine(), walk.keyframes.graph.refine());
        for _ in 0..50 {
            walk.step();
        }
        // The same walk once more, which the restored one takes over after the same steps.
        let mut again = walked(3, 250, settings);
        std::mem::swap(&mut again.keyframes, &mut restored);
        for _ in 0..50 {
            again.step();
        }
        assert_eq!(again.keyframes.digest(), walk.keyframes.digest());
        let complete: Vec<_> = again.keyframes.checkpoint(0).collect();
        for missing in 0..complete.len() {
            let mut pages = complete.clone();
            pages.remove(missing);
            assert!(KeyframeMap::restore(settings, 9, pages).is_err());
        }
    }
}

#[test]
fn an_agent_that_finds_its_place_takes_its_past_along() {
    let tie = Isometry3::new(Vector3::new(3.0, -2.0, 0.0), Vector3::z() * 1.2);
    let mut keyframes = KeyframeMap::new(roomy());
    let agent = keyframes.graph.enrol();
    let step = Isometry3::new(Vector3::x() * 0.3, Vector3::z() * 0.1);
    let variance = Vector6::new(1e-4, 1e-4, 0.0, 0.0, 0.0, 1e-4);
    let mut pose = Isometry3::identity();
    for seq in 1..=10 {
        pose *= step;
        keyframes.graph.motion(
            &moment(agent, seq, &pose),
            &step,
            &variance,
            &as_read(&step),
        );
    }
    assert!(!keyframes.graph.refine().agents[0].is_in_map);
    pose = tie * pose;
    keyframes.graph.placed(agent, &tie);
    for seq in 11..=20 {
        pose *= step;
        keyframes.graph.motion(
            &moment(agent, seq, &pose),
            &step,
            &variance,
            &as_read(&step),
        );
    }
    let refined = &keyframes.graph.refine().agents[0];
    assert!(refined.is_in_map && refined.poses.len() == 20);
    let mut expected = tie;
    for row in &refined.poses {
        expected *= step;
        let off = expected.inv_mul(&row.pose);
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9);
    }
}

/// Between two sessions the agent was carried elsewhere, which the landmarks tell.
#[test]
fn a_new_session_may_begin_elsewhere() {
    let mut walk = walked(1, 120, roomy());
    let carried = Isometry3::new(Vector3::new(0.8, -0.5, 0.0), Vector3::z() * 0.3);
    walk.keyframes
        .graph
        .restart(0, &Vector6::new(1.0, 1.0, 0.0, 0.0, 0.0, 0.5));
    walk.truth[0] *= carried;
    for _ in 0..120 {
        walk.step();
    }
    let refined = walk.keyframes.graph.refine();
    assert!(walk.error_m(&refined) < 0.05, "{}", walk.error_m(&refined));
}

#[test]
fn rest_is_remembered_as_rest() {
    let mut keyframes = KeyframeMap::new(roomy());
    let agent = keyframes.graph.enrol();
    keyframes.graph.found(agent);
    let step = Isometry3::translation(0.05, 0.0, 0.0);
    let variance = Vector6::new(1e-6, 1e-6, 0.0, 0.0, 0.0, 1e-6);
    let mut pose = Isometry3::identity();
    let mut truth = Vec::new();
    for seq in 1..=400_u64 {
        // It rests from 31 to 200, and from 203 on: less than a step away.
        let moves = seq <= 30 || (201..=202).contains(&seq) || seq > 300;
        let increment = if moves { step } else { Isometry3::identity() };
        pose *= increment;
        keyframes.graph.motion(
            &moment(agent, seq, &pose),
            &increment,
            &if moves { variance } else { Vector6::zeros() },
            &as_read(&increment),
        );
        truth.push(pose);
    }
    let rows = &keyframes.graph.refine().agents[0].poses;
    assert!(
        rows.windows(2)
            .all(|pair| pair[0].stamp_ns < pair[1].stamp_ns)
    );
    for (seq, truth) in (1..).zip(&truth) {
        let stamp_ns = seq * 1_000_000_000;
        let after = rows.partition_point(|row| row.stamp_ns < stamp_ns);
        let (a, b) = (&rows[after.saturating_sub(1)], &rows[after]);
        let way_ns = (b.stamp_ns - a.stamp_ns).max(1) as f64;
        let share = (stamp_ns - a.stamp_ns) as f64 / way_ns;
        let x = a.pose.translation.x + share * (b.pose.translation.x - a.pose.translation.x);
        assert!((x - truth.translation.x).abs() < 0.06, "{seq}: {x}");
    }
    assert!(rows.len() < 200);
}
