//! The fold from outside: journals in, maps and events out.

#![expect(
    clippy::unwrap_used,
    reason = "clippy knows test functions, but not what they call"
)]

mod absurd_levels;
mod any_journal; // arbitrary journals
mod astray; // robots that are carried off
mod budgets; // what is forgotten, and when
mod checkpoint; // pages out and in, damaged ones too
mod coarse; // views that are alike over tens of metres
mod correction; // what others see of an agent
mod determinism; // the same records, the same map
mod felt; // what was felt near a point, and who was there
mod guidance; // blockages, routes that are followed, pinned trips
mod headings; // levels that tell how robots are turned
mod journal; // a robot that writes readable journals
mod landmarks; // what sightings teach
mod lessons; // objects that are taught at once
mod levels; // where robots are by what they feel
mod motion; // path integration against closed forms
mod names; // landmarks that are called by other names
mod objects; // what is taught and known again
mod percepts;
mod place_cells; // what places learn of percepts, and what they predict
mod places; // recruitment, revisits
mod ranges; // distances alone
mod readers; // routes after a replay, and on many threads
mod recall; // recall against an exhaustive scan
mod relaxation; // loops that close while samples come in
mod remembrance; // places and ways of another map
mod removal; // agents that go, and who comes after them
mod routes; // cheapest routes against another program's
mod sequences; // which trips the last places look like, and what comes next
mod settings; // what each setting changes
mod thinned; // chains of ways as single edges
mod trips; // legs, and every way a trip ends
mod views; // what is seen along ways that are driven again
mod waking; // robots that wake up in a large hall
mod ways; // what the legs add up to, and which ways go
mod wrong_way; // robots that drive against their route
