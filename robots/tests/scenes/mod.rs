//! Scenes shared by several tests.

#![allow(dead_code)]

use descry_robots::sim::{Scene, SceneSpec, arrange};

/// A scene with a table; the given text starts in its sixth line.
macro_rules! on_a_table {
    ($rest:literal) => {
        concat!("\n[[surface]]\nname = \"table\"\nsize_m = [1.6, 0.8]\nheight_m = 0.72\n", $rest)
    };
}
pub(crate) use on_a_table;

const CUP: &str = on_a_table!(
    r#"[start]
position_m = [-2.0, 0.3]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.07, height_m = 0.1 }
"#
);

/// A table, a body in front of it, and a cup placed by the seed.
pub fn cup_on_a_table(seed: u64) -> Scene {
    arrange(&SceneSpec::parse("scene.toml", CUP).unwrap(), seed).unwrap()
}
