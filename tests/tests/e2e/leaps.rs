//! Sequence numbers that somebody made up: they are refused by name, and lose nobody's samples.

use cogmap_proto::{Codec, Rejection, SeqRange, SkipReason};
use cogmap_tests::{Drive, LONG, RawPublisher, Server, batch, eventually, seed};

const SKIPPED: &str = "cogmap_skipped_samples_total";

/// The rejections of the robot's watermark, once there are some.
fn rejections(server: &Server) -> Vec<Rejection> {
    eventually("a rejection", || {
        let detail = server.api().agent("default", "ada");
        let mark = detail.map_err(|error| error.to_string())?.watermark;
        let told = format!("{mark:?}");
        (!mark.rejected.is_empty())
            .then_some(mark.rejected)
            .ok_or(told)
    })
}

#[test]
fn a_number_that_no_loss_explains_is_refused_by_name() {
    let server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(17)).take(300).collect();
    let robot = server.robot("ada", 7);
    robot.send_batch(samples[..100].to_vec()).unwrap();
    robot.flush(LONG).unwrap();
    let mut raw = RawPublisher::connect(&server.endpoint());
    let from = 1 << 63;
    let forged = batch(7, from, samples[..2].to_vec());
    raw.put_batch("default", "ada", Codec::Postcard, &forged);
    let expected = Rejection {
        range: SeqRange { from, to: from + 2 },
        reason: SkipReason::SequenceLeap,
    };
    assert_eq!(rejections(&server), [expected]);
    let reason = [("reason", "sequence_leap")];
    assert_eq!(server.metrics().sum(SKIPPED, &reason), 2);
    // The robot goes on, and nothing of it is a duplicate.
    robot.send_batch(samples[100..].to_vec()).unwrap();
    robot.flush(LONG).unwrap();
    let detail = server.api().agent("default", "ada").unwrap();
    let mark = detail.watermark;
    assert_eq!((mark.durable, mark.gap), (300, None));
    let duplicates = server.metrics().sum("cogmap_duplicate_samples_total", &[]);
    assert_eq!(duplicates, 0);
}

#[test]
fn a_leap_that_nothing_follows_is_not_waited_for_at_the_robots_cost() {
    let server = Server::start(&["engine.gap_timeout_s=0.5"]);
    let samples: Vec<_> = Drive::new(seed(18)).take(200).collect();
    let robot = server.robot("ada", 7);
    robot.send_batch(samples[..100].to_vec()).unwrap();
    robot.flush(LONG).unwrap();
    let mut raw = RawPublisher::connect(&server.endpoint());
    let forged = batch(7, 1 << 30, samples[..2].to_vec());
    raw.put_batch("default", "ada", Codec::Postcard, &forged);
    // The gap is told, and forgotten when nothing has come for long.
    let gap = |is_open: bool| {
        eventually("the gap to open and to close", || {
            let detail = server.api().agent("default", "ada");
            let gap = detail.map_err(|error| error.to_string())?.watermark.gap;
            let told = format!("{gap:?}");
            (gap.is_some() == is_open).then_some(()).ok_or(told)
        });
    };
    gap(true);
    robot.send_batch(samples[100..].to_vec()).unwrap();
    robot.flush(LONG).unwrap();
    gap(false);
    let mark = server.api().agent("default", "ada").unwrap().watermark;
    assert_eq!((mark.durable, mark.rejected), (200, vec![]));
}

#[test]
fn a_robot_that_has_lost_samples_for_good_goes_on() {
    let server = Server::start(&["engine.gap_timeout_s=0.5"]);
    let samples: Vec<_> = Drive::new(seed(19)).take(40).collect();
    let mut raw = RawPublisher::connect(&server.endpoint());
    let start = batch(7, 0, samples[..2].to_vec());
    raw.put_batch("default", "ada", Codec::Postcard, &start);
    // What is far beyond the window keeps coming, one sample after the other and again from the
    // first.
    let from = 1 << 30;
    let mut sent = 2;
    let durable = eventually("the robot's stream", || {
        sent = samples.len().min(sent + 1);
        let rest = batch(7, from, samples[2..sent].to_vec());
        raw.put_batch("default", "ada", Codec::Postcard, &rest);
        let detail = server.api().agent("default", "ada");
        let durable = detail.map_err(|error| error.to_string())?.watermark.durable;
        (durable > from)
            .then_some(durable)
            .ok_or(durable.to_string())
    });
    assert!(durable <= from + 38);
    let mark = server.api().agent("default", "ada").unwrap().watermark;
    assert!(
        mark.rejected
            .iter()
            .all(|one| one.reason == SkipReason::Lost)
    );
}
