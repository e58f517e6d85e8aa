//! The dense stereo surface of the stop: disparities and ranges, and the outcome of the pixels (R187).

use egui::{Grid, Ui};
use sightline_track::locate::shape_tracker::surface::SurfaceSeen;
use sightline_track::trace::ArrayName;

use crate::drawing::overlay::Mark;
use crate::drawing::raster;
use crate::panels;
use crate::panels::shape::array_image::{ArrayImage, DisplayUnit, side_by_side};
use crate::panels::shape::part_context::{PartContext, ready, why_not};
use crate::theme;

/// The outcomes of a pixel in the order of [`SurfaceSeen::pixels`], and their meanings.
const KINDS: [(&str, &str); 7] = [
    ("found", "a disparity that passed all checks"),
    ("outside", "not in both images"),
    ("no texture", "nothing to compare"),
    ("not unique", "another disparity matches nearly as well"),
    ("left–right", "the right image does not confirm it"),
    ("speckle", "in too small a patch"),
    ("out of range", "nearer or farther than the range limits"),
];

/// Shows the part.
pub(crate) fn show(ui: &mut Ui, context: &PartContext<'_>) {
    let Some(seen) = &context.evidence.surface else {
        panels::missing(ui, "Dense stereo of the stop.", &why_not(context, "surface"));
        return;
    };
    let Some(disparities) = ready(ui, context.state.array(ArrayName::DISPARITIES), "disparities") else {
        return;
    };
    let Some(ranges) = ready(ui, context.state.array(ArrayName::RANGES), "ranges") else { return };
    let size = side_by_side(ui, 2, ui.available_height() - 112.0);
    let target = target(context, seen);
    ui.horizontal_top(|ui| {
        let pictures = [
            ("disparity, px", disparities, DisplayUnit { word: "px", factor: 1.0 }),
            ("range from the left camera, m", ranges, DisplayUnit { word: "m", factor: 1.0 }),
        ];
        for (title, raster, unit) in pictures {
            let colours = Some(raster::ColourMap::Values(raster.levels));
            let placed = ArrayImage { title, raster, colour_map: colours, unit }.show(ui, size);
            if let Some([x, y]) = target {
                placed.mark(x, y, Mark::Ring, theme::run(context.state.cursor.run));
            }
        }
    });
    counts(ui, seen);
}

/// The target's position in the arrays, which are aligned and decimated.
fn target(context: &PartContext<'_>, seen: &SurfaceSeen) -> Option<[f64; 2]> {
    let camera = context.state.aligned_left()?;
    let located = context.trace.located().and_then(|located| located.position_in_rover);
    let predicted = context.trace.prediction().map(|predicted| predicted.position_in_rover);
    let pixel = camera.project(&located.or(predicted)?)?;
    let every = seen.shown_every.max(1) as f64;
    (camera.size == seen.size).then(|| [pixel.x / every, pixel.y / every])
}

fn counts(ui: &mut Ui, seen: &SurfaceSeen) {
    let all = seen.pixels.iter().sum::<usize>().max(1) as f64;
    let [width, height] = seen.size;
    let thinned = match seen.shown_every {
        0 | 1 => String::new(),
        every => format!("; one of {every} × {every} is shown"),
    };
    let words = format!(
        "aligned left image of {width} × {height} px{thinned}. Ring: the target. Mesh around it: {} vertices, {} \
         triangles, one vertex for {} × {} points, which loses {:.1} mm rms.",
        seen.vertices,
        seen.triangles,
        seen.stride,
        seen.stride,
        seen.detail_rms_m * 1000.0
    );
    ui.add(egui::Label::new(theme::note(words)).wrap());
    Grid::new("pixels of the surface").num_columns(7).spacing([14.0, 1.0]).show(ui, |ui| {
        for (word, meaning) in KINDS {
            ui.label(theme::note(word)).on_hover_text(meaning);
        }
        ui.end_row();
        for count in seen.pixels {
            let share = count as f64 / all * 100.0;
            ui.label(theme::number(format!("{share:.1} %"))).on_hover_text(format!("{count} pixels"));
        }
        ui.end_row();
    });
}
