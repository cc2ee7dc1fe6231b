//! Bills of materials, and the licences of what is in a release.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use cargo_metadata::{CargoOpt, MetadataCommand, Package};
use cyclonedx_bom::external_models::uri::Purl;
use cyclonedx_bom::models::component::Classification;
use cyclonedx_bom::models::license::{LicenseChoice, Licenses};
use cyclonedx_bom::prelude::{
    Bom, Component, Components, Metadata, SpdxExpression, SpecVersion, Validate,
};
use xtask::command;

use crate::parts::COMMAND_FEATURES;

/// A file of the release that is compiled from packages.
struct Product {
    name: &'static str,
    package: &'static str,
    manifest: &'static str,
    triple: &'static str,
    features: &'static str,
    kind: Classification,
}

/// Triple of what runs on a computer.
const HOST: &str = "x86_64-unknown-linux-gnu";

/// All of them.
const PRODUCTS: [Product; 6] = [
    Product {
        name: "command",
        package: "quadrant-cli",
        manifest: "Cargo.toml",
        triple: HOST,
        features: COMMAND_FEATURES,
        kind: Classification::Application,
    },
    Product {
        name: "nucleo-f446re",
        package: "quadrant",
        manifest: "Cargo.toml",
        triple: "thumbv7em-none-eabihf",
        features: "board-nucleo-f446re",
        kind: Classification::Firmware,
    },
    Product {
        name: "nucleo-h743zi2",
        package: "quadrant",
        manifest: "Cargo.toml",
        triple: "thumbv7em-none-eabihf",
        features: "board-nucleo-h743zi2",
        kind: Classification::Firmware,
    },
    Product {
        name: "bench",
        package: "quadrant-bench",
        manifest: "Cargo.toml",
        triple: "wasm32-unknown-unknown",
        features: "",
        kind: Classification::Application,
    },
    Product {
        name: "linuxcnc",
        package: "quadrant-linuxcnc",
        manifest: "Cargo.toml",
        triple: HOST,
        features: "",
        kind: Classification::Library,
    },
    Product {
        name: "python",
        package: "quadrant-python",
        manifest: "python/Cargo.toml",
        triple: HOST,
        features: "",
        kind: Classification::Library,
    },
];

/// Name and version.
type Key = (String, String);

/// Writes a bill of each product and one file of licences to the paths that `file` gives for endings; returns the paths.
pub(crate) fn write(root: &Path, file: impl Fn(&str) -> PathBuf) -> Result<Vec<PathBuf>> {
    let mut made = Vec::new();
    let mut foreign = BTreeMap::new();
    for product in PRODUCTS {
        let known = packages(&root.join(product.manifest))?;
        let linked = linked(&product)?;
        let find = |key: &Key| {
            known
                .get(key)
                .with_context(|| format!("cargo metadata has no {} {}", key.0, key.1))
        };
        let mut components = Vec::new();
        for key in &linked {
            let package = find(key)?;
            if package.name == product.package {
                continue;
            }
            components.push(component(package, Classification::Library)?);
            if package.source.is_some() {
                foreign.insert(key.clone(), package.clone());
            }
        }
        let own = known
            .values()
            .find(|package| package.name == product.package);
        let own = own.with_context(|| format!("no package {}", product.package))?;
        let path = file(&format!("{}.cdx.json", product.name));
        write_bill(&path, component(own, product.kind)?, components)?;
        made.push(path);
    }
    let path = file("licences.txt");
    fs::write(&path, licences(&foreign)?)?;
    made.push(path);
    Ok(made)
}

/// Packages that cargo knows of below a manifest.
fn packages(manifest: &Path) -> Result<BTreeMap<Key, Package>> {
    let metadata = MetadataCommand::new()
        .manifest_path(manifest)
        .features(CargoOpt::AllFeatures)
        .other_options(vec!["--locked".to_owned()])
        .exec()?;
    let packages = metadata.packages.into_iter();
    Ok(packages
        .map(|package| {
            (
                (package.name.to_string(), package.version.to_string()),
                package,
            )
        })
        .collect())
}

