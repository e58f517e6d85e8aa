//! Images, arrays and records: their endpoints, and the conversion of the files to rasters and tables.

use std::sync::Arc;

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    ShowArrays, ShowEarlierTemplates, ShowHazards, ShowImage, ShowStep, ShowStop, ShowStopOdometry, ShowTimes,
};
use sightline_api::location::{AtDriveStop, AtImage, AtStop};
use sightline_api::query::ImageWish;
use sightline_api::wire::Problem;
use sightline_track::trace::ArrayName;
use sightline_vision::image::npz;

use crate::cache::{Item, Key};
use crate::drawing::raster::Raster;
use crate::driving::hazards::HazardRaster;
use crate::net::reply::{misread, parse};
use crate::tables::Table;

/// The call that reads an item. A single array is read with all arrays of its step.
pub(crate) fn call(key: &Key) -> Call {
    match key {
        Key::Image { traverse, step, side, camera } => {
            let (id, file) = (traverse.clone(), format!("{}.png", side.word()));
            let wish = ImageWish { bits: None, camera: *camera };
            Call::with_query::<ShowImage>(&AtImage { id, step: *step, file }, &wish)
        }
        Key::Stop { traverse, step } => Call::to::<ShowStop>(&AtStop { id: traverse.clone(), step: *step }),
        Key::Odometry { traverse, step } => {
            Call::to::<ShowStopOdometry>(&AtStop { id: traverse.clone(), step: *step })
        }
        Key::Hazards { session, step, .. } => {
            Call::to::<ShowHazards>(&AtDriveStop { session: session.clone(), step: *step })
        }
        Key::Trace(step) => Call::to::<ShowStep>(step),
        Key::Array(step, _) | Key::Arrays(step) => Call::to::<ShowArrays>(step),
        Key::EarlierTemplates(step) => Call::to::<ShowEarlierTemplates>(step),
        Key::Times(step) => Call::to::<ShowTimes>(step),
    }
}

/// Parses the body of an answer.
pub(super) fn read(key: &Key, bytes: &[u8], context: &egui::Context) -> Result<Item, Problem> {
    match key {
        Key::Stop { .. } => Ok(Item::Stop(Arc::new(parse::<ShowStop>(bytes)?))),
        Key::Odometry { .. } => Ok(Item::Odometry(Arc::new(parse::<ShowStopOdometry>(bytes)?))),
        Key::Hazards { .. } => {
            Ok(Item::Hazards(Arc::new(HazardRaster::new(context, parse::<ShowHazards>(bytes)?))))
        }
        Key::EarlierTemplates(_) => Ok(Item::EarlierTemplates(parse::<ShowEarlierTemplates>(bytes)?)),
        Key::Times(_) => Ok(Item::Times(parse::<ShowTimes>(bytes)?)),
        Key::Trace(_) => Ok(Item::Trace(Arc::new(parse::<ShowStep>(bytes)?))),
        Key::Image { step, side, .. } => {
            let name = format!("the {} image of step {step}", side.word());
            let raster = Raster::from_png(context, &name, bytes).map_err(|why| misread(&why))?;
            Ok(Item::Raster(Arc::new(raster)))
        }
        Key::Array(step, _) | Key::Arrays(step) => {
            let name = format!("the arrays of step {}", step.step);
            let files = npz::decode(bytes, name).map_err(|why| misread(&why.to_string()))?;
            // Unknown arrays are for newer versions of the page.
            let known = files.iter().filter_map(|(word, file)| Some((ArrayName::from_word(word)?, file)));
            let read = known.map(|(name, file)| Ok((name, read_array(name, file, context)?)));
            read.collect::<Result<_, _>>().map(Item::Arrays)
        }
    }
}

fn read_array(name: ArrayName, bytes: &[u8], context: &egui::Context) -> Result<Item, Problem> {
    let item = if Table::is_table(name) {
        Table::from_npy(name, bytes).map(|table| Item::Table(Arc::new(table)))
    } else {
        Raster::from_npy(context, name, bytes).map(|raster| Item::Raster(Arc::new(raster)))
    };
    item.map_err(|why| misread(&why))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::{ImageSide, StepKey};

    #[test]
    fn every_thing_has_its_path() {
        let step = StepKey { session: "s1".to_owned(), target: 2, run: 3, step: 4 };
        let image = |camera: Option<&str>| Key::Image {
            traverse: "t".to_owned(),
            step: 7,
            side: ImageSide::Right,
            camera: camera.map(|name| name.parse().unwrap()),
        };
        assert_eq!(call(&image(None)).path, "traverses/t/steps/7/images/right.png");
        assert_eq!(call(&image(Some("pancam"))).path, "traverses/t/steps/7/images/right.png?camera=pancam");
        assert_eq!(call(&Key::Trace(step.clone())).path, "sessions/s1/targets/2/runs/3/steps/4");
        assert_eq!(call(&Key::Arrays(step)).path, "sessions/s1/targets/2/runs/3/steps/4/arrays.npz");
    }
}
