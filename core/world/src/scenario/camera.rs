//! The cameras: which pair, its optics, its exposure and its detector.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::range::{MAX_SEED, within};
use crate::traverse::FURTHER_CAMERAS_LIMIT;
use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::error::{Error, Result};

/// Largest output of the 12-bit converter, DN.
pub const FULL_SCALE_DN: f64 = 4095.0;
/// Allowed image widths, px.
const IMAGE_SIZES: [u32; 4] = [1024, 512, 256, 128];
/// Full scale of the 8-bit converter's table, DN.
const BYTE_DN: f64 = 255.0;

/// A pair of cameras and where it is mounted; the models are in `camera/rig.rs`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraRig {
    /// Spirit's navcams on the mast, 1024 × 1024 px, 46° (domain.md 4.3).
    #[default]
    MerNavcam,
    /// Opportunity's pancams on the mast, 1024 × 1024 px, 16°; the right camera is ours (domain.md 4.3, 5.1).
    MerPancam,
    /// Opportunity's front hazcams on the body, 1024 × 1024 px, 126°; the right camera is ours (domain.md 5.1).
    MerFrontHazcam,
    /// Rear hazcams: the front ones rotated about the rover's z axis by 180° (ours).
    MerRearHazcam,
    /// Kim et al.'s example "Pancam" on the mast, 1024 × 768 px, f = 16 mm, baseline 0.30 m (R42).
    #[serde(rename = "table1_pancam")]
    Table1Pancam,
    /// Kim et al.'s example "Navcam" on the mast, 1024 × 768 px, f = 6 mm, baseline 0.20 m (R42).
    #[serde(rename = "table1_navcam")]
    Table1Navcam,
}

impl CameraRig {
    /// Whether the pair is fixed to the body and cannot be pointed.
    pub(crate) fn is_on_body(self) -> bool {
        matches!(self, Self::MerFrontHazcam | Self::MerRearHazcam)
    }
}

/// A pair of cameras beside the main one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FurtherRig {
    /// Its name at every stop.
    pub name: CameraName,
    /// Which pair of cameras.
    pub rig: CameraRig,
    /// Azimuth (to the right) and elevation (up), deg, to which the mast is turned for this pair; by default those of
    /// the main pair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_deg: Option<[f64; 2]>,
    /// Width of its images, px: 1024, 512, 256 or 128.
    #[serde(default = "full_size")]
    pub image_size: u32,
}

impl FurtherRig {
    /// Mast angles for this pair; `None` for those of the main pair.
    pub(crate) fn look(&self) -> Option<MastAngles> {
        let [azimuth_rad, elevation_rad] = self.look_deg?.map(f64::to_radians);
        Some(MastAngles { azimuth_rad, elevation_rad })
    }
}

fn full_size() -> u32 {
    1024
}

/// How the recorded number follows from the 12-bit one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantisation {
    /// Scaled: DN8 = round(DN12 · 255/4095).
    #[default]
    Linear,
    /// 8 bits by the table DN8 = round(255 √(DN12/4095)), recorded through the table's inverse as 12 bits.
    SquareRoot,
}

/// How the exposure time is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExposureMode {
    /// One time for all images: the first left one has the mean `mean_level`.
    #[default]
    Fixed,
    /// Automatic at each stop, from the whole left image.
    FullFrame,
    /// Automatic at each stop, from a square around the centre of the left image (R79).
    Subframe,
}

/// Automatic exposure; names and values are those of real image labels (domain.md 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AutoExposureSettings {
    /// Target value of the brightest pixels, 12-bit DN (2000: labels).
    pub data_cut_dn: f64,
    /// Percentage of pixels that may exceed it (1: labels).
    pub pixel_fraction_percent: f64,
    /// The search ends when the exposure changes by less than this, percent (5: labels).
    pub change_percent: f64,
    /// Largest number of trial exposures (6: labels).
    pub iterations: u32,
    /// Exposure time before the first stop, s (0.43: between the 0.420 s and 0.445 s of real labels).
    pub start_s: f64,
    /// Side of the square of `subframe`, px of the image (161: domain.md 5.2).
    pub subframe_px: u32,
}

