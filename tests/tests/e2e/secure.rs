//! The example of docs/security.md as it stands in `docker/secure`, with certificates of its own:
//! who may say and hear what.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use cogmap_client::{
    ClientError, Credentials, Robot, RobotBuilder, RobotSettings, open_session_as,
};
use cogmap_proto::{Codec, RecallAnswer, RecallQuery, query_key, samples_key};
use cogmap_tests::{Drive, LONG, Port, Server, batch, eventually};
use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};
use zenoh::{Session, Wait};

/// How long a refusal is waited for: nobody says no, so nothing comes.
const SHORT: Duration = Duration::from_secs(2);

/// A service with the settings of the example.
struct Site {
    files: tempfile::TempDir,
    server: Server,
    port: Port,
}

/// An authority that signs certificates.
struct Authority(Issuer<'static, KeyPair>);

impl Authority {
    /// Writes its certificate into `ca.pem` of a directory.
    fn new(directory: &Path) -> Self {
        let mut params = CertificateParams::default();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let key = KeyPair::generate().unwrap();
        let certificate = params.self_signed(&key).unwrap();
        fs::write(directory.join("ca.pem"), certificate.pem()).unwrap();
        Self(Issuer::new(params, key))
    }

    /// Writes a certificate for `name` and its key into `{file}.pem` and `{file}.key`.
    fn sign(&self, directory: &Path, file: &str, name: &str) {
        let mut params = CertificateParams::new([name.to_owned()]).unwrap();
        params.distinguished_name.push(DnType::CommonName, name);
        let key = KeyPair::generate().unwrap();
        let certificate = params.signed_by(&key, &self.0).unwrap();
        fs::write(directory.join(format!("{file}.pem")), certificate.pem()).unwrap();
        fs::write(directory.join(format!("{file}.key")), key.serialize_pem()).unwrap();
    }
}

impl Site {
    /// Starts the service, after `change` has changed the text of its Zenoh configuration.
    fn start(change: impl Fn(String) -> String) -> Self {
        let files = tempfile::tempdir().unwrap();
        let directory = files.path();
        let authority = Authority::new(directory);
        authority.sign(directory, "service", "127.0.0.1");
        authority.sign(directory, "carol", "carol");
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docker/secure");
        for file in ["zenoh.json5", "users.txt", "robot.json5"] {
            let text = fs::read_to_string(example.join(file)).unwrap();
            let here = text.replace("/etc/cogmap", &directory.display().to_string());
            fs::write(directory.join(file), change(here)).unwrap();
        }
        let port = Port::free();
        let config = directory.join("zenoh.json5");
        let mut server = Server::stopped(&[
            &format!("zenoh.config_file={}", config.display()),
            &format!("zenoh.listen=[\"tls/127.0.0.1:{}\"]", port.number()),
        ]);
        server.run();
        Self {
            files,
            server,
            port,
        }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.files.path().join(name)
    }

    fn endpoint(&self) -> String {
        format!("tls/127.0.0.1:{}", self.port.number())
    }

    /// Knows the service, and shows nothing.
    fn nobody(&self) -> Credentials {
        Credentials::default().root_certificate(self.file("ca.pem"))
    }

    /// What a user of the example has.
    fn user(&self, name: &str) -> Credentials {
        self.nobody().user(name, &format!("change-me-{name}"))
    }

    fn builder(&self, agent: &str, credentials: Credentials, wait: Duration) -> RobotBuilder {
        let settings = RobotSettings {
            connect_timeout: wait,
            ..RobotSettings::default()
        };
        Robot::builder("default", agent)
            .endpoint(&self.endpoint())
            .credentials(credentials)
            .settings(settings)
    }

    fn robot(&self, agent: &str, credentials: Credentials) -> Robot {
        let robot = self.builder(agent, credentials, LONG).connect();
        robot.expect("the service lets it in")
    }

    fn session(&self, user: &str) -> Session {
        let session = open_session_as(&[self.endpoint()], &self.user(user), LONG);
        session.expect("the service lets it in")
    }

    /// Names of the agents that the service knows.
    fn agents(&self) -> Vec<String> {
        let agents = self.server.api().agents("default").unwrap();
        agents.into_iter().map(|agent| agent.name).collect()
    }
}

/// The keys of all that a session hears under a key.
fn keys_heard(session: &Session, key: &str) -> Receiver<String> {
    let (heard, hear) = channel();
    session
        .declare_subscriber(key.to_owned())
        .callback(move |sample| {
            // The test may have heard enough.
            let _ = heard.send(sample.key_expr().to_string());
        })
        .background()
        .wait()
        .unwrap();
    hear
}

fn drive(robot: &Robot) {
    robot.send_batch(Drive::new(7).take(50).collect()).unwrap();
}

#[test]
fn robots_and_readers_do_what_their_rules_allow_and_nothing_else() {
    let site = Site::start(|text| text);
    // The rules are in place before anybody speaks; the reader's subscriptions, too.
    let dashboard = site.session("dashboard");
    let seen = keys_heard(&dashboard, "cogmap/*/*/estimate");
    let ada = site.robot("ada", site.user("ada"));
    // A session of its own, for what is put on a session comes back on it.
    let spy = site.session("ada");
    let spied = [
        "cogmap/**",
        "cogmap/*/*/estimate",
        "cogmap/default/bob/durable",
    ]
    .map(|key| keys_heard(&spy, key));
    drive(&ada);
    ada.flush(LONG).unwrap();
    let estimate = ada.estimate(LONG).unwrap();
    assert_eq!((estimate.agent.as_str(), estimate.seq), ("ada", 49));
    assert_eq!(site.agents(), ["ada"]);

    // A robot that speaks for another one is not heard, and its program is told what may be wrong.
    let batch = batch(1, 0, Drive::new(9).take(5).collect());
    for (name, session) in [("bob", ada.zenoh_session()), ("dashboard", &dashboard)] {
        session
            .put(samples_key("default", name), Codec::Cbor.encode(&batch))
            .encoding(Codec::Cbor.encoding())
            .wait()
            .unwrap();
    }
    let false_bob = site.robot("bob", site.user("ada"));
    drive(&false_bob);
    let told = false_bob.flush(SHORT).unwrap_err();
    assert!(
        matches!(
            told,
            ClientError::FlushTimeout {
                pending: 50,
                is_heard: false
            }
        ),
        "{told}"
    );
    assert!(told.to_string().contains("access rules"), "{told}");
    assert_eq!(site.agents(), ["ada"]);

    // Neither can it say where another one is, or itself.
    for name in ["ada", "bob"] {
        let key = cogmap_proto::estimate_key("default", name);
        ada.zenoh_session().put(key, "here").wait().unwrap();
    }

    // The other one is heard under its own name, by the service and by the reader, and by nobody
    // else.
    let bob = Credentials::default().config_file(site.file("robot.json5"));
    let bob = site.robot("bob", bob);
    drive(&bob);
    bob.flush(LONG).unwrap();
    assert_eq!(site.agents(), ["ada", "bob"]);
    let mut of = BTreeSet::new();
    eventually("estimates of both", || {
        of.extend(seen.try_iter());
        let both = ["ada", "bob"].map(|name| cogmap_proto::estimate_key("default", name));
        both.iter()
            .all(|key| of.contains(key))
            .then_some(())
            .ok_or_else(|| format!("{of:?}"))
    });
    for heard in &spied {
        let heard: Vec<_> = heard.try_iter().collect();
        assert!(heard.is_empty(), "{heard:?}");
    }

    // A reader asks.
    let replies = dashboard
        .get(query_key("default", "recall"))
        .payload(Codec::Cbor.encode(&RecallQuery::default()))
        .encoding(Codec::Cbor.encoding())
        .timeout(LONG)
        .wait()
        .unwrap();
    let reply = replies.recv().unwrap();
    let answer = reply.result().unwrap().payload().to_bytes().into_owned();
    let recalled: RecallAnswer = Codec::Cbor.decode(&answer).unwrap();
    assert!(!recalled.places.is_empty());
}

#[test]
fn whoever_is_not_known_is_not_let_in() {
    let site = Site::start(|text| text);
    let strangers = [
        ("wrong password", site.nobody().user("ada", "guessed")),
        ("unknown user", site.nobody().user("eve", "change-me-ada")),
        (
            "service not checked",
            Credentials::default().user("ada", "change-me-ada"),
        ),
    ];
    for (what, credentials) in strangers {
        let refused = site.builder("ada", credentials, SHORT).connect();
        assert!(
            matches!(refused, Err(ClientError::Connect { .. })),
            "{what}"
        );
    }
    // Who gets in without a name is nobody, and nobody may say anything.
    if let Ok(robot) = site.builder("ada", site.nobody(), SHORT).connect() {
        drive(&robot);
        robot.flush(SHORT).unwrap_err();
    }
    assert_eq!(site.agents(), Vec::<String>::new());
    let robot = site.robot("ada", site.user("ada"));
    drive(&robot);
    robot.flush(LONG).unwrap();
}

#[test]
fn robots_may_show_certificates_instead_of_passwords() {
    let site = Site::start(|text| {
        // Without the list of users nobody is asked for a password.
        let lines = text.lines().filter(|line| !line.contains("usrpwd"));
        let text = lines.collect::<Vec<_>>().join("\n");
        text.replace("enable_mtls: false", "enable_mtls: true")
            .replace("usernames: [\"bob\"]", "cert_common_names: [\"carol\"]")
            .replace("cogmap/*/bob/*", "cogmap/*/carol/*")
    });
    let own = { site.nobody() }.client_certificate(site.file("carol.pem"), site.file("carol.key"));
    let carol = site.robot("carol", own);
    drive(&carol);
    carol.flush(LONG).unwrap();
    assert_eq!(site.agents(), ["carol"]);
    if let Ok(robot) = site.builder("carol", site.nobody(), SHORT).connect() {
        drive(&robot);
        robot.flush(SHORT).unwrap_err();
    }
}
