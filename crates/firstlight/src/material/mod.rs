//! Materials: how a surface turns the light that arrives into the light that leaves.

mod blinn_phong;
mod phong;

pub use blinn_phong::BlinnPhongDesc;
pub use phong::PhongDesc;

/// A material as a scene may say it.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialDesc {
    /// `[material.phong.NAME]`
    Phong(PhongDesc),
    /// `[material.blinn-phong.NAME]`
    BlinnPhong(BlinnPhongDesc),
}
