//! The squares of pictures that `sightline-experiments scenery` measures: soil and rock, simulated and of recorded frames.
//!
//! A recorded square is written `FILE@X,Y` or `FILE@X,Y,SIDE`: a PDS3 product, or a traverse, whose first left image
//! it is, and the upper left corner and the side of the square, px. Where squares lie is a person's choice, made by
//! looking at the frame; simulated squares of rock are found by the truth: wholly on one face of a rock, lit, one a
//! rock.
//!
//! Levels are those of the file, bias included; what the file was compressed with is not undone.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::picture::{PictureReport, picture_report};
use sightline_geometry::camera::Camera;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_recordings::import::pds3::{Product, is_product};
use sightline_vision::image::{GrayImage, PixelRect};

use sightline_world::{Eye, NoiseSeed, Scenario, SurfaceId, World};

use sightline_server::cli::open;

/// Side of a square of soil, px.
const SOIL_PX: u32 = 256;
/// Side of a simulated square of rock, px.
const ROCK_PX: u32 = 64;
/// Distance of the places at which rock is sought, px.
const STRIDE_PX: u32 = 8;
/// The greatest angle between the normals of what counts as one face, deg.
const FACE_DEG: f64 = 10.0;
/// Simulated squares of rock.
const ROCKS: usize = 3;
/// The stop of the demonstration whose picture shows soil, and the one that shows rocks.
const STOPS: [usize; 2] = [8, 15];

/// A square of a recorded frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Square {
    path: PathBuf,
    rectangle: PixelRect,
}

impl FromStr for Square {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (path, place) = text.rsplit_once('@').ok_or("write it as FILE@X,Y or FILE@X,Y,SIDE")?;
        let number =
            |text: &str| text.trim().parse::<u16>().map_err(|_| format!("{text} is no whole number"));
        let numbers = place.split(',').map(number).collect::<std::result::Result<Vec<u16>, String>>()?;
        let (x, y, side) = match *numbers {
            [x, y] => (x, y, SOIL_PX),
            [x, y, side] => (x, y, u32::from(side)),
            _ => return Err("write it as FILE@X,Y or FILE@X,Y,SIDE".to_owned()),
        };
        Ok(Self { path: path.into(), rectangle: PixelRect::new(x.into(), y.into(), side, side) })
    }
}

impl Square {
    /// Measures the square; its name is that of the frame and the square's corner.
    ///
    /// # Errors
    /// A frame that cannot be read, or a square that does not lie in it.
    pub(super) fn report(&self) -> Result<(String, PictureReport)> {
        let (name, image) = frame(&self.path)?;
        let square = &self.rectangle;
        let whole = PixelRect::whole(image.width(), image.height());
        let inside = square.intersect(&whole).filter(|inside| inside == square);
        let report = inside.and_then(|inside| picture_report(&image, &inside));
        let outside = || Error::format(&self.path, "the square does not lie in the image, or is black");
        Ok((format!("{name} at {}, {}", square.x, square.y), report.ok_or_else(outside)?))
    }
}

/// The name and the image of a product or of a traverse's first left view.
fn frame(path: &Path) -> Result<(String, GrayImage)> {
    if !(path.is_file() && is_product(path)) {
        let traverse = open::open(path, None)?;
        return Ok((traverse.index().name.clone(), traverse.capture(0)?.left.as_ref().clone()));
    }
    let product = Product::read(path)?;
    let raster = product.read_raster()?;
    let image = GrayImage::from_raw(raster.width, raster.height, raster.samples);
    let image = image.ok_or_else(|| Error::format(path, "its size and its samples disagree"))?;
    let host = product.label.text("INSTRUMENT_HOST_ID").unwrap_or_default();
    let sol = product.label.number("PLANET_DAY_NUMBER");
    Ok((sol.map_or_else(|| product.id(), |sol| format!("{host} sol {sol}")), image))
}

