//! Self-contained HTML pages: external text is escaped, the Markdown of notes is converted without raw HTML, and images are
//! embedded.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd};

/// The content security policy of a self-contained page: it may only display itself.
pub(crate) const ALONE: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; \
                         frame-ancestors 'self'; sandbox allow-popups";

/// Escapes text for element content or an attribute.
pub(crate) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            // Control characters are not allowed in XML and HTML.
            c if c.is_control() && !"\n\t".contains(c) => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

/// A PNG image as a data URL.
pub(crate) fn png_address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

/// Converts a note's Markdown to HTML: raw HTML is shown as text, images become their alternative text, and links may lead
/// to the web only.
pub(crate) fn markdown(text: &str) -> String {
    let options = Options::ENABLE_STRIKETHROUGH | Options::ENABLE_TABLES;
    let mut html = String::new();
    let mut is_in_head = false;
    // For each open link, whether its address is allowed.
    let mut links: Vec<bool> = Vec::new();
    for event in Parser::new_ext(text, options) {
        match event {
            Event::Text(words) | Event::Html(words) | Event::InlineHtml(words) => {
                html.push_str(&escape(&words));
            }
            Event::Code(words) => html.push_str(&format!("<code>{}</code>", escape(&words))),
            Event::SoftBreak => html.push('\n'),
            Event::HardBreak => html.push_str("<br>"),
            Event::Rule => html.push_str("<hr>"),
            Event::Start(Tag::Link { dest_url, .. }) => {
                let may = is_web(&dest_url);
                links.push(may);
                if may {
                    let rel = "rel=\"noopener noreferrer nofollow\" target=\"_blank\"";
                    html.push_str(&format!("<a href=\"{}\" {rel}>", escape(&dest_url)));
                }
            }
            Event::End(TagEnd::Link) => html.push_str(if links.pop() == Some(true) { "</a>" } else { "" }),
            Event::Start(tag) => {
                is_in_head |= matches!(tag, Tag::TableHead);
                html.push_str(&opening(&tag, is_in_head));
            }
            Event::End(tag) => {
                html.push_str(closing(tag, is_in_head));
                is_in_head &= tag != TagEnd::TableHead;
            }
            _ => {}
        }
    }
    html
}

fn is_web(address: &CowStr<'_>) -> bool {
    ["http://", "https://", "mailto:"].iter().any(|scheme| address.to_ascii_lowercase().starts_with(scheme))
}

fn opening(tag: &Tag<'_>, is_in_head: bool) -> String {
    match tag {
        Tag::Paragraph => "<p>".to_owned(),
        // Headings of a note must not stand out from those of the page.
        Tag::Heading { .. } => "<p><strong>".to_owned(),
        Tag::BlockQuote(_) => "<blockquote>".to_owned(),
        Tag::CodeBlock(_) => "<pre><code>".to_owned(),
        Tag::List(Some(first)) => format!("<ol start=\"{first}\">"),
        Tag::List(None) => "<ul>".to_owned(),
        Tag::Item => "<li>".to_owned(),
        Tag::Emphasis => "<em>".to_owned(),
        Tag::Strong => "<strong>".to_owned(),
        Tag::Strikethrough => "<del>".to_owned(),
        Tag::Table(_) => "<table>".to_owned(),
        Tag::TableHead | Tag::TableRow => "<tr>".to_owned(),
        Tag::TableCell if is_in_head => "<th scope=\"col\">".to_owned(),
        Tag::TableCell => "<td>".to_owned(),
        _ => String::new(),
    }
}

fn closing(tag: TagEnd, is_in_head: bool) -> &'static str {
    match tag {
        TagEnd::Paragraph => "</p>\n",
        TagEnd::Heading(_) => "</strong></p>\n",
        TagEnd::BlockQuote(_) => "</blockquote>\n",
        TagEnd::CodeBlock => "</code></pre>\n",
        TagEnd::List(true) => "</ol>\n",
        TagEnd::List(false) => "</ul>\n",
        TagEnd::Item => "</li>\n",
        TagEnd::Emphasis => "</em>",
        TagEnd::Strong => "</strong>",
        TagEnd::Strikethrough => "</del>",
        TagEnd::Table => "</table>\n",
        TagEnd::TableHead | TagEnd::TableRow => "</tr>\n",
        TagEnd::TableCell if is_in_head => "</th>",
        TagEnd::TableCell => "</td>",
        _ => "",
    }
}

/// A table with a caption; its first column contains row headers.
pub(crate) fn table(caption: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = head.iter().map(|words| format!("<th scope=\"col\">{}</th>", escape(words))).collect();
    let mut html = format!(
        "<div class=\"wide\"><table><caption>{}</caption><thead><tr>{head}</tr></thead><tbody>\n",
        escape(caption)
    );
    for row in rows {
        html.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            let cell = escape(cell);
            html.push_str(&match column {
                0 => format!("<th scope=\"row\">{cell}</th>"),
                _ => format!("<td>{cell}</td>"),
            });
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// A number with `digits` decimals; a dash if it is missing or not finite.
pub(crate) fn number(value: Option<f64>, digits: usize) -> String {
    value
        .filter(|value| value.is_finite())
        .map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped() {
        assert_eq!(escape("<b a=\"1\">&'\u{0}"), "&lt;b a=&quot;1&quot;&gt;&amp;&#39; ");
    }

    #[test]
    fn a_note_has_no_markup_but_its_own() {
        let html = markdown(
            "# Title\n**bold** `a<b` <script>alert(1)</script>\n\n<img src=x onerror=alert(1)>\n\n- [x](javascript:alert(1))\n- [y](https://example.org/?a=1&b=\"2\")\n\n![alt](http://evil/x.png)",
        );
        assert!(
            !html.contains("<script") && !html.contains("<img") && !html.contains("href=\"javascript"),
            "{html}"
        );
        for part in [
            "<p><strong>Title",
            "<strong>bold</strong>",
            "<code>a&lt;b</code>",
            "&lt;script&gt;",
            "<li>x</li>",
            "href=\"https://example.org/?a=1&amp;b=",
            "alt",
        ] {
            assert!(html.contains(part), "{part} is not in {html}");
        }
    }

    #[test]
    fn a_table_of_a_note_keeps_its_head() {
        let html = markdown("| a | b |\n|---|---|\n| 1 | 2 |");
        assert_eq!(
            html.replace('\n', ""),
            "<table><tr><th scope=\"col\">a</th><th scope=\"col\">b</th></tr><tr><td>1</td><td>2</td></tr></table>"
        );
    }
}
