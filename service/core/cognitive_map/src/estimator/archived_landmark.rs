//! A landmark that left the joint estimate.

use nalgebra::{Matrix3, Point3, SMatrix, UnitQuaternion, Vector3};

use super::frame_alignment::{FrameAlignment, point_by_alignment};
use super::landmark_evidence::LandmarkEvidence;
use super::tuning::TURN_ARM_M;
use crate::input::Label;
use geometry::{align, centre, symmetric};

/// What an anchor says of a landmark.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tie {
    pub(super) anchor: Label,
    /// The anchor's number in the frame.
    pub(super) number: u64,
    /// Where the anchor was when the landmark left.
    pub(super) position: Point3<f64>,
    /// The anchor's covariance then \[m²\].
    pub(super) covariance: Matrix3<f64>,
    /// Gₖ.
    pub(super) gain: Matrix3<f64>,
}

/// A landmark that left the joint estimate.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ArchivedLandmark {
    /// Its number in the frame.
    pub(super) number: u64,
    pub(super) position: Point3<f64>,
    /// The covariance that it had.
    pub(super) covariance: Matrix3<f64>,
    /// What its anchors said of it.
    pub(super) ties: Vec<Tie>,
    /// The covariance of what they left open.
    pub(super) rest: Matrix3<f64>,
    /// The sighting of the frame at which it left.
    pub(super) left: u64,
    /// The one agent that had seen it until then, if there was one only.
    pub(super) only: Option<u32>,
    /// What speaks for its position, and what against it.
    pub(super) evidence: LandmarkEvidence,
}

impl ArchivedLandmark {
    /// With those of its ties alone of which `position` knows where the anchor is; answers where
    /// they are. What the others said of it counts as unknown.
    pub(super) fn tied_to(
        &self,
        position: impl Fn(&Tie) -> Option<Point3<f64>>,
    ) -> (Self, Vec<Point3<f64>>) {
        let mut tied = self.clone();
        let mut anchors = Vec::with_capacity(tied.ties.len());
        let mut rest = self.rest;
        tied.ties.retain(|tie| {
            let known = position(tie);
            match known {
                Some(anchor) => anchors.push(anchor),
                None => rest += tie.gain * tie.covariance * tie.gain.transpose(),
            }
            known.is_some()
        });
        tied.rest = if anchors.is_empty() {
            self.covariance
        } else {
            symmetric(&rest)
        };
        (tied, anchors)
    }

    /// Where it is and what its anchors say of it, as they are by now: with the motions Δₖ of the
    /// anchors, and with the turn R that they have made together about their centre,
    ///
    /// ```text
    /// l ← l + Σ Gₖ Δₖ + S l − Σ Gₖ S aₖ      S = R − 1 − [φ]×      R = exp [φ]×
    /// Gₖ ← R Gₖ Rᵀ
    /// ```
    ///
    /// with positions from that centre.
    ///
    /// The gains hold for small motions of the anchors; S is what a large turn does beyond those.
    /// So a landmark keeps its place in a map that is turned as a whole, and what nobody can know,
    /// where all of it lies, stays unknown.
    pub(super) fn moved_with(&self, anchors: &[Point3<f64>], is_planar: bool) -> Self {
        let (centre, turn) = anchors_turn(anchors, &self.ties, is_planar);
        let rotation = turn.to_rotation_matrix().into_inner();
        let beyond = rotation - Matrix3::identity() - turn.scaled_axis().cross_matrix();
        let mut moved = self.clone();
        moved.position += beyond * (self.position.coords - centre);
        let turned = |matrix: &Matrix3<f64>| symmetric(&(rotation * matrix * rotation.transpose()));
        moved.rest = turned(&self.rest);
        moved.covariance = turned(&self.covariance);
        for (tie, anchor) in moved.ties.iter_mut().zip(anchors) {
            let motion = (anchor - tie.position) - beyond * (tie.position.coords - centre);
            moved.position += tie.gain * motion;
            tie.gain = rotation * tie.gain * rotation.transpose();
            tie.covariance = turned(&tie.covariance);
            tie.position = *anchor;
        }
        moved
    }

    /// The same in an older frame. What its anchors say of it there is what they said, but for how
    /// the error τ of the alignment moves it otherwise than them:
    ///
    /// ```text
    /// e = Σ Gₖ aₖ + r + (J − Σ Gₖ Jₖ) τ
    /// ```
    pub(super) fn aligned(&self, alignment: &FrameAlignment) -> Self {
        let rotation = alignment.pose.rotation.to_rotation_matrix().into_inner();
        let turned = |matrix: &Matrix3<f64>| symmetric(&(rotation * matrix * rotation.transpose()));
        let by_alignment = |point: &Point3<f64>| -> SMatrix<f64, 3, 6> {
            let whole = point_by_alignment(point);
            whole.fixed_view::<3, 6>(0, 0).into_owned()
        };
        let spread = |by: &SMatrix<f64, 3, 6>| by * alignment.covariance * by.transpose();
        let whole = by_alignment(&self.position);
        let of_ties = self.ties.iter();
        let beside: SMatrix<f64, 3, 6> = of_ties
            .map(|tie| tie.gain * by_alignment(&tie.position))
            .sum();
        let tie = |tie: &Tie| Tie {
            anchor: tie.anchor.clone(),
            number: tie.number,
            position: alignment.pose * tie.position,
            covariance: turned(&(tie.covariance + spread(&by_alignment(&tie.position)))),
            gain: rotation * tie.gain * rotation.transpose(),
        };
        Self {
            number: self.number,
            position: alignment.pose * self.position,
            covariance: turned(&(self.covariance + spread(&whole))),
            ties: self.ties.iter().map(tie).collect(),
            rest: turned(&(self.rest + spread(&(whole - beside)))),
            left: self.left,
            only: self.only,
            evidence: LandmarkEvidence {
                rival: None, // its position was one of the other frame
                ..self.evidence
            },
        }
    }
}

