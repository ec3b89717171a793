//! Kidnap detection: an agent of the map sees what contradicts where it is believed to be.
//!
//! Each query says how much better it is expected where the agent is believed to be, by the
//! covariance of that, than anywhere. The sum since nothing spoke against the pose (Page 1954)
//! decides whether all queries together are aligned: only if they contradict every pose where the
//! agent may be does it count as kidnapped.

use geometry::se3::twist;
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3};

use super::PlaceRecognition;
use crate::appearance::{DescriptorProcess, LocalQuery, Prior, ReferenceView, log_odds};
use crate::keyframes::{Keyframes, SampleKey};
use crate::relocalisation::{KidnapTest, Positions, Problem, QueryView, Search, alignment};
use crate::tuning::kidnap as tuning;
use crate::view::View;
use crate::views::Kernel;

impl PlaceRecognition {
    /// Whether what an agent of the map saw lately contradicts its believed pose. `accepted` is the
    /// number of its sightings so far that agree with that pose.
    pub fn is_contradicted(
        &mut self,
        view: &View<'_>,
        accepted: u64,
        keyframes: &dyn Keyframes,
    ) -> bool {
        let known = self.views.known_channel(view);
        let Some((channel, kernel)) =
            known.and_then(|known| Some((known, self.views.kernel(known)?)))
        else {
            return false;
        };
        let number = self.test_of(view.sample);
        let Some(test) = self.kidnap_tests.get(number) else {
            return false;
        };
        let latest = test.latest.as_ref();
        if latest.is_some_and(|latest| latest.is_beside(&view.in_odom)) {
            return false;
        }
        let query = QueryView {
            in_odom: view.in_odom,
            travelled_m: 0.0,
            channel,
            vector: view.vector.into(),
            similar: Vec::new(),
        };
        let is_consistent = self.is_consistent(test, &query);
        let spacing_m = test.weighed_at.map_or(f64::INFINITY, |at| {
            (at.translation.vector - query.in_odom.translation.vector).norm()
        });
        let evidence = (is_consistent && spacing_m >= tuning::SPACING * kernel.length_m)
            .then(|| self.evidence(test, view, &query, kernel, spacing_m, keyframes))
            .flatten();
        let revision = self.revision;
        let Some(test) = self.kidnap_tests.get_mut(number, revision) else {
            return false;
        };
        let is_much = test.add(&query, is_consistent, evidence, accepted, view.sample.seq);
        let Some(test) = self.kidnap_tests.get(number).filter(|_| is_much) else {
            return false;
        };
        self.is_nowhere_about(test, view, kernel, keyframes)
    }

    /// Whether a query is similar to the view before, if that was near enough.
    fn is_consistent(&self, test: &KidnapTest, query: &QueryView) -> bool {
        let before = test.latest.as_ref();
        let Some(before) = before.filter(|before| before.channel == query.channel) else {
            return false;
        };
        let apart = before.in_odom.translation.vector - query.in_odom.translation.vector;
        let reach_m = self.views.reach_m(query.channel).unwrap_or(0.0);
        apart.norm() >= tuning::BESIDE * reach_m
            || self
                .views
                .is_similar(query.channel, &before.vector, &query.vector)
    }

