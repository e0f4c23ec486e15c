//! Circles of files: files that lead back to themselves by their `use` lines.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use petgraph::algo::tarjan_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use syn::{Attribute, Ident, Item, Meta, UseTree, Visibility};

use super::{ROOT, read};

/// The folders of sources.
const SOURCES: &[&str] = &[
    "core/src",
    "core/wire/src",
    "edge-app/src",
    "edge-app/pipeline/src",
    "host-tools/src",
    "host-tools/console/src",
    "host-tools/simulation/src",
    "host-tools/export/src",
    "host-tools/prediction/src",
    "host-tools/report/src",
    "host-tools/reproduce/src",
];

/// A module by its names from the root of its crate.
type Module = Vec<String>;

/// The circles that stand today, a file a line, an empty line between two circles. A circle may shrink or go, and none may come.
const STANDING: &str = include_str!("circles.txt");

#[test]
fn no_circle_of_files_comes() {
    let standing: Vec<BTreeSet<String>> = STANDING
        .trim()
        .split("\n\n")
        .map(|circle| circle.lines().map(str::to_owned).collect())
        .collect();
    let found: Vec<BTreeSet<String>> =
        SOURCES.iter().flat_map(|folder| circles(&Path::new(ROOT).join(folder))).collect();
    let new: Vec<_> = found
        .iter()
        .filter(|circle| !standing.iter().any(|standing| circle.is_subset(standing)))
        .collect();
    assert!(new.is_empty(), "files lead back to themselves by their `use` lines: {new:#?}");
    for standing in &standing {
        let remains: BTreeSet<_> =
            found.iter().filter(|circle| circle.is_subset(standing)).flatten().cloned().collect();
        assert_eq!(&remains, standing, "a circle has shrunk: shorten circles.txt");
    }
}

#[test]
fn a_circle_is_found_by_any_form_of_path_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("x/src");
    for (file, text) in [
        ("lib.rs", "mod a; mod b; mod c; pub mod d; mod e; pub use a::A;"),
        ("a.rs", "use crate::{b::B, d::{self, D as Other}}; pub struct A;"),
        ("b.rs", "fn f() {} use self::inner::In; mod inner; pub struct B;"),
        ("b/inner.rs", "use super::super::c::*; pub struct In;"),
        // Tests may look at everything.
        (
            "c.rs",
            "pub use std::fs; pub(crate) use crate::d::D; #[cfg(test)] mod tests { use crate::e::E; } mod own { use super::super::a::A; }",
        ),
        ("d/mod.rs", "pub use own::Own as D; mod own; mod other;"),
        ("d/own.rs", "use super::other::X; pub struct Own;"),
        ("d/other.rs", "use super::super::c::D;"),
        ("e.rs", "use crate::c::C; pub struct E;"),
    ] {
        fs::create_dir_all(source.join(file).parent().unwrap()).unwrap();
        fs::write(source.join(file), text).unwrap();
    }
    let mut found = circles(&source);
    found.sort();
    let names: Vec<Vec<&str>> = found
        .iter()
        .map(|circle| circle.iter().map(|file| file.rsplit_once("src/").unwrap().1).collect())
        .collect();
    assert_eq!(names, [vec!["a.rs", "b.rs", "b/inner.rs", "c.rs"], vec!["d/other.rs", "d/own.rs"]]);
}

