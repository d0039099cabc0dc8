//! What a scene may say of every shape, whatever its kind.

use crate::transform::TransformDesc;

/// A shape's place in the scene, apart from its form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Common<'a> {
    pub name: Option<&'a str>,
    pub material: Option<&'a str>,
    pub transform: Option<&'a TransformDesc>,
    pub visible: bool,
    pub casts_shadow: bool,
    pub receives_shadow: bool,
    pub single_sided: bool,
    /// `lights_include`, `lights_exclude`.
    pub lights: [Option<&'a [String]>; 2],
    /// `shadow_include`, `shadow_exclude`.
    pub shadows: [Option<&'a [String]>; 2],
}

/// Declares the table of a shape: its own fields, then those that all shapes have.
macro_rules! shape_table {
    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident { $($own:tt)* }
    ) => {
        $crate::describe::table! {
            $(#[doc = $doc])*
            pub struct $name {
                $($own)*
                /// What reports call it.
                pub name: Option<String> = None,
                /// The name of a material; without it, matte gray 0.8.
                pub material: Option<String> = None,
                /// Moves, turns and scales it.
                pub transform: Option<Box<$crate::transform::TransformDesc>> = None,
                /// Whether camera rays see it.
                pub visible: bool = true,
                /// Whether it stands in the way of light.
                pub casts_shadow: bool = true,
                /// Whether other things, and itself, can take its light away.
                pub receives_shadow: bool = true,
                /// Whether camera rays pass through from behind, the side its normals point away from. Light is blocked
                /// from both sides all the same.
                pub single_sided: bool = false,
                /// The names of the lights that shine on it, and no others; an empty list is none.
                pub lights_include: Option<Vec<String>> = None,
                /// The names of the lights that do not shine on it; instead of `lights_include`.
                pub lights_exclude: Option<Vec<String>> = None,
                /// The names of the lights it casts shadows for, and for no others; an empty list is none.
                pub shadow_include: Option<Vec<String>> = None,
                /// The names of the lights it casts no shadow for; instead of `shadow_include`.
                pub shadow_exclude: Option<Vec<String>> = None,
            }
        }

        impl $name {
            /// What it says that every shape can say.
            pub(crate) fn common(&self) -> $crate::shape::common::Common<'_> {
                $crate::shape::common::Common {
                    name: self.name.as_deref(),
                    material: self.material.as_deref(),
                    transform: self.transform.as_deref(),
                    visible: self.visible,
                    casts_shadow: self.casts_shadow,
                    receives_shadow: self.receives_shadow,
                    single_sided: self.single_sided,
                    lights: [self.lights_include.as_deref(), self.lights_exclude.as_deref()],
                    shadows: [self.shadow_include.as_deref(), self.shadow_exclude.as_deref()],
                }
            }
        }
    };
}

pub(crate) use shape_table;
