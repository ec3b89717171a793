//! A subscriber as a process of its own, which can be stopped where it stands.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::thread;

use cogmap_client::open_session;
use cogmap_tests::LONG;
use zenoh::Wait;

/// The argument by which this program becomes a subscriber.
pub(crate) const ARGUMENT: &str = "--subscribe";
/// What it says once it listens.
const LISTENS: &str = "listens";

/// Listens to a key expression at an endpoint until it is killed.
pub(crate) fn run(arguments: &[String]) -> ! {
    let [endpoint, key] = arguments else {
        panic!("{ARGUMENT} ENDPOINT KEY");
    };
    let session = open_session(&[endpoint], LONG).expect("the endpoint answers");
    let subscriber = session.declare_subscriber(key).callback(|_| {}).wait();
    let _subscriber = subscriber.expect("the key is one of Zenoh's");
    println!("{LISTENS}");
    loop {
        thread::park();
    }
}

/// A subscriber; dropping it kills the process.
pub(crate) struct Subscriber(Child);

impl Subscriber {
    /// A subscriber that listens.
    pub(crate) fn start(endpoint: &str, key: &str) -> Self {
        let program = std::env::current_exe().expect("this program has a path");
        let child = Command::new(program)
            .args([ARGUMENT, endpoint, key])
            .stdout(Stdio::piped())
            .spawn();
        let mut child = child.expect("this program can be started");
        let mut said = String::new();
        let output = child.stdout.take().expect("the output is piped");
        BufReader::new(output)
            .read_line(&mut said)
            .expect("it speaks");
        assert_eq!(said.trim(), LISTENS);
        Self(child)
    }

    /// Stops the process where it stands.
    pub(crate) fn stop(&self) {
        let sent = Command::new("/bin/kill")
            .args(["-STOP", &self.0.id().to_string()])
            .status();
        assert!(sent.is_ok_and(|status| status.success()), "kill -STOP");
    }
}

impl Drop for Subscriber {
    fn drop(&mut self) {
        // It may have ended by itself; either way it is gone after the wait.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
