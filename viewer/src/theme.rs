//! How everything looks: colours, text styles and spacing. The only place with colour literals.
//!
//! Data colours are those of Okabe and Ito, which people with any common colour vision tell apart; each meaning
//! has a shape and a word besides. Scores are viridis with fixed limits, signed errors blue–white–red about zero,
//! and a value that does not exist is a checker, never a colour.

use egui::{
    Color32, CornerRadius, FontDefinitions, FontFamily, FontId, Margin, RichText, Stroke, TextStyle, Theme,
    Visuals,
};
use sightline_core::target::TrackingState;

/// The page behind everything; the boot page has the same colour.
pub const PAGE: Color32 = Color32::from_rgb(0x10, 0x12, 0x15);
/// A panel.
pub const PANEL: Color32 = Color32::from_rgb(0x18, 0x1b, 0x20);
/// Bars at the top and bottom.
pub const BAR: Color32 = Color32::from_rgb(0x1e, 0x22, 0x28);
/// A well: what lies behind images, plots and text fields.
pub const WELL: Color32 = Color32::from_rgb(0x0b, 0x0c, 0x0e);
/// Hairlines between things.
pub const LINE: Color32 = Color32::from_rgb(0x2e, 0x34, 0x3d);
/// Text that is read.
pub const TEXT: Color32 = Color32::from_rgb(0xd6, 0xd9, 0xde);
/// Values and titles that stand out.
pub const STRONG: Color32 = Color32::from_rgb(0xf4, 0xf5, 0xf7);
/// Labels, units and hints.
pub const WEAK: Color32 = Color32::from_rgb(0x98, 0xa0, 0xac);
/// What is selected or waits for the person.
pub const ACCENT: Color32 = Color32::from_rgb(0xe0, 0xa4, 0x58);
/// Behind what is selected.
pub const SELECTED: Color32 = Color32::from_rgb(0x3d, 0x31, 0x20);

/// State `tracking`, and a gate that is met.
pub const TRACKING: Color32 = Color32::from_rgb(0x00, 0x9e, 0x73);
/// State `lost`.
pub const LOST: Color32 = Color32::from_rgb(0xe6, 0x9f, 0x00);
/// State `failed`, a gate that is not met, and faults.
pub const FAILED: Color32 = Color32::from_rgb(0xd5, 0x5e, 0x00);
/// What was not computed yet.
pub const UNKNOWN: Color32 = Color32::from_rgb(0x3a, 0x41, 0x4b);
/// Before the target was picked.
pub const BEFORE: Color32 = Color32::from_rgb(0x20, 0x24, 0x2a);
/// The prediction and its gate.
pub const PREDICTION: Color32 = Color32::from_rgb(0x56, 0xb4, 0xe9);
/// The search window, the epipolar curve and thresholds.
pub const SEARCH: Color32 = Color32::from_rgb(0xf0, 0xe4, 0x42);
/// The subframe.
pub const SUBFRAME: Color32 = Color32::from_rgb(0xbf, 0xc4, 0xcc);
/// A feature.
pub const KEYPOINT: Color32 = Color32::from_rgb(0xbf, 0xc4, 0xcc);
/// A match that agrees with the motion: a dot and solid lines.
pub const INLIER: Color32 = TRACKING;
/// A match that does not: a cross and dashed lines.
pub const OUTLIER: Color32 = FAILED;
/// The surface of an earlier step: lines.
pub const MESH_EARLIER: Color32 = LOST;
/// The surface of the step: filled and shaded.
pub const MESH_PRESENT: Color32 = PREDICTION;
/// How far from the prediction a registration by shape can start.
pub const BASIN: Color32 = SEARCH;
/// What is true.
pub const TRUTH: Color32 = Color32::WHITE;
/// A texture in its own colours.
pub const UNTINTED: Color32 = Color32::WHITE;
/// The dark halo under every line on an image.
pub const HALO: Color32 = Color32::from_rgba_premultiplied(0, 0, 0, 0xc8);
/// Behind words on an image.
pub const SCRIM: Color32 = Color32::from_rgba_premultiplied(0x0a, 0x0b, 0x0d, 0xd0);
/// Behind a modal window.
pub const SHADE: Color32 = Color32::from_rgba_premultiplied(0, 0, 0, 0x90);
/// The pixel grid of a magnified image.
pub const GRID: Color32 = Color32::from_rgba_premultiplied(0x20, 0x20, 0x20, 0x50);

