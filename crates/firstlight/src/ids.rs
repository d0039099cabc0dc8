//! Indices with a type: what a number counts is part of its name.

macro_rules! id {
    ($(#[$meta:meta])* $name:ident) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The index into the scene's list.
            #[inline(always)]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(
    /// Something a ray can hit, in scene order: all shapes, then all lights.
    SurfaceId
);
id!(
    /// A light, in scene order.
    LightId
);
id!(
    /// A group of lights, in the order of their first lights.
    LightGroupId
);
id!(
    /// A material of the scene.
    MaterialId
);
id!(
    /// A texture of the scene.
    TextureId
);
