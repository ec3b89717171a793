//! A service as a process of its own.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};

use cogmap_client::{Api, Robot, RobotSettings};
use tempfile::TempDir;

use crate::binary::{binary, forget_settings};
use crate::http::Http;
use crate::port::Port;
use crate::scrape::Metrics;
use crate::wait::eventually;

/// Lines of the log that a failed test shows.
const LOG_LINES_MAX: usize = 200;

/// A service on loopback ports and a directory of its own. It can be killed, paused and started
/// again on the same ports and directory. Dropping it kills the process; when that happens in a
/// test that fails, the end of its log is printed.
#[derive(Debug)]
pub struct Server {
    http: Port,
    zenoh: Port,
    data: PathBuf,
    settings: Vec<String>,
    /// What the shell does before it becomes the service.
    prelude: Option<String>,
    child: Option<Child>,
    /// Holds the log, and the data unless they were put elsewhere.
    home: TempDir,
}

impl Server {
    /// A running service with these settings (`key=value`) on an empty directory.
    pub fn start(settings: &[&str]) -> Self {
        let mut server = Self::stopped(settings);
        server.run();
        server
    }

    /// A service that does not run yet; its ports and directory are fixed.
    pub fn stopped(settings: &[&str]) -> Self {
        let home = tempfile::tempdir().expect("the temporary directory takes a directory");
        Self {
            http: Port::free(),
            zenoh: Port::free(),
            data: home.path().join("data"),
            settings: settings.iter().map(|&setting| setting.to_owned()).collect(),
            prelude: None,
            child: None,
            home,
        }
    }

    /// The same with its data in another directory.
    #[must_use]
    pub fn with_data_in(mut self, directory: &Path) -> Self {
        directory.clone_into(&mut self.data);
        self
    }

    /// Lets a shell do something before it becomes the service: limits of the system, for example.
    /// `None` leaves the shell out again.
    pub fn set_prelude(&mut self, prelude: Option<&str>) {
        self.prelude = prelude.map(str::to_owned);
    }

    /// Starts the process and waits until it is ready.
    pub fn run(&mut self) {
        self.launch();
        self.wait_ready();
    }

    /// Starts the process.
    pub fn launch(&mut self) {
        assert!(self.child.is_none(), "the service runs already");
        let log = File::options()
            .create(true)
            .append(true)
            .open(self.log_file())
            .expect("the log can be opened");
        let mut command = match &self.prelude {
            Some(prelude) => {
                let mut shell = Command::new("bash");
                shell
                    .arg("-c")
                    .arg(format!("{prelude}; exec \"$0\" \"$@\""))
                    .arg(binary());
                shell
            }
            None => Command::new(binary()),
        };
        forget_settings(&mut command);
        let child = command
            .args(self.arguments())
            .stdout(log.try_clone().expect("a file can be shared"))
            .stderr(log)
            .spawn()
            .expect("the binary can be started");
        self.child = Some(child);
    }

    /// The arguments of the binary.
    pub fn arguments(&self) -> Vec<String> {
        let mut arguments = vec![
            "serve".to_owned(),
            "--http".to_owned(),
            format!("127.0.0.1:{}", self.http.number()),
            "--zenoh".to_owned(),
            self.endpoint(),
            "--data-dir".to_owned(),
            self.data.display().to_string(),
        ];
        for setting in &self.settings {
            arguments.extend(["--set".to_owned(), setting.clone()]);
        }
        arguments
    }

    /// Waits until the service takes samples.
    pub fn wait_ready(&mut self) {
        let http = self.http();
        let child = self.child.as_mut().expect("the service was started");
        eventually("readiness", || {
            let ended = child.try_wait().expect("a child can be waited for");
            assert!(ended.is_none(), "the service ended: {ended:?}");
            match http.try_request(&ureq::http::Method::GET, "/readyz", None) {
                Ok(answer) if answer.status == 200 => Ok(()),
                Ok(answer) => Err(answer.body),
                Err(error) => Err(error),
            }
        });
    }

    /// Kills the process as a power cut would: no last word.
    pub fn kill(&mut self) {
        self.signal("KILL");
        let status = self.reap();
        assert!(!status.success());
    }

    /// Asks the process to end, waits for it, and expects it to end well.
    pub fn terminate(&mut self) {
        self.signal("TERM");
        let status = self.reap();
        assert_eq!(status.code(), Some(0), "after SIGTERM");
    }

    /// Stops the process where it stands.
    pub fn pause(&self) {
        self.signal("STOP");
    }

    /// Lets a stopped process go on.
    pub fn resume(&self) {
        self.signal("CONT");
    }

    fn signal(&self, name: &str) {
        let child = self.child.as_ref().expect("the service runs");
        let sent = Command::new("/bin/kill")
            .args([format!("-{name}"), child.id().to_string()])
            .status()
            .expect("/bin/kill can be started");
        assert!(sent.success(), "kill -{name}");
    }

    fn reap(&mut self) -> ExitStatus {
        let mut child = self.child.take().expect("the service runs");
        child.wait().expect("a child can be waited for")
    }

    /// Base of its HTTP interface.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}", self.http.number())
    }

    /// Address and port of its HTTP interface.
    pub fn address(&self) -> String {
        format!("127.0.0.1:{}", self.http.number())
    }

    /// Its Zenoh endpoint.
    pub fn endpoint(&self) -> String {
        format!("tcp/127.0.0.1:{}", self.zenoh.number())
    }

    /// The client's HTTP side.
    pub fn api(&self) -> Api {
        Api::new(&self.url(), None)
    }

    /// Plain HTTP.
    pub fn http(&self) -> Http {
        Http::new(&self.url())
    }

    /// Its metrics now.
    pub fn metrics(&self) -> Metrics {
        Metrics::read(&self.http())
    }

    /// A robot of the space `default`.
    pub fn robot(&self, agent: &str, session: u64) -> Robot {
        self.robot_with(
            agent,
            RobotSettings {
                session: Some(session),
                // The tests count what they send.
                ends_session: false,
                ..RobotSettings::default()
            },
        )
    }

    /// A robot of the space `default` with settings of its own.
    pub fn robot_with(&self, agent: &str, settings: RobotSettings) -> Robot {
        Robot::builder("default", agent)
            .endpoint(&self.endpoint())
            .settings(settings)
            .connect()
            .expect("the service lets robots in")
    }

    /// Directory of its store.
    pub fn data(&self) -> &Path {
        &self.data
    }

    /// Everything that it has logged.
    pub fn log(&self) -> String {
        fs::read_to_string(self.log_file()).unwrap_or_default()
    }

    fn log_file(&self) -> PathBuf {
        self.home.path().join("log")
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            // It may have ended by itself; either way it is gone after the wait.
            let _ = child.kill();
            let _ = child.wait();
        }
        if std::thread::panicking() {
            let log = self.log();
            let lines: Vec<_> = log.lines().collect();
            let from = lines.len().saturating_sub(LOG_LINES_MAX);
            eprintln!("log of {}:\n{}", self.url(), lines[from..].join("\n"));
        }
    }
}
