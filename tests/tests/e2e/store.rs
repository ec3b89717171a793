//! Damage on the disk: one space stops and says so, the others serve, and the commands tell,
//! repair, copy and restore.

use std::fs::{self, File};
use std::io::Write;
use std::net::TcpListener;
use std::path::{Path, PathBuf};

use cogmap_proto::Sample;
use cogmap_tests::{Drive, Finished, Server, batch, eventually, run, seed};
use serde_json::{Value, json};
use tempfile::TempDir;
use ureq::http::Method;

use crate::feeding::{Feeder, Outcome, post_all};

const AGENT: &str = "ada";
const SESSION: u64 = 7;
const SAMPLES: usize = 2000;
/// Samples of a request, and so of a block.
const BLOCK_SAMPLES: usize = 100;
/// Name of the first file of a journal.
const SEGMENT: &str = "0000000000000000.log";

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Posts samples to a space, each request in a block of its own.
fn post(server: &Server, space: &str, samples: &[Sample]) {
    for (number, samples) in (0..).zip(samples.chunks(BLOCK_SAMPLES)) {
        let batch = batch(SESSION, number * BLOCK_SAMPLES as u64, samples.to_vec());
        server.api().post_samples(space, AGENT, &batch).unwrap();
    }
}

/// A service with the space `default`, and the space `other` with the same samples.
fn server_of_two() -> Server {
    let server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(80)).take(SAMPLES).collect();
    let created = server.http().put_json("/v1/spaces/other", &json!({}));
    assert_eq!(created.status, 201, "{created:?}");
    post(&server, "default", &samples);
    post(&server, "other", &samples);
    server
}

fn digest(server: &Server, space: &str) -> String {
    server.api().space(space).unwrap().digest
}

fn delete(server: &Server, space: &str) {
    let path = format!("/v1/spaces/{space}");
    let deleted = server.http().try_request(&Method::DELETE, &path, None);
    assert_eq!(deleted.unwrap().status, 204);
}

/// The only segment of the journal of space `default`.
fn segment(data: &Path) -> PathBuf {
    data.join("spaces/0").join(SEGMENT)
}

fn change(file: &Path, change: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(file).unwrap();
    change(&mut bytes);
    fs::write(file, bytes).unwrap();
}

fn command(server: &Server, args: &[&str]) -> Finished {
    let data = ["--data-dir", text(server.data())];
    run(&[args, &data[..]].concat())
}

/// Every request to the stopped space is answered with what is wrong with it; the other one serves.
fn assert_one_is_stopped(server: &Server, other: &str) -> String {
    let http = server.http();
    let ready = http.get("/readyz").json(200);
    assert_eq!(ready["stopped"][0]["name"], "default", "{ready}");
    let listed = http.get("/v1/spaces").json(200);
    assert_eq!(listed["spaces"][0]["name"], "other", "{listed}");
    assert_eq!(listed["stopped"][0], ready["stopped"][0]);
    for path in ["", "/agents", "/agents/ada", "/places", "/events"] {
        let answer = http.get(&format!("/v1/spaces/default{path}"));
        answer.problem(503, "space-stopped");
    }
    let samples: Vec<_> = Drive::new(1).take(1).collect();
    let batch = batch(SESSION + 1, 0, samples);
    let refused = server.api().post_samples("default", AGENT, &batch);
    assert!(refused.unwrap_err().to_string().contains("damaged"));
    assert_eq!(
        server
            .metrics()
            .sum("cogmap_space_stopped", &[("space", "default")]),
        1
    );
    assert!(server.log().contains("the space is stopped"));

    assert_eq!(digest(server, "other"), other);
    server.api().post_samples("other", "bea", &batch).unwrap();
    ready["stopped"][0]["reason"].as_str().unwrap().to_owned()
}

