//! For build scripts: a digest of the sources that determine a result, by which stored results of other code are
//! recognised.
//!
//! ```text
//! digest = SHA-256 over the files, sorted by path: path relative to its folder's parent, length, content
//! ```
//!
//! The content of a Rust file is its tokens without comments and without modules under `#[cfg(test)]`; that of any other
//! file is its bytes with line ends as LF. Test files (`tests.rs`, `…_tests.rs`, `tests/`) and Markdown are left out.
//! The digest depends on neither the checkout's path, nor Git, nor formatting.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use sha2::{Digest, Sha256};

/// Sets the environment variable `variable` of the compiled package to the digest of `sources`, and makes Cargo run the
/// build script again when one of them changes.
///
/// # Errors
/// A source that cannot be read.
pub fn emit(variable: &str, sources: &[PathBuf]) -> io::Result<()> {
    for source in sources {
        println!("cargo:rerun-if-changed={}", source.display());
    }
    println!("cargo:rustc-env={variable}={}", digest(sources)?);
    Ok(())
}

/// The source folders of the package in `package` and of all its dependencies `sightline-NAME`, which are in the folders
/// `NAME` of `core`.
///
/// # Errors
/// A manifest that cannot be read.
pub fn with_dependencies(package: &Path, core: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = BTreeSet::new();
    let mut pending = vec![package.to_owned()];
    while let Some(package) = pending.pop() {
        if found.insert(package.join("src")) {
            let manifest = fs::read_to_string(package.join("Cargo.toml"))?;
            pending.extend(dependencies(&manifest).map(|name| core.join(name)).filter(|path| path.is_dir()));
        }
    }
    Ok(found.into_iter().collect())
}

/// `NAME` of each dependency `sightline-NAME` of a manifest, without dev and build dependencies.
fn dependencies(manifest: &str) -> impl Iterator<Item = &str> {
    let lines = manifest.lines().skip_while(|line| line.trim() != "[dependencies]").skip(1);
    lines.take_while(|line| !line.starts_with('[')).filter_map(|line| {
        let name = line.strip_prefix("sightline-")?;
        name.split(['.', ' ', '=']).next()
    })
}

/// The digest of files and folders, 64 hexadecimal digits.
///
/// # Errors
/// A source that cannot be read, or a Rust file that has no tokens.
pub fn digest(sources: &[PathBuf]) -> io::Result<String> {
    let mut files = Vec::new();
    for source in sources {
        // `core/world/src` counts as `world/src`, so that equal files of two crates differ.
        let root = source.parent().and_then(Path::parent).unwrap_or(source);
        collect(source, root, &mut files)?;
    }
    files.sort();
    files.dedup();
    let mut hash = Sha256::new();
    for (name, path) in files {
        let content = content(&path)?;
        hash.update(format!("{name}\0{}\0", content.len()));
        hash.update(&content);
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Collects the files of `path` with their names relative to `root`.
fn collect(path: &Path, root: &Path, files: &mut Vec<(String, PathBuf)>) -> io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if name.starts_with('.') || name == "tests" || name.ends_with("tests.rs") || name.ends_with(".md") {
        return Ok(());
    }
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            collect(&entry?.path(), root, files)?;
        }
        return Ok(());
    }
    let parts = path.strip_prefix(root).unwrap_or(path).components();
    let parts: Vec<_> = parts.map(|part| part.as_os_str().to_string_lossy()).collect();
    files.push((parts.join("/"), path.to_owned()));
    Ok(())
}

/// The part of a file that counts.
fn content(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = fs::read(path)?;
    let Ok(text) = String::from_utf8(bytes.clone()) else { return Ok(bytes) };
    let text = text.replace("\r\n", "\n");
    if path.extension().is_none_or(|extension| extension != "rs") {
        return Ok(text.into_bytes());
    }
    let tokens: TokenStream = text
        .parse()
        .map_err(|problem| io::Error::other(format!("{}: no tokens of Rust: {problem}", path.display())))?;
    let mut written = String::new();
    write(tokens, &mut written);
    Ok(written.into_bytes())
}

/// Writes tokens separated by one space, without doc comments and test modules.
fn write(tokens: TokenStream, text: &mut String) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    while at < tokens.len() {
        if let Some(length) = attribute(&tokens[at..], "doc").or_else(|| test_module(&tokens[at..])) {
            at += length;
            continue;
        }
        match &tokens[at] {
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Brace => ("{", "}"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::None => ("", ""),
                };
                text.push_str(open);
                write(group.stream(), text);
                text.push_str(close);
            }
            // The characters of an operator stay together: `a - -b` is not `a -- b`.
            TokenTree::Punct(sign) if sign.spacing() == proc_macro2::Spacing::Joint => {
                text.push(sign.as_char());
                at += 1;
                continue;
            }
            token => text.push_str(&token.to_string()),
        }
        text.push(' ');
        at += 1;
    }
}

