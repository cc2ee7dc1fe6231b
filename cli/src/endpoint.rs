//! The machine that a command line names, and the way to it.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, bail};
use clap::ValueEnum;
use quadrant_cli::{terminal, warn};
use quadrant_host::client::{Client, Interrupt};
use quadrant_host::machine::{
    LawStage, Machine, SerialTransport, Shared, SimulatedLink, TcpTransport, Transport,
};
use quadrant_law::axes::AxisName;
use quadrant_settings::StageSettings;
use quadrant_sim::stage_file::StageFile;
use quadrant_sim::stage_setup::StageSetup;

/// Image that `cargo xtask build --board mps2` leaves, from the workspace's folder.
pub(super) const DEFAULT_IMAGE: &str = "target/images/mps2-f32.elf";

/// Settings that a simulated machine has when it is switched on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Preset {
    /// Nothing, as a board from the shop: it refuses to be enabled until an axis is commissioned, or settings are loaded.
    #[default]
    Fresh,
    /// Settings that suit the simulated stage, for a quick look.
    Commissioned,
}

/// The stage of a machine that is not real.
#[derive(Clone, Debug, Default)]
pub(super) struct Simulation {
    /// Seed of its noise.
    pub(super) seed: u64,
    /// A stage of one's own.
    pub(super) stage: Option<StageFile>,
    /// Settings that a fresh machine starts with, in place of its own.
    pub(super) start: Option<StageSettings>,
    /// The only axis that has a law, of a machine that is the law alone; without it all of them have the simulated stage's.
    pub(super) alone: Option<AxisName>,
}

impl Simulation {
    /// The stage, and the settings of its firmware.
    fn setup(&self, preset: Preset) -> anyhow::Result<StageSetup> {
        let setup = match (preset, &self.stage) {
            (Preset::Fresh, None) => StageSetup::simulated(),
            (Preset::Fresh, Some(stage)) => StageSetup::of(stage),
            (Preset::Commissioned, None) => StageSetup::commissioned(),
            (Preset::Commissioned, Some(stage)) => bail!(
                "the stage of {} has no settings ready: commission its axes, or load the settings that a commissioning has left",
                stage.path.display()
            ),
        };
        Ok(match (preset, &self.start) {
            (Preset::Fresh, Some(start)) => setup.started_with(start),
            _ => setup,
        })
    }
}

/// A machine, as `--machine` names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Endpoint {
    /// The control law alone on the simulated stage.
    Law,
    /// A machine that speaks the link's protocol.
    Link(LinkEndpoint),
}

/// A machine that speaks the link's protocol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum LinkEndpoint {
    /// The firmware's application in this process.
    Simulated(Preset),
    /// The firmware's image in QEMU.
    Emulated(PathBuf),
    /// A board at a serial port.
    Serial(String),
    /// A machine behind a socket.
    Tcp(String),
    /// A machine that another program holds and shares, and the token for it where it has one.
    Look(String, Option<String>),
}

impl FromStr for Endpoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let link = match text.split_once(':') {
            None => match text {
                "law" => return Ok(Self::Law),
                "simulated" => LinkEndpoint::Simulated(Preset::Fresh),
                "emulated" => LinkEndpoint::Emulated(DEFAULT_IMAGE.into()),
                _ => return Err(Self::EXPECTED.to_owned()),
            },
            Some(("simulated", preset)) => LinkEndpoint::Simulated(
                Preset::from_str(preset, false).map_err(|_| Self::EXPECTED.to_owned())?,
            ),
            Some(("emulated", image)) => LinkEndpoint::Emulated(image.into()),
            Some(("serial", port)) => LinkEndpoint::Serial(port.to_owned()),
            Some(("tcp", address)) => LinkEndpoint::Tcp(address.to_owned()),
            Some(_) => return Err(Self::EXPECTED.to_owned()),
        };
        Ok(Self::Link(link))
    }
}

impl Endpoint {
    const EXPECTED: &str = "give law, simulated, simulated:commissioned, emulated, emulated:ELF, serial:PORT or tcp:HOST:PORT";

    /// Opens the machine, on this stage if it is not real.
    pub(super) fn open(&self, simulation: &Simulation) -> anyhow::Result<Box<dyn Machine>> {
        Ok(match self {
            Self::Law => {
                let stage = simulation.stage.as_ref();
                let mut machine = stage.map_or_else(
                    || LawStage::new(simulation.seed),
                    |stage| LawStage::of(stage, simulation.seed),
                );
                if let Some(start) = &simulation.start {
                    machine = machine.started_with(start);
                } else if let Some(axis) = simulation.alone {
                    machine = machine.with_law_of(axis);
                }
                Box::new(machine)
            }
            Self::Link(link) => Box::new(link.connect(simulation, None, None)?),
        })
    }
}

impl LinkEndpoint {
    /// Opens a session: on this stage if the machine is not real, a file keeps the flash of its machine, and others may
    /// look at the address `share`.
    pub(super) fn connect(
        &self,
        simulation: &Simulation,
        flash: Option<&Path>,
        share: Option<&str>,
    ) -> anyhow::Result<Client> {
        let client = self.open(simulation, flash, share)?;
        let firmware = client.identity().firmware.as_str();
        if firmware != env!("CARGO_PKG_VERSION") {
            warn!(
                "the firmware of {} is version {firmware}, this program {}: what one of them does not know, it refuses; use those of one release",
                client.endpoint(),
                env!("CARGO_PKG_VERSION")
            );
        }
        stop_on_signals(client.interrupt())?;
        terminal::keep_modes();
        Ok(client)
    }

