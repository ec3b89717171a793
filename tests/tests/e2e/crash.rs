//! kill -9 under load: nothing that was acknowledged is lost, and everything is there exactly once.

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use cogmap_proto::SeqRange;
use cogmap_tests::{Drive, Server, batch, eventually, run, seed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::feeding::{
    Feeder, Outcome, assert_exactly_once, has_kept, journaled, post_all, setting,
};

const AGENT: &str = "ada";
const SESSION: u64 = 7;
/// Time for watermarks that left the service before the kill to reach the client.
const ARRIVAL: Duration = Duration::from_millis(100);

#[test]
fn killed_at_random_instants_it_loses_nothing_that_it_acknowledged() {
    let seed = seed(1);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // Checkpoints often enough that some kills fall into one.
    let mut server = Server::start(&["engine.checkpoint_interval_s=0.2"]);
    let feeder = Feeder::start(server.robot(AGENT, SESSION), Drive::new(seed));
    for kill in 1..=setting("COGMAP_DRILL_KILLS", 4) {
        // The load is back only when the client has found the service again.
        let before = feeder.told();
        eventually("progress", || {
            (feeder.told() > before)
                .then_some(())
                .ok_or(before.to_string())
        });
        sleep(Duration::from_millis(random.random_range(0..400)));
        server.kill();
        sleep(ARRIVAL);
        let told = feeder.told();
        if random.random() {
            // Another blow while it recovers.
            server.launch();
            sleep(Duration::from_millis(random.random_range(0..60)));
            server.kill();
        }
        server.run();
        has_kept(&server.api(), AGENT, SESSION, told).unwrap();
        eprintln!("kill {kill}: {told} samples acknowledged, all kept");
    }
    let resent = feeder.robot().counters().samples_resent;
    let sent = feeder.finish();
    eprintln!("{} samples sent, {resent} of them again", sent.len());
    assert_exactly_once(&server, AGENT, SESSION, sent.len());
    let drilled = Outcome::read(&server.api(), AGENT);
    let calm = Outcome::undisturbed(AGENT, SESSION, &sent);
    assert!(drilled == calm, "{drilled:?}\nis not\n{calm:?}");

    server.terminate();
    let data = server.data().display().to_string();
    let journal = run(&["export", "journal", "--data-dir", &data]);
    let to = sent.len() as u64;
    assert_eq!(
        journaled(journal.text(), SESSION),
        [SeqRange { from: 0, to }]
    );
}

#[test]
fn a_lost_store_is_noticed() {
    let mut server = Server::start(&[]);
    let feeder = Feeder::start(server.robot(AGENT, SESSION), Drive::new(seed(2)));
    eventually("progress", || {
        (feeder.told() > 0).then_some(()).ok_or(String::new())
    });
    server.kill();
    sleep(ARRIVAL);
    let told = feeder.told();
    fs::remove_dir_all(server.data()).unwrap();
    server.run();
    // The check of the drill above has to fail here, or it would prove nothing.
    has_kept(&server.api(), AGENT, SESSION, told).unwrap_err();
}

#[test]
fn a_replay_of_the_whole_journal_and_a_checkpoint_with_its_tail_give_the_same_map() {
    let samples: Vec<_> = Drive::new(seed(3)).take(6000).collect();
    let outcomes = ["0.1", "3600"].map(|interval_s| {
        let setting = format!("engine.checkpoint_interval_s={interval_s}");
        let mut server = Server::start(&[&setting]);
        post_all(&server, AGENT, SESSION, &samples);
        let before = Outcome::read(&server.api(), AGENT);
        server.kill();
        server.run();
        let after = Outcome::read(&server.api(), AGENT);
        assert!(before == after, "{before:?}\nis not\n{after:?}");
        assert_exactly_once(&server, AGENT, SESSION, samples.len());
        // Once more, now from the checkpoint of a graceful end.
        server.terminate();
        server.run();
        let again = Outcome::read(&server.api(), AGENT);
        assert!(again == after, "{again:?}\nis not\n{after:?}");
        after
    });
    assert!(outcomes[0] == outcomes[1]);
}

#[test]
fn a_request_cut_by_a_kill_can_be_sent_again() {
    let mut server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(4)).take(3000).collect();
    let (first, second) = samples.split_at(1500);
    let api = server.api();
    let earlier = batch(SESSION, 0, first.to_vec());
    let later = batch(SESSION, 1500, second.to_vec());
    api.post_samples("default", AGENT, &earlier).unwrap();
    // The answer is lost with the process, or not: the sender cannot know, and sends both again.
    let unsure = {
        let (api, later) = (api.clone(), later.clone());
        std::thread::spawn(move || drop(api.post_samples("default", AGENT, &later)))
    };
    server.kill();
    unsure.join().unwrap();
    server.run();
    let again = api.post_samples("default", AGENT, &earlier).unwrap();
    assert_eq!(again.duplicates, 1500);
    let answer = api.post_samples("default", AGENT, &later).unwrap();
    assert!([0, 1500].contains(&answer.duplicates), "{answer:?}");
    assert_exactly_once(&server, AGENT, SESSION, 3000);
    let calm = Outcome::undisturbed(AGENT, SESSION, &samples);
    assert!(Outcome::read(&server.api(), AGENT) == calm);
}
