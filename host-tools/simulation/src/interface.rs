//! The test that tells a virtual CAN bus, on which no robot listens, from a real one.

use std::process::Command;

use serde_json::Value;

/// Why frames sent on `interface` may reach a robot; `None` if they cannot.
///
/// Only a vcan is known to lead nowhere. The kernel names the kind of a link in the netlink attribute
/// `IFLA_INFO_KIND`, which `ip -details link` prints. The folder in sysfs does not show the kind: a serial adapter
/// (slcan) has no folder of a device. A vxcan leads into another network namespace, where a gateway may forward the
/// frames.
pub fn may_be_real(interface: &str) -> Option<String> {
    let asked =
        Command::new("ip").args(["-details", "-json", "link", "show", "dev", interface]).output();
    let output = match asked {
        Ok(output) => output,
        Err(error) => {
            return Some(format!("its kind is unknown, since `ip` cannot be run ({error})"));
        }
    };
    match kind(&output.stdout) {
        Some(kind) if kind == "vcan" => None,
        Some(kind) => Some(format!("it is no virtual bus (vcan), but of kind {kind:?}")),
        None => Some("it is not known to be a virtual bus (vcan)".to_owned()),
    }
}

/// The kind of the one link in what `ip -details -json link show dev NAME` prints.
fn kind(printed: &[u8]) -> Option<String> {
    let links: Value = serde_json::from_slice(printed).ok()?;
    let [link] = links.as_array()?.as_slice() else { return None };
    Some(link["linkinfo"]["info_kind"].as_str()?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The output of `ip` of iproute2 6.1, shortened.
    #[test]
    fn the_kind_is_what_the_kernel_says() {
        let vcan = br#"[{"ifindex":2,"ifname":"vcan0","link_type":"can","linkinfo":{"info_kind":"vcan"},"mtu":72}]"#;
        assert_eq!(kind(vcan).as_deref(), Some("vcan"));
        let adapter = br#"[{"ifname":"can0","linkinfo":{"info_kind":"can","info_data":{"state":"STOPPED"}}}]"#;
        assert_eq!(kind(adapter).as_deref(), Some("can"));
        // The outputs without a kind are a serial adapter of an old kernel, nothing, two links, and words.
        let unknown: [&[u8]; 4] = [
            br#"[{"ifname":"slcan0","link_type":"can"}]"#,
            b"",
            br#"[{"linkinfo":{"info_kind":"vcan"}},{"linkinfo":{"info_kind":"can"}}]"#,
            b"Device does not exist.",
        ];
        for printed in unknown {
            assert_eq!(kind(printed), None);
        }
    }

    /// Every machine has a loopback interface, which has no kind.
    #[test]
    fn what_is_not_known_may_be_real() {
        let why = may_be_real("lo").unwrap();
        assert!(why.contains("not known") || why.contains("cannot be run"), "{why}");
        assert!(may_be_real("nocan9").is_some());
    }
}
