//! Building the firmware's images and looking at what came out.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use object::{Object, ObjectSymbol};

use crate::command;
use crate::toolchain::Toolchain;

/// The targets rustup must have.
pub const TRIPLES: [&str; 2] = ["thumbv7em-none-eabihf", "thumbv7m-none-eabi"];

/// Other targets for which the library is built: a Cortex-M0 without atomics, and a RISC-V.
pub const LIBRARY_TRIPLES: [&str; 2] = ["thumbv6m-none-eabi", "riscv32imc-unknown-none-elf"];

/// Further targets for which the law is built as in a firmware of another project: a Cortex-M33, and a RISC-V with atomics.
pub const LAW_TRIPLES: [&str; 2] = ["thumbv8m.main-none-eabihf", "riscv32imac-unknown-none-elf"];

/// The machines the firmware is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// Arm MPS2, emulated by QEMU
    Mps2,
    /// ST Nucleo-F446RE, the reference board
    #[value(name = "nucleo-f446re")]
    NucleoF446re,
    /// ST Nucleo-H743ZI2
    #[value(name = "nucleo-h743zi2")]
    NucleoH743zi2,
}

impl Board {
    /// Addresses of the stored settings, which no image may be loaded over, of a board that keeps any in flash.
    pub const fn settings(self) -> Option<Range<u64>> {
        match self {
            Self::Mps2 => None,
            Self::NucleoF446re => Some(0x0800_4000..0x0800_C000),
            Self::NucleoH743zi2 => Some(0x081C_0000..0x0820_0000),
        }
    }

    /// The chip that an image names for programs that flash it, of a board with a debug probe.
    pub const fn chip(self) -> Option<&'static str> {
        match self {
            Self::Mps2 => None,
            Self::NucleoF446re => Some("STM32F446RETx"),
            Self::NucleoH743zi2 => Some("STM32H743ZITx"),
        }
    }
}

/// The firmware's number types.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scalar {
    /// Single-precision floating point
    F32,
    /// Fixed point, for machines without a floating-point unit
    Fixed,
}

/// Board and number type of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// The machine.
    pub board: Board,
    /// The number type.
    pub scalar: Scalar,
}

impl Target {
    /// All that are released and tested: each board in each number type, but the fastest in floating point alone.
    pub const ALL: [Self; 5] = [
        Self::new(Board::Mps2, Scalar::F32),
        Self::new(Board::Mps2, Scalar::Fixed),
        Self::new(Board::NucleoF446re, Scalar::F32),
        Self::new(Board::NucleoF446re, Scalar::Fixed),
        Self::new(Board::NucleoH743zi2, Scalar::F32),
    ];

    /// The firmware of a board in a number type.
    pub const fn new(board: Board, scalar: Scalar) -> Self {
        Self { board, scalar }
    }

    /// The Rust target. The emulated machine for fixed point is a Cortex-M3, which has no floating-point unit.
    pub fn triple(self) -> &'static str {
        match (self.board, self.scalar) {
            (Board::Mps2, Scalar::Fixed) => TRIPLES[1],
            _ => TRIPLES[0],
        }
    }

    /// The number type's name.
    pub fn scalar_name(self) -> String {
        self.scalar
            .to_possible_value()
            .expect("no variant is hidden")
            .get_name()
            .to_owned()
    }

    /// Cargo's features.
    fn features(self) -> String {
        let board = match self.board {
            Board::Mps2 => "board-mps2",
            Board::NucleoF446re => "board-nucleo-f446re",
            Board::NucleoH743zi2 => "board-nucleo-h743zi2",
        };
        let number = match self.scalar {
            Scalar::F32 => "",
            Scalar::Fixed => ",scalar-fixed",
        };
        format!("{board}{number}")
    }

    /// Cargo's arguments to select the firmware of this target.
    pub fn arguments(self) -> [String; 10] {
        [
            "--package".into(),
            "quadrant".into(),
            "--bin".into(),
            "quadrant-firmware".into(),
            "--profile".into(),
            "firmware".into(),
            "--target".into(),
            self.triple().into(),
            "--features".into(),
            self.features(),
        ]
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let board = self
            .board
            .to_possible_value()
            .expect("no variant is hidden");
        write!(f, "{} {}", board.get_name(), self.scalar_name())
    }
}

/// A linked image.
pub struct Image {
    /// Target that it was built for.
    pub target: Target,
    /// Path of the file.
    pub path: PathBuf,
    /// Its bytes.
    pub elf: Vec<u8>,
    /// The compiler that made it.
    pub compiler: String,
}

