//! Within a crate, modules depend one way: no file needs, directly or by others, a file that needs it.
//!
//! A file needs another when a path in it (`crate::…`, `super::…`, or a child module's name) leads to an item there; what a `mod.rs` re-exports is
//! looked for where it is defined. A file may look up to the modules that it is part of (`super::Args`), and tests beside the code at whatever they test.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};

/// The crates, by their folders; all whose modules are looked at.
const CRATES: [&str; 13] = [
    "im-model",
    "im-observers",
    "im-control",
    "im-identify",
    "im-design",
    "im-diagnose",
    "im-fleet",
    "im-formats",
    "im-verify",
    "im-trials",
    "im-cli",
    "im-chart",
    "im-lapack",
];

/// The path of a module from the root of its crate: empty for the root.
type Module = Vec<String>;

/// What is said about modules in one file.
#[derive(Default)]
struct Mentions {
    /// Paths as they stand in the file, with their first segments resolved as far as `super`, `self` and `crate` go.
    paths: BTreeSet<Module>,
    /// Names that the file re-exports, and the path that each stands for; a glob has no name.
    exports: Vec<(Option<String>, Module)>,
    here: Module,
    children: BTreeSet<String>,
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("cfg") && a.parse_args::<syn::Ident>().is_ok_and(|name| name == "test"))
}

impl Mentions {
    /// The path from the root of the crate, for one that begins in this crate.
    fn resolved(&self, path: &[String]) -> Option<Module> {
        let mut at = self.here.clone();
        let mut rest = path;
        match rest.first().map(String::as_str) {
            Some("crate") => (at, rest) = (Vec::new(), &rest[1..]),
            Some("self") => rest = &rest[1..],
            Some("super") => {}
            Some(child) if self.children.contains(child) => {}
            _ => return None,
        }
        while rest.first().is_some_and(|s| s == "super") {
            at.pop();
            rest = &rest[1..];
        }
        Some(at.into_iter().chain(rest.iter().cloned()).collect())
    }

    fn take(&mut self, tree: &syn::UseTree, before: &mut Vec<String>, exported: bool) {
        match tree {
            syn::UseTree::Path(p) => {
                before.push(p.ident.to_string());
                self.take(&p.tree, before, exported);
                before.pop();
            }
            syn::UseTree::Group(g) => g.items.iter().for_each(|t| self.take(t, before, exported)),
            syn::UseTree::Glob(_) => self.add(before, None, exported),
            syn::UseTree::Name(n) if n.ident == "self" => self.add(before, before.last().cloned(), exported),
            syn::UseTree::Name(syn::UseName { ident }) => {
                before.push(ident.to_string());
                self.add(before, before.last().cloned(), exported);
                before.pop();
            }
            syn::UseTree::Rename(r) => {
                before.push(r.ident.to_string());
                self.add(before, Some(r.rename.to_string()), exported);
                before.pop();
            }
        }
    }

    fn add(&mut self, path: &[String], name: Option<String>, exported: bool) {
        if let Some(path) = self.resolved(path) {
            if exported {
                self.exports.push((name, path));
            } else {
                self.paths.insert(path);
            }
        }
    }
}

impl<'a> Visit<'a> for Mentions {
    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }
    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        if !is_test(&item.attrs) {
            visit::visit_item_fn(self, item);
        }
    }
    fn visit_item_impl(&mut self, item: &'a syn::ItemImpl) {
        if !is_test(&item.attrs) {
            visit::visit_item_impl(self, item);
        }
    }
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        if !is_test(&item.attrs) {
            self.take(&item.tree, &mut Vec::new(), !matches!(item.vis, syn::Visibility::Inherited));
        }
    }
    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if names.len() > 1 {
            self.add(&names, None, false);
        }
        visit::visit_path(self, path);
    }
}

