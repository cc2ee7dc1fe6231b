//! Flash of an image by module.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use object::{Object, ObjectSymbol, SymbolKind};

use xtask::image::Image;

/// Crates whose modules are distinguished.
const OURS: [&str; 4] = [
    "quadrant",
    "quadrant_firmware",
    "quadrant_law",
    "quadrant_settings",
];
/// The module whose modules are distinguished in turn.
const LARGE: &str = "app";
/// Smaller ones go together.
const LEAST_BYTES: u64 = 1024;

/// Prints the bytes of functions and constants by the module that they are written in, the largest first. What is inlined
/// counts where it ended up; texts and tables of jumps have no name, and are what is left of the flash.
pub(crate) fn print(image: &Image) -> Result<()> {
    let file = object::File::parse(&*image.elf).context("the image is not an ELF file")?;
    let flash = image.footprint()?.flash_bytes();
    let mut modules = BTreeMap::<String, u64>::new();
    let mut named = 0;
    let mut last = None;
    let mut symbols: Vec<_> = file
        .symbols()
        .filter(|symbol| symbol.size() > 0 && symbol.address() < 0x2000_0000)
        .filter(|symbol| matches!(symbol.kind(), SymbolKind::Text | SymbolKind::Data))
        .collect();
    symbols.sort_by_key(|symbol| symbol.address());
    for symbol in symbols {
        // One function may have several names.
        if last.replace(symbol.address()) == Some(symbol.address()) {
            continue;
        }
        let name = format!("{:#}", rustc_demangle::demangle(symbol.name()?));
        *modules.entry(module(&name)).or_default() += symbol.size();
        named += symbol.size();
    }
    let mut others = 0;
    let mut rows = Vec::new();
    for (module, bytes) in modules {
        if bytes < LEAST_BYTES {
            others += bytes;
        } else {
            rows.push((bytes, module));
        }
    }
    rows.sort_by_key(|row| std::cmp::Reverse(row.0));
    rows.push((others, "other modules".into()));
    rows.push((
        flash.saturating_sub(named),
        "texts and other things without a name".into(),
    ));
    println!("{}: flash by module, bytes", image.target);
    for (bytes, module) in rows {
        println!("  {bytes:7}  {module}");
    }
    println!("  {flash:7}  in all");
    Ok(())
}

/// The module of a function or constant: its path without its own name, cut to what is worth distinguishing.
fn module(name: &str) -> String {
    if name.contains("miniconf::tree::TreeAny") {
        return "leaves of the settings by path (miniconf)".into();
    }
    // The type that is implemented for, or the path itself.
    let path = name.trim_start_matches(['<', '&', '(', '[']);
    let path = path.strip_prefix("mut ").unwrap_or(path);
    let end = path.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
    let path = path.get(..end.unwrap_or(path.len())).unwrap_or(path);
    let parts: Vec<_> = path.split("::").filter(|part| !part.is_empty()).collect();
    let in_module = |depth: usize| {
        let modules = parts.iter().take(depth);
        let modules = modules.take_while(|part| part.starts_with(char::is_lowercase));
        modules.copied().collect::<Vec<_>>().join("::")
    };
    match parts.as_slice() {
        [krate, module, _, ..] if OURS.contains(krate) && *module == LARGE => in_module(3),
        [krate, _, _, ..] if OURS.contains(krate) => in_module(2),
        [krate, _, ..] => (*krate).to_owned(),
        _ => "handlers, and what is in no module".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::module;

    #[test]
    fn functions_are_counted_for_the_module_they_are_written_in() {
        for (name, expected) in [
            (
                "<quadrant_law::axis::Axis<f32, 8>>::drive",
                "quadrant_law::axis",
            ),
            (
                "quadrant_settings::tree::canonical",
                "quadrant_settings::tree",
            ),
            (
                "<quadrant_settings::stage::StageSettings>::validate",
                "quadrant_settings::stage",
            ),
            (
                "<&quadrant::store::LoadError<F> as core::fmt::Display>::fmt",
                "quadrant::store",
            ),
            ("libm::math::pow::pow", "libm"),
            ("core::fmt::write", "core"),
            ("CONTROL_TICK", "handlers, and what is in no module"),
            (
                "<quadrant_settings::axis::AxisSettings as miniconf::tree::TreeAny>::ref_any_by_key",
                "leaves of the settings by path (miniconf)",
            ),
        ] {
            assert_eq!(module(name), expected, "{name}");
        }
    }
}
