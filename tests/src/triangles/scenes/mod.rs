//! Scenes that sweep the state of triangle pipelines, each named after what it shows.

use super::{Gpu, Output};

mod simple;
mod topology;

/// A scene: one function that draws it on any device.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// Its name.
    pub name: &'static str,
    /// Draws it.
    pub draw: fn(&Gpu) -> Drawn,
}

/// What a scene leaves behind, unless the device lacks an optional feature that it needs.
pub type Drawn = Result<Output, Missing>;

/// An optional feature that a device does not have.
#[derive(Clone, Debug, thiserror::Error)]
#[error("the device does not have {0}")]
pub struct Missing(pub String);

/// The scene of a name.
pub fn find(name: &str) -> Option<&'static Scene> {
    ALL.iter().find(|scene| scene.name == name)
}

/// Hands the names of all scenes, grouped by module, to a macro.
#[macro_export]
macro_rules! for_each_scene {
    ($macro:ident) => {
        $macro! {
            topology: triangle_list, triangle_strip, triangle_fan;
        }
    };
}

macro_rules! list {
    ($($module:ident: $($name:ident),+;)+) => {
        /// All scenes.
        pub const ALL: &[Scene] = &[
            $($(Scene { name: stringify!($name), draw: $module::$name }),+),+
        ];
    };
}
for_each_scene!(list);
