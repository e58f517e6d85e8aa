//! Identifies test sources, and the folders of a source's modules.

use std::path::{Path, PathBuf};

/// True for a file whose name or folder identifies it as a test.
pub(super) fn is_of_tests(file: &Path) -> bool {
    let is_folder = file.components().any(|part| part.as_os_str() == "tests");
    is_folder || file.file_stem().is_some_and(|name| name.to_string_lossy().ends_with("tests"))
}

/// The folder with the files of the modules that a file declares.
pub(super) fn folder_of_modules(file: &Path) -> PathBuf {
    match file.file_stem().and_then(|name| name.to_str()) {
        Some("mod" | "lib" | "main") => file.parent().unwrap_or(file).to_owned(),
        _ => file.with_extension(""),
    }
}
