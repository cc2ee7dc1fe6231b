//! Debug probes at this computer.

use anyhow::{Context, bail};
use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem};
use probe_rs::probe::{DebugProbeInfo, DebugProbeSelector, Probe};

/// A name of a probe for a person, with what `--probe` takes.
pub(super) fn name(probe: &DebugProbeInfo) -> String {
    format!("{} {}", probe.identifier, DebugProbeSelector::from(probe))
}

/// Opens the requested probe, or the only one, and returns it with its name.
pub(super) fn open(requested: Option<&str>) -> anyhow::Result<(Probe, String)> {
    let requested = requested.map(str::parse).transpose();
    let requested: Option<DebugProbeSelector> =
        requested.context("--probe: it is VID:PID:SERIAL, or VID:PID, such as 0483:374b")?;
    let found = Lister::new().list_all_with_access();
    let probe = chosen(&found, requested.as_ref())?;
    let opened = probe.open().with_context(|| {
        format!(
            "cannot open {}: close what else uses it, a debugger or an editor",
            name(probe)
        )
    })?;
    Ok((opened, name(probe)))
}

/// Returns the requested probe, or the only one.
///
/// # Errors
/// None, several, or one that this user may not open.
fn chosen<'a>(
    found: &'a [ProbeListItem],
    requested: Option<&DebugProbeSelector>,
) -> anyhow::Result<&'a DebugProbeInfo> {
    let names = |items: &[&ProbeListItem]| {
        let names: Vec<String> = items.iter().map(|item| name(&item.info)).collect();
        names.join(", ")
    };
    let all: Vec<_> = found.iter().collect();
    let matching: Vec<_> = found
        .iter()
        .filter(|item| requested.is_none_or(|it| it.matches_probe(&item.info)))
        .collect();
    match (&matching[..], requested) {
        ([item], _) if item.accessibility == Accessibility::PermissionDenied => {
            bail!("{}", no_access(&item.info))
        }
        ([item], _) => Ok(&item.info),
        ([], Some(requested)) if !all.is_empty() => {
            bail!("no probe is {requested}; there is {}", names(&all))
        }
        ([], _) => bail!(
            "no debug probe is found: connect the board's USB socket of the ST-Link, by a cable that carries data and not power alone"
        ),
        (several, _) => bail!(
            "several debug probes: {}; choose one with --probe VID:PID:SERIAL",
            names(several)
        ),
    }
}

/// The remedy where the system keeps the probe from this user. The rule is that of https://probe.rs.
fn no_access(probe: &DebugProbeInfo) -> String {
    let (vendor, product) = (probe.vendor_id, probe.product_id);
    format!(
        "{} may not be opened by this user: allow it, once, and plug it in again\n  \
         echo 'ATTRS{{idVendor}}==\"{vendor:04x}\", ATTRS{{idProduct}}==\"{product:04x}\", MODE=\"660\", GROUP=\"plugdev\", TAG+=\"uaccess\"' \
         | sudo tee /etc/udev/rules.d/69-quadrant-probe.rules\n  sudo udevadm control --reload",
        name(probe)
    )
}

#[cfg(test)]
mod tests {
    use probe_rs::probe::stlink::StLinkFactory;

    use super::*;

    fn probe(serial: &str, accessibility: Accessibility) -> ProbeListItem {
        let serial = Some(serial.to_owned());
        let info = DebugProbeInfo::new(
            "ST-Link",
            0x0483,
            0x374b,
            serial,
            &StLinkFactory,
            None,
            false,
        );
        ProbeListItem {
            info,
            accessibility,
        }
    }

    fn refused(found: &[ProbeListItem], requested: Option<&str>) -> String {
        let requested = requested.map(|it| it.parse().unwrap());
        chosen(found, requested.as_ref()).unwrap_err().to_string()
    }

    #[test]
    fn the_only_probe_is_chosen() {
        let found = [probe("A1", Accessibility::Accessible)];
        let chosen = chosen(&found, None).unwrap();
        assert_eq!(name(chosen), "ST-Link 0483:374b:A1");
    }

    #[test]
    fn one_of_several_is_chosen_by_what_the_refusal_shows() {
        let found = ["A1", "B2"].map(|serial| probe(serial, Accessibility::Accessible));
        let said = refused(&found, None);
        assert!(
            said.contains("0483:374b:A1, ST-Link 0483:374b:B2"),
            "{said}"
        );
        assert!(said.contains("--probe"), "{said}");
        let second = "0483:374b:B2".parse().unwrap();
        let chosen = chosen(&found, Some(&second)).unwrap();
        assert_eq!(chosen.serial_number.as_deref(), Some("B2"));
        let said = refused(&found, Some("0483:374b:C3"));
        assert!(said.contains("no probe is 0483:374b:C3"), "{said}");
    }

    #[test]
    fn a_probe_that_is_missing_asks_for_a_cable() {
        for requested in [None, Some("0483:374b")] {
            let said = refused(&[], requested);
            assert!(
                said.contains("no debug probe") && said.contains("cable"),
                "{said}"
            );
        }
    }

    #[test]
    fn a_probe_without_access_gets_the_udev_rule_that_allows_it() {
        let said = refused(&[probe("A1", Accessibility::PermissionDenied)], None);
        let rule = r#"ATTRS{idVendor}=="0483", ATTRS{idProduct}=="374b", MODE="660", GROUP="plugdev", TAG+="uaccess""#;
        assert!(said.contains(rule), "{said}");
        assert!(said.contains("/etc/udev/rules.d/"), "{said}");
    }
}
