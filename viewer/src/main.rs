//! The native viewer.

fn main() -> eframe::Result {
    eframe::run_native(
        "Sightline",
        eframe::NativeOptions::default(),
        Box::new(|context| Ok(Box::new(sightline_viewer::SightlineApp::new(context)))),
    )
}
