//! One flipped bit anywhere in a store: the service starts, what it serves is what was
//! acknowledged, and a space of which something is lost is stopped by name.

use std::fs;
use std::path::{Path, PathBuf};

use cogmap_tests::{Drive, Server, batch, seed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Flips, each in a fresh copy of the store.
const FLIPS: usize = 60;
const SPACES: [&str; 2] = ["default", "other"];
const SAMPLES: usize = 4000;
/// Samples of a request, and so of a block.
const BLOCK_SAMPLES: usize = 50;

pub(crate) fn drill() -> Value {
    let seed = seed(90);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut server = Server::start(&[]);
    let created = server.http().put_json("/v1/spaces/other", &json!({}));
    assert_eq!(created.status, 201, "{created:?}");
    let samples: Vec<_> = Drive::new(seed).take(SAMPLES).collect();
    for space in SPACES {
        for (number, samples) in (0..).zip(samples.chunks(BLOCK_SAMPLES)) {
            let batch = batch(1, number * BLOCK_SAMPLES as u64, samples.to_vec());
            let posted = server.api().post_samples(space, "ada", &batch);
            posted.expect("the service takes samples");
        }
    }
    let digest = |server: &Server, space| server.api().space(space).map(|info| info.digest);
    let before = SPACES.map(|space| digest(&server, space).expect("it serves"));
    server.terminate();
    let files = files_below(server.data());
    let sizes: Vec<_> = files.iter().map(|file| bytes(file).len()).collect();

    let (mut stopped, mut unnoticed) = (0, 0);
    for flip in 0..FLIPS {
        let home = tempfile::tempdir().expect("a temporary directory");
        let data = home.path().join("data");
        for file in &files {
            let copy = data.join(below(file, server.data()));
            let parent = copy.parent().expect("it is below the directory");
            fs::create_dir_all(parent).expect("a directory");
            fs::copy(file, copy).expect("a copy");
        }
        // Each file as often as any other one, for small ones matter most.
        let chosen = loop {
            let chosen = random.random_range(0..files.len());
            if sizes[chosen] > 0 {
                break chosen;
            }
        };
        let damaged = below(&files[chosen], server.data());
        let mut contents = bytes(&files[chosen]);
        let bit = random.random_range(0..8 * contents.len());
        contents[bit / 8] ^= 1 << (bit % 8);
        fs::write(data.join(damaged), contents).expect("written");

        let mut victim = Server::stopped(&[]).with_data_in(&data);
        victim.run();
        let ready = victim.http().get("/readyz").json(200);
        let is_stopped = |space: &str| {
            let stopped = ready["stopped"].as_array().into_iter().flatten();
            stopped
                .map(|stopped| &stopped["name"])
                .any(|name| name == space)
        };
        for (space, before) in SPACES.iter().zip(&before) {
            if is_stopped(space) {
                stopped += 1;
                let own = Path::new("spaces").join(if *space == "default" { "0" } else { "1" });
                assert!(
                    damaged.starts_with(own),
                    "{} stops {space}",
                    damaged.display()
                );
            } else {
                let after = digest(&victim, space).expect("it serves");
                assert_eq!(*before, after, "{}, bit {bit}", damaged.display());
            }
        }
        // A checkpoint that is whole must not hide a journal that is not.
        let is_journal = damaged.extension().is_some_and(|ending| ending == "log");
        assert!(
            !(is_journal && damaged.starts_with("spaces")) || ready.get("stopped").is_some(),
            "{}, bit {bit}: nobody has noticed",
            damaged.display()
        );
        unnoticed += usize::from(ready.get("stopped").is_none());
        eprintln!("flip {flip}: bit {bit} of {}", damaged.display());
        victim.terminate();
    }
    assert!(stopped > 0, "no flip met a journal");
    json!({ "flips": FLIPS, "spaces_stopped": stopped, "served_whole": unnoticed })
}

fn bytes(file: &Path) -> Vec<u8> {
    fs::read(file).expect("it can be read")
}

fn below<'a>(file: &'a Path, directory: &Path) -> &'a Path {
    file.strip_prefix(directory)
        .expect("it is below the directory")
}

fn files_below(directory: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).expect("a directory") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files.sort();
    files
}
