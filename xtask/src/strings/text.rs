//! Separates user-visible texts from keys, scripts and formats; extracts the texts of a page, and finds requirement numbers.

/// Substrings of literals for programs: scripts, shaders, styles, drawings, HTTP headers and schemas.
const OF_PROGRAMS: [&str; 13] = [
    " => ",
    "#version",
    "@media",
    "SameSite=",
    "charset=",
    "filename=",
    "fn ",
    "font:",
    "function",
    "message rows",
    "no-cache",
    "none'",
    "self'",
];

/// True for words; false for keys, identifiers, paths, scripts, markup and formats without words.
pub(super) fn is_for_users(text: &str) -> bool {
    let bare = without(&without(text, '{', '}'), '<', '>');
    let bare = bare.trim();
    let letters = bare.chars().filter(|letter| letter.is_alphanumeric()).count();
    if letters < 2 || is_of_programs(&without(text, '<', '>')) || !bare.chars().any(char::is_alphabetic) {
        return false;
    }
    if bare.contains(char::is_whitespace) {
        return true;
    }
    // A single word counts as a label if only its first letter is a capital.
    let is_small = |letter: char| !letter.is_uppercase() && !matches!(letter, '_' | '/');
    let is_label = bare.starts_with(char::is_uppercase) && bare.chars().skip(1).all(is_small);
    is_label || bare.chars().any(|letter| letter.is_alphabetic() && !letter.is_ascii())
}

/// True for scripts, markup without words, and other program code.
fn is_of_programs(text: &str) -> bool {
    let is_open_tag = text.rfind('<').is_some_and(|start| {
        text[start + 1..].starts_with(|letter: char| letter.is_ascii_lowercase())
            && !text[start..].contains('>')
    });
    is_open_tag || OF_PROGRAMS.iter().any(|part| text.contains(part))
}

/// The text without its placeholders or tags.
fn without(text: &str, open: char, close: char) -> String {
    let mut bare = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(open) {
        let Some(end) = rest[start..].find(close) else { break };
        bare.push_str(&rest[..start]);
        rest = &rest[start + end + close.len_utf8()..];
    }
    bare + rest
}

/// The visible texts of a page in HTML, with their lines.
pub(super) fn texts_of_page(page: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut line = 1;
    for part in page.split('<') {
        let (tag, text) = part.split_once('>').unwrap_or(("", part));
        for name in ["aria-label", "alt", "placeholder", "title"] {
            let value = tag.split_once(&format!(" {name}=\"")).and_then(|(_, value)| value.split('"').next());
            found.extend(value.map(|value| (line, value.to_owned())));
        }
        let lead = text.len() - text.trim_start().len();
        let start = line + tag.matches('\n').count() + text[..lead].matches('\n').count();
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.iter().any(|word| word.chars().any(char::is_alphabetic)) {
            found.push((start, words.join(" ")));
        }
        line += part.matches('\n').count();
    }
    found
}

/// True for a text with a requirement number, such as R71.
pub(super) fn quotes_requirement(text: &str) -> bool {
    let letters: Vec<char> = text.chars().collect();
    letters.iter().enumerate().any(|(at, letter)| {
        let is_free = at == 0 || !(letters[at - 1].is_alphanumeric() || letters[at - 1] == '_');
        let digits = letters[at + 1..].iter().take_while(|digit| digit.is_ascii_digit()).count();
        let after = letters.get(at + 1 + digits);
        *letter == 'R'
            && is_free
            && (1..=3).contains(&digits)
            && !after.is_some_and(|letter| letter.is_alphanumeric() || *letter == '_')
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_formats_and_scripts_are_no_texts() {
        for text in
            ["snake_case", "kebab-case", "{:.2}", "image/png", "TOKEN", "C", "fn main() {}", "<path d=\"{}\""]
        {
            assert!(!is_for_users(text), "{text}");
        }
        for text in ["two words", "Open", "{value:.2} px off", "<p>No notes.</p>", "1σ"] {
            assert!(is_for_users(text), "{text}");
        }
    }

    #[test]
    fn texts_of_a_page_have_the_line_where_they_begin() {
        let page = "<title>Name</title>\n<p\n aria-label=\"Label\">\n Some\n words</p>";
        let expected = [(1, "Name"), (2, "Label"), (4, "Some words")];
        assert_eq!(texts_of_page(page), expected.map(|(line, text)| (line, text.to_owned())));
    }

    #[test]
    fn only_numbers_of_requirements_are_refused() {
        for text in ["R71", "as flown (R112).", "R1, K§4.6"] {
            assert!(quotes_requirement(text), "{text}");
        }
        for text in ["R²", "R Σ Rᵀ", "MER1", "R1000", "key R", "R2D2", "R_1"] {
            assert!(!quotes_requirement(text), "{text}");
        }
    }
}
