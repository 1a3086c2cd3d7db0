//! Modules of a crate, their dependencies, and their declared types, from the source.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;
use quote::ToTokens;

/// Modules of a crate by path (empty for the root), each with the modules it names.
pub struct Modules(BTreeMap<String, BTreeSet<String>>);

impl Modules {
    /// Modules of the sources below a folder.
    pub fn of(folder: &Path, files: &[PathBuf]) -> Self {
        let words: BTreeMap<String, Vec<String>> =
            files.iter().map(|file| (module(folder, file), words(&parsed(file)))).collect();
        let known: BTreeSet<&String> = words.keys().collect();
        let uses = |(own, words): (&String, &Vec<String>)| {
            let named = named(own, words).into_iter().filter_map(|path| nearest(&path, &known));
            (own.clone(), named.filter(|other| other != own).collect())
        };
        Self(words.iter().map(uses).collect())
    }

    /// Modules with the modules that each names.
    pub fn each(&self) -> impl Iterator<Item = (&str, &BTreeSet<String>)> {
        self.0.iter().map(|(module, others)| (module.as_str(), others))
    }

    /// Largest strongly connected set of modules.
    pub fn largest_circle(&self) -> Vec<&str> {
        let mut graph = DiGraphMap::<&str, ()>::new();
        for (module, others) in self.each() {
            graph.add_node(module);
            others.iter().for_each(|other| _ = graph.add_edge(module, other, ()));
        }
        let mut largest = tarjan_scc(&graph).into_iter().max_by_key(Vec::len).unwrap_or_default();
        largest.sort_unstable();
        largest
    }

    /// Cycle as text: each module with the cycle's modules that it names.
    pub fn drawn(&self, circle: &[&str]) -> String {
        let line = |module: &&str| {
            let within: Vec<&str> =
                self.0[*module].iter().map(String::as_str).filter(|other| circle.contains(other)).collect();
            format!("  {} -> {}", shown(module), within.into_iter().map(shown).collect::<Vec<_>>().join(", "))
        };
        circle.iter().map(line).collect::<Vec<_>>().join("\n")
    }
}

fn shown(module: &str) -> &str {
    if module.is_empty() { "(root)" } else { module }
}

/// Module path of a file.
fn module(folder: &Path, file: &Path) -> String {
    let below = file.strip_prefix(folder).expect("a source lies below its folder").with_extension("");
    let mut parts: Vec<String> = below.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if parts.last().is_some_and(|last| last == "mod" || last == "lib") {
        parts.pop();
    }
    parts.join("::")
}

/// Parsed file without its tests.
fn parsed(file: &Path) -> syn::File {
    let text = fs::read_to_string(file).expect("a source file is text");
    let mut parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let is_test = |item: &syn::Item| match item {
        syn::Item::Mod(of) => of.attrs.iter().any(|a| a.to_token_stream().to_string().contains("cfg (test)")),
        _ => false,
    };
    parsed.items.retain(|item| !is_test(item));
    parsed
}

/// Tokens of a file, brackets apart.
fn words(file: &syn::File) -> Vec<String> {
    let mut text = file.to_token_stream().to_string();
    for sign in ["{", "}", "(", ")", "[", "]", "<", ">", ",", ";", "&", "*", "!"] {
        text = text.replace(sign, &format!(" {sign} "));
    }
    text.split_whitespace().map(str::to_string).collect()
}

/// Paths within the crate that a module names: from `crate`, `super`, `self`, and from declared
/// child modules.
fn named(own: &str, words: &[String]) -> Vec<Vec<String>> {
    let own: Vec<String> = own.split("::").filter(|part| !part.is_empty()).map(str::to_string).collect();
    let declared: BTreeSet<&String> =
        words.windows(3).filter(|w| w[0] == "mod" && w[2] == ";").map(|w| &w[1]).collect();
    let mut paths = Vec::new();
    for (at, word) in words.iter().enumerate() {
        let is_head = at == 0 || words[at - 1] != "::";
        if !is_head || words.get(at + 1).is_none_or(|next| next != "::") {
            continue;
        }
        let from = match word.as_str() {
            "crate" => Vec::new(),
            "self" => own.clone(),
            "super" => own[..own.len().saturating_sub(1)].to_vec(),
            _ if declared.contains(word) => [own.clone(), vec![word.clone()]].concat(),
            _ => continue,
        };
        branches(&words[at + 2..], from, &mut paths);
    }
    paths
}

/// Collects the paths that continue from the head of a token list; returns the number of tokens
/// read.
fn branches(words: &[String], mut path: Vec<String>, paths: &mut Vec<Vec<String>>) -> usize {
    let mut at = 0;
    loop {
        match words.get(at).map(String::as_str) {
            Some("super") => _ = path.pop(),
            Some("{") => {
                at += 1;
                while words.get(at).is_some_and(|word| word != "}") {
                    at += branches(&words[at..], path.clone(), paths).max(1);
                    at += usize::from(words.get(at).is_some_and(|word| word == ","));
                }
                return at + 1;
            }
            Some(word) => path.push(word.to_string()),
            None => return at,
        }
        at += 1;
        if words.get(at).is_none_or(|word| word != "::") {
            paths.push(path);
            while words.get(at).is_some_and(|word| ![",", "}", ";"].contains(&word.as_str())) {
                at += 1;
            }
            return at;
        }
        at += 1;
    }
}

/// Module that a path leads to: its longest prefix that is a module.
fn nearest(path: &[String], known: &BTreeSet<&String>) -> Option<String> {
    (0..=path.len()).rev().map(|n| path[..n].join("::")).find(|start| known.contains(start))
}

/// Names of the public types that a file declares.
pub fn public_types(file: &Path) -> Vec<String> {
    fn of(items: &[syn::Item], names: &mut Vec<String>) {
        for item in items {
            let (vis, name) = match item {
                syn::Item::Struct(i) => (&i.vis, &i.ident),
                syn::Item::Enum(i) => (&i.vis, &i.ident),
                syn::Item::Trait(i) => (&i.vis, &i.ident),
                syn::Item::Type(i) => (&i.vis, &i.ident),
                syn::Item::Mod(i) => {
                    i.content.iter().for_each(|(_, items)| of(items, names));
                    continue;
                }
                _ => continue,
            };
            if matches!(vis, syn::Visibility::Public(_)) {
                names.push(name.to_string());
            }
        }
    }
    let mut names = Vec::new();
    of(&parsed(file).items, &mut names);
    names
}
