//! Matches of views, and news: views that resemble earlier ones more than those before did.

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

/// The log of a robot that was at points of a corridor \[m\] and saw these views there.
fn log_along(views: impl Iterator<Item = (f64, Box<[f32]>)>) -> ViewLog {
    let mut log = ViewLog::default();
    for (ordinal, (at_m, vector)) in (0..).zip(views) {
        let view = LoggedView {
            channel: 0,
            sample: SampleKey {
                agent: 0,
                session: 0,
                seq: u64::from(ordinal),
            },
            ordinal,
            stretch: 0,
            in_odom: Isometry3::translation(at_m, 0.0, 0.0),
            vector,
        };
        log.add(view, 1);
    }
    log
}

/// The log of a robot that was at points of a corridor \[m\]; the last of them are new.
fn log_of(way: &[f64], n_new: u32) -> ViewLog {
    let mut log = log_along(way.iter().map(|at| (*at, seen(*at))));
    log.n_new = n_new;
    log
}

fn news_nats(way: &[f64]) -> f64 {
    let log = log_of(way, 20);
    let channels = Similarity::of_channels(&log, 1024);
    assert_eq!(channels.len(), 1, "views of one channel that say something");
    channels[0].news_nats()
}

/// The log of so many sessions, of one view each.
fn log_of_sessions(count: u32) -> ViewLog {
    let mut log = ViewLog::default();
    for session in 0..count {
        let at = 0.05 * f64::from(session);
        let sample = SampleKey {
            agent: 0,
            session,
            seq: 0,
        };
        let view = LoggedView {
            channel: 0,
            sample,
            ordinal: 0,
            stretch: 0,
            in_odom: Isometry3::identity(),
            vector: seen(at),
        };
        log.add(view, 1);
    }
    log
}

