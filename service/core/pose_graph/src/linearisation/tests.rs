//! Derivatives against difference quotients, for every kind of link.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3, Vector6};
use proptest::prelude::*;

use crate::link::{Link, SightingTarget};
use crate::node::{CalibrationId, Freedom, Lengths, Node, PointId, PoseId, Veer};
use crate::normal_blocks::NormalBlocks;
use crate::{
    Calibration, CalibrationInformation, Exposure, PoseInformation, PositionInformation,
    RangeInformation, Reading,
};

/// A node from, a node to, and a link from the first to the second.
#[derive(Clone, Debug)]
struct Case {
    from: Node,
    to: Node,
    link: Link,
    /// The place of the calibration, of a motion.
    calibration: Isometry3<f64>,
}

/// Some lasting errors of odometry.
fn calibration() -> Calibration {
    Calibration {
        length: 0.1,
        angle: -0.2,
        veer_rad_m: 0.05,
        bias_rad_s: Vector3::new(0.02, -0.01, 0.03),
    }
}

fn pose() -> impl Strategy<Value = Isometry3<f64>> {
    (
        prop::array::uniform3(-5.0..5.0_f64),
        prop::array::uniform3(-1.7..1.7_f64),
    )
        .prop_map(|(shift, turn)| Isometry3::new(shift.into(), turn.into()))
}

/// A positive matrix that is nothing special.
fn information(seed: [f64; 6]) -> Matrix6<f64> {
    let root =
        Matrix6::from_fn(|r, c| (seed[r] * (c as f64 + 1.3)).sin() + f64::from(u8::from(r == c)));
    root * root.transpose()
}

/// All kinds of distances between these poses, with an error \[m\].
fn ranges(from: Isometry3<f64>, to: Isometry3<f64>, error_m: f64, seed: f64) -> [(Node, Link); 3] {
    let (a, b) = (PoseId(0), PoseId(1));
    let antenna = Vector3::new(-0.2, 0.1, 0.7);
    let range = |target: SightingTarget| {
        let seen = from.inverse_transform_point(&(to * Point3::from(target.lever())));
        Link::Range {
            from: a,
            antenna,
            target,
            range_m: (seen.coords - antenna).norm() + error_m,
            information: RangeInformation::of_variance(0.04 * seed).expect("a positive variance"),
        }
    };
    let node = || Node::pose(to, Freedom::Full);
    let point = Node::point(to.translation.vector.into(), Freedom::Full);
    let lever = Vector3::new(0.4, -0.3, 0.2);
    [
        (node(), range(SightingTarget::Pose(b))),
        (node(), range(SightingTarget::PointOf(b, lever))),
        (point, range(SightingTarget::Point(PointId(1)))),
    ]
}

/// All kinds of links between these poses, measured as they are (`error` zero) or with an error.
fn cases(
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    error: Isometry3<f64>,
    seed: [f64; 6],
) -> Vec<Case> {
    let whole = PoseInformation::new(&information(seed)).expect("a square is positive");
    let block: Matrix3<f64> = information(seed).fixed_view::<3, 3>(0, 0).into_owned();
    let position_information = PositionInformation::new(&block).expect("a square is positive");
    let node = |pose| Node::pose(pose, Freedom::Full);
    let point = Node::point(to.translation.vector.into(), Freedom::Full);
    let (a, b) = (PoseId(0), PoseId(1));
    let position = |target: SightingTarget| {
        let point = to * Point3::from(target.lever());
        from.inverse_transform_point(&point).coords + error.translation.vector
    };
    let sighting = |target| Link::Sighting {
        from: a,
        target,
        position: position(target),
        information: position_information,
    };
    let at: Point3<f64> = (to.translation.vector + error.translation.vector).into();
    let links = [
        (
            node(to),
            Link::PosePrior {
                pose: b,
                at: to * error,
                information: whole,
            },
        ),
        (
            point.clone(),
            Link::PointPrior {
                point: PointId(1),
                at,
                information: position_information,
            },
        ),
        (
            node(to),
            Link::Between {
                from: a,
                to: b,
                transform: from.inv_mul(&to) * error,
                information: whole,
            },
        ),
        (
            node(to),
            Link::Odometry {
                from: a,
                to: b,
                calibration: CalibrationId(2),
                reading: Reading::corrected_to(
                    &(from.inv_mul(&to) * error),
                    &calibration(),
                    &Exposure {
                        moving_s: 0.7,
                        turned_rad: Vector3::new(0.3, -0.2, 0.5),
                    },
                    0.1,
                ),
                information: whole,
            },
        ),
        (node(to), sighting(SightingTarget::Pose(b))),
        (
            node(to),
            sighting(SightingTarget::PointOf(b, Vector3::new(0.4, -0.3, 0.2))),
        ),
        (point, sighting(SightingTarget::Point(PointId(1)))),
    ];
    { links.into_iter() }
        .chain(ranges(from, to, error.translation.vector.x, seed[0]))
        .map(|(to, link)| Case {
            from: node(from),
            to,
            link,
            calibration: calibration().place(),
        })
        .collect()
}

