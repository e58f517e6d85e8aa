//! The colours of every meaning in each of the three themes, as one table.
//!
//! Data colours are those of Okabe and Ito, darkened on a light background and brightened on black for contrast: text
//! reaches a contrast of 4.5, or 7 in the high-contrast theme, and marks reach 3 (WCAG 2.2, 1.4.3, 1.4.6 and 1.4.11; a
//! test computes all of them).

use std::cell::Cell;

use egui::Color32;

/// The colour theme of the page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColourTheme {
    /// Light text on a dark background.
    #[default]
    Dark,
    /// Dark text on a light background.
    Light,
    /// White text on a black background, with strong lines.
    Contrast,
}

impl ColourTheme {
    /// All themes.
    pub const ALL: [Self; 3] = [Self::Dark, Self::Light, Self::Contrast];

    /// The theme's name.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Light => "light",
            Self::Contrast => "high contrast",
        }
    }

    /// The theme's word in the browser's storage.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Light => "light",
            Self::Contrast => "contrast",
        }
    }

    /// The theme of a stored word.
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|colour_theme| colour_theme.word() == word)
    }
}

thread_local! {
    /// The current theme; the page paints on one thread.
    static IN_USE: Cell<ColourTheme> = const { Cell::new(ColourTheme::Dark) };
}

/// The current theme.
pub(crate) fn colour_theme() -> ColourTheme {
    IN_USE.get()
}

/// Sets the theme for all subsequent painting.
pub(crate) fn choose(colour_theme: ColourTheme) {
    IN_USE.set(colour_theme);
}

/// The colour for the current theme out of three: dark, light, high contrast.
fn of(colours: [u32; 3]) -> Color32 {
    let [_, r, g, b] = colours[colour_theme() as usize].to_be_bytes();
    Color32::from_rgb(r, g, b)
}

/// Paints marks on an image: in the colours for a dark background with a dark halo, also in the light theme.
pub(crate) fn on_image<R>(paint: impl FnOnce() -> R) -> R {
    let present = colour_theme();
    if present == ColourTheme::Light {
        choose(ColourTheme::Dark);
    }
    let painted = paint();
    choose(present);
    painted
}

