//! The debugger's page: data in, commands out.

#[cfg(target_arch = "wasm32")]
mod web;

/// The application.
#[derive(Default)]
pub struct SightlineApp {
    clicks: u32,
    key: String,
}

impl SightlineApp {
    /// The application as it is when the page opens.
    pub fn new(_context: &eframe::CreationContext<'_>) -> Self {
        Self::default()
    }
}

impl eframe::App for SightlineApp {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        egui::CentralPanel::default().show(ui, |ui| {
            ui.heading("Sightline");
            if ui.button("Count a click").clicked() {
                self.clicks += 1;
            }
            ui.input(|input| {
                for event in &input.events {
                    if let egui::Event::Key { key, pressed: true, .. } = event {
                        self.key = key.name().to_owned();
                    }
                }
            });
            ui.label(format!("Clicks: {}; last key: {}", self.clicks, self.key));
            assert!(self.key != "P", "the key P was pressed");
        });
    }
}