impl Case {
    /// The squared error after motions of the two nodes.
    fn squared_error(&self, from_step: &Vector6<f64>, to_step: &Vector6<f64>) -> f64 {
        let from = self.from.moved(&self.from.pose, from_step.as_slice());
        let to = self.to.moved(&self.to.pose, to_step.as_slice());
        self.link.squared_error(|node| self.place(node, &from, &to))
    }

    /// The blocks at the places of the nodes.
    fn blocks(&self, weight: f64) -> NormalBlocks {
        let (from, to) = (&self.from.pose, &self.to.pose);
        self.link
            .normal_blocks(|node| self.place(node, from, to), |_| weight)
    }

    /// The place of a node of the link: the first, the second, or the calibration.
    fn place<'a>(
        &'a self,
        node: u32,
        from: &'a Isometry3<f64>,
        to: &'a Isometry3<f64>,
    ) -> &'a Isometry3<f64> {
        [from, to, &self.calibration][node as usize]
    }
}

proptest! {
    #[test]
    fn gradients_are_difference_quotients(
        (from, to) in (pose(), pose()),
        shift in prop::array::uniform3(-2.0..2.0_f64),
        turn in prop::array::uniform3(-1.5..1.5_f64),
        seed in prop::array::uniform6(0.3..3.0_f64),
    ) {
        for case in cases(from, to, Isometry3::new(shift.into(), turn.into()), seed) {
            let blocks = case.blocks(1.0);
            let zero = Vector6::zeros();
            for axis in 0..6 {
                let mut step = Vector6::zeros();
                step[axis] = 1e-5;
                let by_to = case.squared_error(&zero, &step) - case.squared_error(&zero, &-step);
                let by_from = case.squared_error(&step, &zero) - case.squared_error(&-step, &zero);
                // Of a point only three axes count, and a prior has no second node.
                let moves_to = axis < 3 || !case.to.is_point();
                let expected_to = if moves_to { 2.0 * blocks.to_gradient[axis] } else { 0.0 };
                let scale = 1.0 + blocks.to_gradient.norm() + blocks.from_gradient.norm();
                prop_assert!((by_to / 2e-5 - expected_to).abs() < 1e-6 * scale, "{case:?} {axis}");
                let expected_from = 2.0 * blocks.from_gradient[axis];
                prop_assert!((by_from / 2e-5 - expected_from).abs() < 1e-6 * scale, "{case:?} {axis}");
            }
        }
    }

    /// Where a link fits, its cost is the quadratic form of its blocks.
    #[test]
    fn blocks_are_the_curvature_of_a_link_that_fits(
        (from, to) in (pose(), pose()),
        steps in prop::array::uniform12(-1.0..1.0_f64),
        seed in prop::array::uniform6(0.3..3.0_f64),
    ) {
        for case in cases(from, to, Isometry3::identity(), seed) {
            let blocks = case.blocks(1.0);
            let from_step = Vector6::from_column_slice(&steps[..6]) * 1e-5;
            let mut to_step = Vector6::from_column_slice(&steps[6..]) * 1e-5;
            if case.to.is_point() {
                to_step.fixed_rows_mut::<3>(3).fill(0.0);
            }
            let cost = case.squared_error(&from_step, &to_step);
            let model = from_step.dot(&(blocks.from_from * from_step))
                + 2.0 * to_step.dot(&(blocks.to_from * from_step))
                + to_step.dot(&(blocks.to_to * to_step));
            prop_assert!((cost - model).abs() < 1e-3 * model + 1e-13, "{case:?}: {cost} {model}");
        }
    }
}