/// Every file of a crate, by the path of its module. `main.rs` and `lib.rs` are the root.
fn files(folder: &Path, at: &Module, found: &mut BTreeMap<Module, PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        let below = || at.iter().cloned().chain([stem.clone()]).collect::<Module>();
        if path.is_dir() {
            files(&path, &below(), found);
        } else if path.extension().is_some_and(|e| e == "rs") && stem != "tests" {
            found.insert(if ["lib", "main", "mod"].contains(&&*stem) { at.clone() } else { below() }, path);
        }
    }
}

/// The files that each file of a crate needs.
fn needs(source: &Path) -> BTreeMap<Module, BTreeSet<Module>> {
    let mut of = BTreeMap::new();
    files(source, &Vec::new(), &mut of);
    let children = |m: &Module| {
        of.keys().filter(|c| c.len() == m.len() + 1 && c.starts_with(m)).map(|c| c[m.len()].clone()).collect::<BTreeSet<_>>()
    };
    let mentions: BTreeMap<&Module, Mentions> = of
        .iter()
        .map(|(module, path)| {
            let file =
                syn::parse_file(&std::fs::read_to_string(path).unwrap()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let mut seen = Mentions { here: module.clone(), children: children(module), ..Mentions::default() };
            seen.visit_file(&file);
            (module, seen)
        })
        .collect();
    // The file that an item's path leads to: the longest module in it, and on from there where it re-exports the item.
    fn home(path: &Module, mentions: &BTreeMap<&Module, Mentions>, depth: usize) -> Module {
        let module = (0..=path.len()).rev().map(|n| path[..n].to_vec()).find(|m| mentions.contains_key(m)).unwrap_or_default();
        let Some(item) = path.get(module.len()) else { return module };
        let onward = mentions[&module].exports.iter().find_map(|(name, to)| match name {
            Some(name) if name == item => Some(to.iter().chain(&path[module.len() + 1..]).cloned().collect()),
            _ => None,
        });
        match onward {
            Some(to) if depth < 8 => home(&to, mentions, depth + 1),
            _ => module,
        }
    }
    let others = |module: &Module, seen: &Mentions| -> BTreeSet<Module> {
        seen.paths.iter().map(|p| home(p, &mentions, 0)).filter(|m| !module.starts_with(m)).collect()
    };
    mentions.iter().map(|(module, seen)| ((*module).clone(), others(module, seen))).collect()
}

/// The files that need themselves by way of others.
fn in_circles(needs: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<&Module> {
    let comes_back = |start: &Module| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(at) = open.pop() {
            open.extend(needs[at].iter().filter(|next| seen.insert(*next)));
        }
        seen.contains(start)
    };
    needs.keys().filter(|m| comes_back(m)).collect()
}

#[test]
fn modules_depend_one_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut circles = Vec::new();
    for name in CRATES {
        let needs = needs(&root.join(name).join("src"));
        assert!(
            ["im-lapack", "im-chart"].contains(&name) || needs.values().any(|n| !n.is_empty()),
            "{name}: no path was understood"
        );
        let found = in_circles(&needs);
        if !found.is_empty() {
            let shown: Vec<String> = found.iter().map(|m| m.join("::")).collect();
            circles.push(format!("{name}: {} files: {}", shown.len(), shown.join(", ")));
        }
    }
    assert!(circles.is_empty(), "files that need each other:\n{}", circles.join("\n"));
}

#[test]
fn a_circle_is_found_through_re_exports_and_none_where_there_is_none() {
    let folder = std::env::temp_dir().join(format!("modules-{}", std::process::id()));
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    std::fs::create_dir_all(folder.join("b")).unwrap();
    write("lib.rs", "mod a; mod b; pub use b::Thing;");
    write("a.rs", "use crate::Thing; fn f() {}");
    write("b/mod.rs", "mod inner; pub use inner::Thing; #[cfg(test)] mod tests { use crate::a::f; }");
    write("b/inner.rs", "pub struct Thing;");
    assert!(in_circles(&needs(&folder)).is_empty());
    write("b/inner.rs", "pub struct Thing; fn g() { crate::a::f() }");
    let found = needs(&folder);
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(in_circles(&found), [&vec!["a".to_owned()], &vec!["b".to_owned(), "inner".to_owned()]]);
}
