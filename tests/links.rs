//! Links and names of documents lead somewhere: in each page to a file of the repository and a section of it, in code and configuration to a
//! page.

use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The files of the repository whose names end so. What a build or another program leaves is none of it.
fn files(ends: &[&str]) -> Vec<PathBuf> {
    let (mut found, mut folders) = (Vec::new(), vec![PathBuf::from(ROOT)]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            if entry.file_type().unwrap().is_dir() {
                if name != "target" && !name.starts_with('.') {
                    folders.push(entry.path());
                }
            } else if ends.iter().any(|end| name.ends_with(end)) {
                found.push(entry.path().strip_prefix(ROOT).unwrap().to_path_buf());
            }
        }
    }
    found
}

fn text(file: &Path) -> String {
    fs::read_to_string(Path::new(ROOT).join(file)).unwrap()
}

/// The part of a link that a heading has.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = kept.chars().filter(|own| own.is_alphanumeric() || " -_".contains(*own));
    kept.map(|own| if own == ' ' { '-' } else { own }).collect()
}

/// Returns whether a page has the section of a link. The page of a folder is its README.
fn has_section(page: &Path, section: &str) -> bool {
    let page = if page.is_dir() { page.join("README.md") } else { page.to_path_buf() };
    let text = fs::read_to_string(page).unwrap_or_default();
    let mut is_code = false;
    text.lines().any(|line| {
        is_code ^= line.starts_with("```");
        !is_code && line.starts_with('#') && anchor(line) == section
    })
}

#[test]
fn links_of_pages_lead_to_files_and_sections() {
    let (mut dead, mut links) = (Vec::new(), 0);
    for page in files(&[".md"]) {
        let text = text(&page);
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.contains("://") || link.contains(char::is_whitespace) {
                continue;
            }
            links += 1;
            let (path, section) = link.split_once('#').unwrap_or((link, ""));
            let folder = Path::new(ROOT).join(page.parent().unwrap());
            let to = if path.is_empty() { Path::new(ROOT).join(&page) } else { folder.join(path) };
            if !to.exists() || !section.is_empty() && !has_section(&to, section) {
                dead.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(links > 50, "{links}");
    assert!(dead.is_empty(), "{dead:#?}");
}

/// In comments and messages a page has its path in the repository; in a README that of its folder may stand for it.
#[test]
fn pages_that_code_and_configuration_name_are_there() {
    let pages = files(&[".md"]);
    let mut dead = Vec::new();
    for file in files(&[".rs", ".toml"]).iter().filter(|file| !file.ends_with("links.rs")) {
        let is_of_path = |own: char| own.is_ascii_alphanumeric() || "_-./".contains(own);
        let text = text(file);
        for word in text.split(|own| !is_of_path(own)).filter(|word| word.ends_with(".md")) {
            let end = word.trim_start_matches(['.', '/']);
            if !pages.iter().any(|page| page.ends_with(end)) {
                dead.push(format!("{}: {word}", file.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{dead:#?}");
}

#[test]
fn a_heading_gives_its_anchor() {
    assert_eq!(anchor("## Errors larger than `typical`."), "errors-larger-than-typical");
    assert!(!has_section(&Path::new(ROOT).join("host-tools"), "no-such-section"));
    assert!(has_section(&Path::new(ROOT).join("host-tools/docs/predict.md"), "map"));
}
