//! The visual design: colours (`palette`), text styles and spacing. The only module with colour literals.
//!
//! Data colours are those of Okabe and Ito, which are distinguishable with any common colour vision; each meaning also has
//! a shape and a word. Scores use viridis with fixed limits, signed errors blue–white–red about zero, and missing values a
//! checker.

use egui::{
    Color32, CornerRadius, FontDefinitions, FontFamily, FontId, Margin, RichText, Stroke, TextStyle, Theme,
    Visuals,
};
use sightline_rover::trackability::Verdict;
use sightline_track::target::TrackingState;

mod palette;

pub(crate) use self::palette::*;

/// Inliers: a dot and solid lines.
pub(crate) fn inlier() -> Color32 {
    tracking()
}

/// Outliers: a cross and dashed lines.
pub(crate) fn outlier() -> Color32 {
    failed()
}

/// The mesh of an earlier step: lines.
pub(crate) fn mesh_earlier() -> Color32 {
    lost()
}

/// The mesh of the current step: filled and shaded.
pub(crate) fn mesh_present() -> Color32 {
    prediction()
}

/// The basin within which a registration by shape converges.
pub(crate) fn basin() -> Color32 {
    search()
}

/// Results of tried changes: dashed.
pub(crate) fn ghost() -> Color32 {
    accent()
}

/// The tint of the previous step's image when it is overlaid.
pub(crate) const ONION: Color32 = Color32::from_rgba_premultiplied(0x80, 0x80, 0x80, 0x80);
/// A texture in its own colours.
pub(crate) const UNTINTED: Color32 = Color32::WHITE;

/// Distance between a panel's border and its contents, points.
pub(crate) const MARGIN: i8 = 8;

/// The colour of a tracking state.
pub(crate) fn state(state: TrackingState) -> Color32 {
    match state {
        TrackingState::Cleared => weak(),
        TrackingState::Tracking => tracking(),
        TrackingState::Lost { .. } => lost(),
        TrackingState::Failed => failed(),
    }
}

/// The colour of passed and failed gates.
pub(crate) fn verdict(good: bool) -> Color32 {
    if good { tracking() } else { failed() }
}

/// The colour of a breakpoint's hits; breakpoints with the same colour differ in shape.
pub(crate) fn breakpoint(number: usize) -> Color32 {
    [failed(), run(1), search(), prediction()][number % 4]
}

/// A colour scaled in brightness, from a fifth at `share` 0 to the full colour at 1.
pub(crate) fn shaded(colour: Color32, share: f64) -> Color32 {
    let bright = 0.2 + 0.8 * share.clamp(0.0, 1.0);
    let level = |value: u8| (f64::from(value) * bright).round() as u8;
    Color32::from_rgb(level(colour.r()), level(colour.g()), level(colour.b()))
}

/// Viridis, from 0 for the smallest score shown to 1 for the largest; transparent for NaN.
pub(crate) fn score(share: f32) -> Color32 {
    ramp(colorous::VIRIDIS, f64::from(share))
}

/// Blue–white–red from −`limit` to `limit`; transparent for NaN.
pub(crate) fn signed(value: f32, limit: f32) -> Color32 {
    ramp(colorous::RED_BLUE, 0.5 - f64::from(value / limit) / 2.0)
}

/// Red–yellow–green over the goodness of the ground, 0 to 100 %, semi-transparent; unknown ground (negative) is
/// transparent.
pub(crate) fn goodness(percent: i8) -> Color32 {
    if percent < 0 {
        return Color32::TRANSPARENT;
    }
    ramp(colorous::RED_YELLOW_GREEN, f64::from(percent) / 100.0).gamma_multiply(0.6)
}

/// The colour of a trackability verdict.
pub(crate) fn trackability(verdict: Verdict) -> Color32 {
    match verdict {
        Verdict::Good => tracking(),
        Verdict::Risky => lost(),
        Verdict::Bad => failed(),
    }
}

/// The overlay on an image: a tint for good places, 12 % darker for bad ones; `None` for risky places, which are outlined.
pub(crate) fn trackability_fill(verdict: Verdict) -> Option<Color32> {
    match verdict {
        Verdict::Good => Some(trackability(verdict).gamma_multiply(0.2)),
        Verdict::Risky => None,
        Verdict::Bad => Some(Color32::from_black_alpha(31)),
    }
}

