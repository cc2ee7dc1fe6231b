//! `watch`: the machine live in the terminal.
//!
//! [`state`] is what is seen and asked for, [`view`] its picture, and here the time passes: a simulated machine's as fast as a
//! real one's.

mod state;
mod view;

use std::io::{IsTerminal, stdin, stdout};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use quadrant_cli::terminal;
use quadrant_host::client::Client;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEventKind};
use serde_json::json;

use self::state::{Going, Watch};
use super::answer::Answer;
use super::command::WatchOptions;

/// Time from one picture to the next.
const PICTURE: Duration = Duration::from_millis(50);
/// Time from one look for a key to the next.
const LOOK: Duration = Duration::from_millis(5);

pub(super) fn run(client: &mut Client, options: &WatchOptions) -> anyhow::Result<Answer> {
    if !(stdin().is_terminal() && stdout().is_terminal()) {
        bail!("watch needs a terminal; `scope` draws anywhere, `record` writes a file");
    }
    let mut watch = Watch::start(client, options)?;
    let mut terminal = ratatui::try_init().context("cannot use the terminal")?;
    let outcome = live(client, &mut watch, &mut terminal);
    ratatui::restore();
    outcome?;
    let written = watch.finish(client)?;
    Ok(Answer::new("", json!({ "files": written })))
}

fn live(
    client: &mut Client,
    watch: &mut Watch,
    terminal: &mut DefaultTerminal,
) -> anyhow::Result<()> {
    let (began, machine_began) = (Instant::now(), client.now());
    loop {
        watch.look(client, PICTURE)?;
        terminal.draw(|frame| view::draw(watch, frame))?;
        // A real machine's time has passed by itself.
        let ahead = client.now().saturating_sub(machine_began);
        let mut left = ahead.saturating_sub(began.elapsed());
        while waits_for_event(left)? {
            if let Event::Key(key) = event::read()?
                && key.kind != KeyEventKind::Release
                && watch.press(client, key)? == Going::Leave
            {
                return Ok(());
            }
            left = ahead.saturating_sub(began.elapsed());
        }
    }
}

