//! What a film can hold beside the picture: one plane of numbers for each buffer.

use super::cryptomatte::Named;
use super::png::Depth;
use super::{FileSettings, Format, ImageError, Receipt, Window};
use crate::describe::{Words, words};
use crate::parallel;

words! {
    /// A buffer: what a plane of the film says of each pixel.
    ///
    /// `color`, `alpha` and the terms that `color` is the sum of, `background` to `rest`, are means over the pixel, and
    /// so are `shadow`, coverage, Cryptomatte and what ends in `:filtered`. All others are of its centre ray, and never
    /// averaged: what it meets first, a shape or a visible light, as the camera sees it. Where it meets nothing,
    /// `depth` and `distance` are infinite and all others 0; so are the means where no ray meets anything.
    pub enum Plane {
        /// The picture, with its alpha.
        Color = "color",
        /// The share of the pixel that is covered; 1 where the scene is not transparent.
        Alpha = "alpha",
        /// What of the picture is the scene's background.
        Background = "background",
        /// What of it is lights that are seen.
        Emission = "emission",
        /// What of it is light from everywhere, the scene's `ambient`.
        Ambient = "ambient",
        /// What of it lights send by the diffuse reflection of surfaces, of all lights together.
        Diffuse = "diffuse",
        /// What of it lights send by highlights, of all lights together.
        Specular = "specular",
        /// What of it lights send that are not kept apart: `color` without `background`, `emission`, `ambient` and the
        /// lights, or else groups of lights, that are asked for beside it. Added to those it is `color`.
        Rest = "rest",
        /// Of what all lights together would send if nothing cast shadows, the share that arrives, 0 to 1; 0 where
        /// nothing would.
        Shadow = "shadow",
        /// How far away it is along the line of sight of the camera, as in a depth map: from the eye's plane, or the
        /// film of an orthographic camera.
        Depth = "depth",
        /// How far away it is along the ray.
        Distance = "distance",
        /// Where it is.
        Position = "position",
        /// Where it is, from the camera: x to the right, y up, z backwards.
        PositionCamera = "position-camera",
        /// Where it is in the space that the object was described in, before its transform and those of the instances
        /// around it; 0 on lights.
        PositionObject = "position-object",
        /// The shading normal, unit, on the side that is seen: what light sees of a smooth mesh.
        Normal = "normal",
        /// The shading normal from the camera: x to the right, y up, z backwards.
        NormalCamera = "normal-camera",
        /// The shading normal in the space that the object was described in; 0 on lights.
        NormalObject = "normal-object",
        /// The geometric normal, unit, on the side that is seen: of the facet itself.
        NormalGeometric = "normal-geometric",
        /// The geometric normal from the camera: x to the right, y up, z backwards.
        NormalGeometricCamera = "normal-geometric-camera",
        /// The direction, unit, in which u grows on the surface; 0 where there is none, and on lights.
        Tangent = "tangent",
        /// The texture coordinate; 0 on lights.
        Uv = "uv",
        /// On a triangle, how much its second and its third corner count; 0 on all else.
        Barycentric = "barycentric",
        /// The diffuse colour of its material there, texture and vertex colour looked up; 0 on lights.
        Albedo = "albedo",
        /// The roughness of its material there, 0 to 1, the root of GGX's alpha; of the kinds with a `shininess` that
        /// of the same width: (2 / (s + 2))^(1/4), s the exponent of Blinn-Phong or 4 times that of Phong. 1 where
        /// there is no highlight; 0 on lights.
        Roughness = "roughness",
        /// How much of a metal its material is there, 0 to 1; 0 of all kinds but metallic-roughness, and on lights.
        Metallic = "metallic",
        /// The alpha, 0 to 1, of the first surface there, be it a veil that all other buffers pass through: 1 of what
        /// is opaque, and of lights.
        Opacity = "opacity",
        /// Which object it is, in scene order: 1 for the first shape, and the lights after all shapes. Each instance of
        /// a shape is an object of its own.
        ObjectId = "object-id",
        /// Which instance placed it, in scene order, of nested ones the outermost: 1 for the first; 0 on what no
        /// instance placed.
        InstanceId = "instance-id",
        /// Which material it has, in the order of the scene: 1 for the first; 0 on lights.
        MaterialId = "material-id",
        /// Which triangle of its mesh, or point of its point set, in the order of its file: 1 for the first; 0 on all
        /// else.
        PrimitiveId = "primitive-id",
        /// Which side is seen: 1 for the front, 2 for the back.
        FaceOrientation = "face-orientation",
        /// The way in the picture, in pixels to the right and down, from here to where the same point of the same thing
        /// is at the moment, or for the camera, that `motion_to` names. `visible` is 1 if it is seen there, 0 if
        /// something hides it or it is outside of the picture, and -1 if it has no place there, with a way of 0. What
        /// meets nothing is infinitely far away.
        Motion = "motion",
        /// The same the other way: of the picture that `motion_to` names, pixel by pixel of that picture, the way to
        /// this one.
        MotionBackward = "motion-backward",
        /// The mean of `depth` over those of the pixel's camera rays that meet something.
        FilteredDepth = "depth:filtered",
        /// The same of `distance`.
        FilteredDistance = "distance:filtered",
        /// The same of `position`.
        FilteredPosition = "position:filtered",
        /// The same of `position-camera`.
        FilteredPositionCamera = "position-camera:filtered",
        /// The same of `normal`: shorter than 1 where the surface bends.
        FilteredNormal = "normal:filtered",
        /// The same of `normal-camera`.
        FilteredNormalCamera = "normal-camera:filtered",
        /// The same of `normal-geometric`.
        FilteredNormalGeometric = "normal-geometric:filtered",
        /// The same of `normal-geometric-camera`.
        FilteredNormalGeometricCamera = "normal-geometric-camera:filtered",
        /// The same of `uv`.
        FilteredUv = "uv:filtered",
        /// The same of `albedo`.
        FilteredAlbedo = "albedo:filtered",
        /// The same of `roughness`.
        FilteredRoughness = "roughness:filtered",
        /// The same of `metallic`.
        FilteredMetallic = "metallic:filtered",
        /// The share of the pixel's camera rays that meet nothing. With the coverage of each object it adds up to 1.
        BackgroundCoverage = "coverage:background",
        /// Cryptomatte of objects: the six with the greatest shares of the pixel's camera rays, each as the hash of its
        /// name and its share.
        CryptoObject = "crypto-object",
        /// Cryptomatte of the outermost instances; what no instance placed has no share.
        CryptoInstance = "crypto-instance",
        /// Cryptomatte of materials; lights have no share.
        CryptoMaterial = "crypto-material",
        /// How much work the pixel took, as in `--heat`: rays that were asked, from the camera and to lights.
        Rays = "rays",
    }
}

