//! Levels that no sensor of their kind has.

use cognitive_map::Settings;

use crate::objects::{RODS, UP, end, feel, identify, learn, recognised, taught};

#[test]
fn absurd_levels_of_one_hand_leave_the_objects_of_all() {
    for absurd in [1e4, -1e8, 1e30, 1e308, f64::MAX] {
        let (mut map, mut hand) = taught(Settings::default());
        let strange = RODS[2]
            .1
            .map(|level| if level < 6.0 { absurd } else { -absurd });
        hand.sample(&mut map, identify());
        feel(&mut map, &mut hand, &strange, &UP[..6]);
        hand.sample(&mut map, end());
        // Whoever states that it is an object, teaches it.
        hand.sample(&mut map, learn(Some("absurd")));
        feel(&mut map, &mut hand, &strange, &UP);
        hand.sample(&mut map, end());
        for (name, rod) in &RODS {
            hand.sample(&mut map, identify());
            let events = feel(&mut map, &mut hand, rod, &UP[2..10]);
            assert_eq!(recognised(&events), [*name], "{absurd}");
            hand.sample(&mut map, end());
        }
    }
}
