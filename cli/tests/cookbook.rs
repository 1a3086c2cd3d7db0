//! The cookbook, recipe by recipe: its commands run, its outputs compared.

use std::path::Path;
use std::process::Command;

use crate::tutorial::{follow, page};

/// Copies a folder recursively.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder can be made");
    for entry in std::fs::read_dir(from).expect("it is a folder").flatten() {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy(&from, &to);
        } else {
            std::fs::copy(from, to).expect("a file can be copied");
        }
    }
}

/// Follows one section in a copy of the cookbook's folders.
fn recipe(number: usize) {
    if Command::new("python3").arg("--version").output().is_err() {
        println!("SKIPPED: there is no python3");
        return;
    }
    let text = page("docs/cookbook.md");
    let (_, rest) = text.split_once(&format!("\n## {number}. ")).expect("the recipe is there");
    let section = rest.split("\n## ").next().unwrap_or_default();
    let folder = tempfile::tempdir().expect("a folder can be made");
    let cookbook = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/cookbook");
    copy(&cookbook, &folder.path().join("cookbook"));
    follow(section, folder.path());
}

macro_rules! recipes {
    ($($name:ident $number:literal)*) => {
        const RECIPES: &[usize] = &[$($number),*];
        $(#[test]
        fn $name() {
            recipe($number);
        })*
    };
}

recipes! {
    ferry 1
    fuel 2
    breakfast 3
    market 4
    wishes 5
    roads 6
    shelf 7
    courier 8
    tea 9
    benches 10
    pour 11
    dust 12
}

#[test]
fn every_folder_is_a_recipe_and_every_recipe_a_test() {
    let text = page("docs/cookbook.md");
    assert_eq!(text.matches("\n## ").count(), RECIPES.len());
    let folders = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/cookbook"));
    for folder in folders.expect("it is a folder").flatten() {
        let name = folder.file_name().display().to_string();
        assert!(text.contains(&format!("cookbook/{name}")), "{name} is in no recipe");
    }
}