/// How a pixel of a plane comes about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// The mean over the pixel's camera rays.
    Filtered,
    /// What its centre ray meets.
    Center,
    /// Counted over all that was done for it.
    Counted,
}

/// The numbers of a plane: the window's rows from the top, each from the left, the channels of a pixel side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaneNumbers<'a> {
    /// 32-bit floats.
    Floats(&'a [f32]),
    /// 32-bit whole numbers: ids.
    Wholes(&'a [u32]),
}

impl Plane {
    /// The names of its channels, as in EXR files after `NAME.`; those of `color` and of Cryptomatte stand there alone.
    pub fn channels(self) -> &'static [&'static str] {
        use Plane::*;
        match self.of_each_ray().unwrap_or(self) {
            Color => &["R", "G", "B", "A"],
            Alpha => &["A"],
            Background | Emission | Ambient | Diffuse | Specular | Rest | Albedo => &["R", "G", "B"],
            Shadow | Roughness | Metallic => &["Y"],
            Opacity => &["A"],
            Depth | Distance => &["Z"],
            Position | PositionCamera | PositionObject => &["X", "Y", "Z"],
            Normal | NormalCamera | NormalObject | NormalGeometric | NormalGeometricCamera | Tangent => {
                &["X", "Y", "Z"]
            }
            Uv | Barycentric => &["U", "V"],
            Motion | MotionBackward => &["X", "Y", "visible"],
            ObjectId | InstanceId | MaterialId | PrimitiveId | FaceOrientation => &["ID"],
            Rays => &["N"],
            BackgroundCoverage => &["A"],
            CryptoObject => Named::Object.channels(),
            CryptoInstance => Named::Instance.channels(),
            CryptoMaterial => Named::Material.channels(),
            _ => unreachable!("a mean is of a plane that is none"),
        }
    }

    /// Whether its numbers are whole.
    pub fn is_whole(self) -> bool {
        use Plane::*;
        matches!(self, ObjectId | InstanceId | MaterialId | PrimitiveId | FaceOrientation)
    }

    /// The type of its numbers, as numpy names it.
    pub fn number_type(self) -> &'static str {
        if self.is_whole() { "uint32" } else { "float32" }
    }

    /// What its numbers count; "1" for none.
    pub fn unit(self) -> &'static str {
        use Plane::*;
        match self.of_each_ray().unwrap_or(self) {
            Color | Background | Emission | Ambient | Diffuse | Specular | Rest => "linear Rec. 709, premultiplied",
            Albedo => "linear Rec. 709",
            Depth | Distance | Position | PositionCamera | PositionObject => "m",
            Motion | MotionBackward => "px",
            Rays => "rays",
            _ => "1",
        }
    }

    /// The space of its coordinates; "-" for none.
    pub fn space(self) -> &'static str {
        use Plane::*;
        match self.of_each_ray().unwrap_or(self) {
            Position | Normal | NormalGeometric | Tangent => "world",
            Depth | PositionCamera | NormalCamera | NormalGeometricCamera => "camera",
            PositionObject | NormalObject => "object",
            Uv => "texture",
            Motion | MotionBackward => "picture",
            _ => "-",
        }
    }

    /// What its numbers mean beside their unit and space: axes, signs, where they count from.
    pub fn convention(self) -> &'static str {
        use Plane::*;
        match self.of_each_ray().unwrap_or(self) {
            Color => "colour times alpha",
            Alpha => "0 nothing, 1 all of the pixel",
            Background | Emission | Ambient | Diffuse | Specular | Rest => "a term of color",
            Shadow => "0 nothing arrives, 1 all",
            Albedo => "diffuse reflectance",
            Roughness => "0 smooth, 1 rough",
            Metallic => "0 dielectric, 1 metal",
            Opacity => "0 lets all light through, 1 none",
            Depth => "along the line of sight, infinite for nothing",
            Distance => "along the ray, infinite for nothing",
            Position | PositionObject | Normal | NormalObject | NormalGeometric | Tangent => "right-handed, y up",
            PositionCamera | NormalCamera | NormalGeometricCamera => "x right, y up, z backwards",
            Uv => "u right, v up",
            Barycentric => "weights of the second and third corner",
            ObjectId | InstanceId | MaterialId | PrimitiveId => "1 for the first, 0 for none",
            FaceOrientation => "1 front, 2 back, 0 for none",
            Motion | MotionBackward => "x right, y down; visible 1, hidden 0, nowhere -1",
            BackgroundCoverage => "0 nothing, 1 all of the pixel",
            CryptoObject | CryptoInstance | CryptoMaterial => "Cryptomatte: hash and share, by share",
            Rays => "counted",
            _ => unreachable!("a mean is of a plane that is none"),
        }
    }

    /// How a pixel of it comes about.
    pub fn sampling(self) -> Sampling {
        match self {
            Plane::Color | Plane::Alpha | Plane::Rest | Plane::Shadow => Sampling::Filtered,
            plane if plane.is_of_terms() || plane.is_of_all_rays() => Sampling::Filtered,
            Plane::Rays => Sampling::Counted,
            _ => Sampling::Center,
        }
    }

    /// What it is, in words.
    pub fn about(self) -> String {
        let choice = Plane::CHOICES.iter().find(|choice| choice.word == self.name());
        choice.map_or(String::new(), |choice| choice.doc.join(" ").split_whitespace().collect::<Vec<_>>().join(" "))
    }

    /// Whether it is the sum of some of the terms of `color`.
    pub(crate) fn is_of_terms(self) -> bool {
        use Plane::*;
        matches!(self, Background | Emission | Ambient | Diffuse | Specular)
    }

    /// What of each camera ray it is the mean of; `None` if it is no such mean.
    pub(crate) fn of_each_ray(self) -> Option<Plane> {
        use Plane::*;
        match self {
            FilteredDepth => Some(Depth),
            FilteredDistance => Some(Distance),
            FilteredPosition => Some(Position),
            FilteredPositionCamera => Some(PositionCamera),
            FilteredNormal => Some(Normal),
            FilteredNormalCamera => Some(NormalCamera),
            FilteredNormalGeometric => Some(NormalGeometric),
            FilteredNormalGeometricCamera => Some(NormalGeometricCamera),
            FilteredUv => Some(Uv),
            FilteredAlbedo => Some(Albedo),
            FilteredRoughness => Some(Roughness),
            FilteredMetallic => Some(Metallic),
            _ => None,
        }
    }

    /// Why there is no [mean](Self::of_each_ray) of it over camera rays.
    pub(crate) fn why_no_mean(self) -> String {
        let name = self.name();
        match self.sampling() {
            Sampling::Filtered => format!("\"{name}\" is a mean over the pixel as it is"),
            Sampling::Counted => format!("\"{name}\" is counted over the whole pixel as it is"),
            Sampling::Center if self.is_whole() => {
                "an id has no mean; how much of the pixel each thing has is in \"coverage:NAME\" and \"crypto-object\""
                    .to_owned()
            }
            Sampling::Center if self == Plane::Opacity => {
                "how much all surfaces of the pixel cover of it is in \"alpha\"".to_owned()
            }
            Sampling::Center => format!("\"{name}\" is in a space of each object's own, and has no mean over several"),
        }
    }

    /// Whether all camera rays of a pixel together say it, without light.
    pub(crate) fn is_of_all_rays(self) -> bool {
        use Plane::*;
        self.of_each_ray().is_some()
            || matches!(self, BackgroundCoverage | CryptoObject | CryptoInstance | CryptoMaterial)
    }

    /// Whether its channels have names of their own in files, without that of a layer before them.
    #[cfg_attr(not(feature = "exr"), allow(dead_code, reason = "only EXR files have channels"))]
    pub(crate) fn names_channels(self) -> bool {
        self == Plane::Color || Named::of_layer(self).is_some()
    }

    /// Whether the centre ray of a pixel says it.
    pub(crate) fn is_of_center(self) -> bool {
        self.sampling() == Sampling::Center
    }

    /// Whether it takes light: neither the centre ray of a pixel alone says it, nor all its camera rays together.
    pub fn is_lit(self) -> bool {
        !self.is_of_center() && !self.is_of_all_rays()
    }

    /// Whether it leads to another moment or camera.
    pub fn is_of_motion(self) -> bool {
        matches!(self, Plane::Motion | Plane::MotionBackward)
    }

    /// Bytes of a pixel of it.
    pub(crate) fn bytes(self) -> usize {
        self.channels().len() * size_of::<f32>()
    }
}