/// Measurements of runs A, B, C and D.
const RUNS: [Color32; 4] = [
    Color32::from_rgb(0x2f, 0x8f, 0xd0),
    Color32::from_rgb(0xcc, 0x79, 0xa7),
    Color32::from_rgb(0xf4, 0xf5, 0xf7),
    Color32::from_rgb(0xf0, 0xe4, 0x42),
];
const CHECKER: [Color32; 2] = [Color32::from_rgb(0x24, 0x26, 0x2a), Color32::from_rgb(0x32, 0x35, 0x3b)];

/// Distance between a panel's border and its contents, points.
pub const MARGIN: i8 = 8;

/// The colour of a run's measurements.
pub fn run(number: usize) -> Color32 {
    RUNS[number % RUNS.len()]
}

/// The colour of a tracking state.
pub fn state(state: TrackingState) -> Color32 {
    match state {
        TrackingState::Cleared => WEAK,
        TrackingState::Tracking => TRACKING,
        TrackingState::Lost { .. } => LOST,
        TrackingState::Failed => FAILED,
    }
}

/// The colour of met and unmet.
pub fn verdict(good: bool) -> Color32 {
    if good { TRACKING } else { FAILED }
}

/// The colour of a breakpoint's hits; its shape is another one where the colours repeat.
pub fn breakpoint(number: usize) -> Color32 {
    [FAILED, RUNS[1], SEARCH, PREDICTION][number % 4]
}

/// The two greys of the pattern that stands for no data.
pub fn checker(odd: bool) -> Color32 {
    CHECKER[usize::from(odd)]
}

/// A colour between a fifth and all of its brightness.
pub fn shaded(colour: Color32, share: f64) -> Color32 {
    let bright = 0.2 + 0.8 * share.clamp(0.0, 1.0);
    let level = |value: u8| (f64::from(value) * bright).round() as u8;
    Color32::from_rgb(level(colour.r()), level(colour.g()), level(colour.b()))
}

/// Viridis, from 0 for the least score that is shown to 1 for the greatest; transparent where there is none.
pub fn score(share: f32) -> Color32 {
    ramp(colorous::VIRIDIS, f64::from(share))
}

/// Blue–white–red over signed values from −`limit` to `limit`.
pub fn signed(value: f32, limit: f32) -> Color32 {
    ramp(colorous::RED_BLUE, 0.5 - f64::from(value / limit) / 2.0)
}

/// Grey from black (0) to white (1); transparent where there is no value.
pub fn grey(value: f32) -> Color32 {
    if value.is_nan() {
        Color32::TRANSPARENT
    } else {
        Color32::from_gray((value.clamp(0.0, 1.0) * 255.0).round() as u8)
    }
}

fn ramp(gradient: colorous::Gradient, t: f64) -> Color32 {
    if t.is_nan() {
        return Color32::TRANSPARENT;
    }
    let c = gradient.eval_continuous(t.clamp(0.0, 1.0));
    Color32::from_rgb(c.r, c.g, c.b)
}

/// Gives the context its looks.
pub fn apply(context: &egui::Context) {
    let mut fonts = FontDefinitions::default();
    // Arrows and dots, which the proportional font lacks, come from the one with equal widths.
    let fallback = fonts.families.get(&FontFamily::Monospace).cloned().unwrap_or_default();
    let proportional = fonts.families.entry(FontFamily::Proportional).or_default();
    for font in fallback {
        if !proportional.contains(&font) {
            proportional.push(font);
        }
    }
    context.set_fonts(fonts);
    context.set_theme(Theme::Dark);
    context.all_styles_mut(|style| {
        style.text_styles = [
            (TextStyle::Heading, FontId::new(17.0, FontFamily::Proportional)),
            (TextStyle::Body, FontId::new(13.0, FontFamily::Proportional)),
            (TextStyle::Button, FontId::new(13.0, FontFamily::Proportional)),
            (TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace)),
            (TextStyle::Small, FontId::new(11.0, FontFamily::Proportional)),
        ]
        .into();
        style.visuals = visuals();
        style.animation_time = 0.0;
        style.spacing.item_spacing = egui::vec2(6.0, 4.0);
        style.spacing.button_padding = egui::vec2(8.0, 2.0);
        style.spacing.interact_size.y = 22.0;
        style.spacing.menu_margin = Margin::same(6);
        style.spacing.scroll = egui::style::ScrollStyle::thin();
        style.interaction.selectable_labels = false;
        style.interaction.tooltip_delay = 0.3;
    });
}

