//! News: views that resemble earlier ones more than those before them did.

use nalgebra::Isometry3;

use super::*;
use crate::similarity::view_log::LoggedView;

/// Numbers of a view.
const NUMBERS: u32 = 24;

/// What is seen so far along a corridor \[m\]: numbers that were drawn for every two metres, and
/// between them what lies between.
fn seen(at_m: f64) -> Box<[f32]> {
    let drawn = |number: u32, cell: f64| {
        let wave = (cell * 12.989_8 + f64::from(number) * 78.233).sin() * 43_758.545_3;
        2.0 * (wave - wave.floor()) - 1.0
    };
    let (cell, share) = ((at_m / 2.0).floor(), (at_m / 2.0).fract());
    let number = |number: u32| {
        let between = (1.0 - share) * drawn(number, cell) + share * drawn(number, cell + 1.0);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "numbers of a view are short"
        )]
        let short = between as f32;
        short
    };
    (0..NUMBERS).map(number).collect()
}

/// The log of a robot that was at points of a corridor \[m\]; the last of them are new.
fn log_of(way: &[f64], n_new: u32) -> ViewLog {
    let mut log = ViewLog::default();
    for (ordinal, at) in (0..).zip(way) {
        let view = LoggedView {
            channel: 0,
            sample: SampleKey {
                agent: 0,
                session: 0,
                seq: u64::from(ordinal),
            },
            ordinal,
            stretch: 0,
            in_odom: Isometry3::translation(*at, 0.0, 0.0),
            vector: seen(*at),
        };
        log.add(view, 1);
    }
    log.n_new = n_new;
    log
}

fn news_nats(way: &[f64]) -> f64 {
    let log = log_of(way, 20);
    let channels = Similarity::of_channels(&log, 1024);
    assert_eq!(channels.len(), 1, "views of one channel that say something");
    channels[0].news_nats()
}

#[test]
fn views_are_news_where_the_robot_comes_back() {
    let ahead = |number: u32| 0.4 * f64::from(number);
    let out: Vec<_> = (0..380).map(ahead).collect();
    let on: Vec<_> = (380..400).map(ahead).collect();
    let back: Vec<_> = (100..120).map(ahead).collect();
    let first_half = &out[..190];
    for (new, is_news) in [(&on, false), (&back, true)] {
        let once = news_nats(&[out.as_slice(), new.as_slice()].concat());
        assert_eq!(once > 20.0, is_news, "{once}");
    }
    // Of one that goes to and fro all the time, coming back is nothing new.
    let rounds = [first_half, first_half, &out[100..120]].concat();
    let again = news_nats(&rounds);
    let once = news_nats(&[out.as_slice(), back.as_slice()].concat());
    assert!(again < 0.6 * once, "{again} {once}");
}