impl Sampling {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Sampling::Filtered => "filtered",
            Sampling::Center => "center",
            Sampling::Counted => "counted",
        }
    }
}

impl PlaneNumbers<'_> {
    /// How many there are.
    pub fn count(self) -> usize {
        match self {
            PlaneNumbers::Floats(numbers) => numbers.len(),
            PlaneNumbers::Wholes(numbers) => numbers.len(),
        }
    }

    /// Their bytes, the lowest of each first.
    pub fn to_le_bytes(self) -> Vec<u8> {
        fn bytes<T: Copy>(numbers: &[T], of: impl Fn(T) -> [u8; 4]) -> Vec<u8> {
            numbers.iter().map(|n| of(*n)).collect::<Vec<[u8; 4]>>().into_flattened()
        }
        match self {
            PlaneNumbers::Floats(numbers) => bytes(numbers, f32::to_le_bytes),
            PlaneNumbers::Wholes(numbers) => bytes(numbers, u32::to_le_bytes),
        }
    }

    /// The same as a file holds them that may have floats of 16 bits.
    #[cfg_attr(not(feature = "exr"), allow(unused_variables, reason = "only EXR files hold such floats"))]
    pub(super) fn stored_bytes(self, half: bool) -> Vec<u8> {
        match self {
            #[cfg(feature = "exr")]
            PlaneNumbers::Floats(numbers) if half => super::exr::half_bytes(numbers),
            PlaneNumbers::Floats(_) | PlaneNumbers::Wholes(_) => self.to_le_bytes(),
        }
    }
}