/// Packages that are linked into a product: without those of build scripts, macros' own included.
fn linked(product: &Product) -> Result<BTreeSet<Key>> {
    let text = command::output(
        command::command("cargo")
            .args(["tree", "--locked", "--edges", "normal", "--prefix", "none"])
            .args(["--format", "{p}", "--manifest-path", product.manifest])
            .args(["--package", product.package, "--target", product.triple])
            .args(["--features", product.features]),
    )?;
    text.lines()
        .map(|line| key(line).with_context(|| format!("cargo tree: {line}")))
        .collect()
}

/// `name v1.2.3 (path)` and marks behind it.
fn key(line: &str) -> Option<Key> {
    let mut words = line.split(' ');
    let name = words.next()?;
    let version = words.next()?.strip_prefix('v')?;
    Some((name.to_owned(), version.to_owned()))
}

/// A package as an entry of a bill.
fn component(package: &Package, kind: Classification) -> Result<Component> {
    let (name, version) = (package.name.as_str(), package.version.to_string());
    let address = Purl::new("cargo", name, &version)?;
    let mut component = Component::new(kind, name, &version, Some(address.to_string()));
    component.purl = Some(address);
    let licence = licence(package)?;
    component.licenses = Some(Licenses(vec![LicenseChoice::Expression(
        SpdxExpression::new(&licence),
    )]));
    Ok(component)
}

/// A package's licence as SPDX writes it: older manifests have a slash for `OR`.
fn licence(package: &Package) -> Result<String> {
    let licence = package.license.as_deref();
    let licence = licence.with_context(|| format!("{} names no licence", package.name))?;
    Ok(spdx(licence))
}

fn spdx(licence: &str) -> String {
    let words = licence.split('/').map(str::trim);
    words.collect::<Vec<_>>().join(" OR ")
}

/// Writes a bill, CycloneDX 1.5. Without time and serial number: the same sources give the same bytes.
fn write_bill(path: &Path, product: Component, components: Vec<Component>) -> Result<()> {
    let bom = Bom {
        serial_number: None,
        metadata: Some(Metadata {
            component: Some(product),
            ..Metadata::default()
        }),
        components: Some(Components(components)),
        ..Bom::default()
    };
    let checked = bom.validate_version(SpecVersion::V1_5);
    ensure!(checked.passed(), "{}: {checked:?}", path.display());
    bom.output_as_json_v1_5(&mut File::create(path)?)?;
    Ok(())
}

/// Licence expressions of packages, and every text that their sources have of them, equal ones once.
fn licences(packages: &BTreeMap<Key, Package>) -> Result<String> {
    let mut list = String::new();
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for ((name, version), package) in packages {
        let licence = licence(package)?;
        writeln!(list, "{name} {version}: {licence}")?;
        let folder = package
            .manifest_path
            .parent()
            .context("a manifest has a folder")?;
        for entry in fs::read_dir(folder)?.flatten() {
            let file = entry.file_name().to_string_lossy().to_uppercase();
            let is_text = ["LICEN", "COPYING", "NOTICE", "COPYRIGHT"]
                .iter()
                .any(|start| file.starts_with(start));
            if is_text && entry.path().is_file() {
                let text = fs::read(entry.path())?;
                let text = String::from_utf8_lossy(&text).trim().to_owned();
                texts
                    .entry(text)
                    .or_default()
                    .push(format!("{name} {version}"));
            }
        }
    }
    for (text, packages) in texts {
        write!(
            list,
            "\n{}\n{}\n\n{text}\n",
            "=".repeat(72),
            packages.join(", ")
        )?;
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_of_cargo_tree_are_read_with_all_that_may_follow() {
        let of = |name: &str, version: &str| Some((name.to_owned(), version.to_owned()));
        assert_eq!(key("libm v0.2.16"), of("libm", "0.2.16"));
        assert_eq!(
            key("darling_macro v0.23.0 (proc-macro) (*)"),
            of("darling_macro", "0.23.0")
        );
        assert_eq!(key("quadrant v0.1.0 (/a/b)"), of("quadrant", "0.1.0"));
        assert_eq!(key(""), None);
    }

    #[test]
    fn a_slash_between_licences_means_either() {
        assert_eq!(spdx("MIT/Apache-2.0"), "MIT OR Apache-2.0");
        assert_eq!(spdx("Unlicense / MIT"), "Unlicense OR MIT");
        assert_eq!(spdx("MIT AND BSD-3-Clause"), "MIT AND BSD-3-Clause");
    }
}
