//! The steps of a route.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::cost::duration_s;
use super::path::{Hop, Path};
use super::{Route, RouteEnd, RouteStep, StepKind, tuning};
use crate::fold::CognitiveMap;
use crate::memory::way::{Edge, Way, Waypoint};

/// A route under construction.
struct Steps {
    route: Route,
    at: Point3<f64>,
    facing: UnitQuaternion<f64>,
    variance_m2: f64,
    tolerance_min_m: f64,
}

/// What is known of an edge: its way, where it leads, and the variance of that by motion \[m²\].
struct Known<'a> {
    way: &'a Way,
    to: &'a Waypoint,
    variance_m2: f64,
}

impl CognitiveMap {
    /// The route along a path, with an approach to its first place and from its last where the ends
    /// lie beside them.
    pub(super) fn route_along(
        &self,
        path: &Path,
        cost_micro: u64,
        from: &RouteEnd,
        to: &RouteEnd,
    ) -> Route {
        let at = self.position_of(from);
        let mut steps = Steps {
            route: Route {
                cost_micro,
                start: at,
                length_m: 0.0,
                duration_s: 0.0,
                sd_m: from.variance_m2.sqrt(),
                steps: Vec::new(),
            },
            at,
            facing: self.facing_at(from),
            variance_m2: from.variance_m2,
            tolerance_min_m: tuning::TOLERANCE_PER_FIELD_RADIUS * self.settings().field_radius_m,
        };
        // Looked up together, so that the processor fetches what is far apart at the same time.
        let known: Vec<_> = { path.iter() }
            .map(|(_, hop)| hop.edge().and_then(|edge| self.known(edge)))
            .collect();
        for (pair, known) in path.windows(2).zip(known.iter().skip(1)) {
            let Some(before) = self.ways.waypoint(pair[0].0) else {
                continue;
            };
            if steps.route.steps.is_empty() && from.position.is_some() {
                let place = Point3::from(before.pose().translation.vector);
                steps.approach(Some(before.place()), place);
            }
            match (pair[1].1, known) {
                (Hop::Way(edge), Some(known)) => steps.follow(before, &edge, known),
                (hop, _) => self.cut(&mut steps, pair[1].0, hop),
            }
        }
        if let Some(goal) = to.position {
            steps.approach(None, goal);
        } else if path.len() < 2 && from.position.is_some() {
            // From beside the place to the place itself.
            steps.approach(Some(to.place), self.position_of(to));
        }
        steps.finish()
    }

    /// How a body faces at an end while nothing leads there.
    fn facing_at(&self, end: &RouteEnd) -> UnitQuaternion<f64> {
        let place = self.place(end.place);
        place.map_or_else(UnitQuaternion::identity, |place| *place.rotation())
    }

    /// Adds the step along a straight line to a waypoint.
    fn cut(&self, steps: &mut Steps, to: u32, hop: Hop) {
        let Hop::Shortcut {
            variance_m2,
            s_per_m,
        } = hop
        else {
            return;
        };
        let Some(to) = self.ways.waypoint(to) else {
            return;
        };
        steps.variance_m2 += variance_m2;
        let position = Point3::from(to.pose().translation.vector);
        let length_m = (position - steps.at).norm();
        let step = RouteStep {
            place: Some(to.place()),
            duration_s: s_per_m * length_m,
            ..steps.step_to(position, length_m, StepKind::Shortcut)
        };
        steps.push(step);
    }

    /// What is known of an edge.
    fn known(&self, edge: &Edge) -> Option<Known<'_>> {
        let (way, to) = (self.ways.way(edge.way)?, self.ways.waypoint(edge.to)?);
        let variance_m2 = way.position_variance_m2();
        Some(Known {
            way,
            to,
            variance_m2,
        })
    }
}

