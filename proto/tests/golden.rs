//! Every codec writes and reads the bytes in `golden/`, for every message.
//!
//! A change of these files is a change of what crosses the wire: clients in other languages test
//! themselves against the same files. Where it is meant (a new message, a new variant at the end),
//! write them anew with
//!
//! ```text
//! COGMAP_REGENERATE_GOLDEN=1 cargo test -p cogmap-proto --test golden
//! ```
//!
//! and look at the difference of the JSON files. That run fails, so that it cannot pass for a test.

mod messages;

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::path::{Path, PathBuf};

use cogmap_proto::{Codec, SampleBatch};
use serde::Serialize;
use serde::de::DeserializeOwned;

use messages::Visit;

const CODECS: [Codec; 3] = [Codec::Postcard, Codec::Cbor, Codec::Json];

fn golden_dir() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
}

#[test]
fn every_codec_writes_and_reads_the_golden_bytes() {
    let regenerate = std::env::var_os("COGMAP_REGENERATE_GOLDEN").is_some();
    let mut golden = Golden {
        regenerate,
        files: BTreeSet::new(),
        differing: Vec::new(),
    };
    messages::each(&mut golden);

    let mut stray: BTreeSet<String> = std::fs::read_dir(golden_dir())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "README.md")
        .collect();
    stray.retain(|name| !golden.files.contains(name));

    assert_eq!(stray, BTreeSet::new(), "files that no message has");
    assert_eq!(
        golden.differing,
        Vec::<String>::new(),
        "files that differ from what is written"
    );
    assert!(!regenerate, "the golden files were written, not tested");
}

struct Golden {
    regenerate: bool,
    files: BTreeSet<String>,
    differing: Vec<String>,
}

impl Golden {
    /// Compares or writes the file of a message in a codec, and returns its bytes.
    fn file(&mut self, name: &str, codec: Codec, written: Vec<u8>) -> Vec<u8> {
        let file = format!("{name}.{}", codec.name());
        let path = golden_dir().join(&file);
        assert!(
            self.files.insert(file.clone()),
            "two messages are called {name}"
        );
        if self.regenerate {
            std::fs::write(&path, &written).expect("golden files can be written");
            return written;
        }
        let Ok(golden) = std::fs::read(&path) else {
            self.differing.push(format!("{file} (missing)"));
            return written;
        };
        if golden != written {
            self.differing.push(file);
        }
        golden
    }
}

impl Visit for Golden {
    fn message<T: Serialize + DeserializeOwned + PartialEq + Debug>(
        &mut self,
        name: &str,
        message: &T,
    ) {
        for codec in CODECS {
            let golden = self.file(name, codec, codec.encode(message));
            let read: T = codec
                .decode(&golden)
                .unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(&read, message, "{name} in {codec:?}");
        }
    }

    fn batch(&mut self, name: &str, batch: &SampleBatch) {
        self.message(name, batch);
        for codec in CODECS {
            let read = codec.decode_batch(&codec.encode(batch));
            assert_eq!(read.as_ref(), Ok(batch), "{name} in {codec:?}");
        }
    }
}