/// The left camera of a stop of the demonstration, and its recorded picture.
fn simulated(scenario: &Scenario, world: &World, stop: usize) -> Result<(Camera, GrayImage)> {
    let index = sightline_world::index(scenario, world)?;
    let camera = index.stops.get(stop).and_then(|stop| sightline_world::true_camera_in_site(stop, Eye::Left));
    let camera = camera.ok_or_else(|| Error::Request(format!("the demonstration has no stop {stop}")))?;
    let picture =
        sightline_world::render(world, scenario, &camera, NoiseSeed { step: stop as u32, eye: Eye::Left });
    Ok((camera, picture))
}

/// A square of soil beside the drive, as the left camera records it.
pub(super) fn simulated_soil(scenario: &Scenario, world: &World) -> Result<PictureReport> {
    let (_, picture) = simulated(scenario, world, STOPS[0])?;
    let square = PixelRect::new(100, 700, SOIL_PX, SOIL_PX);
    picture_report(&picture, &square).ok_or_else(|| Error::Request("the square of soil is black".to_owned()))
}

/// Squares that show one lit face of a rock each, with their names.
pub(super) fn simulated_rocks(scenario: &Scenario, world: &World) -> Result<Vec<(String, PictureReport)>> {
    let (camera, picture) = simulated(scenario, world, STOPS[1])?;
    let mut known = BTreeSet::new();
    let mut found = Vec::new();
    let places = |side: u32| (0..=side - ROCK_PX).step_by(STRIDE_PX as usize);
    for (x, y) in places(camera.height()).flat_map(|y| places(camera.width()).map(move |x| (x, y))) {
        let Some(rock) = lit_rock(world, &camera, x, y).filter(|rock| !known.contains(rock)) else {
            continue;
        };
        let square = PixelRect::new(x as i32, y as i32, ROCK_PX, ROCK_PX);
        if let Some(report) = picture_report(&picture, &square) {
            known.insert(rock);
            found.push((format!("simulated, default, rock {rock} at {x}, {y}"), report));
        }
        if found.len() == ROCKS {
            break;
        }
    }
    Ok(found)
}

/// The rock of which a square shows one face, every fourth pixel asked, where the sun reaches nine tenths of it.
fn lit_rock(world: &World, camera: &Camera, x: u32, y: u32) -> Option<u32> {
    let cast = |dx: u32, dy: u32| {
        let hit = world.cast(&camera.ray(Pixel::new(f64::from(x + dx), f64::from(y + dy)))?)?;
        matches!(hit.surface, SurfaceId::Rock(_)).then_some(hit)
    };
    let middle = cast(ROCK_PX / 2, ROCK_PX / 2)?;
    let (mut shaded, mut count) = (0, 0);
    for (dx, dy) in (0..=ROCK_PX).step_by(4).flat_map(|dy| (0..=ROCK_PX).step_by(4).map(move |dx| (dx, dy))) {
        let hit = cast(dx, dy)?;
        if hit.surface != middle.surface || hit.normal.angle(&middle.normal) > FACE_DEG.to_radians() {
            return None;
        }
        shaded += u32::from(world.in_shadow(&hit.point));
        count += 1;
    }
    let SurfaceId::Rock(number) = middle.surface else { return None };
    (10 * shaded <= count).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_read_with_its_side_or_without_and_refused_with_a_sentence() {
        let square: Square = "a@b/c.img@40,700".parse().unwrap();
        assert_eq!((square.path, square.rectangle), ("a@b/c.img".into(), PixelRect::new(40, 700, 256, 256)));
        let square: Square = "c.img@1,2,64".parse().unwrap();
        assert_eq!(square.rectangle, PixelRect::new(1, 2, 64, 64));
        for wrong in ["c.img", "c.img@1", "c.img@1,-2", "c.img@1,2,3,4"] {
            assert!(wrong.parse::<Square>().is_err(), "{wrong}");
        }
    }
}