/// What is damaged, and how.
type Damage = (&'static str, fn(&mut Vec<u8>));

#[test]
fn damage_anywhere_in_a_journal_stops_its_space_and_repair_brings_it_back() {
    let damages: [Damage; 3] = [
        ("the first header", |bytes| bytes[9] ^= 1),
        ("a block in the middle", |bytes| {
            let middle = bytes.len() / 2;
            bytes[middle] ^= 0x40;
        }),
        ("a zero page near the end", |bytes| {
            let page = (bytes.len() - 4096) / 4096 * 4096;
            bytes[page..page + 4096].fill(0);
        }),
    ];
    for (what, damage) in damages {
        eprintln!("damage: {what}");
        let mut server = server_of_two();
        let before = digest(&server, "other");
        server.terminate();
        change(&segment(server.data()), damage);

        server.run();
        let detail = assert_one_is_stopped(&server, &before);
        assert!(
            detail.contains("cogmap store repair --space default"),
            "{detail}"
        );
        assert!(detail.contains("of 2000 samples"), "{detail}");
        server.terminate();

        let verified = command(&server, &["store", "verify", "--json"]);
        assert_eq!(verified.code(), 1, "{verified:?}");
        let report: Value = serde_json::from_str(&verified.stdout).unwrap();
        assert_eq!(report["spaces"][1]["sound"], true, "{report}");
        let damaged = &report["spaces"][0];
        let lost = damaged["lost_samples"].as_u64().unwrap();
        assert!(lost > 0 && lost < SAMPLES as u64 / 2, "{report}");
        let first = damaged["damage"][0]["block"].as_u64().unwrap();

        let exported = command(&server, &["export", "journal"]);
        assert_eq!(exported.code(), 1);
        assert!(
            exported.stderr.contains(&format!("block {first}")),
            "{}",
            exported.stderr
        );
        assert_eq!(samples_in(&exported.stdout), first * BLOCK_SAMPLES as u64);

        let repaired = command(
            &server,
            &["store", "repair", "--space", "default", "--json"],
        );
        let report = repaired.json();
        assert_eq!(report["samples_lost"], lost, "{report}");
        let agent = &report["agents"][0];
        // The checkpoint still knows the name of an agent whose enrolment is lost.
        assert_eq!(
            (&agent["name"], &agent["name_lost"]),
            (&json!(AGENT), &json!(false))
        );
        let missing = &agent["missing"][0];
        let count = missing["to"].as_u64().unwrap() - missing["from"].as_u64().unwrap();
        assert_eq!(
            (&missing["session"], count),
            (&json!(SESSION), lost),
            "{report}"
        );
        let aside = Path::new(report["set_aside"].as_str().unwrap());
        assert!(aside.join(SEGMENT).exists(), "{report}");

        assert_eq!(command(&server, &["store", "verify"]).code(), 0);
        let again = command(&server, &["store", "repair", "--space", "default"]);
        assert!(again.text().contains("nothing is damaged"), "{again:?}");
        server.run();
        assert_eq!(server.http().get("/readyz").json(200).get("stopped"), None);
        let mark = server.api().agent("default", AGENT).unwrap().watermark;
        let at_end = missing["at_end"].as_bool().unwrap();
        let durable = if at_end {
            &missing["from"]
        } else {
            &json!(SAMPLES)
        };
        assert_eq!(&json!(mark.durable), durable, "{report}");
        // What is missing is journaled as lost, so another fold gives the same map.
        let digest = digest(&server, "default");
        server.terminate();
        fs::remove_dir_all(server.data().join("derived")).unwrap();
        server.run();
        assert_eq!(server.api().space("default").unwrap().digest, digest);
    }
}

fn samples_in(journal: &str) -> u64 {
    let entries = journal
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    let samples = entries.filter_map(|entry| {
        let samples = entry["Samples"]["batch"]["samples"].as_array()?;
        Some(samples.len() as u64)
    });
    samples.sum()
}

#[test]
fn an_agent_whose_name_is_lost_keeps_its_number_and_gets_a_placeholder() {
    let mut server = server_of_two();
    server.kill();
    change(&segment(server.data()), |bytes| bytes[9] ^= 1);
    fs::remove_dir_all(server.data().join("derived")).unwrap();
    let repaired = command(&server, &["store", "repair", "--space", "default"]);
    let said = repaired.text();
    assert!(said.contains("agent 0: its name is lost"), "{said}");
    assert!(said.contains("samples 0 to 99 of session 7"), "{said}");
    server.run();
    let agents = server.http().get("/v1/spaces/default/agents").json(200);
    assert_eq!(agents["agents"][0]["name"], "unknown-0", "{agents}");
}

#[test]
fn a_journal_cut_to_half_is_told_against_what_was_acknowledged() {
    let mut server = server_of_two();
    let before = digest(&server, "other");
    server.kill();
    change(&segment(server.data()), |bytes| {
        bytes.truncate(bytes.len() / 2);
    });
    server.run();
    let detail = assert_one_is_stopped(&server, &before);
    let lost = detail.split_once("acknowledged blocks and ").unwrap().1;
    let lost: u64 = lost.split(' ').next().unwrap().parse().unwrap();
    assert!((500..1500).contains(&lost), "{detail}");
    // Whoever wants none of it deletes the space, and may begin anew under its name.
    delete(&server, "default");
    let created = server.http().put_json("/v1/spaces/default", &json!({}));
    assert_eq!(created.status, 201, "{created:?}");
    assert_eq!(server.http().get("/readyz").json(200).get("stopped"), None);
}

#[test]
fn damaged_checkpoints_are_made_again() {
    let mut server = Server::start(&["engine.checkpoint_interval_s=0.2"]);
    let samples: Vec<_> = Drive::new(seed(81)).take(3000).collect();
    post_all(&server, AGENT, SESSION, &samples);
    let before = Outcome::read(&server.api(), AGENT);
    server.terminate();
    let derived = server.data().join("derived");
    let whole: Vec<_> = files_below(&derived)
        .into_iter()
        .map(|file| (fs::read(&file).unwrap(), file))
        .collect();
    assert!(whole.len() > 3);
    for (bytes, damaged) in &whole {
        if bytes.is_empty() {
            continue;
        }
        eprintln!("damage: {}", damaged.display());
        fs::remove_dir_all(&derived).unwrap();
        for (bytes, file) in &whole {
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, bytes).unwrap();
        }
        change(damaged, |bytes| {
            let middle = bytes.len() / 2;
            bytes[middle] ^= 0x08;
        });
        server.run();
        let after = Outcome::read(&server.api(), AGENT);
        assert!(before == after, "{before:?}\nis not\n{after:?}");
        server.terminate();
    }
}

