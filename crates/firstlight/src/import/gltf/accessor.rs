//! Buffer views and accessors: from bytes to numbers.
//!
//! Source: "glTF 2.0 specification", section 3.6.

use super::json::JsonPlace;
use super::{Gltf, GltfFault};

/// The bytes of a buffer view.
pub(super) struct ViewedBytes<'a> {
    pub bytes: &'a [u8],
    /// From one element to the next, where it is said.
    stride: Option<usize>,
}

/// The type of a number of an accessor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ComponentType {
    Byte,
    UnsignedByte,
    Short,
    UnsignedShort,
    UnsignedInt,
    Float,
}

impl ComponentType {
    fn of(at: &JsonPlace<'_>) -> Result<Self, GltfFault> {
        Ok(match at.index()? {
            5120 => Self::Byte,
            5121 => Self::UnsignedByte,
            5122 => Self::Short,
            5123 => Self::UnsignedShort,
            5125 => Self::UnsignedInt,
            5126 => Self::Float,
            other => return Err(at.fault(format!("{other} is none of 5120 to 5123, 5125 and 5126"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::Byte | Self::UnsignedByte => 1,
            Self::Short | Self::UnsignedShort => 2,
            Self::UnsignedInt | Self::Float => 4,
        }
    }

    /// The number that `bytes` begin with, as it is.
    fn whole(self, bytes: &[u8]) -> u32 {
        match self {
            Self::Byte | Self::UnsignedByte => u32::from(bytes[0]),
            Self::Short | Self::UnsignedShort => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Self::UnsignedInt | Self::Float => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }

    /// The number that `bytes` begin with; a whole one by itself, or as a part of 1.
    ///
    /// Source: section 3.6.2.2 (of meshes: KHR_mesh_quantization).
    fn number(self, bytes: &[u8], normalized: bool) -> f32 {
        let whole = self.whole(bytes);
        let (number, most) = match self {
            Self::Float => return f32::from_bits(whole),
            Self::Byte => (f32::from(whole as u8 as i8), 127.0),
            Self::UnsignedByte => (whole as f32, 255.0),
            Self::Short => (f32::from(whole as u16 as i16), 32767.0),
            Self::UnsignedShort => (whole as f32, 65535.0),
            Self::UnsignedInt => (whole as f32, u32::MAX as f32),
        };
        if normalized { (number / most).max(-1.0) } else { number }
    }
}

/// Numbers in each element of an accessor.
fn components(at: &JsonPlace<'_>) -> Result<usize, GltfFault> {
    Ok(match at.text()? {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        other => {
            return Err(at.fault(format!("{:?} is no type of accessors", other.chars().take(40).collect::<String>())));
        }
    })
}

/// An accessor whose bytes are known to be there.
struct Accessor<'a> {
    component: ComponentType,
    components: usize,
    normalized: bool,
    count: usize,
    /// The bytes of its elements and the stride; without, all numbers are 0.
    elements: Option<(&'a [u8], usize)>,
    /// Elements that are replaced: their numbers, and their bytes without gaps.
    sparse: Option<(Vec<u32>, &'a [u8])>,
}

impl Gltf {
    /// The buffer view that `at` is the number of.
    pub(super) fn view(&self, at: &JsonPlace<'_>) -> Result<ViewedBytes<'_>, GltfFault> {
        let view = self.root().of_index("bufferViews", at)?;
        let buffer = view.need("buffer")?;
        let index = buffer.index()?;
        let Some(bytes) = self.buffers.get(index) else {
            let count = self.buffers.len();
            return Err(buffer.fault(format!("there is no number {index} in \"buffers\", which has {count}")));
        };
        let bytes = bytes.as_ref().map_err(Clone::clone)?;
        let (offset, length) = (view.index_or("byteOffset", 0)?, view.need("byteLength")?.index()?);
        let within = offset.checked_add(length).and_then(|end| bytes.get(offset..end));
        let Some(within) = within else {
            let there = bytes.len();
            return Err(view.fault(format!("{length} bytes from {offset} on are not in its buffer, which has {there}")));
        };
        // 0 is what glTF 1.0 wrote for elements without a gap
        let stride = view.get("byteStride").map(|stride| stride.index()).transpose()?.filter(|stride| *stride > 0);
        Ok(ViewedBytes { bytes: within, stride })
    }

    fn accessor(&self, at: &JsonPlace<'_>) -> Result<Accessor<'_>, GltfFault> {
        let accessor = self.root().of_index("accessors", at)?;
        let component = ComponentType::of(&accessor.need("componentType")?)?;
        let components = components(&accessor.need("type")?)?;
        let count = accessor.need("count")?.index()?;
        let size = component.size() * components;
        let elements = match accessor.get("bufferView") {
            None => None,
            Some(view) => {
                let view = self.view(&view)?;
                let offset = accessor.index_or("byteOffset", 0)?;
                let stride = view.stride.unwrap_or(size);
                let needed = match count {
                    0 => Some(0),
                    count => stride.checked_mul(count - 1).and_then(|last| last.checked_add(size)),
                };
                let there = view.bytes.len().saturating_sub(offset);
                let Some(needed) = needed.filter(|needed| *needed <= there) else {
                    let message = format!("{count} elements with a stride of {stride} are not in {there} bytes");
                    return Err(accessor.fault(message));
                };
                Some((view.bytes.get(offset..offset + needed).unwrap_or_default(), stride))
            }
        };
        let sparse = accessor.get("sparse").map(|sparse| self.sparse(&sparse, count, size)).transpose()?;
        let normalized = accessor.flag("normalized");
        Ok(Accessor { component, components, normalized, count, elements, sparse })
    }

    fn sparse(&self, sparse: &JsonPlace<'_>, count: usize, size: usize) -> Result<(Vec<u32>, &[u8]), GltfFault> {
        let replaced = sparse.need("count")?.index()?;
        let part = |key: &str, size: usize| {
            let part = sparse.need(key)?;
            let view = self.view(&part.need("bufferView")?)?;
            let offset = part.index_or("byteOffset", 0)?;
            let bytes = size.checked_mul(replaced).and_then(|length| offset.checked_add(length));
            let bytes = bytes.and_then(|end| view.bytes.get(offset..end));
            bytes.ok_or_else(|| part.fault(format!("{replaced} elements are not in its buffer view")))
        };
        let indices = sparse.need("indices")?;
        let component = ComponentType::of(&indices.need("componentType")?)?;
        let indices = part("indices", component.size())?;
        let values = part("values", size)?;
        let indices: Vec<u32> = indices.chunks_exact(component.size()).map(|bytes| component.whole(bytes)).collect();
        match indices.iter().find(|index| **index as usize >= count) {
            Some(index) => Err(sparse.fault(format!("replaces element {index} of {count}"))),
            None => Ok((indices, values)),
        }
    }

    /// How many elements the accessor has that `at` is the number of.
    pub(super) fn count(&self, at: &JsonPlace<'_>) -> Result<usize, GltfFault> {
        self.root().of_index("accessors", at)?.need("count")?.index()
    }

    /// The vectors of an accessor with at least one number each; what it lacks of N is 1, as the fourth of colours.
    pub(super) fn vectors<const N: usize>(&self, at: &JsonPlace<'_>) -> Result<Vec<[f32; N]>, GltfFault> {
        let accessor = self.accessor(at)?;
        self.take(at, (accessor.count as u64).saturating_mul(size_of::<[f32; N]>() as u64))?;
        let (size, used) = (accessor.component.size(), accessor.components.min(N));
        let read = |bytes: &[u8]| {
            let mut vector = [1.0; N];
            for (number, bytes) in vector.iter_mut().zip(bytes.chunks_exact(size)).take(used) {
                *number = accessor.component.number(bytes, accessor.normalized);
            }
            vector
        };
        let mut vectors = match accessor.elements {
            None => {
                let mut zero = [1.0; N];
                zero[..used].fill(0.0);
                vec![zero; accessor.count]
            }
            Some((bytes, stride)) => {
                let length = size * accessor.components;
                (0..accessor.count).map(|i| read(&bytes[i * stride..i * stride + length])).collect()
            }
        };
        if let Some((indices, values)) = &accessor.sparse {
            for (index, bytes) in indices.iter().zip(values.chunks_exact(size * accessor.components)) {
                vectors[*index as usize] = read(bytes);
            }
        }
        Ok(vectors)
    }

    /// The numbers of an accessor, all of one element after the other.
    pub(super) fn numbers(&self, at: &JsonPlace<'_>) -> Result<Vec<f32>, GltfFault> {
        let flat = |components: usize| -> Result<Vec<f32>, GltfFault> {
            Ok(match components {
                1 => self.vectors::<1>(at)?.into_flattened(),
                2 => self.vectors::<2>(at)?.into_flattened(),
                3 => self.vectors::<3>(at)?.into_flattened(),
                4 => self.vectors::<4>(at)?.into_flattened(),
                9 => self.vectors::<9>(at)?.into_flattened(),
                _ => self.vectors::<16>(at)?.into_flattened(),
            })
        };
        flat(self.accessor(at)?.components)
    }

    /// The whole numbers of an accessor with N in each element.
    pub(super) fn wholes<const N: usize>(&self, at: &JsonPlace<'_>) -> Result<Vec<[u32; N]>, GltfFault> {
        let accessor = self.accessor(at)?;
        if accessor.component == ComponentType::Float || accessor.components != N {
            let message = format!("an accessor of {N} whole numbers in each element is needed here");
            return Err(at.fault(message));
        }
        self.take(at, (accessor.count as u64).saturating_mul(size_of::<[u32; N]>() as u64))?;
        let size = accessor.component.size();
        let read = |bytes: &[u8]| {
            let mut element = [0; N];
            for (whole, bytes) in element.iter_mut().zip(bytes.chunks_exact(size)) {
                *whole = accessor.component.whole(bytes);
            }
            element
        };
        let mut wholes = match accessor.elements {
            None => vec![[0; N]; accessor.count],
            Some((bytes, stride)) => {
                (0..accessor.count).map(|i| read(&bytes[i * stride..i * stride + size * N])).collect()
            }
        };
        if let Some((indices, values)) = &accessor.sparse {
            for (index, bytes) in indices.iter().zip(values.chunks_exact(size * N)) {
                wholes[*index as usize] = read(bytes);
            }
        }
        Ok(wholes)
    }
}