    fn open(
        &self,
        simulation: &Simulation,
        flash: Option<&Path>,
        share: Option<&str>,
    ) -> anyhow::Result<Client> {
        if let Some(stage) = &simulation.stage
            && !matches!(self, Self::Simulated(_) | Self::Emulated(_))
        {
            bail!(
                "--stage {}: this machine has a stage of its own; a file describes that of a simulated or emulated one",
                stage.path.display()
            );
        }
        match self {
            Self::Simulated(preset) => {
                let setup = simulation.setup(*preset)?;
                session(SimulatedLink::start(&setup, simulation.seed, flash)?, share)
            }
            Self::Emulated(image) => emulated(image, simulation, flash, share),
            Self::Serial(path) => {
                let port = SerialTransport::open(path).with_context(|| {
                    format!(
                        "serial port {path} cannot be opened; check the cable, the name (on Linux `ls /dev/ttyACM* \
                         /dev/ttyUSB*`), that no other program has it, and that you may use it (group dialout)"
                    )
                })?;
                session(port, share)
            }
            Self::Tcp(address) => {
                let socket = TcpTransport::connect(address).with_context(|| {
                    format!(
                        "tcp:{address} does not answer; check the address and that the machine runs"
                    )
                })?;
                session(socket, share)
            }
            Self::Look(address, token) => {
                let socket = TcpTransport::look(address, token.as_deref()).with_context(|| {
                    format!(
                        "nobody shares a machine at {address}; its holder starts `quadrant connect --share {address}`"
                    )
                })?;
                session(socket, share)
            }
        }
    }
}

/// A session over a connection that others may look at.
fn session(transport: impl Transport + 'static, share: Option<&str>) -> anyhow::Result<Client> {
    let Some(address) = share else {
        return Ok(Client::open(transport)?);
    };
    let shared = Shared::listen(transport, address)
        .with_context(|| format!("--share {address}: nobody can be listened to there"))?;
    let (address, token) = (shared.address(), shared.token().map(str::to_owned));
    let client = Client::open(shared)?;
    // Not before there is something to see.
    match token {
        None => {
            warn!(
                "others on this computer may look, stop and disable: quadrant connect --look {address}"
            );
        }
        Some(token) => warn!(
            "anyone on the network with the token may look, stop and disable; the token goes over it in the clear: quadrant connect \
             --look {address} --token {token}"
        ),
    }
    Ok(client)
}

/// Signals after which this program ends, acted on or not: the machine stops what its host has started when that is gone.
const SIGNALS: u32 = 3;

/// Stops the axes on Ctrl-C, and when this program is to end.
fn stop_on_signals(interrupt: Interrupt) -> anyhow::Result<()> {
    on_signals(move |ends| {
        let requests = match ends {
            true => interrupt.request_end(),
            false => interrupt.request(),
        };
        match requests {
            1 => warn!("stopping the axes; once more disables the outputs"),
            SIGNALS.. => {
                warn!("ended");
                terminal::restore_modes();
                std::process::exit(130);
            }
            _ => warn!("disabling the outputs"),
        }
    })
    .context("cannot take Ctrl-C")
}

/// Calls `act` at every signal, with whether the program is to end after it: Ctrl-C is for what is under way alone.
#[cfg(unix)]
fn on_signals(act: impl Fn(bool) + Send + 'static) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    std::thread::spawn(move || signals.forever().for_each(|signal| act(signal != SIGINT)));
    Ok(())
}

#[cfg(not(unix))]
fn on_signals(act: impl Fn(bool) + Send + 'static) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || act(false))
}

#[cfg(all(unix, feature = "emulated"))]
fn emulated(
    image: &Path,
    simulation: &Simulation,
    flash: Option<&Path>,
    share: Option<&str>,
) -> anyhow::Result<Client> {
    let setup = simulation.setup(Preset::Fresh)?;
    let link = quadrant_host::machine::EmulatedLink::start(image, &setup, simulation.seed, flash)?;
    session(link, share)
}

#[cfg(not(all(unix, feature = "emulated")))]
fn emulated(_: &Path, _: &Simulation, _: Option<&Path>, _: Option<&str>) -> anyhow::Result<Client> {
    anyhow::bail!(if cfg!(unix) {
        "emulated: this program was built without QEMU's side; build it with `--features emulated`, as in `cargo run \
         --release --features emulated -- connect --emulated`"
    } else {
        "emulated: QEMU shares memory through a file on Unix systems alone; the simulated machine works here"
    })
}

#[cfg(test)]
mod tests {
    use super::{Endpoint, LinkEndpoint, Preset};

    #[test]
    fn every_machine_has_a_name_and_others_are_refused_with_them() {
        let link = |text: &str| match text.parse() {
            Ok(Endpoint::Link(link)) => link,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!("law".parse(), Ok(Endpoint::Law));
        assert_eq!(link("simulated"), LinkEndpoint::Simulated(Preset::Fresh));
        assert_eq!(
            link("simulated:commissioned"),
            LinkEndpoint::Simulated(Preset::Commissioned)
        );
        assert_eq!(
            link("emulated:a.elf"),
            LinkEndpoint::Emulated("a.elf".into())
        );
        assert_eq!(
            link("serial:/dev/ttyACM0"),
            LinkEndpoint::Serial("/dev/ttyACM0".to_owned())
        );
        assert_eq!(
            link("tcp:shop:7000"),
            LinkEndpoint::Tcp("shop:7000".to_owned())
        );
        for text in ["", "board", "usb:1", "simulated:commissionned"] {
            let refused = text.parse::<Endpoint>().unwrap_err();
            assert!(refused.contains("serial:PORT"), "{text}: {refused}");
        }
    }
}
