//! Images and arrays from the server, with their textures.

use egui::{Color32, ColorImage, TextureFilter, TextureHandle, TextureOptions};
use sightline_track::trace::ArrayName;
use sightline_vision::image::{GrayImage, npy};

use crate::drawing::stretch::{Stretch, levels};
use crate::theme;

/// The difference of two normalised patches is shown between ± this many standard deviations.
pub(crate) const DIFFERENCE_LIMIT: f32 = 2.0;

/// Patches are shown from this many standard deviations below their mean to the same number above.
pub(crate) const PATCH_SIGMAS: f32 = 2.5;

/// Maximum side of an accepted image, px.
const SIDE_MAX: u32 = 8192;

/// The colour map of an array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ColourMap {
    /// Viridis, from the first value to the second.
    Values([f32; 2]),
    /// Blue–white–red, from minus the value to the value.
    Signed(f32),
}

impl ColourMap {
    /// The colour of a value; transparent if it is NaN.
    pub(crate) fn colour(self, value: f32) -> Color32 {
        match self {
            Self::Values([low, high]) => theme::score((value - low) / (high - low).max(f32::MIN_POSITIVE)),
            Self::Signed(limit) => theme::signed(value, limit.max(f32::MIN_POSITIVE)),
        }
    }

    /// The values at the ends of the colour map.
    pub(crate) fn limits(self) -> [f32; 2] {
        match self {
            Self::Values(limits) => limits,
            Self::Signed(limit) => [-limit, limit],
        }
    }
}

/// A grid of values and its texture.
pub struct Raster {
    /// Fractions of full scale for images, scores for score maps; NaN if missing.
    pub values: GrayImage,
    /// The texture, one texel per value.
    pub texture: TextureHandle,
    /// Mean of the finite values.
    pub mean: f32,
    /// Standard deviation of the finite values.
    pub sigma: f32,
    /// Levels of an image for the automatic stretch, or the 1st and 99th percentiles of an array.
    pub levels: [f32; 2],
    options: TextureOptions,
    /// The name of an array; `None` for an image of a stop.
    array: Option<ArrayName>,
    /// The current stretch of the texture.
    stretched: egui::mutex::Mutex<Stretch>,
    /// The current colour map of an array; `None` before a panel sets one.
    colour_map: egui::mutex::Mutex<Option<ColourMap>>,
}

impl Raster {
    /// Decodes an image of a stop from its PNG.
    ///
    /// # Errors
    /// A sentence if the bytes are not a PNG image with sides of at most 8192 px.
    pub fn from_png(context: &egui::Context, name: &str, bytes: &[u8]) -> Result<Self, String> {
        let mut reader =
            image::ImageReader::with_format(std::io::Cursor::new(bytes), image::ImageFormat::Png);
        let mut limits = image::Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(SIDE_MAX), Some(SIDE_MAX));
        reader.limits(limits);
        let decoded = reader.decode().map_err(|e| format!("{name} is damaged: {e}"))?;
        let values = decoded.to_luma32f();
        let colours = values.iter().map(|&v| theme::grey(v)).collect();
        // Nearest when magnified, to show whole pixels; mipmaps when reduced, to avoid aliasing.
        let options = TextureOptions {
            magnification: TextureFilter::Nearest,
            minification: TextureFilter::Linear,
            mipmap_mode: Some(TextureFilter::Linear),
            ..TextureOptions::NEAREST
        };
        Ok(Self::new(context, name, values, colours, options))
    }

    /// Decodes an array of a step from its NumPy file.
    ///
    /// # Errors
    /// A sentence if the bytes are not a 2-D array of numbers.
    pub fn from_npy(context: &egui::Context, array: ArrayName, bytes: &[u8]) -> Result<Self, String> {
        let values = npy::decode(bytes, array.word()).map_err(|e| e.to_string())?;
        Ok(Self::from_values(context, array, values))
    }

    /// Creates an array of a step from its values.
    pub fn from_values(context: &egui::Context, array: ArrayName, values: GrayImage) -> Self {
        let (mean, sigma) = statistics(&values);
        let colours = values.iter().map(|&v| default_colour(array, v, [mean, sigma])).collect();
        let levels = ends(&values);
        let new = Self::new(context, array.word(), values, colours, TextureOptions::NEAREST);
        Self { levels, array: Some(array), ..new }
    }

    fn new(
        context: &egui::Context,
        name: &str,
        values: GrayImage,
        colours: Vec<Color32>,
        options: TextureOptions,
    ) -> Self {
        let size = [values.width() as usize, values.height() as usize];
        let texture = context.load_texture(name, ColorImage::new(size, colours), options);
        let (mean, sigma) = statistics(&values);
        let (levels, stretched) = (levels(&values), egui::mutex::Mutex::new(Stretch::None));
        let colour_map = egui::mutex::Mutex::default();
        Self { values, texture, mean, sigma, levels, options, array: None, stretched, colour_map }
    }

    /// Applies a stretch to the texture of an image, unless it is already applied.
    pub fn stretch(&self, stretch: Stretch) {
        let mut present = self.stretched.lock();
        if *present == stretch {
            return;
        }
        *present = stretch;
        let size = self.size().map(|side| side as usize);
        let colours = self.values.iter().map(|&v| theme::grey(stretch.apply(v, self.levels))).collect();
        self.texture.clone().set(ColorImage::new(size, colours), self.options);
    }

    /// Applies a colour map to the texture of an array, unless it is already applied.
    pub(crate) fn set_colour_map(&self, colour_map: ColourMap) {
        let mut present = self.colour_map.lock();
        if *present == Some(colour_map) {
            return;
        }
        *present = Some(colour_map);
        let size = self.size().map(|side| side as usize);
        let colours = self.values.iter().map(|&v| colour_map.colour(v)).collect();
        self.texture.clone().set(ColorImage::new(size, colours), self.options);
    }

    /// The colours of the texture.
    pub fn pixels(&self) -> ColorImage {
        let (stretch, colour_map) = (*self.stretched.lock(), *self.colour_map.lock());
        let colour = |v: f32| match (colour_map, self.array) {
            (Some(colour_map), _) => colour_map.colour(v),
            (None, Some(array)) => default_colour(array, v, [self.mean, self.sigma]),
            (None, None) => theme::grey(stretch.apply(v, self.levels)),
        };
        let colours = self.values.iter().map(|&v| colour(v)).collect();
        ColorImage::new(self.size().map(|side| side as usize), colours)
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.values.dimensions().into()
    }

    /// The value at a column and row; `None` outside the raster and for NaN.
    pub fn at(&self, x: i64, y: i64) -> Option<f32> {
        let (x, y) = (u32::try_from(x).ok()?, u32::try_from(y).ok()?);
        self.values.get_pixel_checked(x, y).map(|p| p[0]).filter(|v| !v.is_nan())
    }

    /// Memory used by values and texture, bytes.
    pub fn bytes(&self) -> usize {
        self.values.as_raw().len() * (size_of::<f32>() + size_of::<Color32>())
    }
}

