//! A disk that takes no more: the service says so, goes on answering, and recovers with room.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use cogmap_proto::{Codec, Sample};
use cogmap_tests::{Answer, Drive, Server, batch, eventually, seed};
use tempfile::TempDir;

use crate::feeding::{Feeder, Outcome, assert_exactly_once, has_kept};

const AGENT: &str = "ada";
const SESSION: u64 = 7;
/// What `mount` takes before the directory.
const MOUNT_ARGS: [&str; 5] = ["-t", "tmpfs", "-o", "size=200m", "tmpfs"];
/// Room that the ballast leaves: more than nothing, so that the disk fills in the midst of writes.
const ROOM_BYTES: u64 = 4 << 20;

/// A small disk of its own, taken down at the end.
struct SmallDisk {
    /// Where it is mounted.
    mount: TempDir,
    /// The process in whose name space it is mounted, where this one may not mount.
    holder: Option<Child>,
}

impl SmallDisk {
    /// Mounts it: here if this process may, else in a name space in which anyone may.
    fn mount() -> Self {
        let mount = tempfile::tempdir().unwrap();
        let mounted = Command::new("mount")
            .args(MOUNT_ARGS)
            .arg(mount.path())
            .output();
        let holder = match mounted {
            Ok(output) if output.status.success() => None,
            refused => {
                eprintln!("mounting is refused, so a name space is made: {refused:?}");
                Some(hold_mount(mount.path()))
            }
        };
        Self { mount, holder }
    }

    /// Its root, as this process reaches it.
    fn path(&self) -> PathBuf {
        let mount = self.mount.path();
        match &self.holder {
            None => mount.to_owned(),
            Some(holder) => {
                let root = PathBuf::from(format!("/proc/{}/root", holder.id()));
                root.join(mount.strip_prefix("/").unwrap())
            }
        }
    }

    fn ballast(&self) -> PathBuf {
        self.path().join("ballast")
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

/// A process that has mounted a small disk in a name space of its own, and stays.
fn hold_mount(mount: &Path) -> Child {
    let script = format!(
        "mount {} \"$0\" && echo mounted && exec sleep infinity",
        MOUNT_ARGS.join(" ")
    );
    let mut holder = Command::new("unshare")
        .args(["--user", "--map-root-user", "--mount", "sh", "-c", &script])
        .arg(mount)
        .stdout(Stdio::piped())
        .spawn()
        .expect("unshare can be started");
    let mut said = String::new();
    let stdout = holder.stdout.take().expect("it is piped");
    BufReader::new(stdout).read_line(&mut said).unwrap();
    assert_eq!(
        said, "mounted\n",
        "this drill fills a disk of its own: it needs the right to mount, or to make a name space"
    );
    holder
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        if let Some(holder) = &mut self.holder {
            // The mount goes with the process.
            let _ = holder.kill();
            let _ = holder.wait();
            return;
        }
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
    let disk = SmallDisk::mount();
    let settings = ["engine.checkpoint_interval_s=0.5"];
    let mut server = Server::stopped(&settings).with_data_in(&disk.path().join("data"));
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