/// Waits for an event of the terminal; returns false when time is up.
///
/// # Errors
/// A terminal that is gone: crossterm would read it without an end, and the outputs would stay on.
fn waits_for_event(time: Duration) -> anyhow::Result<bool> {
    let due = Instant::now() + time;
    loop {
        ensure!(terminal::is_there(), "the terminal is gone");
        if event::poll(Duration::ZERO)? {
            return Ok(true);
        }
        let left = due.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(false);
        }
        thread::sleep(left.min(LOOK));
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use quadrant::app::Translated;
    use quadrant_host::machine::SimulatedLink;
    use quadrant_law::reference::{MotionSettings, PointToPointSettings};
    use quadrant_link::message::{Body, MachineState};
    use quadrant_settings::PlanSettings;
    use quadrant_sim::stage_setup::StageSetup;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        options: WatchOptions,
    }

    fn watched(words: &[&str]) -> (Client, Watch) {
        let words = ["watch"].iter().chain(words);
        let options = Line::parse_from(words).options;
        let setup = StageSetup::commissioned();
        let mut client = Client::open(SimulatedLink::start(&setup, 1, None).unwrap()).unwrap();
        let watch = Watch::start(&mut client, &options).unwrap();
        (client, watch)
    }

    fn press(client: &mut Client, watch: &mut Watch, key: KeyCode) -> Going {
        let going = watch.press(client, KeyEvent::from(key)).unwrap();
        for _ in 0..4 {
            watch.look(client, PICTURE).unwrap();
        }
        going
    }

    fn twice(client: &mut Client, watch: &mut Watch, key: char) -> Going {
        press(client, watch, KeyCode::Char(key));
        press(client, watch, KeyCode::Char(key))
    }

    fn picture(watch: &Watch) -> String {
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
        terminal.draw(|frame| view::draw(watch, frame)).unwrap();
        terminal.backend().to_string()
    }

    #[test]
    fn eighty_columns_show_state_axes_inputs_gain_and_three_charts() {
        let (mut client, mut watch) = watched(&[]);
        twice(&mut client, &mut watch, 'e');
        let seen = picture(&watch);
        for part in [
            "enabled",
            "position mm",
            "inputs  none active",
            "x/feedback/pid/kp_v_per_mm",
            "x.error, um",
            "y.error, um",
            "z.error, um",
        ] {
            assert!(seen.contains(part), "{part} is missing:\n{seen}");
        }
    }

    #[test]
    fn an_axis_that_learns_shows_its_scale_beside_three_charts() {
        let (mut client, mut watch) = watched(&[]);
        assert!(!picture(&watch).contains("friction of"));
        let path = quadrant_host::client::settings::whole_path("z/feedforward/learning");
        quadrant_host::client::settings::set(&mut client, &path, "present").unwrap();
        quadrant_host::client::settings::apply(&mut client).unwrap();
        twice(&mut client, &mut watch, 'e');
        let seen = picture(&watch);
        assert!(seen.contains("friction of z x 1.000; frozen: "), "{seen}");
        assert!(seen.contains("z.error, um"), "{seen}");
    }

    #[test]
    fn a_gain_is_nudged_and_undone_on_the_machine() {
        let (mut client, mut watch) = watched(&["--gain", "y/feedback/pid/kd_v_s_per_mm"]);
        let of = |client: &mut Client| {
            let path = quadrant_host::client::settings::whole_path("y/feedback/pid/kd_v_s_per_mm");
            let value = quadrant_host::client::settings::get(client, &path).unwrap();
            value.as_f64().unwrap()
        };
        let before = of(&mut client);
        press(&mut client, &mut watch, KeyCode::Char('+'));
        assert!((of(&mut client) / before - 1.05).abs() < 1e-6);
        press(&mut client, &mut watch, KeyCode::Char('u'));
        assert!((of(&mut client) / before - 1.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_is_enabled_or_moves_before_its_key_is_pressed_again() {
        let (mut client, mut watch) = watched(&[]);
        let state = |client: &mut Client| client.status().unwrap().state;
        press(&mut client, &mut watch, KeyCode::Char('e'));
        assert_eq!(state(&mut client), MachineState::Disabled);
        assert!(watch.message.contains("once more"), "{}", watch.message);
        // Another key in between begins again.
        press(&mut client, &mut watch, KeyCode::Up);
        press(&mut client, &mut watch, KeyCode::Char('e'));
        assert_eq!(state(&mut client), MachineState::Disabled);
        press(&mut client, &mut watch, KeyCode::Char('e'));
        assert_eq!(state(&mut client), MachineState::Enabled);
        press(&mut client, &mut watch, KeyCode::Char('g'));
        assert!(watch.message.contains("once more"), "{}", watch.message);
        // Off goes at once.
        press(&mut client, &mut watch, KeyCode::Char('d'));
        assert_eq!(state(&mut client), MachineState::Disabled);
    }

    #[test]
    fn what_is_refused_is_said_and_ends_nothing() {
        let (mut client, mut watch) = watched(&[]);
        let going = twice(&mut client, &mut watch, 'g');
        assert_eq!(going, Going::On);
        assert!(watch.message.contains("enable"), "{}", watch.message);
    }

    #[test]
    fn outputs_are_left_on_only_by_asking_twice() {
        let (mut client, mut watch) = watched(&[]);
        twice(&mut client, &mut watch, 'e');
        assert_eq!(
            press(&mut client, &mut watch, KeyCode::Char('q')),
            Going::On
        );
        assert_eq!(
            press(&mut client, &mut watch, KeyCode::Char('q')),
            Going::Leave
        );
        let off = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        watch.press(&mut client, off).unwrap();
        client.wait(PICTURE).unwrap();
        assert_eq!(client.status().unwrap().state, MachineState::Disabled);
        watch.look(&mut client, PICTURE).unwrap();
        assert_eq!(
            press(&mut client, &mut watch, KeyCode::Char('q')),
            Going::Leave
        );
    }

    #[test]
    fn a_frozen_picture_stands_still_and_a_motion_is_captured() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("motion.csv");
        let (mut client, mut watch) = watched(&[
            "x.error",
            "--csv",
            file.to_str().unwrap(),
            "--window",
            "0.5",
        ]);
        twice(&mut client, &mut watch, 'e');
        press(&mut client, &mut watch, KeyCode::Char('c'));
        assert!(watch.capturing);
        let mut plan = PlanSettings::default();
        plan.motions[0] = MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm: 1.0,
            max_velocity_mm_s: 20.0,
            max_acceleration_mm_s2: 1e3,
            max_jerk_mm_s3: 1e5,
        });
        client
            .order(Body::SetPlan(Translated::translated(plan)))
            .unwrap();
        twice(&mut client, &mut watch, 'g');
        for _ in 0..200 {
            watch.look(&mut client, PICTURE).unwrap();
        }
        assert!(!watch.capturing && file.exists(), "{}", watch.message);
        press(&mut client, &mut watch, KeyCode::Char(' '));
        let before = picture(&watch).lines().skip(8).collect::<String>();
        press(&mut client, &mut watch, KeyCode::Null);
        let after = picture(&watch).lines().skip(8).collect::<String>();
        assert_eq!(before, after);
    }
}