/// Links the reference board's image with the fallback outputs, and with every line of the log.
///
/// # Errors
/// It does not build.
pub fn link_fallback(toolchain: Toolchain) -> Result<()> {
    let target = Target::new(Board::NucleoF446re, Scalar::F32);
    let mut cargo = toolchain.cargo("build");
    cargo
        .args(target.arguments())
        .args(["--features", "output-on-chip"])
        .env("DEFMT_LOG", "trace");
    command::run(&mut cargo)
}

/// Builds an image, or takes the one that is there if [`BUILT`] says that it was built a moment ago.
///
/// # Errors
/// It does not build.
pub fn build(toolchain: Toolchain, target: Target) -> Result<Image> {
    let path = command::root()
        .join("target/images")
        .join(target.to_string().replace(' ', "-"))
        .with_extension("elf");
    if std::env::var_os(BUILT).is_none() {
        link(toolchain, target, &path)?;
    }
    Ok(Image {
        elf: std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?,
        compiler: toolchain.compiler()?,
        target,
        path,
    })
}

/// The variable that says that all images are up to date.
pub const BUILT: &str = "QUADRANT_IMAGES_BUILT";

/// Builds an image and copies it to a path.
fn link(toolchain: Toolchain, target: Target, path: &Path) -> Result<()> {
    let mut cargo = toolchain.cargo("build");
    cargo.args(target.arguments());
    command::run_quietly(&mut cargo)
        .with_context(|| format!("cannot build the image for {target}"))?;
    let built = command::root()
        .join("target/firmware")
        .join(target.triple())
        .join("firmware")
        .join("quadrant-firmware");
    // Two boards share a triple: keep each image under a name of its own.
    let folder = path.parent().context("the image has a folder")?;
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot create {}", folder.display()))?;
    std::fs::copy(&built, path).with_context(|| format!("cannot copy {}", built.display()))?;
    Ok(())
}

impl Image {
    /// The address of a function, without the bit that says Thumb.
    pub fn function(&self, name: &str) -> Result<u32> {
        Ok(u32::try_from(self.symbol(name)?)? & !1)
    }

    /// The address of a variable of the application, by its name in the source: compilers add to it.
    pub fn variable(&self, name: &str) -> Result<u32> {
        let file = object::File::parse(&*self.elf).context("the image is not an ELF file")?;
        let mangled = format!("3app{}{name}", name.len());
        let is_it = |symbol: &object::Symbol| symbol.name().is_ok_and(|n| n.contains(&mangled));
        let symbol = file.symbols().find(is_it);
        let symbol = symbol.with_context(|| format!("the image has no variable `{name}`"))?;
        Ok(u32::try_from(symbol.address())?)
    }

    /// The address of a symbol.
    pub fn symbol(&self, name: &str) -> Result<u64> {
        let file = object::File::parse(&*self.elf).context("the image is not an ELF file")?;
        let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name));
        let symbol = symbol.with_context(|| format!("the image has no symbol `{name}`"))?;
        Ok(symbol.address())
    }

    /// Returns the memory that the image takes.
    pub fn footprint(&self) -> Result<Footprint> {
        use object::ObjectSection;
        let file = object::File::parse(&*self.elf).context("the image is not an ELF file")?;
        let mut footprint = Footprint {
            target: self.target,
            flash: 0,
            data: 0,
            zeroed: 0,
        };
        for section in file.sections() {
            let object::SectionFlags::Elf { sh_flags } = section.flags() else {
                continue;
            };
            // The log's strings have addresses too, but are in no memory of the machine.
            if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0
                || section.name().is_ok_and(|n| n == ".defmt")
            {
                continue;
            }
            let is_ram = section.address() >= 0x2000_0000;
            let is_stored = section.kind() != object::SectionKind::UninitializedData;
            match (is_ram, is_stored) {
                (false, _) => footprint.flash += section.size(),
                (true, true) => footprint.data += section.size(),
                (true, false) => footprint.zeroed += section.size(),
            }
        }
        ensure!(
            footprint.flash > 0,
            "the image for {} is empty",
            self.target
        );
        Ok(footprint)
    }
}

/// Memory that an image takes, in bytes.
pub struct Footprint {
    target: Target,
    flash: u64,
    data: u64,
    zeroed: u64,
}

impl Footprint {
    /// Flash: initialised variables are in both memories, as flash holds their first values.
    pub fn flash_bytes(&self) -> u64 {
        self.flash + self.data
    }

    /// RAM without the stack.
    pub fn ram_bytes(&self) -> u64 {
        self.data + self.zeroed
    }
}

impl fmt::Display for Footprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: flash {} bytes, RAM {} bytes without the stack",
            self.target,
            self.flash_bytes(),
            self.ram_bytes()
        )
    }
}