fn files_below(directory: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files
}

#[test]
fn a_space_whose_name_is_lost_is_not_begun_anew() {
    let mut server = server_of_two();
    let before = digest(&server, "other");
    server.terminate();
    for copy in ["space", "space.copy"] {
        change(&server.data().join("spaces/0").join(copy), |bytes| {
            bytes[20] ^= 1;
        });
    }
    server.run();
    let listed = server.http().get("/v1/spaces").json(200);
    assert_eq!(listed["stopped"][0]["name"], "space-0", "{listed}");
    let reason = listed["stopped"][0]["reason"].as_str().unwrap();
    assert!(reason.contains("backup"), "{reason}");
    server
        .http()
        .get("/v1/spaces/default")
        .problem(404, "unknown-space");
    assert_eq!(digest(&server, "other"), before);
    assert_eq!(command(&server, &["store", "verify"]).code(), 1);
}

#[test]
fn a_torn_tail_is_cut_and_told() {
    let mut server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(82)).take(1000).collect();
    post_all(&server, AGENT, SESSION, &samples);
    let before = Outcome::read(&server.api(), AGENT);
    server.kill();
    let mut file = File::options()
        .append(true)
        .open(segment(server.data()))
        .unwrap();
    file.write_all(b"CGM2 and then the power went").unwrap();
    server.run();
    let after = Outcome::read(&server.api(), AGENT);
    assert!(before == after, "{before:?}\nis not\n{after:?}");
    assert!(server.log().contains("never acknowledged"));
    assert_eq!(
        server.metrics().sum("cogmap_journal_torn_tails_total", &[]),
        1
    );
    assert_eq!(command(&server, &["store", "verify"]).code(), 0);
}