fn visuals() -> Visuals {
    let mut visuals = Visuals::dark();
    visuals.panel_fill = PANEL;
    visuals.window_fill = BAR;
    visuals.window_stroke = Stroke::new(1.0, LINE);
    visuals.extreme_bg_color = WELL;
    visuals.faint_bg_color = BAR;
    visuals.hyperlink_color = PREDICTION;
    visuals.warn_fg_color = LOST;
    visuals.error_fg_color = FAILED;
    visuals.weak_text_color = Some(WEAK);
    visuals.selection.bg_fill = SELECTED;
    visuals.selection.stroke = Stroke::new(1.0, ACCENT);
    let widgets = &mut visuals.widgets;
    widgets.noninteractive.fg_stroke = Stroke::new(1.0, TEXT);
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, LINE);
    widgets.noninteractive.bg_fill = PANEL;
    widgets.noninteractive.weak_bg_fill = PANEL;
    for (widget, fill, line) in [
        (&mut widgets.inactive, Color32::from_rgb(0x2a, 0x2f, 0x37), LINE),
        (&mut widgets.hovered, Color32::from_rgb(0x36, 0x3d, 0x47), WEAK),
        (&mut widgets.active, SELECTED, ACCENT),
        (&mut widgets.open, Color32::from_rgb(0x2a, 0x2f, 0x37), WEAK),
    ] {
        widget.weak_bg_fill = fill;
        widget.bg_fill = fill;
        widget.bg_stroke = Stroke::new(1.0, line);
        widget.fg_stroke = Stroke::new(1.0, TEXT);
        widget.corner_radius = CornerRadius::same(4);
    }
    widgets.hovered.fg_stroke.color = STRONG;
    widgets.active.fg_stroke.color = STRONG;
    visuals
}

/// A panel's title: small capitals, widely set.
pub fn title(text: &str) -> RichText {
    RichText::new(text.to_uppercase()).size(10.5).extra_letter_spacing(1.1).color(WEAK)
}

/// A label beside a value.
pub fn label(text: impl Into<String>) -> RichText {
    RichText::new(text).color(WEAK)
}

/// A value with digits of equal width.
pub fn number(text: impl Into<String>) -> RichText {
    RichText::new(text).monospace().color(STRONG)
}

/// A unit or remark, small.
pub fn note(text: impl Into<String>) -> RichText {
    RichText::new(text).small().color(WEAK)
}

/// The font of words painted on images.
pub fn image_font() -> FontId {
    FontId::new(11.0, FontFamily::Proportional)
}

/// The font of digits painted on images.
pub fn digit_font() -> FontId {
    FontId::new(10.5, FontFamily::Monospace)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_signed_scale_is_blue_below_white_at_and_red_above_zero() {
        let [negative, zero, positive] = [-1.0, 0.0, 1.0].map(|value| signed(value, 1.0));
        assert!(negative.b() > negative.r() + 40, "{negative:?}");
        assert!(zero.r() > 0xe8 && zero.g() > 0xe8 && zero.b() > 0xe8, "{zero:?}");
        assert!(positive.r() > positive.b() + 40, "{positive:?}");
    }

    #[test]
    fn what_does_not_exist_has_no_colour() {
        assert_eq!(score(f32::NAN), Color32::TRANSPARENT);
        assert_eq!(signed(f32::NAN, 1.0), Color32::TRANSPARENT);
        assert_eq!(grey(f32::NAN), Color32::TRANSPARENT);
    }

    #[test]
    fn the_score_scale_is_fixed_from_minus_one_to_one() {
        assert_eq!(score(-1.0), score(-7.0));
        assert_eq!(score(1.0), score(7.0));
        assert_ne!(score(0.0), score(0.5));
    }
}
