//! `cogmap-lab replay room`.

use clap::Args;
use cogmap_proto::{Sample, SampleBody, Sighting, Target};
use cogmap_worlds::{Reading, WheelSettings, Wheels, dead_reckoned, robot_name};
use trajectory::{Alignment, Span, StampedPose, Trajectory};

use super::arguments::ReplayArgs;
use super::case::Case;
use super::scoring::{Pairing, Scoring};
use super::team::{Known, Team};

/// Ticks a second.
const TICKS_HZ: f64 = 10.0;

#[derive(Debug, Args)]
pub(in crate::cli) struct RoomArgs {
    /// Rooms, each with a seed, landmarks and a space of its own; those of several are numbered.
    #[arg(long, default_value_t = 10)]
    rooms: u32,
    /// Seed of the first room; the next has the next.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Robots in each room.
    #[arg(long, default_value_t = 1)]
    robots: u32,
    /// Landmarks in each room.
    #[arg(long, default_value_t = 12)]
    landmarks: u32,
    /// How long the robots drive [s].
    #[arg(long, default_value_t = 600.0, value_name = "SECONDS")]
    seconds: f64,
    /// Standard deviation of sighted distances [m].
    #[arg(long, default_value_t = 0.03, value_name = "M")]
    range_sd_m: f64,
    /// Standard deviation of sighted directions [rad].
    #[arg(long, default_value_t = 0.01, value_name = "RAD")]
    bearing_sd_rad: f64,
    /// How often each landmark and robot in reach (5 m) is seen [Hz].
    #[arg(long, default_value_t = 1.0, value_name = "HZ")]
    sightings_hz: f64,
    /// Standard deviation of the error of a wheel's size, as a share of it.
    #[arg(long, default_value_t = 0.01, value_name = "SHARE")]
    wheel_error: f64,
    /// Standard deviation of a wheel's slip after a metre [m].
    #[arg(long, default_value_t = 0.005, value_name = "M")]
    slip_m: f64,
    #[command(flatten)]
    replay: ReplayArgs,
}

pub(super) fn run(args: &RoomArgs) -> anyhow::Result<()> {
    let sane = |value: f64| value.is_finite() && value >= 0.0;
    let numbers = [
        args.seconds,
        args.sightings_hz,
        args.wheel_error,
        args.slip_m,
    ];
    anyhow::ensure!(
        numbers.into_iter().all(sane),
        "numbers must not be negative"
    );
    let noise = [args.range_sd_m, args.bearing_sd_rad];
    anyhow::ensure!(
        noise.into_iter().all(|sd| sane(sd) && sd > 0.0),
        "a sighting states a deviation above zero"
    );
    anyhow::ensure!(args.wheel_error < 0.2, "a wheel's size is known to a fifth");
    anyhow::ensure!(args.rooms > 0 && args.robots > 0, "there is no robot");
    let teams = (0..args.rooms).map(|room| team(args, room));
    let case = Case {
        start_pose: "from the truth",
        teams: teams.collect::<anyhow::Result<_>>()?,
        scoring: Scoring {
            pairing: Pairing::Grid(Span {
                start_ns: 0,
                end_ns: ns(args.seconds),
            }),
            alignment: Alignment::Planar,
            is_recorded: true,
        },
    };
    case.show(&args.replay)
}

/// What the robots of a room send, and where they were.
fn team(args: &RoomArgs, room: u32) -> anyhow::Result<Team> {
    let mut wheels = Wheels::new(WheelSettings {
        seed: args.seed + u64::from(room),
        n_robots: args.robots,
        n_landmarks: args.landmarks,
        wheel_error_sd: args.wheel_error,
        slip_sd_m: args.slip_m,
        sightings_hz: args.sightings_hz,
        range_sd_m: args.range_sd_m,
        bearing_sd_rad: args.bearing_sd_rad,
        ..WheelSettings::default()
    });
    let of_room = |robot: u32| prefix(room) + &robot_name(robot);
    let robots = args.robots as usize;
    let mut read: Vec<(Vec<Reading>, Vec<StampedPose>)> = vec![Default::default(); robots];
    let mut samples = Vec::new();
    let ticks = std::iter::repeat_with(|| wheels.tick());
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "`as` saturates"
    )]
    for tick in ticks.take((args.seconds * TICKS_HZ) as usize + 1).flatten() {
        let name = of_room(tick.robot);
        let of_tick = tick.readings.iter().map(|reading| {
            let mut sample = Sample::from(reading);
            if let SampleBody::Sighting(Sighting {
                target: Target::Agent(other),
                ..
            }) = &mut sample.body
            {
                *other = format!("{}{other}", prefix(room));
            }
            sample
        });
        samples.extend(of_tick.map(|sample| (name.clone(), sample)));
        let (readings, truth) = &mut read[tick.robot as usize - 1];
        readings.extend(tick.readings);
        truth.push(tick.truth);
    }
    let space = args.replay.space("room");
    let space = match args.rooms {
        1 => space,
        _ => format!("{space}{}", room + 1),
    };
    let mut team = Team::new(space, samples, args.replay.batch());
    for (robot, (readings, truth)) in (1..).zip(read) {
        let known = Known {
            reckoned: dead_reckoned(&readings)?,
            truth: Some(Trajectory::from_poses(&truth)?),
            true_poses: truth,
        };
        team.robots.insert(of_room(robot), known);
    }
    Ok(team)
}

/// What stands before the names of a room's robots: a report has them all.
fn prefix(room: u32) -> String {
    format!("room{}.", room + 1)
}

fn ns(seconds: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "`as` saturates")]
    let ns = (seconds * 1e9) as i64;
    ns
}