/// The default colour of an array's value, before a panel sets a colour map.
fn default_colour(array: ArrayName, value: f32, [mean, sigma]: [f32; 2]) -> Color32 {
    match array {
        ArrayName::SURFACE => theme::score((value + 1.0) / 2.0),
        ArrayName::DIFFERENCE => theme::signed(value, DIFFERENCE_LIMIT),
        _ => theme::grey(0.5 + (value - mean) / (2.0 * PATCH_SIGMAS * sigma.max(1e-6))),
    }
}

/// The 1st and 99th percentile of the finite values; 0 and 1 if there are none.
fn ends(values: &GrayImage) -> [f32; 2] {
    let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if finite.is_empty() {
        return [0.0, 1.0];
    }
    let skip = finite.len() / 100;
    let last = finite.len() - 1 - skip;
    let low = *finite.select_nth_unstable_by(skip, f32::total_cmp).1;
    let high = *finite.select_nth_unstable_by(last, f32::total_cmp).1;
    [low, high]
}

/// Mean and standard deviation of the finite values.
fn statistics(values: &GrayImage) -> (f32, f32) {
    let valid = || values.iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
    let count = valid().count().max(1) as f64;
    let mean = valid().sum::<f64>() / count;
    let variance = valid().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
    (mean as f32, variance.sqrt() as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_leave_out_what_does_not_exist() {
        let values = GrayImage::from_raw(4, 1, vec![1.0, f32::NAN, 3.0, 2.0]).unwrap();
        let (mean, sigma) = statistics(&values);
        assert_eq!(mean, 2.0);
        assert!((sigma - (2.0_f32 / 3.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn the_ends_leave_out_one_in_a_hundred_on_each_side_and_what_does_not_exist() {
        let mut values: Vec<f32> = (0..200).map(|value| value as f32).collect();
        values.push(f32::NAN);
        assert_eq!(ends(&GrayImage::from_raw(201, 1, values).unwrap()), [2.0, 197.0]);
        assert_eq!(ends(&GrayImage::from_raw(1, 1, vec![f32::NAN]).unwrap()), [0.0, 1.0]);
    }

    #[test]
    fn signed_values_are_coloured_about_zero_and_others_from_their_least() {
        assert_eq!(ColourMap::Signed(0.02).colour(0.02), theme::signed(1.0, 1.0));
        assert_eq!(ColourMap::Values([3.0, 5.0]).colour(3.0), theme::score(0.0));
        assert_eq!(ColourMap::Values([3.0, 5.0]).colour(f32::NAN), Color32::TRANSPARENT);
        assert_eq!(ColourMap::Signed(0.5).limits(), [-0.5, 0.5]);
    }

    #[test]
    fn a_damaged_file_is_refused_with_its_name() {
        let context = egui::Context::default();
        assert!(Raster::from_png(&context, "left image", b"nonsense").err().unwrap().contains("left image"));
        assert!(
            Raster::from_npy(&context, ArrayName::SURFACE, b"nonsense").err().unwrap().contains("surface")
        );
    }

    #[test]
    fn an_array_comes_back_with_its_values_and_holes() {
        let values = GrayImage::from_raw(2, 2, vec![0.25, f32::NAN, -1.0, 1.0]).unwrap();
        let raster =
            Raster::from_npy(&egui::Context::default(), ArrayName::SURFACE, &npy::encode(&values).unwrap())
                .unwrap();
        assert_eq!(raster.size(), [2, 2]);
        assert_eq!(raster.at(0, 0), Some(0.25));
        assert_eq!(raster.at(1, 0), None);
        assert_eq!(raster.at(0, 2), None);
        assert_eq!(raster.bytes(), 4 * 8);
    }
}
