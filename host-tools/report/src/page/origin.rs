//! The lines that reproduce the result.

use maud::{Markup, html};

use super::{folded_section, missing};
use crate::document::Document;
use crate::evidence::OriginFile;

pub(super) fn section(document: &Document, name: &str, sha256: Option<&str>) -> Markup {
    let contents = html! {
            @match &document.further.origin {
                None => (missing("origin")),
                Some(origin) => {
                    p {
                        "flexid " (origin.version) " made the result by"
                        br;
                        code { (origin.command) }
                        @match &origin.date {
                            _ if document.is_static() => { " from static tests." },
                            Some(date) => { br; "from records that begin at " (date) " by the log's clock." },
                            None => { br; "from records whose clock shows no date." },
                        }
                    }
                    table.files {
                        caption { "The same files give the same numbers at the same SIMD level; only the computing time differs." }
                        thead { tr { th.left { "file" } th.left { "SHA-256" } } }
                        tbody {
                            @for file in origin.configuration.iter().chain(&origin.logs) { (row(file)) }
                            (row(&OriginFile { name: name.to_owned(), sha256: sha256.map(str::to_owned) }))
                        }
                    }
                },
            }
            p.note {
                "Computing time " (format!("{:.1}", document.found.fit.seconds)) "\u{a0}s. This page: flexid " (env!("CARGO_PKG_VERSION")) "."
            }
    };
    folded_section("origin", "Origin", &contents)
}

fn row(file: &OriginFile) -> Markup {
    html! {
        tr {
            td.left { (file.name) }
            td.left { @match &file.sha256 { Some(hash) => code { (hash) }, None => "read once, not kept" } }
        }
    }
}
