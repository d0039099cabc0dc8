//! The scenes that come with the program.

/// A scene that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Builtin {
    /// `config11`: camera 1, light 1.
    pub name: &'static str,
    /// One line about it.
    pub title: &'static str,
    /// Its text, in TOML, complete in itself.
    pub text: &'static str,
}

macro_rules! builtin {
    ($($name:literal, $title:literal;)*) => {
        &[$(Builtin {
            name: $name,
            title: $title,
            text: include_str!(concat!("builtin/", $name, ".toml")),
        }),*]
    };
}

const BUILTIN: &[Builtin] = builtin! {
    "config11", "four checkered spheres in a box, from the front, under a white light";
    "config12", "four checkered spheres in a box, from the front, under a yellow light";
    "config13", "four checkered spheres in a box, from the front, under a green-blue light";
    "config21", "four checkered spheres in a box, from the upper right, under a white light";
    "config22", "four checkered spheres in a box, from the upper right, under a yellow light";
    "config23", "four checkered spheres in a box, from the upper right, under a green-blue light";
    "config31", "four checkered spheres in a box, from below, under a white light";
    "config32", "four checkered spheres in a box, from below, under a yellow light";
    "config33", "four checkered spheres in a box, from below, under a green-blue light";
};

/// The scenes that come with the program: `config11` to `config33`, camera first, light second.
pub fn builtin_scenes() -> &'static [Builtin] {
    BUILTIN
}
