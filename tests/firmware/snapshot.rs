//! The slow half's view of the axes.

use quadrant::app::Snapshot;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::stage::{Inputs, Stage, StageState};
use quadrant_settings::{PlanSettings, StageSettings};

#[test]
fn the_index_pulse_that_an_encoder_has_shown_is_reported_of_that_axis_alone() {
    let settings = StageSettings::simulated();
    let stage: Stage<f32, FIRMWARE_ELEMENTS> = settings.build().expect("valid settings");
    let plan = PlanSettings::default().build(&settings).expect("no motion");
    let mut state = StageState::default();
    let mut inputs = Inputs::default();
    let mut shown = |index: Option<u32>| {
        inputs.readings[1].index = index;
        stage.tick(&plan, &mut state, &inputs);
        *Snapshot::of(&stage.as_ref(), &plan, &state).indexed
    };
    assert_eq!(shown(None), [false; 3]);
    assert_eq!(shown(Some(0)), [false, true, false]);
    assert_eq!(shown(None), [false, true, false]);
}
