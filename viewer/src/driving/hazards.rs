//! The goodness map on the map of the drive: its texture, its requests, and a description of the ground at the pointer.

use std::sync::Arc;

use egui::{Color32, ColorImage, Context, TextureHandle, TextureOptions};
use egui_plot::{PlotImage, PlotPoint, PlotUi};
use sightline_rover::hazards::CellBasis;
use sightline_session::hazard_view::{HazardView, UNKNOWN};

use crate::cache::{Key, Slot};
use crate::driving::words;
use crate::panels::numbers::fixed;
use crate::state::State;
use crate::theme;

/// The goodness map of a stop, with the texture of its known cells.
pub struct HazardRaster {
    /// The map.
    pub view: Arc<HazardView>,
    /// The texture, one texel per cell, north up; `None` if no cell is known.
    pub(crate) texture: Option<GoodnessTexture>,
}

/// The texture of a goodness map, with its position.
pub(crate) struct GoodnessTexture {
    texture: TextureHandle,
    /// Centre and size: east and north, m.
    pub(crate) middle_m: [f64; 2],
    pub(crate) size_m: [f32; 2],
}

impl HazardRaster {
    /// Creates the texture of a map.
    pub(crate) fn new(context: &Context, view: HazardView) -> Self {
        let texture = texture(context, &view);
        Self { view: Arc::new(view), texture }
    }

    /// Memory size, bytes.
    pub(crate) fn bytes(&self) -> usize {
        let view = &self.view;
        size_of_val(view.goodness_percent.as_slice())
            + size_of_val(view.limited_by.as_slice())
            + size_of_val(view.value.as_slice())
            + size_of_val(view.basis.as_slice())
            + size_of_val(view.height_m.as_slice())
            + 4 * view.side * view.side
    }
}

/// First and last row, and first and last column, of the bounding box of the known cells; `None` if no cell is known.
fn known_bounds(view: &HazardView) -> Option<[[usize; 2]; 2]> {
    let known = || (0..view.side * view.side).filter(|&index| view.goodness_percent[index] != UNKNOWN);
    let rows = [known().map(|index| index / view.side).min()?, known().map(|index| index / view.side).max()?];
    let columns = known().map(|index| index % view.side);
    Some([rows, [columns.clone().min()?, columns.max()?]])
}

/// The goodness of the cells of the bounding box as an image; the first line is the northernmost row.
pub(crate) fn texels(view: &HazardView) -> Vec<i8> {
    let Some([rows, columns]) = known_bounds(view) else { return Vec::new() };
    let line =
        |row: usize| &view.goodness_percent[row * view.side + columns[0]..=row * view.side + columns[1]];
    (rows[0]..=rows[1]).rev().flat_map(line).copied().collect()
}

/// The texture of the bounding box of the known cells.
fn texture(context: &Context, view: &HazardView) -> Option<GoodnessTexture> {
    let [rows, columns] = known_bounds(view)?;
    let [height, width] = [rows, columns].map(|[first, last]| last - first + 1);
    let colours: Vec<Color32> = texels(view).into_iter().map(theme::goodness).collect();
    let image = ColorImage::new([width, height], colours);
    let texture = context.load_texture("goodness map", image, TextureOptions::NEAREST);
    let middle =
        |corner_m: f64, [first, last]: [usize; 2]| corner_m + 0.5 * (first + last + 1) as f64 * view.cell_m;
    Some(GoodnessTexture {
        texture,
        middle_m: [middle(view.corner_m[1], columns), middle(view.corner_m[0], rows)],
        size_m: [width, height].map(|cells| (cells as f64 * view.cell_m) as f32),
    })
}

impl State {
    /// The goodness map of the cursor's stop.
    pub(crate) fn hazards(&self) -> Slot<'_, HazardRaster> {
        self.hazards_key().map_or(Slot::Absent, |key| self.cache.hazards(&key))
    }

    /// Whether the navigator used a goodness map at the cursor's stop.
    pub(crate) fn has_hazards(&self) -> bool {
        self.hazards_key().is_some()
    }

    /// The cache key of the goodness map of the cursor's stop; `None` if the navigator used none.
    fn hazards_key(&self) -> Option<Key> {
        let step = self.cursor.step;
        self.cycle_at(step)?;
        let steering = self.drive()?.steering.as_ref()?;
        let command = &steering.command;
        if !command.navigator.needs_map() {
            return None;
        }
        // The exempt area is around the target of the driving run.
        let by = [steering.target, steering.run];
        let rules = format!("{by:?} {:?} {}", command.hazard_cameras, command.exemption_radius_m);
        Some(Key::Hazards { session: self.session.as_ref()?.id.clone(), step, rules })
    }

    /// Adds the goodness map of the cursor's stop if a visible panel shows it.
    pub(crate) fn add_hazard_items(&self, keys: &mut Vec<Key>) {
        keys.extend(self.hazards_key().filter(|_| self.wants_hazards));
    }
}

/// Paints the goodness map of the cursor's stop.
pub(crate) fn paint(plot: &mut PlotUi<'_>, state: &State) {
    let Some(GoodnessTexture { texture, middle_m: [east, north], size_m }) =
        state.hazards().ready().and_then(|raster| raster.texture.as_ref())
    else {
        return;
    };
    let image = PlotImage::new("goodness", texture.id(), PlotPoint::new(*east, *north), *size_m);
    plot.image(image.allow_hover(false));
}

/// Describes the ground at a position, east and north, m; empty without a goodness map there.
pub(crate) fn words_at(view: Option<&HazardView>, [east, north]: [f64; 2]) -> String {
    let Some((view, index)) = view.and_then(|view| Some((view, view.index_at([north, east])?))) else {
        return String::new();
    };
    let goodness = f64::from(view.goodness_percent[index]) / 100.0;
    let limit = view.limited_by[index].map(|term| words::term(term, f64::from(view.value[index])));
    match (view.basis[index], limit) {
        (CellBasis::Unknown, _) => "  ground unknown".to_owned(),
        (CellBasis::Assumed, _) => "  assumed good near the start".to_owned(),
        (CellBasis::Exempt, _) => "  exempt near the target".to_owned(),
        (CellBasis::Measured, None) => format!("  goodness {}", fixed(goodness, 2)),
        (CellBasis::Measured, Some(limit)) => format!("  goodness {}: {limit}", fixed(goodness, 2)),
    }
}

/// The goodness map of the cursor's stop, shared so that a label can keep it.
pub(crate) fn view(state: &State) -> Option<Arc<HazardView>> {
    state.hazards().ready().map(|raster| Arc::clone(&raster.view))
}
