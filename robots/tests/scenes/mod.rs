//! Scenes that several tests stand in.

use descry_robots::sim::{Scene, SceneSpec, arrange};

const CUP: &str = r#"
[[surface]]
name = "table"
size_m = [1.6, 0.8]
height_m = 0.72
[start]
position_m = [-2.0, 0.3]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.07, height_m = 0.1 }
"#;

/// A table, a body before it, and a cup where the seed puts it.
pub fn cup_on_a_table(seed: u64) -> Scene {
    arrange(&SceneSpec::parse("scene.toml", CUP).unwrap(), seed).unwrap()
}