impl Default for AutoExposureSettings {
    fn default() -> Self {
        Self {
            data_cut_dn: 2000.0,
            pixel_fraction_percent: 1.0,
            change_percent: 5.0,
            iterations: 6,
            start_s: 0.43,
            subframe_px: 161,
        }
    }
}

/// The cameras (domain.md 5.1, 5.2, 5.3 and 11.3).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSettings {
    /// Which pair of cameras.
    pub rig: CameraRig,
    /// A pair on the body to which the target is handed off: after the last stop the rover stays where it is and this
    /// pair takes one more stop (none; `mer_front_hazcam`: Deans05 §3).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hand_over: Option<CameraRig>,
    /// Width of the image, px: 1024, 512, 256 or 128; smaller ones are block averages (domain.md 2.1). The
    /// height is the same for the square cameras and three quarters of it for those of 1024 × 768 px.
    pub image_size: u32,
    /// σ of the optics' Gaussian blur, px of the image (0.5–0.7: domain.md 11.3).
    pub blur_px: f64,
    /// Samples along each axis of a pixel, 1 to 8; the pixel's value is their mean over its area.
    pub samples_per_axis: u32,
    /// Fraction of the cos⁴ fall-off towards the corners that remains, 0 to 1 (0: corrected on board).
    pub vignetting: f64,
    /// Residue of the flat-field correction, rms over the image, relative (0.025: domain.md 5.1).
    pub flat_field_residue: f64,
    /// Electrons per second of exposure and unit of radiance (600 000, ours: exposes the demonstration for about the
    /// 0.4 s of real labels). A white surface that faces all the light has radiance 1.
    pub electrons_per_s: f64,
    /// Dark current, electrons per second of exposure (0: negligible below −55 °C, domain.md 5.1).
    pub dark_electrons_per_s: f64,
    /// Time for which light falls in while the image is moved to the storage, s (0: corrected on board; 0.00512 where
    /// it is not, domain.md 11.3).
    pub smear_s: f64,
    /// Full-well capacity of a pixel, electrons (200 000: domain.md 5.1).
    pub full_well_electrons: f64,
    /// Bits of a recorded pixel: 12 or 8.
    pub bit_depth: u32,
    /// Conversion to 8 bits; with 12 bits only `linear` is possible.
    pub quantisation: Quantisation,
    /// Electrons per DN of the 12-bit converter (42: 170 ke⁻ / 4095).
    pub gain_electrons_per_dn: f64,
    /// Read noise, electrons (30).
    pub read_noise_electrons: f64,
    /// Converter output in the dark, 12-bit DN (20).
    pub bias_dn: f64,
    /// Pixel-to-pixel spread of the response, 1σ, relative, fixed for each camera (0.01).
    pub response_spread: f64,
    /// How the exposure time is chosen.
    pub exposure: ExposureMode,
    /// Mean of the first left image under `fixed` exposure, fraction of full scale (ours).
    pub mean_level: f64,
    /// Seed of shot and read noise; the scenario's seed if left out. The cameras' own response follows the scenario's
    /// seed in any case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_seed: Option<u64>,
    /// The automatic exposure.
    pub auto_exposure: AutoExposureSettings,
    /// Pairs beside the main one, which take images at every stop; optics and detector are those of this section.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<FurtherRig>,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            rig: CameraRig::default(),
            hand_over: None,
            image_size: 1024,
            blur_px: 0.6,
            samples_per_axis: 4,
            vignetting: 0.0,
            flat_field_residue: 0.025,
            electrons_per_s: 600_000.0,
            dark_electrons_per_s: 0.0,
            smear_s: 0.0,
            full_well_electrons: 200_000.0,
            bit_depth: 12,
            quantisation: Quantisation::default(),
            gain_electrons_per_dn: 42.0,
            read_noise_electrons: 30.0,
            bias_dn: 20.0,
            response_spread: 0.01,
            exposure: ExposureMode::default(),
            mean_level: 0.4,
            noise_seed: None,
            auto_exposure: AutoExposureSettings::default(),
            further: Vec::new(),
        }
    }
}

