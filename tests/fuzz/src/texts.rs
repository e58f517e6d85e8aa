//! Parsers that read text: cameras, scenarios, expressions, stored sessions.

use std::path::Path;

use serde_json::Value;
use sightline_geometry::camera::text;
use sightline_geometry::frames::Pixel;
use sightline_session::Session;
use sightline_session::expression::Expression;
use sightline_session::expression::complete::complete;
use sightline_session::notes::Notes;
use sightline_session::reproduce::Opened;
use sightline_session::view::SavedSession;
use sightline_track::settings::{Changes, Settings};
use sightline_world::Scenario;

/// A camera in JPL's text form. A camera that was read is written and read again.
pub(crate) fn camera(bytes: &[u8]) {
    let Ok(camera) = text::read_text(&String::from_utf8_lossy(bytes), Path::new("left.cahvor")) else {
        return;
    };
    let again = text::read_text(&text::write_text(&camera), Path::new("left.cahvor"));
    assert!(again.is_ok(), "{camera:?} is not read again: {again:?}");
    let _ = camera.ray(Pixel::new(3.0, 4.0)).and_then(|ray| camera.project(&ray.at(5.0)));
}

/// A scenario. One that was read is written and read again.
pub(crate) fn scenario(bytes: &[u8]) {
    let Ok(scenario) = Scenario::from_toml(&String::from_utf8_lossy(bytes), Path::new("scenario.toml"))
    else {
        return;
    };
    let again = Scenario::from_toml(&scenario.to_toml(), Path::new("scenario.toml"));
    assert_eq!(again.ok().as_ref(), Some(&scenario));
}

/// An expression, and its completion at every position.
pub(crate) fn expression(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let _ = (Expression::read(&text), Expression::condition(&text), Expression::column(&text));
    for cursor in [0, text.len() / 2, text.len(), text.len() + 1] {
        let _ = complete(&text, cursor);
    }
}

/// A session in the form of the store. One that was restored is saved and restored again.
pub(crate) fn stored_session(bytes: &[u8]) {
    let Ok(saved) = serde_json::from_slice::<SavedSession>(bytes) else { return };
    let Ok(mut session) = Session::restored(&saved, 5) else { return };
    let _ = (session.view(), session.breakpoint_views());
    let again = Session::restored(&session.saved(), 5).map(|again| again.saved());
    assert_eq!(again.ok().as_ref(), Some(&session.saved()));
}

/// A session as a page exports it.
pub(crate) fn reproduction(bytes: &[u8]) {
    let Ok(value) = serde_json::from_slice::<Value>(bytes) else { return };
    if !Opened::is_one(&value) {
        return;
    }
    let Ok(opened) = Opened::read(&value) else { return };
    if let Ok(session) = Session::restored(&opened.reproduction.session, 5) {
        let _ = Notes::brought(opened.reproduction.notes, &session);
    }
}

/// Changes of the configuration.
pub(crate) fn settings(bytes: &[u8]) {
    let Ok(changes) = serde_json::from_slice::<Changes>(bytes) else { return };
    let Ok(settings) = Settings::default().with(&changes) else { return };
    let again = Settings::default().with(&settings.changes());
    assert_eq!(again.ok().as_ref(), Some(&settings));
}
