//! A machine-readable status, from which a browser test reads what is shown and where to click.
//!
//! In the browser it is the attribute `data-status` of the canvas, written whenever it changes:
//!
//! ```json
//! {
//!   "phase": "ready",              // "starting", "opening" (no traverse yet) or "ready"
//!   "connection": "live",          // "connecting", "live" or "gone"
//!   "traverse": "name", "session": "id",
//!   "step": 3, "stop_count": 17,   // the cursor's step, and the number of stops
//!   "target": 0, "run": 0,         // numbers as in the API's paths; target is null without one
//!   "targets": 1,                  // number of targets
//!   "state": "tracking",           // of the cursor's step: tracking, lost, failed; null if not computed
//!   "steps_done": 17,              // of the selected run
//!   "running": false,              // whether that run is still being computed
//!   "shown": true,                 // whether the left image and, if the step is computed, its record are shown
//!   "complete": true,              // whether the rest of the step (right image, arrays) is loaded or was refused
//!   "stage": "match_template",
//!   "left_image_rect": [x, y, w, h],           // of the panel's image area, CSS px from the canvas' corner
//!   "left_image_size": [w, h],                 // of the image, px
//!   "image_to_screen": {"scale": s, "origin": [x, y]},
//!   "pick_mode": false,
//!   "designating": false,          // whether a designation waits for the server's reply
//!   "advised_against": false,      // whether the picked place is a bad one and was not tried
//!   "drive": "waits",              // "drives", "waits", or why the commanded drive ended; null without one
//!   "paused_before": "judge",      // first stage not computed at the stop where the drive is paused; else null
//!   "playing": 0,                  // multiple of the playback rate; negative backwards, 0 paused
//!   "breakpoints": 1, "hits": 4,   // number of breakpoints, and of their hits in all runs
//!   "problem": "sentence or null"  // the newest message if it is a problem
//! }
//! ```
//! An image pixel (u, v), with (0, 0) at the centre of the first pixel, is on the canvas at `origin + scale · (u, v)`, in
//! CSS px; it is visible if that is inside `left_image_rect`.

use serde_json::{Value, json};
use sightline_geometry::frames::Pixel;

use crate::command::Mode;
use crate::layout::left_image::LeftImage;
use crate::net::events::Connection;
use crate::state::State;
use crate::state::messages::Weight;

/// Writes the status when it changes.
#[derive(Default)]
pub(crate) struct Publisher {
    published: String,
    spoken: String,
}

impl Publisher {
    /// Publishes the status if it differs from the last one; `zoom` is egui's zoom factor of the whole page.
    pub(crate) fn publish(&mut self, state: &State, left_image: &LeftImage, zoom: f32) {
        let text = describe(state, left_image, zoom).to_string();
        if text != self.published {
            #[cfg(target_arch = "wasm32")]
            crate::page::web::publish("data-status", &text);
            self.published = text;
        }
        let spoken = sentence(state);
        if spoken != self.spoken {
            #[cfg(target_arch = "wasm32")]
            crate::access::dom::speak(&spoken);
            self.spoken = spoken;
        }
    }
}

/// The cursor's step and its results, as spoken by a screen reader.
pub(crate) fn sentence(state: &State) -> String {
    let Some(last) = state.stop_count().checked_sub(1) else { return state.missing_target() };
    let mut words = format!("step {} of {last}", state.cursor.step);
    let Some(row) = state.row() else {
        return words + if state.target().is_some() { ", not computed" } else { ", no target" };
    };
    words += &format!(", {}", state.tracking().unwrap_or_default().word());
    let numbers = [
        ("score", row.ncc.map(|score| format!("{score:.2}"))),
        ("error", row.err_px.map(|error| format!("{error:.1} pixels"))),
        ("sigma", row.sigma_m.map(|sigma| format!("{:.1} centimetres", sigma * 100.0))),
    ];
    for (name, number) in numbers {
        words += &number.map(|number| format!(", {name} {number}")).unwrap_or_default();
    }
    words
}

