//! Checks that scenes are readable, and that the default scene has the places named in
//! `domain.toml`.

use descry_planner::{Diagnostic, Source, Span};
use descry_robots::sim::SceneSpec;

use super::Check;
use crate::lexicon::TOLD_APART;
use crate::load::Domain;
use crate::symbol::symbol;

/// Index of the first scene among the sources of the findings, behind `domain.pddl` and `domain.toml`.
const FIRST_SCENE: usize = 2;

/// Texts of the scenes, as sources of findings.
pub(super) fn scenes(domain: &Domain) -> Vec<Source> {
    let source = |(name, text): (&String, &String)| {
        let path = format!("scenes/{name}.toml");
        let shown = domain.files.get(&path).map_or(&path, |(shown, _)| shown);
        Source::new(shown.clone(), text.clone())
    };
    domain.scenes.iter().map(source).collect()
}

/// Byte offset of a line and a column, both counted from 1.
fn byte(text: &str, line: usize, column: usize) -> usize {
    let before: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let within = text[before..].char_indices().nth(column.saturating_sub(1));
    within.map_or(before, |(at, _)| before + at)
}

impl Check<'_> {
    /// Checks that the default scene exists, that every scene can be read, and that surfaces and
    /// expected objects named in `domain.toml` exist.
    pub(super) fn scenes(&self) -> Vec<Diagnostic> {
        let (domain, config) = (self.domain, &self.domain.config);
        let mut list = Vec::new();
        if !config.scene.is_empty() && !domain.scenes.contains_key(&config.scene) {
            let message = format!("there is no scenes/{}.toml", config.scene);
            let help = self.known(&config.scene, domain.scenes.keys().map(String::as_str));
            list.push(self.error("no-scene", message, self.toml.at(&["scene"]), help));
        }
        for (n, source) in scenes(domain).into_iter().enumerate() {
            let Err(wrong) = SceneSpec::parse(&source.name, &source.text) else { continue };
            let start = byte(&source.text, wrong.line, wrong.column);
            let rest = source.text[start..].lines().next().map_or(0, |line| line.trim_end().len());
            let at = |byte: usize| u32::try_from(byte).unwrap_or(u32::MAX);
            let span = Span { source: at(FIRST_SCENE + n), start: at(start), end: at(start + rest) };
            list.push(self.error("scene", wrong.problem, span, wrong.mend));
        }
        if let Some(unclear) = self.places.unclear() {
            let message = format!("{unclear} in scenes/{}.toml", config.scene);
            list.push(self.error("same-name", message, self.toml.at(&["scene"]), TOLD_APART));
        }
        if self.places.surfaces.is_empty() {
            return list;
        }
        let scene = &config.scene;
        let surfaces = || self.places.surfaces.iter().map(String::as_str);
        let is_one = |name: &str| surfaces().any(|s| symbol(s) == symbol(name));
        for (n, name) in config.surfaces.iter().enumerate().filter(|(_, name)| !is_one(name)) {
            let message = format!("the scene {scene} has no surface \"{name}\"");
            let help =
                format!("{}; surfaces of the map need not be named here", self.known(name, surfaces()));
            list.push(self.error("no-surface", message, self.toml.at(&["surfaces", &n.to_string()]), help));
        }
        list.extend(self.expectations());
        list
    }

    fn expectations(&self) -> Vec<Diagnostic> {
        let mut list = Vec::new();
        for (n, expected) in self.domain.config.expect.iter().enumerate() {
            let n = n.to_string();
            let places = || self.places.surfaces.iter().chain(&self.places.rooms).map(String::as_str);
            if places().all(|place| symbol(place) != symbol(&expected.at)) {
                let message = format!("nothing is expected at \"{}\": there is no such place", expected.at);
                let place = self.toml.at(&["expect", &n, "at"]);
                let help = self.known(&expected.at, places());
                list.push(Diagnostic::warning("no-place", message, place, "here").with_help(help));
            }
            let Some(what) = &expected.what else { continue };
            if self.lexicon.of_type("thing").iter().all(|thing| thing.symbol != symbol(what)) {
                let message = format!("\"{what}\" is the name of no object and of no kind");
                let place = self.toml.at(&["expect", &n, "what"]);
                let things = self.lexicon.of_type("thing").iter().filter_map(|t| t.names.first());
                let help = self.known(what, things.map(String::as_str));
                list.push(Diagnostic::warning("no-thing", message, place, "here").with_help(help));
            }
        }
        list
    }
}