#[test]
fn first_views_of_many_sessions_are_thinned_too() {
    let log = log_of_sessions(600);
    let all = Runs::of(&log, 0);
    assert_eq!(all.len(), 600);
    for most in [1, 7, 300, 512, 600, 1024] {
        let n_kept = all.thinned(most).len();
        assert!(
            (most.min(600) / 2..=most).contains(&n_kept),
            "{n_kept} of {most}"
        );
    }
    let most = crate::tuning::log::VIEWS_MAX;
    let n_logged = Runs::of(&log_of_sessions(10_000), 0).len();
    assert!((most / 2..=most).contains(&n_logged), "{n_logged}");
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

#[test]
fn views_are_recognised_where_few_of_them_are_matched() {
    // Of four views 0.6 m apart one is matched, and those are farther apart than what two show
    // together.
    let once: Vec<f64> = (0..400).map(|number| 0.6 * f64::from(number)).collect();
    let twice = [once.as_slice(), once.as_slice()].concat();
    let log = log_of(&twice, 0);
    let channels = Similarity::of_channels(&log, 256);
    assert_eq!(channels.len(), 1, "views of one channel that say something");
    let channel = &channels[0];
    assert_eq!(channel.learned().views, 200);
    let range_m = channel.learned().range_m;
    assert!((1.0..3.0).contains(&range_m), "{range_m}");
    assert!(channel.learned().information_nats > 1.0);
    let at = |sample: SampleKey| twice[usize::try_from(sample.seq).unwrap()];
    let matches = channel.matches();
    let best = |seq: u64| {
        let of_view = matches.iter().filter(|one| one.now.seq == seq);
        of_view.max_by(|a, b| a.depth.total_cmp(&b.depth))
    };
    let is_true = |one: &&ViewMatch| (at(one.now) - at(one.then)).abs() < 3.0;
    let again = (400..800).step_by(4).filter_map(best).filter(is_true);
    let n_true = again.count();
    assert!(n_true >= 95, "{n_true} of 100");
}

#[test]
fn close_matches_are_the_best_among_views_that_a_map_has_close() {
    let once: Vec<f64> = (0..200).map(|number| 0.4 * f64::from(number)).collect();
    let thrice = [once.as_slice(), once.as_slice(), once.as_slice()].concat();
    let log = log_of(&thrice, 0);
    let channels = Similarity::of_channels(&log, 1024);
    assert_eq!(channels.len(), 1, "views of one channel that say something");
    let channel = &channels[0];
    let range_m = channel.learned().range_m;
    let map = |shift_m: f64| -> Vec<Option<Point3<f64>>> {
        // The third time along the corridor lies beside it.
        let shift = |index: usize| if index < 400 { 0.0 } else { shift_m };
        let points = thrice.iter().enumerate();
        points
            .map(|(index, at)| Some(Point3::new(*at, shift(index), 0.0)))
            .collect()
    };
    let index = |sample: SampleKey| usize::try_from(sample.seq).unwrap();
    let apart_m = |one: &ViewMatch| (thrice[index(one.now)] - thrice[index(one.then)]).abs();
    // A view has one match in each of the other two times along.
    let matches = channel.matches_close(&map(0.0));
    assert!((1000..=1200).contains(&matches.len()), "{}", matches.len());
    assert!(matches.iter().all(|one| apart_m(one) < 2.0 * range_m));
    let n_true = matches.iter().filter(|one| apart_m(one) < 0.9).count();
    assert!(n_true >= 950, "{n_true} of {}", matches.len());
    // What a map has beyond two ranges is matched by those that look farther, not closely.
    let beside = map(2.5 * range_m);
    let is_third = |one: &ViewMatch| (index(one.now) < 400) != (index(one.then) < 400);
    assert!(!channel.matches_close(&beside).iter().any(is_third));
    let near = channel.matches_near(&beside);
    assert!(near.iter().filter(|one| is_third(one)).count() > 100);
    assert!(channel.matches_close(&vec![None; thrice.len()]).is_empty());
    // What is doubtful says less of where it is.
    let by_depth = |a: &&ViewMatch, b: &&ViewMatch| a.depth.total_cmp(&b.depth);
    let doubtful = matches.iter().min_by(by_depth).unwrap();
    let sure = matches.iter().max_by(by_depth).unwrap();
    let unweighed = channel.matches_near(&map(0.0))[0];
    assert!(doubtful.depth < sure.depth);
    assert!(unweighed.sd_m <= sure.sd_m && sure.sd_m < doubtful.sd_m);
}

#[test]
fn sequences_of_all_views_are_those_of_views_between_which_there_are_none() {
    let once: Vec<f64> = (0..100).map(|number| 0.4 * f64::from(number)).collect();
    let back: Vec<f64> = once.iter().rev().copied().collect();
    let log = log_of(&[once, back].concat(), 0);
    let all = Runs::of(&log, 0);
    let neighbours = Neighbours::of(&all, &all);
    let views = Centres::of(&all).centred(&all);
    let model = TwoCovariance::of(neighbours.within(&views, all.len()).unwrap(), &views).unwrap();
    let components = model.components(&views);
    let (scores, score_sd) = model.scores(&components);
    let pairs = neighbours.pairs(&model, &components, score_sd);
    for pair in pairs.iter().step_by(97) {
        let score = f64::from(scores[(pair.about.0, pair.about.0 + pair.lag)]);
        assert!((score - pair.score).abs() < 1e-4, "{score} {pair:?}");
    }
    let learned = Learned::of(&all, &pairs, scores).unwrap();
    let score = |some: &_, others: &_| model.scores_between(some, others) / single(score_sd);
    let of_thinned = sequence_odds::of_thinned(&neighbours, &components, score, &learned);
    let of_all = sequence_odds::of_all(&all, &learned.log_odds);
    assert_eq!(of_all.shape(), of_thinned.shape());
    let apart = (of_all - of_thinned).abs().max();
    assert!(apart < 1e-3, "{apart}");
}

/// The log of a robot that goes straight on, a view each 0.4 m: of a field of so many numbers that
/// changes over 1.5 m.
fn log_of_field(n_views: u32, numbers: u32) -> ViewLog {
    let mut draws = random::Seeded(u64::from(numbers));
    let waves: Vec<(f64, f64)> = (0..numbers)
        .map(|_| (draws.normal(), std::f64::consts::TAU * draws.uniform()))
        .collect();
    let view = |ordinal| {
        let at_m = 0.4 * f64::from(ordinal);
        let vector = waves.iter().map(|(wave, shift)| {
            let seen = (wave * at_m / 1.5 + shift).cos() + 0.1 * draws.normal();
            #[expect(clippy::cast_possible_truncation, reason = "a view is no exact number")]
            let seen = seen as f32;
            seen
        });
        (at_m, vector.collect())
    };
    log_along((0..n_views).map(view))
}

/// Of few views, some mixture of their many numbers changes slowly along any way: they seem alike
/// over all of it that was compared, and hold no map. More views show how far they are alike.
#[test]
fn views_that_seem_alike_over_all_of_a_way_hold_no_map() {
    let few = log_of_field(112, 128);
    let many = log_of_field(900, 128);
    let [few, many] = [&few, &many].map(|log| *Similarity::of_channels(log, 1024)[0].learned());
    assert!(few.is_coarse && few.range_m > 5.0, "{few:?}");
    assert!(!many.is_coarse && many.range_m < 4.0, "{many:?}");
}

/// A channel with a long range holds no map until that is clearly shorter; one whose range was not
/// seen holds it from when it is.
#[test]
fn a_channel_that_was_coarse_by_its_range_stays_so_for_a_while() {
    let known = *Similarity::of_channels(&log_of_field(112, 128), 1024)[0].learned();
    let of = |range_m: f64, is_coarse: bool| LearnedChannel {
        range_m,
        is_coarse,
        ..known
    };
    let between = of(14.0, false);
    assert!(between.after(&[of(20.0, true)]).is_coarse);
    assert!(!between.after(&[of(8.0, true)]).is_coarse);
    assert!(!between.after(&[of(14.0, false)]).is_coarse);
    assert!(!of(8.0, false).after(&[of(20.0, true)]).is_coarse);
}