/// The status as JSON.
pub(crate) fn describe(state: &State, left_image: &LeftImage, zoom: f32) -> Value {
    let phase = match (&state.traverse, &state.traverses) {
        (Some(_), _) if state.session.is_some() => "ready",
        (None, None) => "starting",
        _ => "opening",
    };
    let connection = match state.connection {
        Connection::Connecting => "connecting",
        Connection::Live => "live",
        Connection::Gone { .. } => "gone",
    };
    let problem = state.messages.newest().filter(|message| message.weight == Weight::Problem);
    let mut status = json!({
        "phase": phase,
        "connection": connection,
        "traverse": state.traverse.as_ref().map(|traverse| &traverse.id),
        "session": state.session.as_ref().map(|session| &session.id),
        "step": state.cursor.step,
        "stop_count": state.stop_count(),
        "target": state.target().map(|target| target.number),
        "run": state.cursor.run,
        "targets": state.session.as_ref().map_or(0, |session| session.targets.len()),
        "state": state.tracking().map(sightline_track::target::TrackingState::word),
        "steps_done": state.run().map_or(0, |run| run.rows.len()),
        "running": state.is_running(),
        "shown": left_image.is_some() && (state.row().is_none() || state.trace().is_some()),
        "complete": state.is_complete(),
        "stage": state.stage().word(),
        "pick_mode": state.mode == Mode::Pick,
        "designating": state.designating.is_some(),
        "advised_against": state.refusal.as_ref().is_some_and(|refusal| refusal.is_advice),
        "drive": state.drive_word(),
        "paused_before": state.drive().and_then(|drive| drive.paused).map(|halt| halt.before.word()),
        "playing": state.breakpoints.play.speed,
        "breakpoints": state.breakpoints.list.len(),
        "hits": state.breakpoints.list.iter().map(|breakpoint| breakpoint.count).sum::<usize>(),
        "problem": problem.map(|message| &message.text),
        "left_image_rect": null,
        "left_image_size": null,
        "image_to_screen": null,
    });
    if let Some((transform, size)) = left_image {
        let round = |v: f64| (v * f64::from(zoom) * 1e4).round() / 1e4;
        let rect = transform.rect;
        let place = [rect.left(), rect.top(), rect.width(), rect.height()].map(|v| round(f64::from(v)));
        let origin = transform.to_screen(Pixel::new(0.0, 0.0));
        status["left_image_rect"] = json!(place);
        status["left_image_size"] = json!(size);
        status["image_to_screen"] = json!({
            "scale": round(transform.scale),
            "origin": [round(f64::from(origin.x)), round(f64::from(origin.y))],
        });
    }
    status
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::view2d::{Transform, View2d};
    use sightline_vision::image::PixelRect;

    #[test]
    fn a_run_that_is_read_half_way_goes_on_before_its_first_event() {
        let context = egui::Context::default();
        let mut state = crate::tests::fixture::at_step(&context, 1);
        assert_eq!(describe(&state, &None, 1.0)["running"], true);
        let run = &mut state.session.as_mut().unwrap().targets[0].runs[0];
        run.complete = true;
        assert_eq!(describe(&state, &None, 1.0)["running"], false);
    }

    #[test]
    fn a_pixel_can_be_found_on_the_screen_from_the_status() {
        let rect = egui::Rect::from_min_size(egui::pos2(200.0, 60.0), egui::vec2(512.0, 512.0));
        let transform = Transform::new(View2d::Fit, PixelRect::whole(1024, 1024), rect);
        let state = State::new(String::new(), None);
        let status = describe(&state, &Some((transform, [1024, 1024])), 1.0);
        let number = |value: &Value| value.as_f64().unwrap();
        let scale = number(&status["image_to_screen"]["scale"]);
        let x = number(&status["image_to_screen"]["origin"][0]) + scale * 600.0;
        let y = number(&status["image_to_screen"]["origin"][1]) + scale * 300.0;
        let expected = transform.to_screen(Pixel::new(600.0, 300.0));
        assert!((x - f64::from(expected.x)).abs() < 1e-3 && (y - f64::from(expected.y)).abs() < 1e-3);
        assert_eq!(status["phase"], "starting");
    }
}