impl Steps {
    /// Adds the step along an edge.
    fn follow(&mut self, before: &Waypoint, edge: &Edge, known: &Known<'_>) {
        let Known { way, to, .. } = known;
        let there = way.travelled_from(before.place());
        let back = way.travelled_from(to.place());
        let length_m = edge.length_um as f64 / tuning::MICRO;
        self.variance_m2 += known.variance_m2;
        let position = Point3::from(to.pose().translation.vector);
        let kind = if edge.travelled {
            StepKind::Travelled
        } else {
            StepKind::Reversed
        };
        let step = RouteStep {
            place: Some(to.place()),
            duration_s: duration_s(way, before),
            traversals: there.times(),
            last_stamp_ns: Some(way.last_stamp_ns()),
            leg: there.leg().or(back.leg()),
            ..self.step_to(position, length_m, kind)
        };
        self.push(step);
    }

    /// A step in a straight line beside the ways. One of less than a micrometre is none.
    fn approach(&mut self, place: Option<crate::PlaceId>, position: Point3<f64>) {
        let length_m = (position - self.at).norm();
        if length_m >= 1.0 / tuning::MICRO {
            let step = self.step_to(position, length_m, StepKind::Approach);
            self.push(RouteStep { place, ..step });
        }
    }

    /// A step to a position, of which nothing else is known.
    fn step_to(&self, position: Point3<f64>, length_m: f64, kind: StepKind) -> RouteStep {
        let sd_m = self.variance_m2.sqrt();
        RouteStep {
            place: None,
            position,
            rotation: facing(&(position - self.at)).unwrap_or(self.facing),
            tolerance_m: self.tolerance_min_m.max(tuning::TOLERANCE_SD * sd_m),
            sd_m,
            length_m,
            duration_s: 0.0,
            kind,
            traversals: 0,
            last_stamp_ns: None,
            leg: None,
        }
    }

    fn push(&mut self, step: RouteStep) {
        (self.at, self.facing) = (step.position, step.rotation);
        self.route.steps.push(step);
    }

    /// The route. An approach takes as long as the same length of ways does on average.
    fn finish(self) -> Route {
        let mut route = self.route;
        let of_ways = |step: &&RouteStep| step.kind != StepKind::Approach;
        let along = route.steps.iter().filter(of_ways);
        let (length_m, duration_s) = along.fold((0.0, 0.0), |(length_m, duration_s), step| {
            (length_m + step.length_m, duration_s + step.duration_s)
        });
        let s_per_m = if length_m > 0.0 {
            duration_s / length_m
        } else {
            0.0
        };
        for step in &mut route.steps {
            if step.kind == StepKind::Approach {
                step.duration_s = step.length_m * s_per_m;
            }
        }
        route.length_m = route.steps.iter().map(|step| step.length_m).sum();
        route.duration_s = route.steps.iter().map(|step| step.duration_s).sum();
        route.sd_m = self.variance_m2.sqrt();
        route
    }
}

/// Rotation of a body whose x axis points along a way, without roll; `None` where it has no length.
fn facing(way: &Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    if way.norm_squared() == 0.0 || !way.norm_squared().is_finite() {
        return None;
    }
    let yaw = if way.xy().norm_squared() > 0.0 {
        way.y.atan2(way.x)
    } else {
        0.0
    };
    let pitch = -way.z.atan2(way.xy().norm());
    Some(UnitQuaternion::from_euler_angles(0.0, pitch, yaw))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_body_faces_along_the_way(way in prop::array::uniform3(-5.0..5.0f64)) {
            let way = Vector3::from(way);
            prop_assume!(way.norm() > 1e-6);
            let rotation = facing(&way).unwrap();
            prop_assert!((rotation * Vector3::x() - way.normalize()).norm() < 1e-12);
            prop_assert!((rotation * Vector3::y()).z.abs() < 1e-12, "no roll");
        }
    }

    #[test]
    fn upright_ways_and_none_have_a_rotation() {
        for z in [1.0, -1.0] {
            let rotation = facing(&Vector3::new(0.0, 0.0, z)).unwrap();
            assert!((rotation * Vector3::x() - Vector3::new(0.0, 0.0, z)).norm() < 1e-12);
        }
        assert!(facing(&Vector3::zeros()).is_none());
    }
}