/// Grey from black (0) to white (1); transparent for NaN.
pub(crate) fn grey(value: f32) -> Color32 {
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

/// Applies fonts, colours and spacing to the context.
pub(crate) fn apply(context: &egui::Context, colour_theme: ColourTheme) {
    palette::choose(colour_theme);
    let mut fonts = FontDefinitions::default();
    // Arrows and dots, which the proportional font lacks, are taken from the monospace font.
    let fallback = fonts.families.get(&FontFamily::Monospace).cloned().unwrap_or_default();
    let proportional = fonts.families.entry(FontFamily::Proportional).or_default();
    for font in fallback {
        if !proportional.contains(&font) {
            proportional.push(font);
        }
    }
    context.set_fonts(fonts);
    context.set_theme(if colour_theme == ColourTheme::Light { Theme::Light } else { Theme::Dark });
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
    let mut visuals = if colour_theme() == ColourTheme::Light { Visuals::light() } else { Visuals::dark() };
    visuals.panel_fill = panel();
    visuals.window_fill = bar();
    visuals.window_stroke = Stroke::new(1.0, line());
    visuals.extreme_bg_color = well();
    visuals.faint_bg_color = bar();
    visuals.hyperlink_color = prediction();
    visuals.warn_fg_color = lost();
    visuals.error_fg_color = failed();
    visuals.weak_text_color = Some(weak());
    visuals.selection.bg_fill = selected();
    visuals.selection.stroke = Stroke::new(1.0, accent());
    let widgets = &mut visuals.widgets;
    widgets.noninteractive.fg_stroke = Stroke::new(1.0, text());
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, line());
    widgets.noninteractive.bg_fill = panel();
    widgets.noninteractive.weak_bg_fill = panel();
    for (widget, fill, line) in [
        (&mut widgets.inactive, button(), line()),
        (&mut widgets.hovered, button_hovered(), weak()),
        (&mut widgets.active, selected(), accent()),
        (&mut widgets.open, button(), weak()),
    ] {
        widget.weak_bg_fill = fill;
        widget.bg_fill = fill;
        widget.bg_stroke = Stroke::new(1.0, line);
        widget.fg_stroke = Stroke::new(1.0, text());
        widget.corner_radius = CornerRadius::same(4);
    }
    widgets.hovered.fg_stroke.color = strong();
    widgets.active.fg_stroke.color = strong();
    visuals
}

/// A panel's title: small capitals with wide spacing.
pub(crate) fn title(text: &str) -> RichText {
    RichText::new(text.to_uppercase()).size(10.5).extra_letter_spacing(1.1).color(weak())
}

/// A formula in characters that the fonts contain: no superscript T, and no bar over letters.
pub(crate) fn formula(text: &str) -> String {
    text.replace('ᵀ', "^T").replace("T\u{304}", "mean T").replace('Ī', "mean I")
}

/// A label beside a value.
pub(crate) fn label(text: impl Into<String>) -> RichText {
    RichText::new(text).color(weak())
}

/// A value in monospace digits.
pub(crate) fn number(text: impl Into<String>) -> RichText {
    RichText::new(text).monospace().color(strong())
}

/// A unit or remark, small.
pub(crate) fn note(text: impl Into<String>) -> RichText {
    RichText::new(text).small().color(weak())
}

/// The font of text painted on images.
pub(crate) fn image_font() -> FontId {
    FontId::new(11.0, FontFamily::Proportional)
}

/// The font of digits painted on images.
pub(crate) fn digit_font() -> FontId {
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
    fn nan_is_transparent() {
        assert_eq!(score(f32::NAN), Color32::TRANSPARENT);
        assert_eq!(signed(f32::NAN, 1.0), Color32::TRANSPARENT);
        assert_eq!(grey(f32::NAN), Color32::TRANSPARENT);
    }

    #[test]
    fn score_colours_saturate_outside_zero_to_one() {
        assert_eq!(score(-1.0), score(-7.0));
        assert_eq!(score(1.0), score(7.0));
        assert_ne!(score(0.0), score(0.5));
    }
}
