//! Accessors: numbers in buffers, of any type, quantised, interleaved, sparse.

use gltf_json::accessor::{ComponentType, Type};
use gltf_json::validation::Checked;

use super::File;

/// What an accessor without a buffer may have, all zeros, whatever the size of the file.
const ZEROS: u64 = 65_536;

impl File {
    /// All elements of accessor `index`, which must have `N` components; integers that are normalised as numbers in [0, 1] or
    /// [-1, 1].
    ///
    /// # Errors
    /// A sentence with the path in the JSON; `at` names the accessor.
    pub fn vectors<const N: usize>(&self, index: usize, at: &str) -> Result<Vec<[f64; N]>, String> {
        let accessor = self.root.accessors.get(index).ok_or_else(|| missing(at, "accessor", index))?;
        let path = format!("accessors[{index}]");
        let wanted = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        if accessor.type_ != Checked::Valid(wanted) {
            return Err(format!("`{path}.type` must have {N} components here ({at})"));
        }
        let Checked::Valid(component) = accessor.component_type else {
            return Err(format!("`{path}.componentType` is unknown"));
        };
        let count = accessor.count.0;
        let mut vectors = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                let elements = self.elements(view.value(), offset, count, N * component.0.size(), &path)?;
                elements.map(|element| vector(element, component.0, accessor.normalized)).collect()
            }
            None => {
                let bytes: usize = self.buffers.iter().map(Vec::len).sum();
                if count > ZEROS.max(16 * bytes as u64) {
                    return Err(format!("`{path}` has {count} elements, but no `bufferView` to hold them"));
                }
                vec![[0.0; N]; count as usize]
            }
        };
        self.replace(accessor, component.0, &path, &mut vectors)?;
        Ok(vectors)
    }

    /// Elements that a sparse accessor states one by one.
    fn replace<const N: usize>(
        &self,
        accessor: &gltf_json::Accessor,
        component: ComponentType,
        path: &str,
        vectors: &mut [[f64; N]],
    ) -> Result<(), String> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let Checked::Valid(of_indices) = sparse.indices.component_type else {
            return Err(format!("`{path}.sparse.indices.componentType` is unknown"));
        };
        let (count, indices, values) = (sparse.count.0, &sparse.indices, &sparse.values);
        let indices_path = format!("{path}.sparse.indices");
        let view = indices.buffer_view.value();
        let indices = self.elements(view, indices.byte_offset.0, count, of_indices.0.size(), &indices_path)?;
        let values_path = format!("{path}.sparse.values");
        let view = values.buffer_view.value();
        let values = self.elements(view, values.byte_offset.0, count, N * component.size(), &values_path)?;
        for (index, value) in indices.zip(values) {
            let [index] = vector::<1>(index, of_indices.0, false);
            let Some(place) = vectors.get_mut(index as usize) else {
                return Err(format!("`{indices_path}` names element {index} of {}", accessor.count.0));
            };
            *place = vector(value, component, accessor.normalized);
        }
        Ok(())
    }

    /// `count` pieces of `size` bytes from `offset` on in a view.
    fn elements(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
        path: &str,
    ) -> Result<impl Iterator<Item = &[u8]>, String> {
        let index = view;
        let view = self.root.buffer_views.get(index).ok_or_else(|| missing(path, "bufferView", index))?;
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            return Err(format!(
                "`bufferViews[{index}].byteStride` is {stride}, less than the {size} bytes of an element"
            ));
        }
        let bytes = self.view(index)?;
        let all = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..));
        let needed = match count {
            0 => Some(0),
            _ => (count - 1).checked_mul(stride as u64).and_then(|bytes| bytes.checked_add(size as u64)),
        };
        match (all, needed) {
            (Some(all), Some(needed)) if needed <= all.len() as u64 => {
                // The last element need not fill its stride.
                Ok((0..count as usize).map(move |i| &all[i * stride..i * stride + size]))
            }
            _ => Err(format!("`{path}` needs {count} elements of {size} bytes, more than `bufferViews[{index}]` has")),
        }
    }

    /// The bytes of a view.
    ///
    /// # Errors
    /// A sentence.
    pub fn view(&self, index: usize) -> Result<&[u8], String> {
        let path = format!("bufferViews[{index}]");
        let view = self.root.buffer_views.get(index).ok_or_else(|| format!("`{path}` does not exist"))?;
        let buffer = view.buffer.value();
        let bytes = self.buffers.get(buffer).ok_or_else(|| missing(&path, "buffer", buffer))?;
        let (offset, length) = (view.byte_offset.map_or(0, |offset| offset.0), view.byte_length.0);
        let end = offset.checked_add(length).filter(|end| *end <= bytes.len() as u64);
        let end = end.ok_or_else(|| {
            format!("`{path}` is {length} bytes from {offset} on of `buffers[{buffer}]`, which has {}", bytes.len())
        })?;
        Ok(&bytes[offset as usize..end as usize])
    }
}

/// That something is named which the file does not have.
pub fn missing(at: &str, what: &str, index: usize) -> String {
    format!("`{at}` names {what} {index}, which does not exist")
}

/// Numbers one after the other. Normalised integers: glTF 2.0, section 3.6.2.2.
fn vector<const N: usize>(bytes: &[u8], component: ComponentType, normalized: bool) -> [f64; N] {
    let mut values = [0.0; N];
    for (value, bytes) in values.iter_mut().zip(bytes.chunks_exact(component.size())) {
        let (number, largest) = match *bytes {
            [a] if component == ComponentType::I8 => (f64::from(a.cast_signed()), 127.0),
            [a] => (f64::from(a), 255.0),
            [a, b] if component == ComponentType::I16 => (f64::from(i16::from_le_bytes([a, b])), 32_767.0),
            [a, b] => (f64::from(u16::from_le_bytes([a, b])), 65_535.0),
            [a, b, c, d] if component == ComponentType::F32 => (f64::from(f32::from_le_bytes([a, b, c, d])), 1.0),
            [a, b, c, d] => (f64::from(u32::from_le_bytes([a, b, c, d])), 4_294_967_295.0),
            _ => (0.0, 1.0),
        };
        let is_float = component == ComponentType::F32;
        *value = if normalized && !is_float { f64::max(number / largest, -1.0) } else { number };
    }
    values
}