proptest! {
    /// What a calibration adds to a motion, against difference quotients and the quadratic form.
    #[test]
    fn a_calibration_moves_a_motion_as_its_blocks_say(
        (from, to) in (pose(), pose()),
        shift in prop::array::uniform3(-0.3..0.3_f64),
        turn in prop::array::uniform3(-0.3..0.3_f64),
        seed in prop::array::uniform6(0.3..3.0_f64),
    ) {
        let error = Isometry3::new(shift.into(), turn.into());
        let cases = cases(from, to, error, seed).into_iter();
        for case in cases.filter(|case| matches!(case.link, Link::Odometry { .. })) {
            let blocks = case.blocks(1.0).by_calibration.expect("it has a calibration");
            let node = Node::calibration(
                &calibration(),
                Freedom::Full,
                Lengths::Estimated,
                Veer::Estimated,
            );
            let cost = |step: f64, index: usize| {
                let mut unknowns = [0.0; 6];
                unknowns[index] = step;
                let moved = node.moved(&node.pose, &unknowns);
                let place = |node: u32| [&case.from.pose, &case.to.pose, &moved][node as usize];
                case.link.squared_error(place)
            };
            for (index, &axis) in node.axes().iter().enumerate() {
                let quotient = (cost(1e-5, index) - cost(-1e-5, index)) / 2e-5;
                let expected = 2.0 * blocks.gradient[axis];
                let scale = 1.0 + blocks.gradient.norm() + blocks.own.norm();
                prop_assert!((quotient - expected).abs() < 1e-5 * scale, "{axis}: {case:?}");
            }
        }
    }
}

/// A change of a calibration costs its square, by the variance of each component.
#[test]
fn a_calibration_costs_its_distance_from_what_is_expected() {
    let bias = Vector3::repeat(1e-4);
    let information = CalibrationInformation::of_variances(0.01, 0.04, 2.5e-3, &bias).unwrap();
    let (a, b) = (CalibrationId(0), CalibrationId(1));
    let zero = Calibration::default().place();
    let at = calibration().place();
    let place = |node: u32| if node == 0 { &zero } else { &at };
    let prior = Link::CalibrationPrior {
        calibration: b,
        at: Calibration::default(),
        information,
    };
    let wander = Link::CalibrationWander {
        from: a,
        to: b,
        information,
    };
    // 0.1² / 0.01 + 0.2² / 0.04 + 0.05² / 0.0025 + (0.02² + 0.01² + 0.03²) / 1e-4
    let expected = 1.0 + 1.0 + 1.0 + 14.0;
    assert!((prior.squared_error(place) - expected).abs() < 1e-9);
    assert!((wander.squared_error(place) - expected).abs() < 1e-9);
    let blocks = wander.normal_blocks(place, |_| 1.0);
    assert_eq!(blocks.from_gradient, -blocks.to_gradient);
    assert!(CalibrationInformation::of_variances(0.0, 1.0, 1.0, &bias).is_err());
    assert!(CalibrationInformation::of_variances(f64::NAN, 1.0, 1.0, &bias).is_err());
}

#[test]
fn a_weight_multiplies_all_blocks() {
    let error = Isometry3::new(Vector3::new(0.3, 0.1, -0.2), Vector3::new(0.1, 0.2, 0.3));
    let from = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(-0.4, 0.2, 0.1));
    for case in cases(from, from * error, error, [0.5, 0.7, 1.1, 1.3, 1.7, 1.9]) {
        let (whole, half) = (case.blocks(1.0), case.blocks(0.5));
        assert!((whole.to_to - half.to_to * 2.0).norm() < 1e-12);
        assert!((whole.to_from - half.to_from * 2.0).norm() < 1e-12);
        assert!((whole.from_gradient - half.from_gradient * 2.0).norm() < 1e-12);
    }
}

/// Two antennas in one place are at no distance; in no direction are they nearer.
#[test]
fn a_distance_of_zero_has_no_direction() {
    let here = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(-0.4, 0.2, 0.1));
    let link = Link::Range {
        from: PoseId(0),
        antenna: Vector3::zeros(),
        target: SightingTarget::Pose(PoseId(1)),
        range_m: 2.0,
        information: RangeInformation::of_variance(0.25).unwrap(),
    };
    assert!((link.squared_error(|_| &here) - 16.0).abs() < 1e-12);
    let blocks = link.normal_blocks(|_| &here, |_| 1.0);
    assert_eq!(blocks.to_gradient, Vector6::zeros());
    assert_eq!(blocks.from_from, Matrix6::zeros());
    assert!(RangeInformation::of_variance(0.0).is_err());
    assert!(RangeInformation::of_variance(f64::NAN).is_err());
}
