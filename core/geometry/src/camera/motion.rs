//! Exact operations on a camera model: a rigid motion, a subframe, or a reduction of its image.
//!
//! ```text
//! rigid motion (p ↦ ρ p + t): C ← ρ C + t;  A, H, V, O ← ρ ·;  R, E, T, P unchanged        domain.md 2.5
//! subframe whose first pixel is (dx, dy) of the full image: H ← H − dx A, V ← V − dy A     domain.md 2.1
//! mean of blocks of k × k: H ← H/k − ((k − 1)/(2k)) A, V likewise                        domain.md 2.1
//! ```
//!
//! The last line is not H/k alone: the centre of the first block is at (k − 1)/2 of the full image, and pixel centres
//! are whole numbers in both. The distortion is about O, independent of the image, and so unchanged. Source: VICAR
//! `cmod_cahv*_move`.

use super::{Cahv, Cahvor, Cahvore, Camera, CameraModel};
use crate::frames::Pose;

impl Cahv {
    fn moved(&self, to_from_here: &Pose) -> Self {
        Self {
            centre: to_from_here * self.centre,
            axis: to_from_here * self.axis,
            horizontal: to_from_here * self.horizontal,
            vertical: to_from_here * self.vertical,
        }
    }
}

impl CameraModel {
    /// Transforms the model into another frame, or by a motion within one: new position from old.
    pub fn moved(&self, to_from_here: &Pose) -> Self {
        match self {
            Self::Cahv(model) => Self::Cahv(model.moved(to_from_here)),
            Self::Cahvor(model) => Self::Cahvor(Cahvor {
                linear: model.linear.moved(to_from_here),
                optical_axis: to_from_here * model.optical_axis,
                ..model.clone()
            }),
            Self::Cahvore(model) => Self::Cahvore(Cahvore {
                linear: model.linear.moved(to_from_here),
                optical_axis: to_from_here * model.optical_axis,
                ..model.clone()
            }),
        }
    }

    /// The model of the subframe whose first pixel is (`dx`, `dy`) of this model's image, px.
    pub fn shifted(&self, dx: f64, dy: f64) -> Self {
        let mut model = self.clone();
        let linear = model.linear_mut();
        linear.horizontal -= linear.axis * dx;
        linear.vertical -= linear.axis * dy;
        model
    }

    /// The model of the image in which each pixel is the mean of `factor` × `factor` pixels of this one.
    pub fn downsampled(&self, factor: u32) -> Self {
        let k = f64::from(factor.max(1));
        let shift = (k - 1.0) / (2.0 * k);
        let mut model = self.clone();
        let linear = model.linear_mut();
        linear.horizontal = linear.horizontal / k - linear.axis * shift;
        linear.vertical = linear.vertical / k - linear.axis * shift;
        model
    }
}

impl Camera {
    /// Transforms the camera into another frame, or by a motion within one: new position from old.
    pub fn moved(&self, to_from_here: &Pose) -> Self {
        Self { model: self.model.moved(to_from_here), size: self.size }
    }

    /// The camera of the subframe that starts at pixel (`left`, `top`) and has `size` = [width, height] px.
    pub fn subframe(&self, left: u32, top: u32, size: [u32; 2]) -> Self {
        Self { model: self.model.shifted(f64::from(left), f64::from(top)), size }
    }

    /// The camera whose pixels are means of `factor` × `factor` pixels; incomplete blocks are dropped.
    pub fn downsampled(&self, factor: u32) -> Self {
        let [width, height] = self.size;
        let k = factor.max(1);
        Self { model: self.model.downsampled(k), size: [width / k, height / k] }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{all_kinds, pixel_grid};
    use super::*;
    use crate::frames::{Pixel, Vector3};

    #[test]
    fn a_moved_camera_sees_the_moved_point_at_the_same_pixel() {
        let new_from_old = Pose::new(Vector3::new(-84.1, -26.1, 3.6), Vector3::new(0.3, -1.1, 2.0));
        for camera in all_kinds() {
            let moved = camera.moved(&new_from_old);
            for pixel in pixel_grid(&camera) {
                let point = camera.ray(pixel).unwrap().at(2.5);
                let before = camera.project(&point).unwrap();
                let after = moved.project(&(new_from_old * point)).unwrap();
                assert!(before.distance(after) < 1e-9, "{before:?} {after:?}");
            }
        }
    }

    #[test]
    fn a_subframe_keeps_the_rays_of_its_pixels() {
        for camera in all_kinds() {
            let part = camera.subframe(300, 120, [256, 200]);
            assert_eq!((part.width(), part.height()), (256, 200));
            let here = part.ray(Pixel::new(17.25, 150.5)).unwrap();
            let there = camera.ray(Pixel::new(317.25, 270.5)).unwrap();
            assert!((here.direction - there.direction).norm() < 1e-12);
            assert!((here.origin - there.origin).norm() < 1e-12);
        }
    }

    #[test]
    fn a_reduced_pixel_looks_along_the_centre_of_its_block() {
        for camera in all_kinds() {
            let small = camera.downsampled(4);
            assert_eq!((small.width(), small.height()), (256, 256));
            // Block (10, 100) covers columns 40 … 43 and rows 400 … 403.
            let here = small.ray(Pixel::new(10.0, 100.0)).unwrap();
            let there = camera.ray(Pixel::new(41.5, 401.5)).unwrap();
            assert!((here.direction - there.direction).norm() < 1e-12);
        }
    }
}