macro_rules! colours {
    ($($(#[$doc:meta])* $name:ident: $dark:literal, $light:literal, $contrast:literal;)*) => {
        $($(#[$doc])* pub(crate) fn $name() -> Color32 { of([$dark, $light, $contrast]) })*
    };
}

colours! {
    /// The page behind everything.
    page: 0x10_12_15, 0xe2_e5_e9, 0x00_00_00;
    /// A panel.
    panel: 0x18_1b_20, 0xf7_f8_f9, 0x00_00_00;
    /// Bars at the top and bottom.
    bar: 0x1e_22_28, 0xec_ee_f1, 0x0a_0a_0a;
    /// The background of images, plots and text fields.
    well: 0x0b_0c_0e, 0xff_ff_ff, 0x00_00_00;
    /// Separating lines.
    line: 0x2e_34_3d, 0xc3_c9_d1, 0x8c_8c_8c;
    /// Body text.
    text: 0xd6_d9_de, 0x23_27_2e, 0xff_ff_ff;
    /// Emphasised values and titles.
    strong: 0xf4_f5_f7, 0x0b_0d_10, 0xff_ff_ff;
    /// Labels, units and hints.
    weak: 0x98_a0_ac, 0x59_61_6d, 0xdc_dc_dc;
    /// Selected items and items that wait for the user.
    accent: 0xe0_a4_58, 0x8a_52_00, 0xff_d0_00;
    /// The background of selected items.
    selected: 0x3d_31_20, 0xf3_e0_c4, 0x4a_3a_00;
    /// A button.
    button: 0x2a_2f_37, 0xdf_e3_e8, 0x20_20_20;
    /// A button under the pointer.
    button_hovered: 0x36_3d_47, 0xd0_d6_dd, 0x40_40_40;
    /// State `tracking`, and passed gates.
    tracking: 0x00_9e_73, 0x00_76_56, 0x00_e0_a0;
    /// State `lost`.
    lost: 0xe6_9f_00, 0x8f_5f_00, 0xff_b3_00;
    /// State `failed`, failed gates, and faults.
    failed: 0xd5_5e_00, 0xb2_45_00, 0xff_84_3c;
    /// Steps that are not computed yet.
    unknown: 0x3a_41_4b, 0xbb_c2_cb, 0x6e_6e_6e;
    /// Steps before the target was picked.
    before: 0x20_24_2a, 0xdb_df_e4, 0x2c_2c_2c;
    /// The prediction and its gate.
    prediction: 0x56_b4_e9, 0x00_67_a6, 0x6c_cc_ff;
    /// The search window, the epipolar curve and thresholds.
    search: 0xf0_e4_42, 0x7d_6c_00, 0xff_f0_40;
    /// The subframe.
    subframe: 0xbf_c4_cc, 0x56_5e_6a, 0xe6_e6_e6;
    /// A feature.
    keypoint: 0xbf_c4_cc, 0x56_5e_6a, 0xe6_e6_e6;
    /// The ground truth.
    truth: 0xff_ff_ff, 0x00_00_00, 0xff_ff_ff;
}

/// Measurements of runs A, B, C and D.
const RUNS: [[u32; 3]; 4] = [
    [0x2f_8f_d0, 0x00_6b_a8, 0x4d_b8_ff],
    [0xcc_79_a7, 0x9c_45_7d, 0xff_9a_d5],
    [0xb0_94_ff, 0x6a_4f_c4, 0xc4_b0_ff],
    [0x9c_cc_3c, 0x4f_78_00, 0xb4_f0_40],
];

/// The colour of a run's measurements.
pub(crate) fn run(number: usize) -> Color32 {
    of(RUNS[number % RUNS.len()])
}

/// The two greys of the checker for missing data.
pub(crate) fn checker(odd: bool) -> Color32 {
    of(if odd { [0x32_35_3b, 0xc4_c8_ce, 0x50_50_50] } else { [0x24_26_2a, 0xda_dd_e1, 0x20_20_20] })
}

/// The background that separates marks and text from an image: dark, or light where the marks are dark.
fn ground(alpha: u8) -> Color32 {
    match colour_theme() {
        ColourTheme::Light => Color32::from_rgba_unmultiplied(0xff, 0xff, 0xff, alpha),
        ColourTheme::Dark | ColourTheme::Contrast => Color32::from_rgba_unmultiplied(0, 0, 0, alpha),
    }
}

/// The halo under every line on an image.
pub(crate) fn halo() -> Color32 {
    ground(0xc8)
}

/// The background of text on an image.
pub(crate) fn scrim() -> Color32 {
    ground(0xd8)
}

/// The overlay behind a modal window.
pub(crate) fn shade() -> Color32 {
    Color32::from_black_alpha(0x90)
}

/// A colour from premultiplied red, green, blue and alpha.
pub(crate) fn premultiplied([r, g, b, a]: [u8; 4]) -> Color32 {
    Color32::from_rgba_premultiplied(r, g, b, a)
}

/// The pixel grid of a magnified image.
pub(crate) fn grid() -> Color32 {
    Color32::from_rgba_unmultiplied(0x66, 0x66, 0x66, 0x50)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG 2.2).
    fn luminance(colour: Color32) -> f64 {
        let linear = |value: u8| {
            let v = f64::from(value) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(colour.r()) + 0.7152 * linear(colour.g()) + 0.0722 * linear(colour.b())
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
        (a / b).max(b / a)
    }

    #[test]
    fn black_on_white_is_twenty_one() {
        assert!((contrast(Color32::BLACK, Color32::WHITE) - 21.0).abs() < 1e-9);
    }

    #[test]
    fn words_and_marks_stand_out_from_their_ground_in_all_looks() {
        for colour_theme in ColourTheme::ALL {
            choose(colour_theme);
            let words = [("text", text()), ("strong", strong()), ("weak", weak()), ("accent", accent())];
            let least = if colour_theme == ColourTheme::Contrast { 7.0 } else { 4.5 };
            for (name, colour) in words {
                for (ground, behind) in [("panel", panel()), ("bar", bar())] {
                    let found = contrast(colour, behind);
                    assert!(found >= least, "{colour_theme:?}: {name} on {ground} has {found:.2}");
                }
            }
            let states = [("tracking", tracking()), ("lost", lost()), ("failed", failed())];
            let marks = [("prediction", prediction()), ("search", search()), ("subframe", subframe())];
            let runs = [("run A", run(0)), ("run B", run(1)), ("run C", run(2)), ("run D", run(3))];
            for (name, colour) in states.into_iter().chain(marks).chain(runs) {
                let found = contrast(colour, panel());
                assert!(found >= 3.0, "{colour_theme:?}: {name} on the panel has {found:.2}");
            }
        }
        choose(ColourTheme::Dark);
    }

    #[test]
    fn states_and_runs_differ_in_all_looks() {
        for colour_theme in ColourTheme::ALL {
            choose(colour_theme);
            let marks = [truth(), prediction(), search(), subframe()];
            let states = [tracking(), lost(), failed()];
            let runs = [run(0), run(1), run(2), run(3)];
            let all: Vec<Color32> = marks.into_iter().chain(states).chain(runs).collect();
            for (i, a) in all.iter().enumerate() {
                assert!(all.iter().skip(i + 1).all(|b| a != b), "{colour_theme:?}");
            }
        }
        choose(ColourTheme::Dark);
    }
}
