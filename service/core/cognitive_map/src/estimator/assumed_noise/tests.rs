//! A share against the covariance of errors, matrix by matrix.

use nalgebra::{SMatrix, SVector, Vector6};
use random::Seeded;

use super::super::jacobian::Block;
use super::*;
use geometry::symmetric;

const AGENT: u32 = 3;

/// A covariance of two poses, of which the first has moved with noise, and that noise.
fn moved(random: &mut Seeded) -> (JointCovariance, DMatrix<f64>) {
    let mut joint = JointCovariance::default();
    let (one, other) = (joint.grow(6), joint.grow(6));
    let noise = [
        Vector6::new(0.3, 0.2, 0.1, 0.0, 0.0, 0.0),
        Vector6::new(0.0, 0.0, 0.0, 0.1, 0.2, 0.3),
    ];
    let noise = noise.map(|variances| Matrix6::from_diagonal(&variances));
    let own = Matrix6::from_diagonal_element(0.1 + random.uniform());
    joint.set_diagonal(one, &(own + noise[0] + noise[1]));
    joint.set_diagonal(other, &own);
    joint.add_to_shares(AGENT, one, &noise);
    let mut share = DMatrix::zeros(12, 12);
    share
        .fixed_view_mut::<6, 6>(0, 0)
        .copy_from(&(noise[0] + noise[1]));
    (joint, share)
}

fn sum_of_shares(joint: &JointCovariance) -> DMatrix<f64> {
    let dim = joint.dim();
    let shares = joint.shares().iter();
    let squares = shares.map(|share| DMatrix::from_row_slice(dim, dim, &share.entries));
    squares.sum()
}

#[test]
fn a_share_goes_through_motions_and_sightings_as_errors_do() {
    let random = &mut Seeded(7);
    let (mut joint, mut share) = moved(random);
    for round in 0..20 {
        let turn = SMatrix::<f64, 6, 6>::from_fn(|_, _| 0.5 * random.normal());
        let turn = turn + SMatrix::<f64, 6, 6>::identity();
        let own: Matrix6<f64> = joint.block(0, 0);
        joint.transform(0, &turn, &symmetric(&(turn * own * turn.transpose())));
        let mut transition = DMatrix::identity(12, 12);
        transition.fixed_view_mut::<6, 6>(0, 0).copy_from(&turn);
        share = &transition * share * transition.transpose();

        let blocks = [0, 6].map(|offset| Block::<2> {
            offset,
            width: 6,
            jacobian: SMatrix::from_fn(|_, _| random.normal()),
        });
        // Now and then the second pose is to stay as it is.
        let corrected = if round % 3 == 0 { 0..6 } else { 0..12 };
        let projection = joint.project(&blocks);
        let s = projection.spread + SMatrix::<f64, 2, 2>::identity();
        let covariance = DMatrix::from_row_slice(12, 12, joint.entries());
        let by_state = DMatrix::from_fn(2, 12, |row, k| blocks[k / 6].jacobian[(row, k % 6)]);
        let inverse = DMatrix::from_fn(2, 2, |a, b| s[(a, b)])
            .try_inverse()
            .unwrap();
        let mut gain = covariance * by_state.transpose() * inverse;
        for row in corrected.end..12 {
            gain.row_mut(row).fill(0.0);
        }
        let left = DMatrix::identity(12, 12) - gain * by_state;
        share = &left * share * left.transpose();
        joint
            .update(projection, &SVector::zeros(), &s, &corrected)
            .unwrap();

        let off = (sum_of_shares(&joint) - &share).amax();
        assert!(off < 1e-9 * (1.0 + share.amax()), "round {round}: {off}");
    }
    // What appears later is as uncertain as what it hangs on.
    let blocks = [Block::<3> {
        offset: 0,
        width: 6,
        jacobian: SMatrix::from_fn(|row, k| if row == k { 1.0 } else { 0.0 }),
    }];
    let at = joint.append(&blocks, &SMatrix::identity());
    let of_all = sum_of_shares(&joint);
    let of_pose: DMatrix<f64> = share.view((0, 0), (3, 3)).into();
    assert!((of_all.view((at, at), (3, 3)) - of_pose).amax() < 1e-9 * (1.0 + share.amax()));
}

#[test]
fn what_was_assumed_too_much_is_taken_back() {
    let (mut joint, share) = moved(&mut Seeded(1));
    let before = DMatrix::from_row_slice(12, 12, joint.entries());
    assert!(joint.take_back(AGENT, [0.75; 2]));
    let after = DMatrix::from_row_slice(12, 12, joint.entries());
    assert!((before - after - share * 0.75).amax() < 1e-8);
    assert!(joint.shares().is_empty());
    assert!(!joint.take_back(AGENT, [0.75; 2]), "it is taken back once");
}

#[test]
fn nothing_is_taken_back_of_what_is_known_otherwise() {
    let (mut joint, _) = moved(&mut Seeded(1));
    joint.set_diagonal(0, &Matrix6::from_diagonal_element(0.01));
    let before = joint.entries().to_vec();
    assert!(!joint.take_back(AGENT, [1.0; 2]));
    assert_eq!(joint.entries(), before);
}

#[test]
fn agents_that_are_gone_have_no_share() {
    let (mut joint, _) = moved(&mut Seeded(1));
    joint.add_to_shares(AGENT + 1, 6, &[Matrix6::identity(); 2]);
    joint.drop_shares(AGENT);
    assert!(joint.shares().iter().all(|share| share.agent == AGENT + 1));
    joint.remove(0, 6);
    assert_eq!(sum_of_shares(&joint), DMatrix::identity(6, 6) * 2.0);
}

#[test]
fn of_frames_that_merge_no_more_is_followed_than_of_one() {
    let crowd = |first: u32| {
        let mut joint = JointCovariance::default();
        for agent in first..first + 6 {
            let offset = joint.grow(6);
            joint.add_to_shares(agent, offset, &[Matrix6::identity(); 2]);
        }
        joint
    };
    let (mut one, other) = (crowd(0), crowd(6));
    let start = one.grow(other.dim());
    one.place(start, &other);
    assert_eq!(one.shares().len(), NOISE_SHARES_MAX);
    // Those that are followed are where their agents are now.
    let of_all = sum_of_shares(&one);
    let followed = (0..12).map(|agent| of_all[(6 * agent, 6 * agent)]);
    let followed: Vec<f64> = followed.collect();
    assert_eq!(
        followed,
        [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 0.0]
    );
}