    /// Log odds of the believed pose by a query, against anywhere else \[nats\]; `None` where
    /// little is known.
    fn evidence(
        &self,
        test: &KidnapTest,
        view: &View<'_>,
        query: &QueryView,
        kernel: Kernel,
        spacing_m: f64,
        keyframes: &dyn Keyframes,
    ) -> Option<f64> {
        let at = Point3::from(view.pose.translation.vector);
        let mut near: Vec<(ReferenceView<'_>, Isometry3<f64>)> = Vec::new();
        // Rounding errors leave none out.
        let about = Vector3::repeat(kernel.length_m * (1.0 + 1e-9));
        let mut remembered: Vec<_> = { self.views.within([at - about, at + about]) }
            .filter(|stored| stored.channel == query.channel && !test.run.is_own(stored))
            .map(|stored| ((stored.in_map - at).norm_squared(), stored))
            .filter(|(squared, _)| *squared <= kernel.length_m.powi(2))
            .collect();
        remembered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut unsure_m2 = 0.0;
        for (_, stored) in remembered.into_iter().take(tuning::NEAR_MAX) {
            if let Some(pose) = keyframes.pose_at(stored.sample) {
                let from = Point3::from(pose.translation.vector);
                let vector = &*stored.vector;
                near.push((ReferenceView { at: from, vector }, pose));
                unsure_m2 += stored.spread[0].powi(2);
            }
        }
        let turned_rad = |pose: &Isometry3<f64>| pose.rotation.angle_to(&view.pose.rotation);
        let turns_rad = near.iter().map(|(_, pose)| turned_rad(pose));
        let least_rad = turns_rad.fold(f64::INFINITY, f64::min);
        let spread_rad = near
            .iter()
            .map(|(_, pose)| pose.rotation.angle_to(&near[0].1.rotation))
            .fold(tuning::TURNED_RAD, f64::max);
        if least_rad > spread_rad {
            return None;
        }
        let seen: Vec<ReferenceView<'_>> = near.iter().map(|(seen, _)| *seen).collect();
        let covariance = view.covariance.in_map_axes(&view.pose.rotation);
        // The views' positions are no more certain than their agents were then.
        let unsure_m2 = unsure_m2 / (3.0 * near.len() as f64);
        let own: Matrix3<f64> = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let covariance = (own + Matrix3::identity() * unsure_m2) * tuning::INFLATION.powi(2);
        let about = DescriptorProcess::of(&query.vector, &at, &seen, kernel)?;
        let predicted = about.predict(&at, &covariance)?;
        let query = LocalQuery {
            at,
            drift_m: 0.0,
            channel: query.channel,
            kernel: Some(kernel),
            vector: &query.vector,
        };
        let numbers = query.numbers(spacing_m);
        Some(log_odds(numbers, predicted.open, predicted.off))
    }

    /// Whether the queries of a run, all together, contradict every pose where the agent may be.
    fn is_nowhere_about(
        &self,
        test: &KidnapTest,
        view: &View<'_>,
        kernel: Kernel,
        keyframes: &dyn Keyframes,
    ) -> bool {
        let mut spaced = Search {
            queries: Vec::new(),
            ..test.run.clone()
        };
        // From the newest back.
        for query in test.run.queries.iter().rev() {
            let is_apart = spaced.queries.last().is_none_or(|later| {
                let apart = later.in_odom.translation.vector - query.in_odom.translation.vector;
                apart.norm() >= tuning::SPACING * kernel.length_m
            });
            if is_apart {
                spaced.queries.push(query.clone());
            }
        }
        spaced.queries.reverse();
        let positions = Positions::of(keyframes);
        let Some(problem) = Problem::of(&spaced, &self.views, keyframes, &positions) else {
            return false;
        };
        let open = problem.prior().open;
        let stated = view.covariance.matrix() * tuning::INFLATION.powi(2);
        // A floor, so that a component without error, such as the height of a robot on a floor, is
        // held.
        let floor = Matrix6::identity() * 1e-6;
        let Some(information) = (stated + floor).try_inverse() else {
            return false;
        };
        let prior = Prior {
            pose: Some(view.pose),
            information,
            open,
        };
        let alignment = alignment(&problem, &spaced, &self.views, &positions);
        let best = alignment.align(&view.pose, &prior).map(|aligned| {
            let off = twist(&view.pose.inv_mul(&aligned.pose));
            aligned.evidence.total() - 0.5 * off.dot(&(information * off))
        });
        best.is_some_and(|best| best <= -tuning::SURE)
    }

    /// Declares an agent kidnapped. The contradicting views are forgotten at the believed pose, and
    /// a search begins with them.
    pub fn declare_kidnapped(&mut self, sample: SampleKey) {
        let revision = self.revision;
        let number = self.test_of(sample);
        let Some(test) = self.kidnap_tests.get_mut(number, revision) else {
            return;
        };
        let mut search = test.run.clone();
        test.reset(sample.seq);
        test.is_kidnapped = true;
        self.views.forget_since(search.since(), revision);
        self.views.cut(sample.agent, revision);
        search.await_comparison(&self.views);
        let number = self.search_of(sample);
        if let Some(known) = self.searches.get_mut(number, revision) {
            *known = search;
        }
    }

    /// Whether an agent of the map counts as kidnapped.
    pub fn is_kidnapped(&self, agent: u32) -> bool {
        let mut kidnap_tests = self.kidnap_tests.iter();
        kidnap_tests.any(|test| test.agent == agent && test.is_kidnapped)
    }

    /// The believed pose of an agent holds, from a sample on: it was stated, or found.
    pub fn confirm_pose(&mut self, agent: u32, seq: u64) {
        let revision = self.revision;
        let number = self
            .kidnap_tests
            .iter()
            .position(|test| test.agent == agent);
        if let Some(test) = number.and_then(|number| self.kidnap_tests.get_mut(number, revision)) {
            test.is_kidnapped = false;
            test.reset(seq);
        }
    }

    /// The number of the kidnap test of an agent in its present session; a new one if there is
    /// none.
    fn test_of(&mut self, sample: SampleKey) -> usize {
        let revision = self.revision;
        let is_own = |test: &KidnapTest| test.agent == sample.agent;
        let Some(number) = self.kidnap_tests.iter().position(is_own) else {
            self.kidnap_tests.push(KidnapTest::new(sample), revision);
            return self.kidnap_tests.len() - 1;
        };
        let is_over = |test: &KidnapTest| test.session != sample.session;
        if self.kidnap_tests.get(number).is_some_and(is_over)
            && let Some(test) = self.kidnap_tests.get_mut(number, revision)
        {
            let is_kidnapped = test.is_kidnapped;
            *test = KidnapTest {
                is_kidnapped,
                ..KidnapTest::new(sample)
            };
        }
        number
    }
}
