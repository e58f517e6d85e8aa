//! Lays out a note's Markdown as text with emphasis: headings are bold, lists have marks, links show their address.

use egui::text::{LayoutJob, TextFormat};
use egui::{Color32, FontFamily, FontId, Stroke};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use crate::theme;

/// Size of the text, points.
const SIZE: f32 = 13.0;

/// Lays out the text.
pub(crate) fn layout(text: &str) -> LayoutJob {
    let mut writer = Writer::default();
    for event in Parser::new_ext(text, Options::ENABLE_STRIKETHROUGH) {
        writer.take(event);
    }
    writer.job
}

#[derive(Default)]
struct Writer {
    job: LayoutJob,
    strong: usize,
    emphasised: usize,
    struck: usize,
    code: usize,
    /// The next number of each open list; `None` for a bulleted list.
    lists: Vec<Option<u64>>,
    links: Vec<String>,
}

impl Writer {
    fn take(&mut self, event: Event<'_>) {
        match event {
            Event::Text(words) | Event::Html(words) | Event::InlineHtml(words) => self.push(&words),
            Event::Code(words) => {
                self.code += 1;
                self.push(&words);
                self.code -= 1;
            }
            Event::SoftBreak => self.push(" "),
            Event::HardBreak => self.push("\n"),
            Event::Rule => {
                self.new_line();
                self.push("―――\n");
            }
            Event::Start(tag) => self.open(&tag),
            Event::End(tag) => self.close(tag),
            _ => {}
        }
    }

    fn open(&mut self, tag: &Tag<'_>) {
        match tag {
            Tag::Paragraph | Tag::BlockQuote(_) | Tag::HtmlBlock if self.lists.is_empty() => self.new_line(),
            Tag::Heading { .. } => {
                self.new_line();
                self.strong += 1;
            }
            Tag::CodeBlock(_) => {
                self.new_line();
                self.code += 1;
            }
            Tag::List(first) => self.lists.push(*first),
            Tag::Item => {
                self.new_line();
                let indent = "  ".repeat(self.lists.len().saturating_sub(1));
                let mark = match self.lists.last_mut() {
                    Some(Some(number)) => {
                        *number += 1;
                        format!("{indent}{}. ", *number - 1)
                    }
                    _ => format!("{indent}• "),
                };
                self.push(&mark);
            }
            Tag::Emphasis => self.emphasised += 1,
            Tag::Strong => self.strong += 1,
            Tag::Strikethrough => self.struck += 1,
            Tag::Link { dest_url, .. } => self.links.push(dest_url.to_string()),
            _ => {}
        }
    }

    fn close(&mut self, tag: TagEnd) {
        match tag {
            TagEnd::Heading(_) => self.strong -= 1,
            TagEnd::CodeBlock => self.code -= 1,
            TagEnd::List(_) => {
                self.lists.pop();
            }
            TagEnd::Emphasis => self.emphasised -= 1,
            TagEnd::Strong => self.strong -= 1,
            TagEnd::Strikethrough => self.struck -= 1,
            TagEnd::Link => {
                let address = self.links.pop().unwrap_or_default();
                if !self.job.text.ends_with(&address) {
                    self.push(&format!(" ({address})"));
                }
            }
            _ => {}
        }
    }

    fn new_line(&mut self) {
        if !self.job.text.is_empty() && !self.job.text.ends_with('\n') {
            self.push("\n");
        }
    }

    fn push(&mut self, words: &str) {
        let is_code = self.code > 0;
        let family = if is_code { FontFamily::Monospace } else { FontFamily::Proportional };
        let colour = if self.strong > 0 { theme::strong() } else { theme::text() };
        let struck = if self.struck > 0 { Stroke::new(1.0, theme::weak()) } else { Stroke::NONE };
        let format = TextFormat {
            font_id: FontId::new(if is_code { SIZE - 1.0 } else { SIZE }, family),
            color: colour,
            italics: self.emphasised > 0,
            background: if is_code { theme::well() } else { Color32::TRANSPARENT },
            strikethrough: struck,
            ..TextFormat::default()
        };
        self.job.append(words, 0.0, format);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_become_emphasis_and_lists_keep_their_order() {
        let job = layout(
            "# Why\nit was *not* **lost**: `ncc < 0.6`\n\n1. shade\n2. [relief](https://example.org)\n\n<script>",
        );
        let expected = "Why\nit was not lost: ncc < 0.6\n1. shade\n2. relief (https://example.org)\n<script>";
        assert_eq!(job.text, expected);
        let of = |words: &str| {
            let at = job.text.find(words).unwrap();
            let section = job.sections.iter().find(|s| s.byte_range.start.0 <= at && at < s.byte_range.end.0);
            section.unwrap().format.clone()
        };
        assert!(of("not").italics && !of("lost").italics);
        assert_eq!((of("lost").color, of("shade").color), (theme::strong(), theme::text()));
        assert_eq!(of("ncc").font_id.family, FontFamily::Monospace);
    }
}