/// Number of tokens of the attribute at the start of `tokens`, if it is `name` or of the form `name = …`.
fn attribute(tokens: &[TokenTree], name: &str) -> Option<usize> {
    let mut at = 0;
    for sign in ['#', '!'] {
        match tokens.get(at) {
            Some(TokenTree::Punct(punct)) if punct.as_char() == sign => at += 1,
            _ if sign == '#' => return None,
            _ => {}
        }
    }
    let Some(TokenTree::Group(group)) = tokens.get(at) else { return None };
    let text: String = group.stream().into_iter().take(2).map(|token| token.to_string()).collect();
    (text == name || text.starts_with(&format!("{name}="))).then_some(at + 1)
}

/// Number of tokens of the `#[cfg(test)]` module at the start of `tokens`.
fn test_module(tokens: &[TokenTree]) -> Option<usize> {
    let mut at = attribute(tokens, "cfg(test)")?;
    while let Some(TokenTree::Punct(punct)) = tokens.get(at)
        && punct.as_char() == '#'
    {
        at += 2;
    }
    let is_module = |token: &TokenTree| matches!(token, TokenTree::Ident(word) if word == "mod");
    if !tokens.get(at).is_some_and(is_module) {
        return None;
    }
    let is_end = |token: &TokenTree| match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        TokenTree::Punct(sign) => sign.as_char() == ';',
        _ => false,
    };
    let length = tokens[at..].iter().position(is_end)?;
    Some(at + length + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUST: &str = "//! Header.\n/// Doubles.\npub fn double(a: f64) -> f64 {\n    2.0 * a // exact\n}\n";

    /// The digest of a package `one` with these files in its `src`.
    fn of(files: &[(&str, &str)]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("one/src");
        for (name, content) in files {
            let path = source.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        digest(&[source]).unwrap()
    }

    #[test]
    fn the_digest_follows_the_content_and_not_the_folder() {
        let first = of(&[("a.rs", RUST), ("b/c.toml", "x = 1\n")]);
        assert_eq!(first, of(&[("b/c.toml", "x = 1\n"), ("a.rs", RUST)]));
        assert_ne!(first, of(&[("a.rs", &RUST.replace("2.0", "3.0")), ("b/c.toml", "x = 1\n")]));
        assert_ne!(first, of(&[("a.rs", RUST), ("b/c.toml", "x = 2\n")]));
        assert_ne!(first, of(&[("b.rs", RUST), ("b/c.toml", "x = 1\n")]));
        assert_eq!(first.len(), 64);
    }

    #[test]
    fn comments_formatting_and_line_ends_do_not_count() {
        let first = of(&[("a.rs", RUST), ("c.toml", "x = 1\n")]);
        let windows = RUST.replace('\n', "\r\n");
        assert_eq!(first, of(&[("a.rs", &windows), ("c.toml", "x = 1\r\n")]));
        let other =
            RUST.replace("Doubles", "Returns twice").replace(" {\n    ", "\n{").replace("// exact", "");
        assert_eq!(first, of(&[("a.rs", &other), ("c.toml", "x = 1\n"), ("README.md", "text")]));
    }

    #[test]
    fn tests_do_not_count_and_code_behind_them_does() {
        let first = of(&[("a.rs", RUST)]);
        let tests =
            "\n#[cfg(test)]\n#[path = \"x.rs\"]\nmod x_tests;\n#[cfg(test)]\nmod tests { fn one() {} }\n";
        assert_eq!(first, of(&[("a.rs", &format!("{RUST}{tests}")), ("x_tests.rs", "fn two() {}")]));
        assert_eq!(first, of(&[("a.rs", RUST), ("tests/deep.rs", "fn two() {}")]));
        assert_ne!(first, of(&[("a.rs", &format!("{RUST}{tests}fn after() {{}}"))]));
        assert_ne!(first, of(&[("a.rs", &format!("{RUST}#[cfg(test)]\nfn helper() {{}}"))]));
    }

    #[test]
    fn texts_and_operators_count_exactly() {
        assert_ne!(
            of(&[("a.rs", "const A: &str = \"// a\";")]),
            of(&[("a.rs", "const A: &str = \"// b\";")])
        );
        assert_ne!(of(&[("a.rs", "const A: bool = 1 <= 2;")]), of(&[("a.rs", "const A: bool = 1 < 2;")]));
        assert_ne!(of(&[("a.rs", "fn a() { b!(- -1) }")]), of(&[("a.rs", "fn a() { b!(--1) }")]));
    }

    #[test]
    fn dependencies_of_dependencies_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        for (name, manifest) in [
            ("low", "[dependencies]\n"),
            ("middle", "[dependencies]\nsightline-low.workspace = true\n"),
            (
                "top",
                "[dependencies]\nsightline-middle = { path = \"\" }\n[dev-dependencies]\nsightline-aside = \"1\"\n",
            ),
            ("aside", ""),
        ] {
            fs::create_dir_all(folder.path().join(name)).unwrap();
            fs::write(folder.path().join(name).join("Cargo.toml"), manifest).unwrap();
        }
        let found = with_dependencies(&folder.path().join("top"), folder.path()).unwrap();
        assert_eq!(found, ["low", "middle", "top"].map(|name| folder.path().join(name).join("src")));
    }
}
