//! The page around the parts: one document without outside resources.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest as _, Sha256};

use super::parts::{NAMES, Parts};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Headings of the parts that can be folded, and whether they are open at first.
const FOLDED: [(&str, &str, bool); 2] =
    [("confidence", "Confidence of the fit", false), ("bus", "Bus", true)];

/// The Content-Security-Policy: this style, this script, this server's stream, and nothing else.
pub(super) fn policy() -> String {
    format!(
        "default-src 'none'; style-src 'sha256-{}'; script-src 'sha256-{}'; connect-src 'self'; img-src data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        digest(&[STYLE]),
        digest(&[SCRIPT])
    )
}

/// Distinguishes pages of two builds.
pub(super) fn version() -> String {
    digest(&[STYLE, SCRIPT, env!("CARGO_PKG_VERSION")])
}

/// The page with the latest parts.
pub(super) fn page(parts: &Parts, version: &str) -> Markup {
    let part = |name: &str| {
        let index = NAMES.iter().position(|known| *known == name);
        let text = index.map_or("", |index| &*parts[index]);
        html! { div id=(name) data-part {(PreEscaped(text))} }
    };
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                link rel="icon" href="data:,";
                title { "flexid" }
                style { (PreEscaped(STYLE)) }
            }
            body data-version=(version) {
                header {
                    (part("robot"))
                    button #theme type="button" { "light / dark" }
                }
                div #silent role="alert" hidden {}
                (part("link"))
                noscript { p { "Without JavaScript the page stays as it was loaded: load it again." } }
                main {
                    @for name in ["verdict", "progress", "warnings", "spectra", "parameters"] { (part(name)) }
                    p.legend {
                        "Dot: value. Line: 95 % interval, on logarithmic axes that all joints share. tx ty tz along, rx ry rz about the \
                         axes of the joint frame."
                    }
                    @for (name, heading, open) in FOLDED {
                        details open[open] { summary { (heading) } (part(name)) }
                    }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
}

/// SHA-256 of the texts, one after the other, in base 64.
fn digest(texts: &[&str]) -> String {
    let hash = texts.iter().fold(Sha256::new(), |hash, text| hash.chain_update(text));
    STANDARD.encode(hash.finalize())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn the_page_has_every_part_once_and_names_no_other_place() {
        let parts = NAMES.map(|name| Arc::from(format!("<i>{name}</i>")));
        let page = page(&parts, "v").into_string();
        for name in NAMES {
            assert_eq!(page.matches(&format!("<i>{name}</i>")).count(), 1, "{name}");
        }
        for place in ["http:", "https:", "//", "@import", "url("] {
            let page = page.replace("// ", "");
            assert!(!page.contains(place), "the page holds {place}");
        }
    }

    /// The hash of the empty text is a published one.
    #[test]
    fn the_digest_is_sha_256() {
        assert_eq!(digest(&[""]), "47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
    }
}