/// Where the middle of anchors was, and how they have turned about it together. Of some that lie on
/// a line or at a point, the least turn.
fn anchors_turn(
    anchors: &[Point3<f64>],
    ties: &[Tie],
    is_planar: bool,
) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let pairs = anchors.iter().zip(ties);
    let mut pairs: Vec<(Point3<f64>, Point3<f64>)> =
        pairs.map(|(anchor, tie)| (*anchor, tie.position)).collect();
    let equal = vec![1.0; pairs.len()];
    let now = centre(pairs.iter().map(|pair| pair.0.coords), &equal);
    let then = centre(pairs.iter().map(|pair| pair.1.coords), &equal);
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        for arm in [TURN_ARM_M, -TURN_ARM_M] {
            pairs.push(((now + axis * arm).into(), (then + axis * arm).into()));
        }
    }
    let motion = align(&pairs, &vec![1.0; pairs.len()], is_planar);
    (
        then,
        motion.map_or_else(UnitQuaternion::identity, |motion| motion.rotation),
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;

    /// A landmark whose errors are those of a map that lies anywhere, as are its anchors'.
    fn tied(position: Point3<f64>, anchors: &[Point3<f64>]) -> ArchivedLandmark {
        let by_map = |point: &Point3<f64>| -> SMatrix<f64, 3, 6> {
            let whole = point_by_alignment(point);
            whole.fixed_view::<3, 6>(0, 0).into_owned()
        };
        let mut of_anchors = SMatrix::<f64, 9, 6>::zeros();
        for (k, anchor) in anchors.iter().enumerate() {
            let rows = &mut of_anchors.fixed_rows_mut::<3>(3 * k);
            rows.copy_from(&by_map(anchor));
        }
        let own = of_anchors * of_anchors.transpose() + SMatrix::<f64, 9, 9>::identity() * 1e-6;
        let gain = by_map(&position) * of_anchors.transpose() * own.try_inverse().unwrap();
        let tie = |(k, anchor): (usize, &Point3<f64>)| Tie {
            anchor: Label::new(&format!("anchor {k}")).unwrap(),
            number: k as u64,
            position: *anchor,
            covariance: Matrix3::identity(),
            gain: gain.fixed_columns::<3>(3 * k).into_owned(),
        };
        ArchivedLandmark {
            position,
            ties: anchors.iter().enumerate().map(tie).collect(),
            number: 9,
            covariance: Matrix3::identity(),
            rest: Matrix3::identity() * 1e-6,
            left: 0,
            only: None,
            evidence: LandmarkEvidence::default(),
        }
    }

    /// However far the map turns, and wherever the anchors lie.
    #[test]
    fn a_landmark_moves_with_the_map_that_its_anchors_are_of() {
        let anchors = [(3.0, 0.5, 0.2), (-1.0, 2.0, 0.0), (0.5, -2.5, -0.4)]
            .map(|(x, y, z)| Point3::new(x, y, z));
        for position in [Point3::new(1.0, 0.5, 0.1), Point3::new(-6.0, 4.0, 1.0)] {
            for axis in [Vector3::z() * 0.7, Vector3::new(-1.0, 0.6, 1.5)] {
                let motion = Isometry3::new(Vector3::new(10.0, -20.0, 1.0), axis);
                let there = anchors.map(|anchor| motion * anchor);
                let moved = tied(position, &anchors).moved_with(&there, false);
                assert!((moved.position - motion * position).norm() < 0.01);
                // A turn of the whole map still says nothing of the landmark beside its anchors.
                let turns = moved.ties.iter();
                let turns = turns.map(|tie| tie.gain * tie.position.coords.cross_matrix());
                let beside = turns.sum::<Matrix3<f64>>() - moved.position.coords.cross_matrix();
                assert!(beside.norm() < 0.05, "{beside}");
            }
        }
    }

    #[test]
    fn anchors_on_a_line_turn_no_landmark_about_it() {
        let anchors = [0.0, 2.0, 5.0].map(|x| Point3::new(x, 0.0, 0.0));
        let landmark = tied(Point3::new(2.0, 3.0, 0.0), &anchors);
        // Off the line by what anybody's estimate changes by.
        let mut there = anchors;
        there[1] += Vector3::new(0.0, 0.0, 0.002);
        let moved = landmark.moved_with(&there, false);
        assert!(
            (moved.position - landmark.position).norm() < 0.05,
            "{:?}",
            moved.position
        );
        assert_eq!(landmark.moved_with(&anchors, false), landmark);
    }
}
