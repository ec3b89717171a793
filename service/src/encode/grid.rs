//! Grid-cell state of an agent.

use cogmap_proto as wire;
use cognitive_map::{Agent, CognitiveMap};
use grid::heading::heading_rad;
use grid::octant_activation;
use grid::population::{TUNING_WIDTH, activation, interference_pattern};
use nalgebra::{Point3, Vector3};

/// The grid state of an agent; nothing before its first sample.
pub fn grid_state(map: &CognitiveMap, agent: &Agent) -> Option<wire::GridState> {
    let stamp_ns = agent.stamp_ns()?;
    let modules = map.modules();
    let states = modules.lattices().iter().zip(agent.grid().modules());
    let believed = Point3::from(agent.pose().translation.vector);
    let interference = interference_pattern(modules, &agent.grid().code(), &believed);
    // Some cell is always near the phase; the fallback says the same as no correction.
    let interference = interference.normalised().unwrap_or(believed);
    Some(wire::GridState {
        agent: agent.name().as_str().to_owned(),
        stamp_ns,
        modules: states
            .map(|(lattice, state)| wire::GridModuleState {
                spacing_m: lattice.spacing_m(),
                reference: state.reference,
                reference_m: lattice
                    .position(state.reference, &grid::Phase::zero())
                    .coords
                    .into(),
                phase: (*state.phase.turns()).into(),
                activation: activation(lattice, &state.phase).to_vec(),
                octant_activation: octants(&believed, lattice.spacing_m()),
            })
            .collect(),
        decoded_m: agent.grid().decode(modules).coords.into(),
        interference_m: interference.coords.into(),
        octant: agent.octant(),
        displacement_m: agent.displacement_m(),
        turning_rad: agent.turning_rad(),
        heading_rad: heading_rad(&agent.pose().rotation),
    })
}

/// The octant model's activation at a position \[m\], tuned as the module's cells are.
fn octants(position: &Point3<f64>, spacing_m: f64) -> f64 {
    let cell_m = Vector3::repeat(spacing_m);
    octant_activation(position, &cell_m, TUNING_WIDTH * spacing_m, spacing_m).activation
}