impl CameraSettings {
    /// Full scale of a recorded file, DN: 255 for 8 linear bits, else 4095.
    pub fn recorded_full_scale_dn(&self) -> f64 {
        match (self.bit_depth, self.quantisation) {
            (8, Quantisation::Linear) => BYTE_DN,
            _ => FULL_SCALE_DN,
        }
    }

    /// These settings with those that do not affect the clean radiance reset to their defaults.
    pub fn of_radiance(&self) -> Self {
        Self {
            rig: self.rig,
            image_size: self.image_size,
            blur_px: self.blur_px,
            samples_per_axis: self.samples_per_axis,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<()> {
        if !IMAGE_SIZES.contains(&self.image_size) {
            return Err(Error::setting("camera.image_size", "choose 1024, 512, 256 or 128"));
        }
        self.validate_further()?;
        if self.hand_over.is_some_and(|rig| rig != CameraRig::MerFrontHazcam || rig == self.rig) {
            let problem = "choose mer_front_hazcam, beside a camera.rig on the mast";
            return Err(Error::setting("camera.hand_over", problem));
        }
        if ![12, 8].contains(&self.bit_depth) {
            return Err(Error::setting("camera.bit_depth", "choose 12 or 8"));
        }
        if self.bit_depth == 12 && self.quantisation == Quantisation::SquareRoot {
            return Err(Error::setting("camera.quantisation", "square_root needs camera.bit_depth = 8"));
        }
        if self.noise_seed.is_some_and(|seed| seed > MAX_SEED) {
            return Err(Error::setting("camera.noise_seed", "is above 2^53"));
        }
        within("camera.blur_px", self.blur_px, 0.0, 3.0)?;
        within("camera.samples_per_axis", f64::from(self.samples_per_axis), 1.0, 8.0)?;
        within("camera.vignetting", self.vignetting, 0.0, 1.0)?;
        within("camera.flat_field_residue", self.flat_field_residue, 0.0, 0.1)?;
        within("camera.electrons_per_s", self.electrons_per_s, 1e3, 1e9)?;
        within("camera.dark_electrons_per_s", self.dark_electrons_per_s, 0.0, 1e6)?;
        within("camera.smear_s", self.smear_s, 0.0, 0.1)?;
        within("camera.full_well_electrons", self.full_well_electrons, 1e3, 1e7)?;
        within("camera.gain_electrons_per_dn", self.gain_electrons_per_dn, 0.1, 1000.0)?;
        within("camera.read_noise_electrons", self.read_noise_electrons, 0.0, 1000.0)?;
        within("camera.bias_dn", self.bias_dn, 0.0, 1000.0)?;
        within("camera.response_spread", self.response_spread, 0.0, 0.2)?;
        within("camera.mean_level", self.mean_level, 0.02, 0.9)?;
        self.auto_exposure.validate()
    }

    fn validate_further(&self) -> Result<()> {
        let most = FURTHER_CAMERAS_LIMIT;
        if self.further.len() > most {
            return Err(Error::setting("camera.further", format!("has more than {most} cameras")));
        }
        for (index, camera) in self.further.iter().enumerate() {
            let key = |field: &str| format!("camera.further[{index}].{field}");
            if !IMAGE_SIZES.contains(&camera.image_size) {
                return Err(Error::setting(key("image_size"), "choose 1024, 512, 256 or 128"));
            }
            if camera.name == CameraName::ODOMETRY {
                let problem = format!("{} is the pair that visual odometry takes of its own", camera.name);
                return Err(Error::setting(key("name"), problem));
            }
            if let Some([azimuth_deg, elevation_deg]) = camera.look_deg {
                if camera.rig.is_on_body() {
                    let problem =
                        "a pair on the body cannot be turned: leave it out, or choose a rig on the mast";
                    return Err(Error::setting(key("look_deg"), problem));
                }
                within(&key("look_deg[0]"), azimuth_deg, -180.0, 180.0)?;
                within(&key("look_deg[1]"), elevation_deg, -90.0, 90.0)?;
            }
            if self.further[..index].iter().any(|other| other.name == camera.name) {
                let problem = format!("{} is the name of another camera already", camera.name);
                return Err(Error::setting(key("name"), problem));
            }
        }
        Ok(())
    }
}

impl AutoExposureSettings {
    fn validate(&self) -> Result<()> {
        // Above the largest bias, so that the cut corresponds to a positive radiance.
        within("camera.auto_exposure.data_cut_dn", self.data_cut_dn, 1001.0, 4000.0)?;
        within("camera.auto_exposure.pixel_fraction_percent", self.pixel_fraction_percent, 0.0, 50.0)?;
        within("camera.auto_exposure.change_percent", self.change_percent, 0.1, 50.0)?;
        within("camera.auto_exposure.iterations", f64::from(self.iterations), 1.0, 20.0)?;
        within("camera.auto_exposure.start_s", self.start_s, 0.00512, 30.0)?;
        within("camera.auto_exposure.subframe_px", f64::from(self.subframe_px), 5.0, 1024.0)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::CameraRig;
    use crate::Scenario;

    #[test]
    fn impossible_cameras_are_refused_by_name() {
        for (text, key) in [
            ("bit_depth = 12\nquantisation = \"square_root\"", "camera.quantisation"),
            ("noise_seed = 9100000000000000", "camera.noise_seed"),
            ("vignetting = 1.5", "camera.vignetting"),
            ("smear_s = nan", "camera.smear_s"),
            ("[camera.auto_exposure]\niterations = 0", "camera.auto_exposure.iterations"),
            ("rig = \"mer_side_hazcam\"", "mer_front_hazcam"),
            ("hand_over = \"mer_pancam\"", "camera.hand_over"),
            ("further = [{ name = \"A\", rig = \"mer_pancam\" }]", "camera.further[0].name"),
            (
                "further = [{ name = \"odometry\", rig = \"mer_navcam\" }]",
                "camera.further[0].name: odometry is the pair",
            ),
            (
                "further = [{ name = \"a\", rig = \"mer_pancam\", image_size = 9 }]",
                "camera.further[0].image_size",
            ),
            (
                "[[camera.further]]\nname = \"a\"\nrig = \"mer_pancam\"\n\
                 [[camera.further]]\nname = \"a\"\nrig = \"mer_navcam\"",
                "camera.further[1].name: a is the name of another camera already",
            ),
            ("rig = \"mer_front_hazcam\"\nhand_over = \"mer_front_hazcam\"", "camera.hand_over"),
        ] {
            let error = Scenario::from_toml(&format!("[camera]\n{text}\n"), Path::new("s.toml")).unwrap_err();
            assert!(error.to_string().contains(key), "{error}");
        }
    }

    #[test]
    fn a_changed_camera_survives_toml() {
        let text = "[camera]\nrig = \"table1_pancam\"\nnoise_seed = 5\nexposure = \"subframe\"\nbit_depth = 8\n\
                    quantisation = \"square_root\"\n[camera.auto_exposure]\nsubframe_px = 99\n\
                    [[camera.further]]\nname = \"hazcam\"\nrig = \"mer_rear_hazcam\"\n";
        let read = Scenario::from_toml(text, Path::new("s.toml")).unwrap();
        assert_eq!((read.camera.noise_seed, read.camera.auto_exposure.subframe_px), (Some(5), 99));
        assert_eq!(
            (read.camera.further[0].rig, read.camera.further[0].image_size),
            (CameraRig::MerRearHazcam, 1024)
        );
        assert_eq!(Scenario::from_toml(&read.to_toml(), Path::new("s.toml")).unwrap(), read);
    }
}