#[test]
fn a_deleted_space_gives_its_disk_back() {
    let server = server_of_two();
    let other = server.data().join("spaces/1");
    assert!(other.exists());
    delete(&server, "other");
    let kept = fs::read_dir(server.data().join("spaces")).unwrap().count();
    let doomed = fs::read_dir(server.data().join("deleted")).unwrap().count();
    assert_eq!((kept, doomed), (1, 0));
}

#[test]
fn a_backup_of_the_running_service_restores_the_same_map() {
    let mut server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(83)).take(2000).collect();
    post_all(&server, AGENT, SESSION, &samples);
    let before = Outcome::read(&server.api(), AGENT);
    let home = TempDir::new().unwrap();
    let (backup, restored) = (home.path().join("backup"), home.path().join("restored"));
    let copied = command(&server, &["backup", text(&backup)]);
    assert!(copied.text().contains("2000 samples"), "{copied:?}");

    // While samples come in, all that was acknowledged before the command is in the copy.
    let feeder = Feeder::start(server.robot("bea", SESSION), Drive::new(seed(84)));
    let told = eventually("progress", || {
        let told = feeder.told();
        (told > 500).then_some(told).ok_or(told.to_string())
    });
    let busy = home.path().join("busy");
    command(&server, &["backup", text(&busy)]).text();
    feeder.finish();
    server.terminate();
    let journal = run(&["export", "journal", "--data-dir", text(&busy)]);
    assert!(samples_in(journal.text()) >= 2000 + told);

    run(&["restore", text(&backup), "--data-dir", text(&restored)]).text();
    let again = run(&["restore", text(&backup), "--data-dir", text(&restored)]);
    assert_eq!(again.code(), 1, "{again:?}");
    let mut other = Server::stopped(&[]).with_data_in(&restored);
    other.run();
    let after = Outcome::read(&other.api(), AGENT);
    assert!(before == after, "{before:?}\nis not\n{after:?}");
    other.terminate();
}

#[test]
fn a_start_that_fails_leaves_nothing_behind() {
    let home = TempDir::new().unwrap();
    let data = home.path().join("new/data");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = listener.local_addr().unwrap().to_string();
    let free = Server::stopped(&[]).with_data_in(&data);
    let with = |more: &[&str]| {
        let arguments = free.arguments();
        let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
        run(&[&arguments, more].concat())
    };
    let http = format!("http.listen=\"{taken}\"");
    let zenoh = format!("zenoh.listen=[\"tcp/{taken}\"]");
    for setting in [&*http, &zenoh, "spaces.lab.trajectory_interval_s=0"] {
        let failed = with(&["--set", setting]);
        assert_ne!(failed.code(), 0, "{setting}: {failed:?}");
        assert!(
            !home.path().join("new").exists(),
            "{setting}: {}",
            failed.stderr
        );
    }
}

#[test]
fn a_repair_makes_no_store_where_there_is_none() {
    let empty = TempDir::new().unwrap();
    let data = text(empty.path());
    let repaired = run(&["store", "repair", "--space", "default", "--data-dir", data]);
    assert_eq!(repaired.code(), 1, "{repaired:?}");
    assert!(
        repaired.stderr.contains("there is no store"),
        "{repaired:?}"
    );
    assert_eq!(fs::read_dir(empty.path()).unwrap().count(), 0);
}
