//! The memory of a step, by which programs limit their runs.

use super::{ArrayName, StepTrace};
use crate::locate::shape_tracker::view::View;
use crate::locate::store::HeapBytes;

/// Memory of the parts of a step that are not counted individually (numbers, sentences, small lists), bytes; measured.
const SMALL_PARTS: usize = 12 << 10;

impl HeapBytes for StepTrace {
    /// Arrays, features, and the view for later registrations. Data that steps share is counted for each of them, so
    /// that the sum over a run is an upper bound.
    fn heap_bytes(&self) -> usize {
        let arrays = ArrayName::all().filter_map(|name| self.array(name));
        let arrays: usize = arrays.map(|array| size_of_val(array.values())).sum();
        let features = self.features().and_then(|found| found.features.as_ref());
        let view = self.shape().and_then(|found| found.view.as_ref());
        let target = &self.update.target;
        let images: usize = target.memory.template().map_or(0, |memory| {
            // The designated image is shared by the whole run.
            let replaced = memory.replaced.newest().map(|kept| &kept.appearance);
            let own = replaced.filter(|appearance| appearance.step != target.designation.step);
            let images = own.chain([&memory.appearance]).map(|appearance| &appearance.image);
            images.map(|image| size_of_val(image.as_raw().as_slice())).sum()
        });
        SMALL_PARTS
            + arrays
            + features.map_or(0, |found| found.heap_bytes())
            + view.map_or(0, |view| view.heap_bytes())
            + images
    }
}

impl HeapBytes for View {
    fn heap_bytes(&self) -> usize {
        let mesh = &self.mesh;
        size_of_val(self.image.as_raw().as_slice())
            + size_of_val(&*mesh.vertices)
            + size_of_val(&*mesh.range_sigma_m)
            + size_of_val(&*mesh.triangles)
    }
}
