//! How often the acts of the demo's scenario succeed, through the core alone:
//!
//!     cargo run --release -p cogmap-worlds --example scenario -- seeds=20 robots=5
//!
//! Options: `seed` (the first one, 1), `seeds` (20), `robots` (5), `seconds` (60).
#![allow(clippy::print_stdout)] // it is what it is for

use std::collections::BTreeMap;

use cogmap_worlds::{Act, AgentTick, Scenario, ScenarioSettings};
use cognitive_map::{
    AgentId, CognitiveMap, EventKind, Label, Record, Sample, Settings, SettingsValues, Status,
};

fn main() {
    let mut options = BTreeMap::from([("seed", 1), ("seeds", 20), ("robots", 5), ("seconds", 60)]);
    for argument in std::env::args().skip(1) {
        let option = argument
            .split_once('=')
            .and_then(|(name, value)| Some((options.get_mut(name)?, value.parse::<u32>().ok()?)));
        match option {
            Some((option, value)) => *option = value,
            None => println!("{argument} is no option, and is ignored"),
        }
    }
    println!("times since the act [s], errors [m]");
    for seed in (options["seed"]..).take(options["seeds"] as usize) {
        let settings = ScenarioSettings {
            seed: u64::from(seed),
            n_robots: options["robots"],
            epoch_ns: 0,
            duration_s: f64::from(options["seconds"]),
        };
        println!("seed {seed}: {}", Run::new(settings).finish().join("; "));
    }
}

/// One run of the scenario.
struct Run {
    scenario: Scenario,
    map: CognitiveMap,
    agents: BTreeMap<String, (AgentId, u64, Status)>,
    next: u32,
    /// The robot that does not know where it is, and since when.
    lost: Option<(String, f64)>,
    touched: Option<(f64, u64)>,
    told: Vec<String>,
}

impl Run {
    fn new(settings: ScenarioSettings) -> Self {
        let map = Settings::new(SettingsValues::default()).expect("the defaults are valid");
        Self {
            scenario: Scenario::new(settings).expect("there is room"),
            map: CognitiveMap::new(map),
            agents: BTreeMap::new(),
            next: 0,
            lost: None,
            touched: None,
            told: Vec::new(),
        }
    }

    fn finish(mut self) -> Vec<String> {
        while self.scenario.has_more() {
            let now_s = self.scenario.elapsed_s();
            let tick = self.scenario.tick();
            for act in &tick.acts {
                self.act(act, now_s);
            }
            for agent in &tick.agents {
                self.agent(agent, now_s);
            }
        }
        self.told
    }

    fn act(&mut self, act: &Act, now_s: f64) {
        match act {
            Act::SwitchedOff { robot } => {
                if let Some((agent, ..)) = self.agents.remove(robot) {
                    self.map.apply(&Record::Remove { agent }, &mut Vec::new());
                }
            }
            Act::WokenUp { robot } => {
                self.lost = Some((robot.clone(), now_s));
                self.told.push("woken up".to_owned());
            }
            Act::CarriedOff { robot, .. } => {
                self.lost = Some((robot.clone(), now_s));
                self.told.push("carried off".to_owned());
            }
            Act::Touching(thing) => {
                self.touched = Some((now_s, 0));
                self.told.push(format!("touches a {}", thing.name()));
            }
            Act::Learning(_) | Act::LetGo => {}
        }
    }

    fn agent(&mut self, tick: &AgentTick, now_s: f64) {
        let name = &tick.name;
        let (agent, mut seq, before) = *self.agents.entry(name.clone()).or_insert_with(|| {
            let agent = AgentId(self.next);
            self.next += 1;
            let name = Label::new(name).expect("it is a label");
            self.map
                .apply(&Record::Enrol { agent, name }, &mut Vec::new());
            (agent, 0, Status::Lost)
        });
        let mut events = Vec::new();
        for reading in &tick.readings {
            let sample = Sample::try_from(reading).expect("what is read is valid");
            let record = Record::Sample {
                agent,
                session: 1,
                seq,
                sample,
            };
            seq += 1;
            self.map.apply(&record, &mut events);
        }
        if let Some((_, identified)) = self.map.episode(agent)
            && let Some((_, contacts)) = &mut self.touched
        {
            *contacts = identified.posterior.contacts as u64;
        }
        for event in events {
            if let (EventKind::ObjectRecognised { name, .. }, Some((since_s, contacts))) =
                (event.kind, self.touched)
            {
                self.told.push(format!(
                    "recognised as a {} after {contacts} contacts, {:.1}",
                    name.as_str(),
                    now_s - since_s
                ));
            }
        }
        let status = self.map.status(agent).expect("it was enrolled");
        self.agents.insert(name.clone(), (agent, seq, status));
        self.status(tick, agent, [before, status], now_s);
    }

    fn status(
        &mut self,
        tick: &AgentTick,
        agent: AgentId,
        [before, status]: [Status; 2],
        now_s: f64,
    ) {
        let Some((robot, since_s)) = &self.lost else {
            return;
        };
        if *robot != tick.name {
            return;
        }
        let pose = self.map.agent(agent).expect("it was enrolled").pose();
        let error_m = (pose.translation.vector - tick.truth.pose.translation.vector).norm();
        let after_s = now_s - *since_s;
        match status {
            // Who is carried off may be found by the very sightings that tell so.
            Status::Localized if error_m < 0.5 => {
                self.told
                    .push(format!("found {after_s:.1}, {error_m:.2} off"));
                self.lost = None;
            }
            _ if status != before => self
                .told
                .push(format!("{status:?} {after_s:.1}, {error_m:.2} off")),
            _ => {}
        }
    }
}
