//! Searches among places that somebody else keeps.

use std::cell::Cell;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use place_filter::{Field, Found, Kernel, PlaceFilter, Seeker, SensedLevel, Support};

/// Channels, and distance between places \[m\].
const CHANNELS: u8 = 4;
const APART_M: f64 = 0.4;

/// Places in rows on a floor, all of which remember the levels of a smooth field.
struct Floor {
    rows: u32,
    kernel: Kernel,
    /// How often it was asked about a place since the last record.
    asked: Cell<u32>,
}

impl Floor {
    fn new(rows: u32) -> Self {
        let kernel = Kernel {
            mean: 0.0,
            sill: 0.5,
            nugget: 0.005,
            length_m: 1.0,
        };
        Self {
            rows,
            kernel,
            asked: Cell::new(0),
        }
    }

    fn position(&self, place: u32) -> Point3<f64> {
        let (row, column) = (place / self.rows, place % self.rows);
        Point3::new(APART_M * f64::from(row), APART_M * f64::from(column), 0.0)
    }

    fn ask(&self) {
        self.asked.set(self.asked.get() + 1);
    }
}

/// A field that repeats itself nowhere near.
fn level(channel: u8, at: &Point3<f64>) -> f64 {
    let turn = f64::from(channel) + 0.3;
    let along = at.x * turn.cos() + at.y * turn.sin();
    let across = at.y * turn.cos() - at.x * turn.sin();
    (along + 0.05 * across * across + turn).sin() * (0.7 * across + 0.03 * along * along).cos()
}

impl Field for Floor {
    fn kernel(&self, _: u8) -> Option<&Kernel> {
        Some(&self.kernel)
    }

    fn nearest(&self, at: &Point3<f64>) -> Option<u32> {
        self.ask();
        let index = |x: f64| {
            let of_row = |row: &u32| (x - APART_M * f64::from(*row)).abs() <= 0.5 * APART_M;
            (0..self.rows).find(of_row)
        };
        Some(index(at.x)? * self.rows + index(at.y)?)
    }

    fn near(&self, _: &Point3<f64>, _: f64) -> Vec<(u32, Point3<f64>)> {
        Vec::new()
    }

    fn support(&self, place: u32, channel: u8) -> Option<Support> {
        self.ask();
        let at = self.position(place);
        Some(Support {
            at,
            value: level(channel, &at),
            spread_m2: 0.0,
            own_m2: 0.0,
        })
    }

    fn places_from(&self, first: u32) -> Box<dyn Iterator<Item = u32> + '_> {
        Box::new(first..self.rows * self.rows)
    }

    fn extent_m(&self) -> Vector3<f64> {
        let edge_m = APART_M * f64::from(self.rows);
        Vector3::new(edge_m, edge_m, 1.0)
    }
}

/// Walks from somewhere, unknown to it, until it is found; answers where that was and really is,
/// and the most questions about places that a record took.
fn search(floor: &Floor, records: u32) -> (Option<(Found, Isometry3<f64>)>, u32) {
    let from = Isometry3::new(Vector3::new(3.1, 2.3, 0.0), Vector3::z() * 0.8);
    let mut filter = PlaceFilter::default();
    let mut in_odom = Isometry3::identity();
    let mut most = 0;
    for record in 0..records {
        let channel = u8::try_from(record % u32::from(CHANNELS)).expect("there are few");
        if channel == 0 {
            in_odom *= Isometry3::new(Vector3::x() * 0.1, Vector3::z() * 0.02);
        }
        let here = from * in_odom;
        let sensed = SensedLevel {
            channel,
            value: level(channel, &here.translation.vector.into()),
            offset_m: Vector3::zeros(),
            in_odom,
        };
        filter.take(&sensed, floor);
        let seeker = Seeker {
            in_odom,
            upright: &[UnitQuaternion::identity()],
            upright_sd_rad: 0.1,
            is_planar: true,
            sd_max_m: 0.25,
        };
        floor.asked.set(0);
        let found = filter.seek(&seeker, floor);
        most = most.max(floor.asked.get());
        if let Some(found) = found {
            return (Some((found, here)), most);
        }
    }
    (None, most)
}

#[test]
fn a_search_finds_where_it_is() {
    let (found, _) = search(&Floor::new(30), 400);
    let (found, truth) = found.expect("it is found within ten metres");
    let off_m = (found.pose.translation.vector - truth.translation.vector).norm();
    assert!(off_m < 0.2, "{off_m}");
}

/// What a record takes does not depend on how many places there are: some four thousand of them on
/// four channels are looked at, and a last pose is weighed.
#[test]
fn a_record_asks_about_a_bounded_number_of_places() {
    for rows in [20, 60, 120] {
        let (_, most) = search(&Floor::new(rows), 120);
        assert!(most <= 20_000, "{rows}: {most}");
    }
}
