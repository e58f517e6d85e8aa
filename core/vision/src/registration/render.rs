//! Renders a mesh with the virtual range sensor (R191).

use super::mesh::Mesh;
use super::range_sensor::{NO_FACET, RangeImage, RangeSensor};
use super::rasterise::{Facets, Picture, rasterise};
use sightline_geometry::frames::Pose;

impl RangeSensor {
    /// Renders a mesh in the pose `sensor_from_mesh`.
    pub fn see(&self, mesh: &Mesh, sensor_from_mesh: &Pose) -> RangeImage {
        self.see_facets(&Facets::new(mesh, sensor_from_mesh), &Pose::identity())
    }

    /// Renders facets after a motion.
    pub(super) fn see_facets(&self, facets: &Facets, motion: &Pose) -> RangeImage {
        let pixels = self.width * self.height;
        let mut image = RangeImage {
            width: self.width,
            height: self.height,
            depth_m: vec![f32::INFINITY; pixels],
            facet: vec![NO_FACET; pixels],
            weights: vec![[0.0; 3]; pixels],
        };
        rasterise(self, facets, motion, &mut Picture::default(), &mut image);
        image
    }
}
