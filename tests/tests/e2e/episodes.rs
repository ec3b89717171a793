//! What an arm has recognised stays readable when it has closed, whatever ends the service
//! meanwhile.

use std::fs;

use cogmap_client::{Robot, RobotSettings};
use cogmap_proto::{
    AgentObject, EpisodeKind, Increment, Level, ObjectMark, ObjectVerdict, Orientation, SampleBody,
    TouchNoise,
};
use cogmap_tests::{LONG, Server};

const ARM: &str = "arm";
/// Levels along two rods whose places are 2 cm apart.
const CUP: [f64; 8] = [3.0, 5.0, 9.0, 2.0, 7.0, 7.0, 1.0, 4.0];
const CAN: [f64; 8] = [3.0, 9.0, 2.0, 5.0, 1.0, 7.0, 4.0, 7.0];

/// Sends a sample with the time of now.
fn send(arm: &Robot, body: SampleBody) {
    arm.send_now(body).expect("the robot takes samples");
}

fn feel(arm: &Robot, mark: ObjectMark, felt: impl Iterator<Item = f64>, way_m: f64) {
    send(arm, SampleBody::Object(mark));
    for value in felt {
        let level = Level {
            channel: "texture".to_owned(),
            value,
            offset_m: [0.0; 3],
            normal: None,
        };
        send(arm, SampleBody::Level(level));
        let step = Increment {
            translation_m: [way_m, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        };
        send(arm, SampleBody::Increment(step));
    }
}

fn learn(name: &str) -> ObjectMark {
    ObjectMark::Learn {
        name: Some(name.to_owned()),
        spacing_m: 0.004,
        orientation: Orientation::default(),
        noise: TouchNoise::default(),
    }
}

fn identify() -> ObjectMark {
    ObjectMark::Identify {
        orientation: Orientation::default(),
        noise: TouchNoise::default(),
    }
}

fn of_arm(server: &Server) -> AgentObject {
    let told = server.api().agent_object("default", ARM);
    told.expect("the agent is known")
}

#[test]
fn the_last_identification_outlives_the_robot_and_the_service() {
    let mut server = Server::start(&[]);
    let settings = RobotSettings {
        session: Some(1),
        ..RobotSettings::default()
    };
    let arm = server.robot_with(ARM, settings);
    feel(&arm, learn("cup"), CUP.into_iter(), 0.02);
    feel(&arm, learn("can"), CAN.into_iter(), 0.02);
    send(&arm, SampleBody::Object(ObjectMark::End {}));
    // Nothing was asked of the first ones, and nothing is felt in the last.
    feel(&arm, identify(), CUP.into_iter().rev(), -0.02);
    arm.flush(LONG).expect("everything becomes durable");
    let under_way = of_arm(&server);
    assert_eq!(under_way.episode, Some(EpisodeKind::Identify));
    let said = under_way.identification.expect("eight contacts say much");
    let is_cup = ObjectVerdict::Object {
        name: "cup".to_owned(),
    };
    assert_eq!(said.verdict, is_cup);
    let last = under_way.last.expect("two were learned before");
    assert_eq!((last.episode, last.session), (EpisodeKind::Learn, 1));
    assert_eq!(last.identification, None);

    arm.close(LONG).expect("the session ends");
    let closed = of_arm(&server);
    assert_eq!((closed.episode, &closed.identification), (None, &None));
    let last = closed.last.as_ref().expect("the episode has ended");
    assert_eq!((last.episode, last.session), (EpisodeKind::Identify, 1));
    let told = last.identification.as_ref().expect("it recognised");
    assert_eq!((&told.verdict, told.contacts), (&is_cup, 8));
    assert_eq!(told.pose.as_ref().map(|pose| &*pose.object), Some("cup"));
    assert_eq!(told.next_touch, None);

    // From the journal, from a checkpoint, and from the journal again.
    server.kill();
    server.run();
    assert_eq!(of_arm(&server), closed, "after a crash");
    server.terminate();
    server.run();
    assert_eq!(of_arm(&server), closed, "after an orderly end");
    server.terminate();
    fs::remove_dir_all(server.data().join("derived")).expect("derived state can be dropped");
    server.run();
    assert_eq!(of_arm(&server), closed, "from the journal alone");

    // It goes with the agent.
    let removed = server.api().delete_agent("default", ARM);
    removed.expect("it can be removed");
    let again = server.robot(ARM, 2);
    send(&again, SampleBody::Object(ObjectMark::End {}));
    again.flush(LONG).expect("everything becomes durable");
    let nothing = of_arm(&server);
    assert_eq!((nothing.episode, nothing.last), (None, None));
}
