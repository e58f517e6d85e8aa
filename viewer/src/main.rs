//! The native viewer: `sightline-viewer [http://127.0.0.1:7700[/#session=ID]]`.

use sightline_viewer::{Fragment, Link, SightlineApp};

/// The default address of the server.
const DEFAULT: &str = "http://127.0.0.1:7700";

fn main() -> eframe::Result {
    let link = link(&std::env::args().nth(1).unwrap_or_else(|| DEFAULT.to_owned()));
    let viewport = egui::ViewportBuilder::default().with_inner_size([1600.0, 1000.0]).with_title("Sightline");
    eframe::run_native(
        "Sightline",
        eframe::NativeOptions { viewport, ..Default::default() },
        Box::new(|context| Ok(Box::new(SightlineApp::new(&context.egui_ctx, link)))),
    )
}

/// Splits an address into server and session.
fn link(address: &str) -> Link {
    let (origin, fragment) = address.split_once('#').unwrap_or((address, ""));
    Link { origin: origin.trim_end_matches('/').to_owned(), fragment: Fragment::parse(fragment) }
}
