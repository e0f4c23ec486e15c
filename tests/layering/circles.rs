//! Circles of files: files that lead back to themselves by their `use` lines.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use petgraph::algo::tarjan_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use syn::visit::{self, Visit};
use syn::{Attribute, Ident, Item, ItemMod, ItemUse, Macro, Meta, UseTree, Visibility};

use super::{ROOT, packages, read};

/// A module by its names from the root of its crate.
type Module = Vec<String>;

/// Files that lead back to themselves, by their paths.
type Circle = BTreeSet<String>;

#[test]
fn no_files_lead_back_to_themselves() {
    let sources = packages(".").into_iter().map(|(_, folder)| folder.join("src"));
    let sources = sources.filter(|source| source.is_dir());
    let found: Vec<Circle> = sources.flat_map(|source| circles(&source)).collect();
    assert!(found.is_empty(), "files lead back to themselves by their `use` lines: {found:#?}");
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
        // A name that is passed on and used, in code or in a macro, and `use` within a function.
        ("f/mod.rs", "mod g; pub use g::G; pub struct F; struct Own(G);"),
        ("f/g.rs", "use super::F; pub struct G;"),
        ("h/mod.rs", "mod i; pub use i::I; pub struct H; fn f() { println!(\"{}\", I(1)); }"),
        ("h/i.rs", "fn f() { use super::H; } pub struct I(u8);"),
        ("j/mod.rs", "mod k; pub use k::K; pub struct J;"),
        ("j/k.rs", "use super::J; pub struct K;"),
    ] {
        fs::create_dir_all(source.join(file).parent().unwrap()).unwrap();
        fs::write(source.join(file), text).unwrap();
    }
    let mut found = circles(&source);
    found.sort();
    let name = |file: &'_ String| file.rsplit_once("src/").unwrap().1.to_owned();
    let names: Vec<Vec<String>> =
        found.iter().map(|files| files.iter().map(name).collect()).collect();
    assert_eq!(
        names,
        [
            vec!["a.rs", "b.rs", "b/inner.rs", "c.rs"],
            vec!["d/other.rs", "d/own.rs"],
            vec!["f/g.rs", "f/mod.rs"],
            vec!["h/i.rs", "h/mod.rs"],
        ]
    );
}

/// The circles among the files below `source`, each with the paths of its files from [`ROOT`].
fn circles(source: &Path) -> Vec<Circle> {
    let files = modules(source);
    let mut graph = DiGraph::<&Module, ()>::new();
    let nodes: BTreeMap<&Module, NodeIndex> =
        files.keys().map(|module| (module, graph.add_node(module))).collect();
    let mut passed_on = BTreeMap::new();
    let mut imports = Vec::new();
    for (module, file) in &files {
        let parsed = syn::parse_file(&read(file)).expect("Rust");
        for Use { path, name } in Uses::of(&parsed.items, module.clone()) {
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

/// A path that a module uses, from the root of its crate.
struct Use {
    path: Module,
    /// The name under which the module passes it on, `pub use`.
    name: Option<String>,
}

/// The paths that a module uses within its crate.
struct Uses {
    module: Module,
    /// Names of the modules that it declares.
    children: BTreeSet<String>,
    found: Vec<Use>,
    /// First names of the paths in its code.
    named: BTreeSet<String>,
}

impl Uses {
    fn of(items: &[Item], module: Module) -> Vec<Use> {
        let child = |item: &Item| match item {
            Item::Mod(child) => Some(child.ident.to_string()),
            _ => None,
        };
        let children = items.iter().filter_map(child).collect();
        let mut uses = Self { module, children, found: Vec::new(), named: BTreeSet::new() };
        items.iter().for_each(|item| uses.visit_item(item));
        let is_named = |own: &&Use| own.name.as_ref().is_some_and(|name| uses.named.contains(name));
        let of_own = uses.found.iter().filter(is_named);
        let of_own: Vec<_> = of_own.map(|own| Use { path: own.path.clone(), name: None }).collect();
        uses.found.into_iter().chain(of_own).collect()
    }

    /// The path from the root of the crate; `None` for a path of another crate.
    fn resolved(&self, path: Module) -> Option<Module> {
        let mut rest = path.into_iter().peekable();
        let mut names = self.module.clone();
        match rest.peek()?.as_str() {
            "crate" => names.clear(),
            "self" | "super" => {}
            name if self.children.contains(name) => {}
            _ => return None,
        }
        while let Some(name) =
            rest.next_if(|name| ["crate", "self", "super"].contains(&name.as_str()))
        {
            if name == "super" {
                names.pop();
            }
        }
        Some(names.into_iter().chain(rest).collect())
    }
}

impl Visit<'_> for Uses {
    fn visit_item_use(&mut self, item: &ItemUse) {
        if is_test(&item.attrs) {
            return;
        }
        let mut paths = Vec::new();
        flatten(&item.tree, Vec::new(), &mut paths);
        let is_private = matches!(item.vis, Visibility::Inherited);
        for (path, name) in paths {
            if let Some(path) = self.resolved(path) {
                self.found.push(Use { path, name: name.filter(|_| !is_private) });
            }
        }
    }

    fn visit_item_mod(&mut self, child: &ItemMod) {
        if let Some((_, inline)) = child.content.as_ref().filter(|_| !is_test(&child.attrs)) {
            let module = [self.module.as_slice(), &[child.ident.to_string()]].concat();
            // Names that it passes on are named from within only.
            self.found.extend(Self::of(inline, module));
        }
    }

    fn visit_path(&mut self, path: &syn::Path) {
        self.named.extend(path.segments.first().map(|first| first.ident.to_string()));
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, own: &Macro) {
        let tokens = own.tokens.to_string();
        let words = tokens.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
        self.named.extend(words.map(str::to_owned));
        visit::visit_macro(self, own);
    }
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
