//! A disk that takes no more: the service says so, goes on answering, and recovers with room.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

use cogmap_proto::{Codec, Sample};
use cogmap_tests::{Answer, Drive, Server, batch, eventually, seed};
use tempfile::TempDir;

use crate::feeding::{Feeder, Outcome, assert_exactly_once, has_kept};

const AGENT: &str = "ada";
const SESSION: u64 = 7;
/// Room that the ballast leaves: more than nothing, so that the disk fills in the midst of writes.
const ROOM_BYTES: u64 = 4 << 20;

/// A small disk of its own, taken down at the end.
struct SmallDisk {
    mount: TempDir,
}

impl SmallDisk {
    /// None where the system does not let this process mount.
    fn mount() -> Option<Self> {
        let mount = tempfile::tempdir().unwrap();
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", "size=200m", "tmpfs"])
            .arg(mount.path())
            .output();
        match mounted {
            Ok(output) if output.status.success() => Some(Self { mount }),
            refused => {
                eprintln!("a disk of its own needs the right to mount: {refused:?}");
                None
            }
        }
    }

    fn ballast(&self) -> PathBuf {
        self.mount.path().join("ballast")
    }

    /// Fills the disk but for [`ROOM_BYTES`].
    fn fill(&self) {
        let mut ballast = File::create(self.ballast()).unwrap();
        let lump = vec![0; 1 << 20];
        while ballast.write_all(&lump).is_ok() {}
        let length = ballast.metadata().unwrap().len();
        ballast.set_len(length.saturating_sub(ROOM_BYTES)).unwrap();
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        // Lazily, because a failed test leaves a service on it that is only about to go.
        let unmounted = Command::new("umount")
            .arg("-l")
            .arg(self.mount.path())
            .status();
        if !unmounted.is_ok_and(|status| status.success()) {
            eprintln!("{} is still mounted", self.mount.path().display());
        }
    }
}

/// Samples that take 16 KiB each now and then.
fn drive(seed: u64) -> Drive {
    Drive::new(seed).with_descriptors_of(4096)
}

fn post(server: &Server, first_seq: u64, samples: &[Sample]) -> Answer {
    let batch = batch(SESSION, first_seq, samples.to_vec());
    server.http().post(
        "/v1/spaces/default/agents/bea/samples",
        Codec::Postcard.encoding(),
        &Codec::Postcard.encode(&batch),
    )
}

/// While nothing can be written, everything can be read.
fn assert_reads_go_on(server: &Server) {
    let http = server.http();
    assert_eq!(http.get("/healthz").status, 200);
    for path in [
        "",
        "/agents/ada",
        "/agents/ada/trajectory",
        "/agents/ada/grid",
        "/places",
        "/trips",
        "/landmarks",
        "/export",
    ] {
        let answer = http.get(&format!("/v1/spaces/default{path}"));
        assert_eq!(answer.status, 200, "{path}: {answer:?}");
    }
}

/// Lets the client feed the service until that cannot write, and gives what the client was told.
fn feed_until_broken(server: &Server, feeder: &Feeder) -> u64 {
    let problem = eventually("a refusal of writes", || {
        let answer = server.http().get("/readyz");
        (answer.status == 503)
            .then_some(answer)
            .ok_or(String::new())
    });
    problem.problem(503, "not-ready");
    feeder.told()
}

#[test]
fn a_full_disk_is_said_and_room_heals_it() {
    let Some(disk) = SmallDisk::mount() else {
        return; // the test below needs no rights
    };
    let settings = ["engine.checkpoint_interval_s=0.5"];
    let mut server = Server::stopped(&settings).with_data_in(&disk.mount.path().join("data"));
    server.run();
    let feeder = Feeder::start(server.robot(AGENT, SESSION), drive(seed(6)));
    eventually("progress", || {
        (feeder.told() > 1000).then_some(()).ok_or(String::new())
    });
    disk.fill();
    feed_until_broken(&server, &feeder);

    let samples: Vec<_> = drive(9).take(10).collect();
    let problem = post(&server, 0, &samples).problem(507, "store-full");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("no space left"), "{detail}");
    assert_reads_go_on(&server);
    let told = feeder.told();

    server.terminate();
    std::fs::remove_file(disk.ballast()).unwrap();
    server.run();
    has_kept(&server.api(), AGENT, SESSION, told).unwrap();
    heals(server, feeder);
}

/// What a file-size limit does to the service needs no rights, and is an error of the disk other
/// than a full one.
#[test]
fn a_failing_disk_is_said_and_repair_heals_it() {
    let mut server = Server::start(&[]);
    server.terminate();
    // No file may be written beyond its first MiB. Such a write would end the process by a signal,
    // were that not left out.
    let limit = "trap '' XFSZ; ulimit -f 1024";
    server.set_prelude(Some(limit));
    server.run();
    let feeder = Feeder::start(server.robot(AGENT, SESSION), drive(seed(7)));
    feed_until_broken(&server, &feeder);
    let samples: Vec<_> = drive(9).take(10).collect();
    post(&server, 0, &samples).problem(500, "store-failed");
    assert_reads_go_on(&server);
    let told = feeder.told();

    server.kill();
    server.set_prelude(None);
    server.run();
    has_kept(&server.api(), AGENT, SESSION, told).unwrap();
    heals(server, feeder);
}

/// The client's repetitions complete what is missing, and the map is as if nothing had been.
fn heals(mut server: Server, feeder: Feeder) {
    let sent = feeder.finish();
    assert_exactly_once(&server, AGENT, SESSION, sent.len());
    let healed = Outcome::read(&server.api(), AGENT);
    let calm = Outcome::undisturbed(AGENT, SESSION, &sent);
    assert!(healed == calm, "{healed:?}\nis not\n{calm:?}");
    server.terminate();
}
