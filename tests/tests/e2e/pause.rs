//! A process that is stopped for a while, as by a debugger, a snapshot of its machine or an
//! overcommitted host.

use std::thread::sleep;
use std::time::Duration;

use cogmap_tests::{Drive, Server, eventually, seed};

use crate::feeding::{Feeder, Outcome, assert_exactly_once, setting};

const AGENT: &str = "ada";
const SESSION: u64 = 7;

#[test]
fn stopped_under_load_it_goes_on_as_if_nothing_had_been() {
    let mut server = Server::start(&[]);
    let feeder = Feeder::start(server.robot(AGENT, SESSION), Drive::new(seed(5)));
    let progress = |beyond: u64| {
        eventually("progress", || {
            let told = feeder.told();
            (told > beyond).then_some(told).ok_or(told.to_string())
        })
    };
    let before = progress(1000);
    server.pause();
    sleep(Duration::from_secs(setting("COGMAP_DRILL_PAUSE_S", 3)));
    server.resume();
    progress(before + 3000);
    let sent = feeder.finish();
    assert_exactly_once(&server, AGENT, SESSION, sent.len());
    let paused = Outcome::read(&server.api(), AGENT);
    let calm = Outcome::undisturbed(AGENT, SESSION, &sent);
    assert!(paused == calm, "{paused:?}\nis not\n{calm:?}");
    server.terminate();
}