/// The circles among the files below `source`, each with the paths of its files from [`ROOT`].
fn circles(source: &Path) -> Vec<BTreeSet<String>> {
    let files = modules(source);
    let mut graph = DiGraph::<&Module, ()>::new();
    let nodes: BTreeMap<&Module, NodeIndex> =
        files.keys().map(|module| (module, graph.add_node(module))).collect();
    let mut passed_on = BTreeMap::new();
    let mut imports = Vec::new();
    for (module, file) in &files {
        let parsed = syn::parse_file(&read(file)).expect("Rust");
        for Use { path, name } in uses(&parsed.items, module) {
            match name {
                Some(name) => _ = passed_on.insert([module.as_slice(), &[name]].concat(), path),
                None => imports.push((nodes[module], path)),
            }
        }
    }
    for (module, mut path) in imports {
        // Where a module only passes a name on, the file that has it is imported.
        let step = |path: &Module| {
            let names = (0..=path.len()).find(|&names| {
                !files.contains_key(&path[..names]) && passed_on.contains_key(&path[..names])
            })?;
            Some([passed_on[&path[..names]].as_slice(), &path[names..]].concat())
        };
        while let Some(further) = step(&path) {
            path = further;
        }
        // The longest part of the path that is a file.
        let target = (0..=path.len()).rev().find_map(|names| nodes.get(&path[..names].to_vec()));
        if let Some(&target) = target.filter(|target| **target != module) {
            graph.update_edge(module, target, ());
        }
    }
    let components = tarjan_scc(&graph).into_iter().filter(|component| component.len() > 1);
    let name = |node: NodeIndex| {
        let file = &files[graph[node]];
        file.strip_prefix(ROOT).unwrap_or(file).display().to_string()
    };
    components.map(|component| component.into_iter().map(name).collect()).collect()
}

/// The modules that are files, below `source`. `lib.rs` is the root; a program's `main.rs` imports, and nothing imports it.
fn modules(source: &Path) -> BTreeMap<Module, PathBuf> {
    let mut found = BTreeMap::new();
    let mut folders = vec![source.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a readable folder") {
            let path = entry.expect("a readable entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let relative =
                    path.strip_prefix(source).expect("below the source").with_extension("");
                let mut names: Module =
                    relative.iter().map(|name| name.to_string_lossy().into_owned()).collect();
                if names.last().is_some_and(|name| ["mod", "lib"].contains(&name.as_str())) {
                    names.pop();
                }
                found.insert(names, path);
            }
        }
    }
    found
}

/// A path that is used, from the root of its crate.
struct Use {
    path: Module,
    /// The name under which the module passes it on and does not use it itself, `pub use`.
    name: Option<String>,
}

/// What `items` of `module` use within their crate.
fn uses(items: &[Item], module: &[String]) -> Vec<Use> {
    let children = || {
        items.iter().filter_map(|item| match item {
            Item::Mod(child) => Some(child.ident.to_string()),
            _ => None,
        })
    };
    let mut found = Vec::new();
    for item in items {
        match item {
            Item::Use(item) if !is_test(&item.attrs) => {
                let mut paths = Vec::new();
                flatten(&item.tree, Vec::new(), &mut paths);
                for (path, name) in paths {
                    let mut rest = path.into_iter().peekable();
                    let mut names = module.to_vec();
                    match rest.peek().map(String::as_str) {
                        Some("crate") => names.clear(),
                        Some("self" | "super") => {}
                        Some(name) if children().any(|child| child == name) => {}
                        _ => continue,
                    }
                    while let Some(name) =
                        rest.next_if(|name| ["crate", "self", "super"].contains(&name.as_str()))
                    {
                        if name == "super" {
                            names.pop();
                        }
                    }
                    let is_private = matches!(item.vis, Visibility::Inherited);
                    let name = name.filter(|_| !is_private);
                    found.push(Use { path: names.into_iter().chain(rest).collect(), name });
                }
            }
            Item::Mod(child) if !is_test(&child.attrs) => {
                let Some((_, inline)) = &child.content else { continue };
                found.extend(uses(inline, &[module, &[child.ident.to_string()]].concat()));
            }
            _ => {}
        }
    }
    found
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string() == "test",
        _ => false,
    })
}

/// Adds the paths of `tree`, which stand behind `path`, with their names in the module; `*` has none.
fn flatten(tree: &UseTree, path: Module, paths: &mut Vec<(Module, Option<String>)>) {
    let with = |name: &Ident| [path.as_slice(), &[name.to_string()]].concat();
    match tree {
        UseTree::Path(tree) => flatten(&tree.tree, with(&tree.ident), paths),
        UseTree::Name(tree) => paths.push((with(&tree.ident), Some(tree.ident.to_string()))),
        UseTree::Rename(tree) => paths.push((with(&tree.ident), Some(tree.rename.to_string()))),
        UseTree::Glob(_) => paths.push((path, None)),
        UseTree::Group(group) => {
            group.items.iter().for_each(|tree| flatten(tree, path.clone(), paths));
        }
    }
}