/// Planes that go to a file together.
pub(crate) struct PlaneFile<'a> {
    /// The width and height of the whole film.
    #[cfg_attr(not(feature = "exr"), allow(dead_code, reason = "only EXR files have a place for it"))]
    pub film: [u32; 2],
    /// The part of it that the planes hold.
    pub window: Window,
    pub planes: &'a [NamedPlane<'a>],
}

/// A plane with its name in files.
#[derive(Clone, Copy, Debug)]
pub struct NamedPlane<'a> {
    /// The name: of a layer of EXR files, of an array of NPZ files.
    pub name: &'a str,
    /// What it is, or is like: its channels, its unit and its sampling.
    pub plane: Plane,
    /// Its numbers.
    pub numbers: PlaneNumbers<'a>,
}

impl<'a> NamedPlane<'a> {
    /// By the name of what it is.
    pub fn new(plane: Plane, numbers: PlaneNumbers<'a>) -> Self {
        NamedPlane { name: plane.name(), plane, numbers }
    }
}

impl PlaneFile<'_> {
    /// The bytes of a file. The planes fill the window.
    pub fn encode(&self, format: Format, settings: &FileSettings, receipt: &Receipt) -> Result<Vec<u8>, ImageError> {
        receipt.check()?;
        settings.check()?;
        if let [NamedPlane { name, plane, .. }] = self.planes
            && let Some(reason) = format.refuses(*plane)
        {
            return Err(ImageError::NotHeld { format, buffer: (*name).to_owned(), reason });
        }
        if let Some(reason) = self.planes.iter().find_map(|plane| format.refuses_name(plane.name)) {
            return Err(ImageError::Name { format, reason });
        }
        let whole = |receipt| self.described(receipt, &FileSettings { half: false, ..*settings });
        match (format, self.planes) {
            #[cfg(feature = "exr")]
            (Format::Exr, _) => super::exr::encode(self, settings, &self.described(receipt, settings)),
            #[cfg(not(feature = "exr"))]
            (Format::Exr, _) => Err(ImageError::WithoutExr),
            (Format::Npz, _) => super::npz::encode(self, &whole(receipt)),
            (Format::Npy, [plane]) => Ok(super::npz::encode_one(self.window, plane, &whole(receipt))),
            (Format::Png8, [plane]) => super::quantized::png(self.window, plane, Depth::Eight, settings, receipt),
            (Format::Png16, [plane]) => super::quantized::png(self.window, plane, Depth::Sixteen, settings, receipt),
            (Format::Hdr, [plane]) => Ok(super::quantized::hdr(self.window, plane, &receipt.shown_by(None))),
            (Format::Jpeg, [plane]) => super::quantized::jpeg(self.window, plane, settings, receipt),
            (Format::Npy | Format::Png8 | Format::Png16 | Format::Hdr | Format::Jpeg, _) => {
                Err(ImageError::OneBuffer { format })
            }
        }
    }

    /// The receipt with what each plane is and the hash of its bits.
    fn described(&self, receipt: &Receipt, settings: &FileSettings) -> Receipt {
        let mut receipt = receipt.shown_by(None);
        let hash = |k: usize| {
            let NamedPlane { plane, numbers, .. } = self.planes[k];
            blake3::hash(&numbers.stored_bytes(settings.is_half(plane))).to_hex()
        };
        let hashes = parallel::collect(self.planes.len(), hash);
        for (NamedPlane { name, plane, .. }, hash) in self.planes.iter().zip(hashes) {
            let said = format!(
                "channels {}; {}; unit {}; space {}; {}; {}; blake3 {hash}",
                plane.channels().join(" "),
                if settings.is_half(*plane) { HALF } else { plane.number_type() },
                plane.unit(),
                plane.space(),
                plane.convention(),
                plane.sampling().name()
            );
            receipt = receipt.with(&format!("{BUFFER_KEY}{name}"), said);
        }
        receipt
    }
}

/// Before the name of a plane, the key of what a receipt says of it.
pub(super) const BUFFER_KEY: &str = "buffer.";

/// The type of 16-bit floats, in what a receipt says of a plane.
const HALF: &str = "float16";

/// Whether a plane was stored in 16-bit floats, by what a receipt says of it.
pub(super) fn is_half(said: &str) -> bool {
    said.split("; ").nth(1) == Some(HALF)
}
