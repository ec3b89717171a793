//! What the particles say of where an agent is.

use std::f64::consts::PI;

use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};

use super::*;
use crate::particle_numbers::floats;

/// A filter with particles about a pose in the map, and some far away.
fn filter(pose: &Isometry3<f64>, in_odom: Isometry3<f64>) -> Filter {
    let sample = SampleKey {
        agent: 0,
        session: 1,
        seq: 0,
    };
    let turn = (pose.rotation * in_odom.rotation.inverse())
        .euler_angles()
        .2;
    let mut draws = Seeded(3);
    let mut about = |weight: f64, off_m: f64| {
        let [a, b] = pair(&mut draws);
        let [c, d] = pair(&mut draws);
        let at = pose.translation.vector + Vector3::new(off_m + 0.8 * a, 0.4 * b, 0.1 * d);
        // Some of them turned by a whole turn more: it is the same turn.
        let turn_rad = turn + 0.2 * c + if d > 0.0 { TAU } else { 0.0 };
        let [x, y, z, turn_rad, weight] = floats([at.x, at.y, at.z, turn_rad, weight]);
        Particle {
            at: [x, y, z],
            turn_rad,
            scale: 1.0,
            weight,
        }
    };
    let near = (0..900).map(|_| (0.001, 0.0));
    let far = (0..100).map(|_| (0.001, 50.0));
    let particles = near.chain(far);
    let particles = particles
        .map(|(weight, off_m)| about(weight, off_m))
        .collect();
    Filter {
        in_odom,
        without: 0.0,
        particles,
        ..Filter::new(sample, 0, false)
    }
}

#[test]
fn the_mode_is_where_most_are_and_as_sure_as_they_agree() {
    for heading_rad in [0.0, 3.0, -PI] {
        let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, heading_rad);
        let pose = Isometry3::from_parts(Vector3::new(20.0, -7.0, 0.3).into(), rotation);
        let in_odom = Isometry3::rotation(Vector3::new(0.1, 0.2, 1.3));
        let filter = filter(&pose, in_odom);
        let mut cells = Cells::default();
        assert!(filter.mode(&cells).is_none(), "nobody is between cells");
        for particle in &filter.particles {
            cells.add(filter.channel, &particle.position(), (&[1.0], 1.0), 1);
        }
        let mode = filter.mode(&cells).expect("particles in cells");
        assert!((mode.probability - 0.9).abs() < 1e-6);
        assert!((mode.pose.translation.vector - pose.translation.vector).norm() < 0.1);
        // The covariance is that of the errors on the right of the pose, one by one.
        let near = &filter.particles[..900];
        let mut expected = Matrix6::zeros();
        for particle in near {
            let turn = f64::from(particle.turn_rad);
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, turn);
            let own =
                Isometry3::from_parts(particle.position().coords.into(), turn * in_odom.rotation);
            let off = mode.pose.inv_mul(&own);
            let mut error = Vector6::zeros();
            let (mut across, mut about) = error.rows_range_pair_mut(0..3, 3..6);
            across.copy_from(&off.translation.vector);
            about.copy_from(&off.rotation.scaled_axis());
            expected += error * error.transpose() / near.len() as f64;
        }
        let off = (mode.covariance.matrix() - expected).abs().max();
        assert!(off < 1e-4, "{off} of {expected}");
    }
}

#[test]
fn nothing_is_said_without_particles() {
    let pose = Isometry3::identity();
    let none = Filter {
        particles: Vec::new(),
        ..filter(&pose, pose)
    };
    assert!(none.mode(&Cells::default()).is_none());
}
